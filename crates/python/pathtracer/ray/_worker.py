"""Tasks, which run in the processes of a cluster."""

from __future__ import annotations

import time
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import ray

from .._native import PartialRender, merge_parts
from ._packing import unpack, unpack_scene

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._native import Scene

# Compiled scenes that a process keeps: those of the two images on which a cluster works at a time.
_KEPT = 2

_renders: OrderedDict[str, PartialRender] = OrderedDict()
# Scenes by the objects that have them, with their compiled parts.
_scenes: OrderedDict[str, Scene] = OrderedDict()


@dataclass(frozen=True)
class Item:
    """Samples of a rectangle: numbers from `first` to `end`, or up to `end` on top of `film`."""

    region: tuple[int, int, int, int]
    first: int
    end: int
    film: bytes | None = None


@dataclass(frozen=True)
class Taken:
    """Film of an item, and its costs."""

    film: bytes
    samples: int
    rays: int
    seconds: float


@dataclass(frozen=True)
class Done:
    """Result of a task: films of its items, and seconds of the task and of compilation in it."""

    items: list[Taken]
    seconds: float
    compilation: float


def take(
    key: str,
    packed: Sequence[ray.ObjectRef[Any]],
    items: Sequence[Item],
    threads: int,
) -> Done:
    """Take the samples of items. The scene is fetched and compiled once for each process; for other
    settings, it is compiled as far as they differ."""
    start = time.perf_counter()
    render = _renders.get(key)
    if render is None:
        while len(_renders) >= _KEPT:
            _renders.popitem(last=False)
        scene, settings = packed
        render = unpack(_scene(scene), ray.get(settings))
        _renders[key] = render
    _renders.move_to_end(key)
    compilation = time.perf_counter() - start
    films = []
    for item in items:
        if item.film is None:
            taken = render.render_part(item.region, item.first, item.end, threads)
        else:
            taken = render.continue_part(item.film, item.end, threads)
        films.append(Taken(*taken))
    return Done(films, time.perf_counter() - start, compilation)


def _scene(packed: ray.ObjectRef[Any]) -> Scene:
    """Read a scene, unless this process has it."""
    name = packed.hex()
    scene = _scenes.get(name)
    if scene is None:
        while len(_scenes) >= _KEPT:
            _scenes.popitem(last=False)
        scene = _scenes[name] = unpack_scene(ray.get(packed))
    _scenes.move_to_end(name)
    return scene


def merge(*parts: Done) -> Done:
    """Merge the films of consecutive samples of one rectangle."""
    taken = [part.items[0] for part in parts]
    sum_of = Taken(
        merge_parts([part.film for part in taken]),
        sum(part.samples for part in taken),
        sum(part.rays for part in taken),
        sum(part.seconds for part in taken),
    )
    seconds = sum(part.seconds for part in parts)
    return Done([sum_of], seconds, sum(part.compilation for part in parts))
