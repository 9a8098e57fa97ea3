"""Receipts of images, denoised images, and sizes by one side."""

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer

Program = Callable[[Sequence[object]], str]


@pytest.mark.parametrize(
    ("file", "options", "reading", "settings"),
    [
        ("cornell.dae", ["-s", 2, "--camera", "fit"], {"camera": "fit"}, {"spp": 2}),
        ("json/shapes.json", ["-s", 2, "--seed", 5], {}, {"spp": 2, "seed": 5}),
        (
            "json/mist.json",
            ["--target-error", "50%", "--max-spp", "8", "--aov", "albedo,cryptomatte_object"],
            {},
            {"target_error": "50%", "max_spp": 8, "aovs": ["albedo", "cryptomatte_object"]},
        ),
    ],
)
def test_files_have_the_receipt_of_the_program(
    scenes: Path,
    tmp_path: Path,
    program: Program,
    file: str,
    options: list[object],
    reading: dict[str, Any],
    settings: dict[str, Any],
) -> None:
    scene = pathtracer.load(scenes / file, **reading)
    image = pathtracer.render(scene, width=24, height=16, **settings)
    ours, theirs = tmp_path / "ours.exr", tmp_path / "theirs.exr"
    image.save(ours, metadata="stable")
    program([scenes / file, "-r", 24, 16, "--metadata", "stable", *options, "-f", theirs])
    assert ours.read_bytes() == theirs.read_bytes()
    assert file.split("/")[-1] in [name for name, _ in image.receipt["files"]]


def test_the_program_reads_receipts_and_renders_again(
    scenes: Path, tmp_path: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The scene is read from another folder than the one in which it is rendered.
    monkeypatch.chdir(scenes.parent)
    scene = pathtracer.load(Path(scenes.name) / "cornell.dae")
    monkeypatch.chdir(tmp_path)
    image = pathtracer.render(scene, width=24, spp=4, threads=2)
    receipt = image.receipt
    assert receipt["finished"]
    assert receipt["samples"] == image.samples == 24 * image.height * 4
    assert receipt["run"]["threads"] == 2
    for file, options in [("a.exr", {}), ("a.png", {"exposure": 1.5, "tonemap": "agx"})]:
        image.save(file, **options)  # type: ignore[arg-type]
        program(["info", file])
        assert f"{file} is the same to the bit" in program(["rerender", file])


def test_receipts_name_scenes_in_memory(scenes: Path, tmp_path: Path) -> None:
    text = (scenes / "cornell.dae").read_text()
    of_file = pathtracer.render(pathtracer.load(scenes / "cornell.dae"), width=8, spp=1)
    in_memory = pathtracer.render(pathtracer.loads(text, "collada"), width=8, spp=1)
    [[name, content]] = in_memory.receipt["files"]
    assert name == "scene in memory (.dae)"
    assert [content] == [hash for _, hash in of_file.receipt["files"]]
    assert in_memory.receipt["film"] == of_file.receipt["film"]
    in_memory.save(tmp_path / "a.exr")
    command = [sys.executable, "-m", "pathtracer", "rerender", str(tmp_path / "a.exr")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert f"scene in memory (.dae): {content} before, none now" in done.stderr


@pytest.mark.parametrize(("size", "expected"), [({"width": 20}, (20, 15)), ({"height": 60}, (80, 60))])
def test_one_side_keeps_the_aspect_ratio(size: dict[str, Any], expected: tuple[int, int]) -> None:
    scene = pathtracer.Scene.from_dict({
        "pathtracer": 1,
        "settings": {"resolution": [40, 30]},
        "lights": [{"type": "constant", "radiance": 0.5}],
    })
    image = pathtracer.render(scene, spp=1, **size)
    assert (image.width, image.height) == expected
    both = pathtracer.render(scene, spp=1, width=expected[0], height=expected[1])
    np.testing.assert_array_equal(image["color"], both["color"])


def test_denoised_files_have_the_bytes_of_the_program(
    scenes: Path, tmp_path: Path, program: Program
) -> None:
    scene = pathtracer.load(scenes / "cornell.dae")
    size: dict[str, Any] = {"width": 40, "height": 30, "spp": 4}
    image = pathtracer.render(scene, **size, aovs=["albedo", "normal"])
    denoised = image.denoise()
    assert list(denoised) == ["color", "albedo", "normal", "noisy"]
    np.testing.assert_array_equal(denoised["noisy"], image["color"])
    assert (denoised["color"] != image["color"]).any()
    ours, theirs = tmp_path / "ours.exr", tmp_path / "theirs.exr"
    denoised.save(ours, metadata="stable")
    program([
        scenes / "cornell.dae", "-r", 40, 30, "-s", 4, "--aov", "albedo,normal", "--denoise",
        "--metadata", "stable", "-f", theirs,
    ])
    assert ours.read_bytes() == theirs.read_bytes()
    denoised.save(ours)
    assert "is the same to the bit" in program(["rerender", ours])
    denoised["albedo"][:] = 0.0
    assert image["albedo"].any()
    with pytest.raises(ValueError, match="threads: found -1, expected a number from 0 up to 4096"):
        image.denoise(threads=-1)
    with pytest.raises(TypeError, match="threads: "):
        image.denoise(threads="1")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="denoised already"):
        denoised.denoise()
    # Without guides, the colours alone are denoised.
    plain = pathtracer.render(scene, **size).denoise()
    assert list(plain) == ["color", "noisy"]
    assert np.isfinite(plain["color"]).all()
    assert (plain["color"] != denoised["color"]).any()


MISSING_DENOISER = """
import sys
sys.modules["pyoidn"] = None
import pathtracer

try:
    pathtracer.render(pathtracer.default_scene(), width=8, spp=1).denoise()
except OSError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ("variable", "message"),
    [
        ("PATHTRACER_OIDN", "where Open Image Denoise cannot be opened"),
        ("HOME", "-m pip install --no-deps"),
    ],
)
def test_a_missing_denoiser_is_an_oserror(tmp_path: Path, variable: str, message: str) -> None:
    left_out = ["VIRTUAL_ENV", "CONDA_PREFIX", "XDG_DATA_HOME", "PATHTRACER_OIDN"]
    environment = {name: value for name, value in os.environ.items() if name not in left_out}
    environment[variable] = str(tmp_path)
    # An open library is found by its name: the process is a new one.
    command = [sys.executable, "-c", MISSING_DENOISER]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert message in done.stdout
