"""Renders from Python: equality with the program, arrays, settings, progress and interruption."""

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer

SMALL: dict[str, Any] = {"width": 24, "height": 16, "spp": 4}


@pytest.mark.parametrize(
    ("file", "options", "settings"),
    [
        ("cornell.dae", ["-s", "8", "-t", "1"], {"spp": 8, "threads": 2}),
        (
            "json/shapes.json",
            ["--aov", "albedo,depth,cryptomatte_object,samples", "-s", "4"],
            {"aovs": ["albedo", "depth", "cryptomatte_object", "samples"], "spp": 4, "threads": 1},
        ),
        (
            "cornell.dae",
            ["--target-error", "20%", "--max-spp", "64", "--alpha", "-p", "3", "4", "20", "18"],
            {"target_error": "20%", "max_spp": 64, "alpha": True, "crop": (3, 4, 20, 18)},
        ),
        ("json/mist.json", ["--integrator", "volpath", "-m", "3", "-s", "2"],
         {"integrator": "volpath", "max_depth": 3, "spp": 2}),
    ],
)
def test_files_have_the_bytes_of_the_program(
    scenes: Path,
    tmp_path: Path,
    program: Callable[[Sequence[object]], str],
    file: str,
    options: list[str],
    settings: dict[str, Any],
) -> None:
    scene = pathtracer.load(scenes / file)
    image = pathtracer.render(scene, width=32, height=24, **settings)
    assert image.complete
    for name in ["image.exr", "image.png"]:
        ours, theirs = tmp_path / f"ours_{name}", tmp_path / f"theirs_{name}"
        image.save(ours, metadata="none")
        if name.endswith(".png") and "--aov" in options:
            continue
        program([scenes / file, "-r", 32, 24, "--metadata", "none", *options, "-f", theirs])
        assert ours.read_bytes() == theirs.read_bytes(), name


def test_the_image_does_not_depend_on_threads_or_tiles(scene: pathtracer.Scene) -> None:
    images = [
        pathtracer.render(scene, **SMALL, threads=threads, tile_size=size)["color"]
        for threads, size in [(1, 16), (2, 16), (3, 8)]
    ]
    for image in images[1:]:
        np.testing.assert_array_equal(images[0], image)
    other = pathtracer.render(scene, **SMALL, seed=1)["color"]
    assert (other != images[0]).any()


def test_arrays_have_shapes_and_types(scene: pathtracer.Scene) -> None:
    aovs = ["albedo", "depth", "primitive", "cryptomatte_object"]
    image = pathtracer.render(scene, **SMALL, aovs=aovs, alpha=True)
    found = {name: (image[name].shape, image[name].dtype.name) for name in image}
    assert found["color"] == ((16, 24, 3), "float32")
    assert found["alpha"] == ((16, 24), "float32")
    assert found["albedo"] == ((16, 24, 3), "float32")
    assert found["depth"] == ((16, 24), "float32")
    assert found["primitive"] == ((16, 24), "uint32")
    assert found["CryptoObject00"] == ((16, 24, 4), "float32")
    assert list(image) == image.keys()
    assert len(image) == len(found)
    assert "depth" in image
    assert "normal" not in image
    assert (image.width, image.height, image.samples) == (24, 16, 24 * 16 * 4)
    with pytest.raises(KeyError, match="the image has color, alpha, albedo"):
        image["colour"]


def test_arrays_are_not_copied_and_outlive_the_image(scene: pathtracer.Scene) -> None:
    image = pathtracer.render(scene, **SMALL)
    color = image["color"]
    assert color is image["color"]
    mean = color.mean()
    del image
    assert color.mean() == mean > 0.0


def test_files_contain_what_the_arrays_contain(scene: pathtracer.Scene, tmp_path: Path) -> None:
    image = pathtracer.render(scene, **SMALL)
    image["color"][:] = 0.25
    levels = image.to_srgb()
    assert levels.shape == (16, 24, 3)
    assert (levels == 137).all()
    assert (image.to_srgb(exposure=2) == 255).all()
    image.save(tmp_path / "a.png", metadata="none")
    assert image._repr_png_() == (tmp_path / "a.png").read_bytes()


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"spp": 0}, ValueError, "expected a whole number from 1"),
        ({"spp": "many"}, ValueError, "spp"),
        ({"spp": True}, TypeError, "spp: found bool, expected a number or text"),
        ({"spp": 2.5}, ValueError, "spp"),
        ({"max_dept": 3}, ValueError, 'did you mean "max_depth"'),
        ({"output": "a.png"}, ValueError, 'unknown setting "output"; known: resolution, crop'),
        ({"crop": [1, 2, 3]}, ValueError, "crop: found 3 values, expected 4"),
        ({"crop": 3}, TypeError, "crop: found int, expected a sequence"),
        ({"crop": np.zeros((2, 2))}, ValueError, "crop: found 2 values"),
        ({"crop": [0, 0, 900, 9]}, pathtracer.SceneError, "expected a cell with pixels inside"),
        ({"width": 0}, ValueError, "width: found 0, expected a whole number from 1 on"),
        ({"height": 2.5}, ValueError, "height: found 2.5, expected a whole number"),
        ({"height": "3", "resolution": [3, 4]}, ValueError, "height and resolution"),
        ({"width": 2**20}, pathtracer.SceneError, "resolution .* found too many pixels"),
        ({"width": 0, "height": 3}, ValueError, "resolution"),
        ({"width": -1, "height": 3}, ValueError, "resolution"),
        ({"width": 2**40, "height": 2**40}, ValueError, "resolution"),
        ({"width": float("nan"), "height": 3}, ValueError, "resolution"),
        ({"panorama": 1}, TypeError, "panorama: found int, expected True or False"),
        ({"clamp": float("nan")}, ValueError, "clamp"),
        ({"aovs": ["colour"]}, ValueError, "possible values: albedo"),
        ({"aovs": "albedo,albedo"}, ValueError, "duplicate aov"),
        ({"integrator": "pathh"}, ValueError, 'unknown integrator "pathh"'),
        ({"light_groups": {"key": ["nobody"]}}, pathtracer.SceneError, "nobody"),
        ({"environment": "missing.exr"}, pathtracer.SceneError, "missing.exr"),
        ({"path_splitting": 2, "path_reuse": 2}, ValueError, "mutually exclusive"),
        ({"progress": 3}, TypeError, "progress: found int, expected a callable"),
        ({"seed": object()}, TypeError, "seed: found object"),
    ],
)
def test_wrong_settings_are_named(
    scene: pathtracer.Scene, settings: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message.replace("(", r"\(")) as found:
        pathtracer.render(scene, **settings)
    assert "--" not in str(found.value)


def test_numbers_of_numpy_and_none_are_settings(scene: pathtracer.Scene) -> None:
    size = np.array([24, 16])
    image = pathtracer.render(
        scene, resolution=size, spp=np.int64(4), clamp=np.float32(1e6), max_depth=None
    )
    np.testing.assert_array_equal(image["color"], pathtracer.render(scene, **SMALL)["color"])


def test_progress_ends_with_all_samples(scene: pathtracer.Scene) -> None:
    states: list[pathtracer.Progress] = []
    pathtracer.render(scene, width=200, height=150, spp=64, progress=states.append)
    samples = [state.samples for state in states]
    assert samples == sorted(samples)
    assert samples[-1] == states[-1].total == 200 * 150 * 64
    assert states[-1].fraction == 1.0


def test_exceptions_of_progress_end_the_render(scene: pathtracer.Scene) -> None:
    def fail(_: pathtracer.Progress) -> None:
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        pathtracer.render(scene, width=600, height=600, spp=100_000, progress=fail)


def test_a_time_limit_ends_the_render(scene: pathtracer.Scene) -> None:
    image = pathtracer.render(scene, width=200, height=200, spp=1_000_000, time_limit="0.2s")
    assert not image.complete
    assert 0 < image.samples < 200 * 200 * 1_000_000
    assert np.isfinite(image["color"]).all()
    assert "incomplete" in repr(image)


def test_other_threads_run_during_a_render(scene: pathtracer.Scene) -> None:
    ticks = 0
    done = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    image = pathtracer.render(scene, width=200, height=200, spp=100_000, time_limit="0.5s")
    done.set()
    thread.join()
    # With the interpreter locked there would be none.
    assert ticks > 20
    assert image.samples > 0


def test_images_of_an_iteration_end_with_that_of_render(scene: pathtracer.Scene) -> None:
    size: dict[str, Any] = {"width": 100, "height": 75}
    images = list(pathtracer.render_iter(scene, **size, spp=64, interval=0.02, threads=1))
    assert len(images) > 1
    assert [image.complete for image in images] == [False] * (len(images) - 1) + [True]
    samples = [image.samples for image in images]
    assert samples == sorted(samples)
    assert samples[-1] == 100 * 75 * 64
    whole = pathtracer.render(scene, **size, spp=64)
    np.testing.assert_array_equal(images[-1]["color"], whole["color"])
    assert images[-1].rays == whole.rays
    late = list(
        pathtracer.render_iter(scene, **size, spp=10**6, interval=0.1, time_limit="0.25s")
    )
    assert 1 <= len(late) <= 3
    assert not late[-1].complete
    each = list(islice(pathtracer.render_iter(scene, **size, spp=8, interval=0), 1000))
    assert each[-1].complete
    np.testing.assert_array_equal(
        each[-1]["color"], pathtracer.render(scene, **size, spp=8)["color"]
    )
    samples = [0, *(image.samples for image in each)]
    assert samples == sorted(samples)
    # The image with the last samples may precede the complete one.
    assert len(set(samples[:-1])) == len(samples) - 1
    with pytest.raises(ValueError, match="interval: found -1, expected seconds"):
        pathtracer.render_iter(scene, interval=-1.0)
    with pytest.raises(ValueError, match="spp"):
        pathtracer.render_iter(scene, spp=0)


INTERRUPTED = """
import pathtracer

def started(progress):
    print("started", flush=True)

try:
    pathtracer.render(
        pathtracer.default_scene(), width=400, height=400, spp=1_000_000, progress=started
    )
except pathtracer.Interrupted as error:
    image = error.partial
    print("partial", image.complete, image.samples > 0, float(image["color"].mean()) > 0.0)
"""


INTERRUPTED_ITERATION = """
import pathtracer

images = pathtracer.render_iter(
    pathtracer.default_scene(), width=400, height=400, spp=1_000_000, interval=0.5
)
first = next(images)
try:
    print("started", flush=True)
    while True:
        last = next(images)
except pathtracer.Interrupted as error:
    last = error.partial
print("partial", last.complete, last.samples > first.samples, next(images).samples > last.samples)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("program", [INTERRUPTED, INTERRUPTED_ITERATION])
def test_ctrl_c_keeps_the_image_so_far(
    program: str, interruptible: Callable[..., subprocess.Popen[str]]
) -> None:
    render = interruptible(program)
    assert render.stdout is not None
    assert render.stdout.readline() == "started\n"
    # The line may arrive before the interpreter is back in the render.
    time.sleep(0.2)
    render.send_signal(signal.SIGINT)
    output, _ = render.communicate(timeout=60)
    assert output.splitlines()[-1] == "partial False True True"
    assert render.returncode == 0


def test_many_renders_need_no_more_memory(scene: pathtracer.Scene) -> None:
    status = Path("/proc/self/status")
    if not status.exists():
        pytest.skip("no /proc")

    def resident() -> int:
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS"))
        return int(line.split()[1])

    def renders(count: int) -> None:
        for _ in range(count):
            pathtracer.render(scene, width=64, height=64, spp=1, aovs=["albedo"])

    renders(100)
    before = resident()
    renders(400)
    # An image alone has 96 kB.
    assert resident() - before < 8_000
