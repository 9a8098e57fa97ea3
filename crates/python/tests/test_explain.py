"""Light paths of a pixel."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer

Start = Callable[..., subprocess.Popen[str]]
SIZE: dict[str, Any] = {"width": 32, "height": 24, "spp": 16}
LUMINANCE = np.array([0.212639, 0.715169, 0.072192])


def of_program(scenes: Path, options: list[object]) -> Any:
    command = [sys.executable, "-m", "pathtracer", "explain", scenes / "cornell.dae", "-r", 32, 24]
    command += ["-s", 16, "-x", 10, "-y", 20, "--json", *options]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_rows_are_the_paths_of_the_program(scenes: Path) -> None:
    rows = pathtracer.explain(scenes / "cornell.dae", 10, 20, **SIZE, top=5)
    expected = of_program(scenes, [])["brightest"]
    assert len(rows) == len(expected) == 5
    for row, path in zip(rows, expected, strict=True):
        [contribution] = path["contributions"]
        source = contribution["source"]
        item = source.get("light") or source.get("surface")
        assert row["sample"] == path["sample"]
        assert row["luminance"] == path["luminance"]
        assert row["type"] == contribution["expression"]
        assert [row["r"], row["g"], row["b"]] == contribution["value"]
        assert (row["source"], row["object"]) == (source["kind"], item["object"])
        assert (row["pdf"], row["mis_weight"]) == (source.get("pdf"), source["weight"])
        assert row["path"] == path["vertices"]


def test_rows_of_a_sample_are_its_contributions(scenes: Path) -> None:
    scene = pathtracer.load(scenes / "cornell.dae")
    rows = pathtracer.explain(scene, 10, 20, **SIZE, sample=3)
    expected = of_program(scenes, ["--sample", 3])
    assert [row["type"] for row in rows] == [c["expression"] for c in expected["contributions"]]
    np.testing.assert_allclose(
        np.sum([[row["r"], row["g"], row["b"]] for row in rows], axis=0),
        expected["radiance"],
        rtol=1e-6,
    )
    assert sum(row["share"] for row in rows) == pytest.approx(1.0)


def test_all_paths_add_up_to_the_pixel(scene: pathtracer.Scene) -> None:
    rows = pathtracer.explain(scene, 10, 20, **SIZE)
    luminances = [row["luminance"] for row in rows]
    assert luminances == sorted(luminances, reverse=True)
    assert sum(row["share"] for row in rows) == pytest.approx(1.0)
    assert len({tuple(row) for row in rows}) == 1
    pixel = pathtracer.render(scene, **SIZE)["color"][20, 10]
    assert sum(luminances) / 16 == pytest.approx(float(pixel @ LUMINANCE), rel=1e-4)
    assert rows[:3] == pathtracer.explain(scene, 10, 20, **SIZE, top=3)


INTERRUPTED = """
import threading
import pathtracer

threading.Timer(0.5, lambda: print("on", flush=True)).start()
try:
    pathtracer.explain(pathtracer.default_scene(), 10, 20, spp=1_000_000_000)
except KeyboardInterrupt:
    print("stopped")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_stops_an_explanation(interruptible: Start) -> None:
    process = interruptible(INTERRUPTED)
    assert process.stdout is not None
    assert process.stdout.readline() == "on\n"
    start = time.monotonic()
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert output == "stopped\n"
    assert time.monotonic() - start < 5.0


@pytest.mark.parametrize(
    ("pixel", "options", "error", "message"),
    [
        ((32, 0), {}, ValueError, "x 32, y 0: found a pixel outside of the image of 32 x 24"),
        ((-1, 0), {}, ValueError, "x: found -1, expected a whole number from 0 on"),
        ((0, "a"), {}, TypeError, "y: "),
        ((0, 0.5), {}, TypeError, "y: "),
        ((0, 0), {"sample": 16}, ValueError, "sample 16: expected 0 to 15"),
        ((0, 0), {"sample": 1, "top": 1}, ValueError, "mutually exclusive"),
        ((0, 0), {"path_reuse": 2}, ValueError, "omit path_splitting and path_reuse"),
        ((0, 0), {"integrator": "ao"}, ValueError, "ao"),
        ((0, 0), {"spp": "many"}, ValueError, "spp"),
        ((0, 0), {"crop": (1, 1, 2, 2)}, ValueError, "only columns 1 to 2"),
    ],
)
def test_wrong_arguments_are_named(
    scene: pathtracer.Scene,
    pixel: tuple[Any, Any],
    options: dict[str, Any],
    error: type[Exception],
    message: str,
) -> None:
    with pytest.raises(error, match=message):
        pathtracer.explain(scene, *pixel, **{**SIZE, **options})
    with pytest.raises(TypeError, match="scene: found .*int.*expected a Scene or a path"):
        pathtracer.explain(3, 0, 0)  # type: ignore[arg-type]
    with pytest.raises(FileNotFoundError):
        pathtracer.explain("missing.xml", 0, 0)
