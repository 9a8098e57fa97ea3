"""Scenes as values of Python."""

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

from .build._part import Part

_NAMED = {
    "material": "materials",
    "materials": "materials",
    "medium": "media",
    "interior": "media",
    "exterior": "media",
}
"""Keys whose values are entries of a table, and the table."""

_TABLES = (
    "images",
    "grids",
    "textures",
    "profiles",
    "measurements",
    "motions",
    "meshes",
    "points",
    "media",
    "materials",
)
"""Tables in the order in which they may refer to each other."""


def parse(text: str, attachments: list[Any]) -> dict[str, Any]:
    """The values of a text, with arrays and contents of files in place of their references."""

    def attached(value: dict[str, Any]) -> Any:
        return attachments[value["$attached"]] if "$attached" in value else value

    def integer(digits: str) -> float:
        # Python has no integer of this sign.
        return -0.0 if digits == "-0" else int(digits)

    values: dict[str, Any] = json.loads(text, object_hook=attached, parse_int=integer)
    return values


def of_parts(keys: Mapping[str, Any]) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """The values of a scene of parts, and the places of table entries that have names of their own:
    pairs of a place in the values and one in the arguments."""
    return _Scene(keys).values()


def of_material(
    material: Any, parts: Mapping[str, Any]
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """The values of a square of a material, seen from +z."""
    materials = dict(parts.get("materials") or {})
    name = "material"
    if isinstance(material, str) and material in materials:
        name = material
    else:
        while name in materials:
            name += "_"
        materials[name] = material
    square = {"type": "rectangle", "material": name}
    values, places = of_parts({**parts, "materials": materials, "objects": [square]})
    return values, [(f"materials.{name}", "material"), *places]


def of_phase(
    phase: Any, parts: Mapping[str, Any]
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
    """The values of a cube of a medium with a phase function."""
    medium = {"type": "homogeneous", "extinction": 1, "albedo": 1, "phase": phase}
    cube = {"type": "cube", "media": {"interior": "phase"}}
    values, places = of_parts({**parts, "media": {"phase": medium}, "objects": [cube]})
    return values, [("media.phase.phase", "phase"), *places]


class _Scene:
    def __init__(self, keys: Mapping[str, Any]) -> None:
        self.keys = dict(keys)
        self.tables: dict[str, dict[str, Any]] = {table: {} for table in _TABLES}
        self.places: list[tuple[str, str]] = []
        # Entries by the identities of their parts, which the list keeps alive.
        self.names: dict[tuple[str, int], str] = {}
        self.parts: list[Any] = []
        self.taken: dict[str, set[str]] = {table: set() for table in _TABLES}
        self.open: set[int] = set()
        for table in _TABLES:
            given = self.keys.get(table)
            if given is None:
                continue
            if not isinstance(given, Mapping):
                found = type(given).__name__
                raise TypeError(f"{table}: found a value of type {found}, expected a dict by name")
            for name, entry in given.items():
                if not isinstance(name, str):
                    found = type(name).__name__
                    raise TypeError(f"{table}: found a key of type {found}, expected str")
                self.taken[table].add(name)
                if isinstance(entry, Part):
                    self.names[table, id(entry)] = name

    def values(self) -> tuple[dict[str, Any], list[tuple[str, str]]]:
        values: dict[str, Any] = {"pathtracer": 1}
        for table in _TABLES:
            for name, entry in (self.keys.pop(table, None) or {}).items():
                self.entry(table, name, entry, f"{table}{_key(name)}")
        camera = self.keys.pop("camera", None)
        if camera is not None:
            if self.keys.get("cameras") is not None:
                raise TypeError("camera: found camera and cameras, expected one of them")
            values["cameras"] = [self.value(camera, "camera")]
            self.places.append(("cameras[0]", "camera"))
        for key, value in self.keys.items():
            if value is not None:
                values[key] = self.value(value, key)
        tables = {table: entries for table, entries in self.tables.items() if entries}
        return tables | values, self.places

    def value(self, value: Any, place: str) -> Any:
        if isinstance(value, Part):
            if value.table is not None and value.table not in ("materials", "media"):
                return self.reference(value.table, value, place)
            return self.fields(value, place)
        if isinstance(value, Mapping):
            return {key: self.of_key(key, each, f"{place}.{key}") for key, each in value.items()}
        if isinstance(value, (list, tuple)):
            return [self.value(each, f"{place}[{i}]") for i, each in enumerate(value)]
        return value

    def fields(self, part: Part, place: str) -> dict[str, Any]:
        assert dataclasses.is_dataclass(part)
        if id(part) in self.open:
            raise ValueError(f"{place}: found a part that contains itself")
        self.open.add(id(part))
        values: dict[str, Any] = {} if part.type is None else {"type": part.type}
        for field in dataclasses.fields(part):
            value = getattr(part, field.name)
            if value is not None:
                key = field.name.rstrip("_")
                values[key] = self.of_key(key, value, f"{place}.{field.name}")
        self.open.remove(id(part))
        return values

    def of_key(self, key: Any, value: Any, place: str) -> Any:
        """The value of a key of an object."""
        table = _NAMED.get(key)
        if table is not None:
            if isinstance(value, Part) and value.table == table:
                return self.reference(table, value, place)
            if key == "materials" and isinstance(value, (list, tuple)):
                return [self.of_key("material", v, f"{place}[{i}]") for i, v in enumerate(value)]
        if key in ("to_world", "to_texture", "to_pattern") and getattr(value, "ndim", None) == 2:
            return {"matrix": value}
        return self.value(value, place)

    def reference(self, table: str, part: Part, place: str) -> str:
        """Name of a part that is an entry of a table."""
        name = self.names.get((table, id(part)))
        if name is None:
            wanted = getattr(part, "name", None)
            if not isinstance(wanted, str) or not wanted or table == "textures":
                wanted = part.type or type(part).__name__.lower()
            name, count = wanted, 1
            while name in self.taken[table]:
                count += 1
                name = f"{wanted}_{count}"
            self.taken[table].add(name)
            self.names[table, id(part)] = name
            self.places.append((f"{table}{_key(name)}", place))
        elif id(part) in self.open:
            raise ValueError(f"{place}: found a part that contains itself")
        self.entry(table, name, part, place)
        return name

    def entry(self, table: str, name: str, entry: Any, place: str) -> None:
        """Adds an entry of a table after those to which it refers."""
        if name not in self.tables[table]:
            self.parts.append(entry)
            is_part = isinstance(entry, Part) and entry.table == table
            value = self.fields(entry, place) if is_part else self.value(entry, place)
            self.tables[table][name] = value


def _key(name: str) -> str:
    """End of the place of a key."""
    is_plain = all(c.isalnum() or c == "_" for c in name)
    return f".{name}" if is_plain else f"[{json.dumps(name, ensure_ascii=False)}]"
