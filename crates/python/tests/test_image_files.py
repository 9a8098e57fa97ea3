"""Functions on image files: develop, denoise and join."""

import importlib.util
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

import pathtracer

Program = Callable[[Sequence[object]], str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder with an image of several layers, in which commands run."""
    scene = pathtracer.default_scene()
    image = pathtracer.render(scene, width=40, spp=2, aovs=["albedo", "normal"], alpha=True)
    image.save(tmp_path / "room.exr")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_developed_images_are_those_of_the_program(folder: Path, program: Program) -> None:
    program(["develop", "room.exr", "-f", "theirs.png", "--exposure", 1, "--tonemap", "agx"])
    assert pathtracer.develop("room.exr", "ours.png", exposure=1, tonemap="agx") == [
        Path("ours.png")
    ]
    assert (folder / "ours.png").read_bytes() == (folder / "theirs.png").read_bytes()
    (folder / "pictures").mkdir()
    options = ["--layer", "albedo", "-p", 5, 0, 20, 10, "--resize", 10, 5, "--alpha=off"]
    program(["develop", "room.exr", "-f", "theirs.png", *options])
    written = pathtracer.develop(
        (path for path in [Path("room.exr")]),
        Path("pictures"),
        layer="albedo",
        crop=np.array([5, 0, 20, 10]),
        resize=(10, 5),
        alpha=False,
    )
    assert written == [Path("pictures/room.png")]
    assert written[0].read_bytes() == (folder / "theirs.png").read_bytes()


def test_an_unreadable_image_does_not_prevent_the_others(folder: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"missing.exr") as error:
        pathtracer.develop(["missing.exr", "room.exr", "none.exr"])
    assert "none.exr" in str(error.value)
    assert (folder / "room.png").exists()
    (folder / "text.exr").write_text("text")
    with pytest.raises(ValueError, match=r"text.exr"):
        pathtracer.develop("text.exr")


def test_wrong_arguments_are_named(folder: Path) -> None:
    with pytest.raises(ValueError, match='unknown setting "exposur"; did you mean "exposure"'):
        pathtracer.develop("room.exr", exposur=1)  # type: ignore[call-arg]
    with pytest.raises(ValueError, match="exposure and tonemap require a PNG image"):
        pathtracer.develop("room.exr", "other.exr", exposure=1)
    with pytest.raises(ValueError, match="resize: found 3 values, expected 2"):
        pathtracer.develop("room.exr", resize=(1, 2, 3))
    with pytest.raises(ValueError, match="found no layer"):
        pathtracer.develop("room.exr", layer="depth")
    with pytest.raises(ValueError, match="which is an input"):
        pathtracer.develop("room.exr", "room.exr")
    with pytest.raises(ValueError, match="images: found none"):
        pathtracer.develop([])
    with pytest.raises(TypeError, match="images: found int"):
        pathtracer.develop(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="images: found int"):
        pathtracer.develop(["room.exr", 3])  # type: ignore[list-item]


def test_values_that_are_not_finite_are_warnings(folder: Path) -> None:
    image = pathtracer.render(pathtracer.default_scene(), width=8, spp=1)
    image["color"][0, 0] = np.nan
    image.save("nan.exr")
    with pytest.warns(UserWarning, match=r"nan.exr"):
        pathtracer.develop("nan.exr")


def test_denoised_files_are_those_of_the_program(
    folder: Path, program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    program(["denoise", "room.exr", "-f", "theirs.exr"])
    assert pathtracer.denoise("room.exr", threads=1) == [Path("room_denoised.exr")]
    assert (folder / "room_denoised.exr").read_bytes() == (folder / "theirs.exr").read_bytes()
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    monkeypatch.setenv("PATHTRACER_OIDN", str(folder))
    with pytest.raises(OSError, match="PATHTRACER_OIDN"):
        pathtracer.denoise("room.exr")


def test_joined_parts_are_the_whole_image(folder: Path) -> None:
    scene = pathtracer.default_scene()
    for name, crop in [("whole", (0, 0, 20, 15)), ("a", (0, 0, 8, 15)), ("b", (8, 0, 12, 15))]:
        image = pathtracer.render(scene, resolution=(20, 15), spp=2, crop=crop)
        image.save(f"{name}.exr")
    assert pathtracer.join(["b.exr", "a.exr"], "both.exr") == [Path("both.exr")]
    pathtracer.develop(["whole.exr", "both.exr"])
    whole, both = (Path(name).read_bytes()[-200:] for name in ["whole.png", "both.png"])
    assert whole == both
    with pytest.raises(ValueError, match="allow_gaps"):
        pathtracer.join("a.exr", "gap.exr")
    pathtracer.join("a.exr", "gap.png", allow_gaps=True, exposure=1)
    assert Path("gap.png").exists()
