"""Films and images of the program: resume, merge and rerender."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

import pathtracer

Program = Callable[[Sequence[object]], str]

STABLE = ["--metadata", "stable"]


@pytest.fixture
def folder(scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with a scene and an environment, in which commands run."""
    shutil.copy(scenes / "cornell.dae", tmp_path / "scene.dae")
    (tmp_path / "inner").mkdir()
    sky = pathtracer.render(pathtracer.default_scene(), width=8, height=4, spp=1)
    sky.save(tmp_path / "inner" / "sky.exr")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder in which the functions are called."""
    return tmp_path_factory.mktemp("elsewhere")


@pytest.mark.parametrize("ending", ["exr", "png"])
def test_resuming_a_stopped_render_gives_the_whole_image(
    folder: Path, elsewhere: Path, program: Program, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    options: list[object] = ["scene.dae", "-r", 60, 45, "-e", "inner/sky.exr", *STABLE]
    program([*options, "-s", 256, "-f", f"whole.{ending}"])
    image = folder / f"part.{ending}"
    program([*options, "-s", 256, "-t", 1, "-f", image.name, "--time-limit", "0.1s"])
    assert image.with_name(f"{image.name}.film").exists()
    monkeypatch.chdir(elsewhere)
    stopped = pathtracer.resume(image, time_limit=0.05)
    assert not stopped.complete
    states: list[pathtracer.Progress] = []
    done = pathtracer.resume(f"{image}.film" if ending == "exr" else image, progress=states.append)
    assert done.complete
    assert done.samples == 60 * 45 * 256 > stopped.samples
    assert states[-1].samples == done.samples
    assert image.read_bytes() == (folder / f"whole.{ending}").read_bytes()
    assert Path.cwd() == elsewhere
    if ending == "exr":
        more = pathtracer.resume(image, spp=300, threads=2)
        assert more.samples == 60 * 45 * 300
        monkeypatch.chdir(folder)
        program([*options, "-s", 300, "-f", "whole.exr"])
        assert image.read_bytes() == (folder / "whole.exr").read_bytes()


def test_merging_parts_gives_the_whole_image(
    folder: Path, elsewhere: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    options: list[object] = ["scene.dae", "-r", 32, 24, "-s", 8, *STABLE]
    program([*options, "-f", "whole.exr"])
    for number, samples in enumerate(["0..3", "3..8"]):
        program([*options, "--samples", samples, "-f", f"part{number}.film"])
    parts = [folder / "part1.film", folder / "part0.film"]
    monkeypatch.chdir(elsewhere)
    merged = pathtracer.merge(parts, "merged.exr")
    assert Path("merged.exr").read_bytes() == (folder / "whole.exr").read_bytes()
    assert merged.complete
    assert merged.samples == 32 * 24 * 8
    expected = pathtracer.render(
        pathtracer.load(folder / "scene.dae"), width=32, height=24, spp=8
    )
    np.testing.assert_array_equal(merged["color"], expected["color"])
    assert merged.receipt["film"] == expected.receipt["film"]
    with pytest.raises(ValueError, match="missing samples 0 to 3"):
        pathtracer.merge(parts[:1], "merged.exr")
    second = pathtracer.merge(parts[:1], "second.film")
    assert second.receipt["first"] == 3
    with pytest.raises(ValueError, match="in both"):
        pathtracer.merge([*parts, parts[0]], "merged.exr")
    with pytest.raises(ValueError, match="films: found none"):
        pathtracer.merge([], "merged.exr")
    with pytest.raises(ValueError, match=r"output merged.txt: unknown extension"):
        pathtracer.merge(parts, "merged.txt")
    with pytest.raises(FileNotFoundError, match=r"missing.film"):
        pathtracer.merge(["missing.film"], "merged.exr")
    with pytest.raises(ValueError, match="is not a film"):
        pathtracer.merge([folder / "scene.dae"], "merged.exr")
    with pytest.raises(TypeError):
        pathtracer.merge([3], "merged.exr")  # type: ignore[list-item]


def test_images_are_rendered_again(
    folder: Path, elsewhere: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    program(["scene.dae", "-r", 32, 24, "-s", 4, "-e", "inner/sky.exr", "-f", "a.exr"])
    monkeypatch.chdir(elsewhere)
    again = pathtracer.rerender(folder / "a.exr")
    assert again.complete
    assert again.receipt["run"]["folder"] == os.path.realpath(folder)
    assert (folder / "a_again.exr").exists()
    with pytest.raises(ValueError, match="exists already"):
        pathtracer.rerender(folder / "a.exr")
    pathtracer.rerender(folder / "a.exr", force=True)
    pathtracer.rerender(folder / "a.exr", output="b.exr", threads=1)
    assert Path("b.exr").exists()
    # An image whose pixels were changed has the same samples, but is another one.
    image = pathtracer.render(pathtracer.load(folder / "scene.dae"), width=8, spp=1)
    image["color"][:] = 0.0
    image.save("c.exr")
    with pytest.raises(RuntimeError, match="reproduces the samples"):
        pathtracer.rerender("c.exr")
    image.save("d.exr", metadata="none")
    with pytest.raises(ValueError, match="missing provenance metadata"):
        pathtracer.rerender("d.exr")
    with pytest.raises(FileNotFoundError, match=r"missing.exr"):
        pathtracer.rerender("missing.exr")
    (folder / "scene.dae").write_text("<COLLADA/>")
    with pytest.raises(pathtracer.SceneError, match=r"scene.dae"):
        pathtracer.rerender(folder / "a.exr", force=True)


def test_wrong_arguments_of_resume_are_named(
    folder: Path, program: Program, scenes: Path
) -> None:
    program(["scene.dae", "-r", 8, 6, "-s", 4, "-f", "a.exr"])
    with pytest.raises(ValueError, match="found 4 samples per pixel; expected spp 4 or more"):
        pathtracer.resume("a.exr", spp=2)
    with pytest.raises(ValueError, match="spp"):
        pathtracer.resume("a.exr", spp=-1)
    with pytest.raises(TypeError, match="threads: found bool"):
        pathtracer.resume("a.exr", threads=True)
    with pytest.raises(TypeError, match="progress: found int"):
        pathtracer.resume("a.exr", progress=3)  # type: ignore[arg-type]
    with pytest.raises(FileNotFoundError, match="no samples to resume"):
        pathtracer.resume("b.exr")
    (folder / "b.exr.film").write_bytes(b"P6")
    with pytest.raises(ValueError, match="is not a film"):
        pathtracer.resume("b.exr")
    shutil.copy(scenes / "json" / "shapes.json", folder / "scene.dae")
    with pytest.raises(pathtracer.SceneError):
        pathtracer.resume("a.exr", spp=8)


INTERRUPTED = """
import sys
import pathtracer

try:
    pathtracer.resume(sys.argv[1], spp=1_000_000, progress=lambda _: print("on", flush=True))
except pathtracer.Interrupted as error:
    print(error.partial.complete, error.partial.samples)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_keeps_the_samples_of_a_resumed_render(
    folder: Path, program: Program, interruptible: Callable[..., subprocess.Popen[str]]
) -> None:
    program(["scene.dae", "-r", 60, 45, "-s", 4, "-f", "a.exr"])
    render = interruptible(INTERRUPTED, folder / "a.exr")
    assert render.stdout is not None
    assert render.stdout.readline() == "on\n"
    render.send_signal(signal.SIGINT)
    output, _ = render.communicate(timeout=60)
    complete, samples = output.splitlines()[-1].split()
    assert complete == "False"
    command = [sys.executable, "-m", "pathtracer", "info", "--json", "a.exr.film"]
    film = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert json.loads(film)["samples"] == int(samples) > 60 * 45 * 4


def test_an_image_is_written_by_one_render_at_a_time(folder: Path, program: Program) -> None:
    program(["scene.dae", "-r", 60, 45, "-s", 4, "-f", "a.exr"])
    image = folder / "a.exr"
    began = threading.Event()

    def resume() -> None:
        pathtracer.resume(image, spp=100_000, time_limit=2, progress=lambda _: began.set())

    thread = threading.Thread(target=resume)
    thread.start()
    assert began.wait(60)
    start = time.monotonic()
    with pytest.raises(BlockingIOError, match="locked by another"):
        pathtracer.resume(image, spp=8)
    assert time.monotonic() - start < 2.0
    thread.join()
