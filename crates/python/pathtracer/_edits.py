"""Parts of edited scenes."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from . import build
from ._values import of_parts
from .build._part import Part

_ENDINGS = {"cameras": "Camera", "lights": "Light", "materials": "Material"}
"""Ends of the names of the classes of a table."""


def values(
    parts: Mapping[str, Any], scene: dict[str, Any], media: Sequence[str]
) -> tuple[dict[str, Any], list[tuple[str, str]], dict[str, list[str | int] | None]]:
    """The values of a scene of the new parts, with the settings of `scene`; the places of parts
    that have names of their own; and the keys of the materials, lights and transforms. `media`
    are the names of the media of the edited scene."""
    keys = dict(parts)
    places: list[tuple[str, str]] = []
    transforms = _mapping("transforms", keys.pop("transforms", {}))
    keys["objects"] = []
    for i, (key, value) in enumerate(transforms.items()):
        place = f"transforms[{_shown(key)}]"
        places += [
            (f"objects[{i}].to_world.matrix", place),
            (f"objects[{i}].to_world", place),
        ]
        keys["objects"].append({"type": "sphere", "to_world": _steps(value, place)})
    lights = keys.pop("lights", [])
    of_lights: list[str | int] | None = None
    if isinstance(lights, Mapping):
        of_lights = list(lights)
        places += [(f"lights[{i}]", f"lights[{_shown(key)}]") for i, key in enumerate(lights)]
        lights = list(lights.values())
    elif not isinstance(lights, (list, tuple)):
        found = type(lights).__name__
        raise TypeError(f"lights: found a value of type {found}, expected a list or a dict")
    keys["lights"] = lights
    if media:
        keys["media"] = {name: {"type": "homogeneous", "extinction": 1} for name in media}
    new, named = of_parts(keys)
    numbered = {
        "materials": list(new.get("materials", {})),
        "lights": of_lights,
        "transforms": list(transforms),
    }
    return scene | new, places + named, numbered


def parts(table: str, values: dict[str, Any], transforms: Sequence[Any]) -> list[Part]:
    """The parts of a table, with their transforms as matrices."""
    entries = values.get(table, [])
    if isinstance(entries, dict):
        entries = list(entries.values())
    made = [_part(table, entry) for entry in entries]
    for part, to_world in zip(made, transforms, strict=False):
        if hasattr(part, "to_world"):
            part.to_world = to_world
    return made


def _part(table: str, values: Mapping[str, Any]) -> Part:
    ending = _ENDINGS[table]
    kinds = [kind for name, kind in vars(build).items() if name.endswith(ending)]
    classes = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Part)]
    kind: Any = next(kind for kind in classes if kind.type == values["type"])
    names = {field.name.rstrip("_"): field.name for field in dataclasses.fields(kind)}
    fields = {names[key]: value for key, value in values.items() if key != "type"}
    part: Part = kind(**fields)
    return part


def _mapping(name: str, value: Any) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        found = type(value).__name__
        raise TypeError(f"{name}: found a value of type {found}, expected a dict by name")
    return value


def _steps(value: Any, place: str) -> Any:
    """A transform as in scene files."""
    is_step = isinstance(value, (Part, Mapping))
    if is_step or isinstance(value, (list, tuple)) and _are_steps(value):
        return value
    if hasattr(value, "__dlpack__") and not isinstance(value, np.ndarray):
        value = np.from_dlpack(value)
    try:
        matrix = np.asarray(value)
    except (TypeError, ValueError) as error:
        raise TypeError(f"{place}: expected a matrix of numbers, {error}") from error
    if matrix.dtype.kind not in "iuf":
        found = type(value).__name__ if matrix.dtype.kind == "O" else f"array of {matrix.dtype}"
        message = f"{place}: found a value of type {found}, expected a matrix of real numbers"
        raise TypeError(message)
    if matrix.shape not in ((3, 4), (4, 4)):
        message = f"{place}: found shape {matrix.shape}, expected (3, 4) or (4, 4)"
        raise ValueError(message)
    return {"matrix": matrix.astype(np.float64).tolist()}


def _are_steps(values: Sequence[Any]) -> bool:
    return all(isinstance(step, (Part, Mapping)) for step in values)


def _shown(key: Any) -> str:
    return json.dumps(key, ensure_ascii=False) if isinstance(key, str) else str(key)
