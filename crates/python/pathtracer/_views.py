"""Renders of many views of a scene."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._native import Image, Scene, camera_of, render, view_numbers

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from ._native import _Integer, _Report, _Settings, _View

# Keys of a camera that transforms.json has once if they are those of all views.
_LENS = ("fl_x", "fl_y", "cx", "cy", "w", "h")


def render_views(
    scene: Scene,
    cameras: str | os.PathLike[str] | Iterable[_View] | None = None,
    *,
    output: str | os.PathLike[str] | None = None,
    transforms: str | os.PathLike[str] | None = None,
    width: _Integer | None = None,
    height: _Integer | None = None,
    aovs: Sequence[str] | None = None,
    progress: _Report = None,
    **settings: Unpack[_Settings],
) -> Iterator[Image]:
    """Render a scene with many cameras, for which it is compiled once.

    Parameters
    ----------
    scene : Scene
        Scene to be rendered.
    cameras : iterable or path, optional
        Cameras, which may be generated: parts of :mod:`pathtracer.build` or dictionaries of a scene
        file, names or numbers of cameras of the scene, or matrices of shape (3, 4) or (4, 4) that
        replace the transform of its active camera: camera to world, with axes to the right, up and
        backwards. Or the path of a file of views, transforms.json of NeRF or images.txt of COLMAP,
        of which "transforms.json#0..99/10" selects some. By default, all cameras of the scene.
    output : str or os.PathLike, optional
        Files to which the images are saved, such as "train/r_%03d.png"; %d is the number of the
        view, from 0.
    transforms : str or os.PathLike, optional
        File, transforms.json, to which the cameras of all images are written after the last one, as
        NeRF and its successors read it. It refers to the files of `output`.
    width, height, aovs, progress, **settings
        As for :func:`render`; progress is that of each image.

    Yields
    ------
    Image
        The images, in order. Each equals the one of :func:`render` with this camera, bit for bit.

    Raises
    ------
    SceneError, TypeError, ValueError, OSError, Interrupted
        As :func:`render` and :meth:`Image.save`; also if a camera is unknown, or `transforms` is
        requested of a camera that is not a perspective one.
    """
    pattern = None if output is None else _pattern(Path(output))
    if transforms is not None and Path(transforms).suffix != ".json":
        message = f"transforms: found {os.fspath(transforms)}, expected the name of a .json file"
        raise ValueError(message)
    named: dict[str, Any] = {
        "width": width,
        "height": height,
        "aovs": aovs,
        "progress": progress,
        **settings,
    }
    views = _views(scene, cameras)
    return _images(views, named, pattern, None if transforms is None else Path(transforms))


def _images(
    views: Iterable[tuple[Scene, dict[str, Any]]],
    settings: dict[str, Any],
    pattern: str | None,
    transforms: Path | None,
) -> Iterator[Image]:
    frames: list[dict[str, Any]] = []
    for number, (scene, of_view) in enumerate(views):
        image = render(scene, **{**settings, **of_view})
        path = None if pattern is None else Path(pattern % number)
        if path is not None:
            image.save(path)
        if transforms is not None:
            frames.append(_frame(image, number, path, transforms.parent))
        yield image
    if transforms is not None:
        _write(transforms, frames)


def _views(
    scene: Scene, cameras: str | os.PathLike[str] | Iterable[_View] | None
) -> Iterator[tuple[Scene, dict[str, Any]]]:
    if cameras is None:
        cameras = scene.cameras
        if not cameras:
            raise ValueError("cameras: the scene has none, expected some")
    if isinstance(cameras, (str, os.PathLike)):
        file, numbers = view_numbers(os.fspath(cameras))
        return ((scene, {"camera_file": f"{file}#{number}"}) for number in numbers)
    if not isinstance(cameras, Iterable):
        found = type(cameras).__name__
        raise TypeError(f"cameras: found a value of type {found}, expected cameras, or a path")
    return ((scene.replace(camera=_camera(scene, i, each)), {}) for i, each in enumerate(cameras))


def _camera(scene: Scene, number: int, view: Any) -> Any:
    """The camera of a view."""
    import numpy as np  # When it is needed: it takes most of the time of an import.

    if isinstance(view, str) or hasattr(view, "__index__") and not np.ndim(view):
        return camera_of(scene, view)
    if isinstance(view, Mapping) or hasattr(view, "to_world"):
        return view
    matrix = np.asarray(view)
    if matrix.shape not in ((3, 4), (4, 4)):
        found = f"a value of type {type(view).__name__} and shape {matrix.shape}"
        message = f"cameras[{number}]: found {found}, expected a camera or a matrix of shape (4, 4)"
        raise ValueError(message)
    camera: Any = scene.camera
    if camera is None:
        raise ValueError(f"cameras[{number}]: the scene has no camera that a matrix could move")
    camera.to_world = matrix
    return camera


def _pattern(path: Path) -> str:
    text = os.fspath(path)
    try:
        names = {text % number for number in (0, 1)}
    except (TypeError, ValueError):
        names = set()
    if len(names) < 2:
        message = f"output: found {text}, expected a place for a number, as in r_%03d.png"
        raise ValueError(message)
    return text


def _frame(image: Image, number: int, path: Path | None, folder: Path) -> dict[str, Any]:
    camera = image.camera
    if camera is None:
        message = f"transforms: the camera of image {number} is not a perspective one"
        raise ValueError(message)
    camera["transform_matrix"] = camera["transform_matrix"].tolist()
    if path is not None:
        camera["file_path"] = Path(os.path.relpath(path, folder)).as_posix()
    return camera


def _write(path: Path, frames: list[dict[str, Any]]) -> None:
    """Write transforms.json, which replaces an existing file when it is complete."""
    whole: dict[str, Any] = {}
    for key in _LENS:
        values = {frame[key] for frame in frames}
        if len(values) == 1:
            whole[key] = values.pop()
    if "fl_x" in whole and "w" in whole:
        whole["camera_angle_x"] = 2 * math.atan(whole["w"] / (2 * whole["fl_x"]))
    whole["frames"] = [{k: v for k, v in frame.items() if k not in whole} for frame in frames]
    partial = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        partial.write_text(json.dumps(whole, indent=1))
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
