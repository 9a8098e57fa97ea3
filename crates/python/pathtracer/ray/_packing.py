"""Scenes and settings as values that other machines can use."""

from __future__ import annotations

import hashlib
import os
import pickle
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._native import (
    PartialRender,
    hierarchies,
    load,
    reading_options,
    with_camera,
    with_hierarchies,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .._native import Scene

# Settings that are names of files.
_FILES = ("environment", "camera_file")
_SCENE = "scene.json"


@dataclass(frozen=True)
class PackedScene:
    """Files of a scene in the project's own format, the options of reading it, and its compiled
    hierarchies."""

    files: dict[str, bytes]
    options: dict[str, Any]
    hierarchies: bytes

    @property
    def nbytes(self) -> int:
        """Size of all files and hierarchies."""
        return sum(map(len, self.files.values())) + len(self.hierarchies)


@dataclass(frozen=True)
class PackedSettings:
    """Settings of a render, with the files that they name, and the identity of the render."""

    settings: dict[str, Any]
    camera: str | int | None
    # By setting: the name, with a number of a view, and the contents of its files by name.
    files: dict[str, tuple[str, dict[str, bytes]]]
    identity: str


def pack_scene(scene: Scene) -> PackedScene:
    """Save a scene to memory, with its hierarchies if it was compiled; it is read as it was, to the
    last bit."""
    with tempfile.TemporaryDirectory(prefix="pathtracer-") as folder:
        scene.save(Path(folder, _SCENE))
        paths = (Path(parent, name) for parent, _, names in os.walk(folder) for name in names)
        files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    return PackedScene(files, reading_options(scene), hierarchies(scene))


def pack_settings(
    settings: Mapping[str, Any], camera: str | int | None, identity: str
) -> PackedSettings:
    """Read the files of settings."""
    files = {}
    for name in _FILES:
        path = settings.get(name)
        if path is not None:
            files[name] = _files_of(Path(path))
    others = {name: value for name, value in settings.items() if name not in files}
    return PackedSettings(others, camera, files, identity)


def _files_of(path: Path) -> tuple[str, dict[str, bytes]]:
    """Name of a file, and its contents with those of the file beside it that it needs."""
    file, number = path, ""
    if not path.is_file():
        name, mark, number = path.name.rpartition("#")
        file, number = (path.with_name(name), mark + number) if mark else (path, "")
    needed = [file, file.with_name("cameras.txt")] if file.suffix == ".txt" else [file]
    contents = {each.name: each.read_bytes() for each in needed if each == file or each.is_file()}
    return file.name + number, contents


def key_of(scene: PackedScene, settings: PackedSettings) -> str:
    """Hash of a render."""
    # The hierarchies follow from the files.
    return hashlib.sha256(pickle.dumps((scene.files, scene.options, settings))).hexdigest()


def unpack_scene(packed: PackedScene) -> Scene:
    """Read a scene."""
    with tempfile.TemporaryDirectory(prefix="pathtracer-") as folder:
        for name, content in packed.files.items():
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        scene = load(Path(folder, _SCENE), **packed.options)
    return with_hierarchies(scene, packed.hierarchies)


def view_of(scene: Scene, camera: str | int | None) -> Scene:
    """Return the scene with one of its cameras, which shares the compilation.

    Raises
    ------
    ValueError
        If there is no such camera, or the scene has to be read for each camera.
    """
    if camera is None:
        return scene
    view = with_camera(scene, str(camera))
    if view is None:
        message = (
            "camera: this scene has to be read for each camera, since they have settings of their "
            f"own, or since it was read for a time; use load(…, camera={camera!r})"
        )
        raise ValueError(message)
    return view


def unpack(scene: Scene, packed: PackedSettings) -> PartialRender:
    """Compile a scene; of the one that was compiled last for it, what is the same is kept.

    Raises
    ------
    RuntimeError
        If this machine has another version of pathtracer than the one that packed it.
    """
    with tempfile.TemporaryDirectory(prefix="pathtracer-") as folder:
        settings = dict(packed.settings)
        for setting, (name, contents) in packed.files.items():
            beside = Path(folder, setting)
            beside.mkdir()
            for file, content in contents.items():
                (beside / file).write_bytes(content)
            settings[setting] = beside / name
        render = PartialRender(view_of(scene, packed.camera), **settings)
    if render.identity != packed.identity:
        message = (
            "the worker would render another image: found "
            f"{render.identity}, expected {packed.identity}; install the same version of "
            "pathtracer on all machines"
        )
        raise RuntimeError(message)
    return render
