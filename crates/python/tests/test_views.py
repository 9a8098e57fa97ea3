"""Renders of many views of a scene, and their cameras."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pathtracer
from pathtracer import build

Program = Callable[[Sequence[object]], str]

SIZE: dict[str, Any] = {"width": 40, "height": 30, "spp": 2}


def turned(scene: pathtracer.Scene, angle: float) -> np.ndarray[Any, Any]:
    """Camera to world of the camera of a scene, turned to the left."""
    sine, cosine = np.sin(angle), np.cos(angle)
    turn = np.array([[cosine, 0, sine, 0], [0, 1, 0, 0], [-sine, 0, cosine, 0], [0, 0, 0, 1]])
    camera: Any = scene.camera
    to_world: np.ndarray[Any, Any] = camera.to_world @ turn
    return to_world


@pytest.fixture
def scene(scenes: Path) -> pathtracer.Scene:
    return pathtracer.load(scenes / "cornell.dae")


def test_each_view_is_the_render_with_its_camera(scene: pathtracer.Scene) -> None:
    orthographic = build.OrthographicCamera(
        half_height=280, to_world=build.Translate(translate=[278, 273, -100])
    )
    cameras: list[Any] = [turned(scene, 0.1), orthographic, {"type": "panorama"}, 0, scene.camera]
    images = list(pathtracer.render_views(scene, (each for each in cameras), seed=3, **SIZE))
    assert len(images) == len(cameras)
    moved: Any = scene.camera
    moved.to_world = cameras[0]
    single = [moved, *cameras[1:3], scene.cameras[0], scene.camera]
    for image, camera in zip(images, single):
        expected = pathtracer.render(scene.replace(camera=camera), seed=3, **SIZE)
        np.testing.assert_array_equal(image["color"], expected["color"])
        assert image.receipt["film"] == expected.receipt["film"]
    assert images[0].camera is not None
    assert images[1].camera is images[2].camera is None
    assert len(list(pathtracer.render_views(scene, **SIZE))) == len(scene.cameras)


def test_the_scene_is_compiled_once(scene: pathtracer.Scene) -> None:
    assert not scene.compiled
    views = pathtracer.render_views(scene, [turned(scene, 0.1), turned(scene, 0.2)], **SIZE)
    next(views)
    assert scene.compiled
    assert scene.replace(lights=[]).compiled
    moved = scene.replace(transforms={0: np.eye(4)})
    assert moved.compiled
    # A scene with other objects keeps its compilation to itself.
    first = pathtracer.loads("<scene version='3.0.0'><shape type='sphere'/></scene>", "mitsuba")
    pathtracer.render(first.replace(transforms={0: np.eye(4)}), width=4, spp=1)
    assert not first.compiled


def test_datasets_have_their_cameras(
    scene: pathtracer.Scene, tmp_path: Path, program: Program, scenes: Path
) -> None:
    (tmp_path / "train").mkdir()
    matrices = [turned(scene, angle) for angle in (0.0, 0.1)]
    file = tmp_path / "transforms.json"
    images = list(
        pathtracer.render_views(
            scene, matrices, output=tmp_path / "train/r_%03d.exr", transforms=file, **SIZE
        )
    )
    written = json.loads(file.read_text())
    assert (written["w"], written["h"]) == (40, 30)
    assert [frame["file_path"] for frame in written["frames"]] == [
        "train/r_000.exr",
        "train/r_001.exr",
    ]
    for frame, to_world, image in zip(written["frames"], matrices, images):
        np.testing.assert_allclose(frame["transform_matrix"], to_world, atol=1e-4)
        assert image.camera is not None
        np.testing.assert_array_equal(image.camera["transform_matrix"], frame["transform_matrix"])
        assert (tmp_path / "train" / Path(frame["file_path"]).name).exists()
    # The views are those of the file: the pictures differ by the rounding of the matrices.
    again = list(pathtracer.render_views(scene, file, spp=2))
    for image, first in zip(again, images):
        assert image["color"].shape == first["color"].shape
        assert np.median(np.abs(image["color"] - first["color"])) < 1e-4
    one = list(pathtracer.render_views(scene, f"{file}#1..1", spp=2))
    np.testing.assert_array_equal(one[0]["color"], again[1]["color"])
    options: list[object] = ["-s", 2, "--cameras", file, "--metadata", "none"]
    program([scenes / "cornell.dae", *options, "-f", tmp_path / "%d.exr"])
    for number, image in enumerate(again):
        image.save(tmp_path / "ours.exr", metadata="none")
        expected = (tmp_path / f"{number}.exr").read_bytes()
        assert (tmp_path / "ours.exr").read_bytes() == expected


def test_the_camera_of_an_image_projects_its_positions(scene: pathtracer.Scene) -> None:
    image = pathtracer.render(scene, aovs=["position"], crop=(8, 4, 20, 15), **SIZE)
    camera: Any = image.camera
    assert (camera["w"], camera["h"]) == (20, 15) == image["color"].shape[1::-1]
    to_camera = np.linalg.inv(camera["transform_matrix"])
    # Positions are in metres, and the scene is in millimetres.
    local = 1000 * image["position"] @ to_camera[:3, :3].T + to_camera[:3, 3]
    x = camera["cx"] + camera["fl_x"] * local[..., 0] / -local[..., 2]
    y = camera["cy"] - camera["fl_y"] * local[..., 1] / -local[..., 2]
    rows, columns = np.mgrid[:15, :20]
    # Means of positions over the samples of a pixel, which may be of several surfaces.
    assert np.quantile(np.abs(x - columns - 0.5), 0.8) < 0.5
    assert np.quantile(np.abs(y - rows - 0.5), 0.8) < 0.5


@pytest.mark.parametrize(
    ("cameras", "options", "message"),
    [
        (["camra"], {}, 'cameras: unknown camera "camra"; did you mean "camera"'),
        ([7], {}, "cameras: found 7, expected a number below 1"),
        ([np.eye(3)], {}, r"cameras\[0\]: found .* shape \(3, 3\), expected a camera or a matrix"),
        ([0], {"output": "view.png"}, "output: found view.png, expected a place for a number"),
        ([0], {"output": "view%d.gif"}, "unknown extension"),
        ([0], {"transforms": "cameras.txt"}, "transforms: found cameras.txt, expected"),
        ([{"type": "panorama"}], {"transforms": "t.json"}, "image 0 is not a perspective one"),
        ([0], {"max_dept": 3}, 'did you mean "max_depth"'),
        ([np.full((4, 4), np.nan)], {}, r"camera"),
    ],
)
def test_wrong_views_are_named(
    scene: pathtracer.Scene,
    cameras: Any,
    options: Any,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        list(pathtracer.render_views(scene, cameras, width=8, spp=1, **options))
    assert not list(tmp_path.iterdir())


def test_wrong_types_of_views(scene: pathtracer.Scene) -> None:
    with pytest.raises(TypeError, match="cameras: found a value of type int"):
        pathtracer.render_views(scene, 3)  # type: ignore[arg-type]
    with pytest.raises(FileNotFoundError, match=r"missing.json"):
        pathtracer.render_views(scene, "missing.json")
