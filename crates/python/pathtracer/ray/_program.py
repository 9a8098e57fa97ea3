"""The command line of renders on clusters."""

from __future__ import annotations

import argparse
import os
import sys
from typing import TYPE_CHECKING, Any

import pathtracer

from .._native import cluster_commands, program, with_camera
from . import Job, render_many

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

# Exit status of errors, and of renders that Ctrl-C ended, as those of the program.
_FAILURE = 2
_INTERRUPTED = 130
# Values of the option camera of `load` that are no names of cameras.
_PLACEMENTS = ("file", "course", "fit")


def _options(arguments: Sequence[str]) -> tuple[argparse.Namespace, list[str]]:
    parser = argparse.ArgumentParser(
        prog="pathtracer ray",
        description=(
            "Render on a Ray cluster. All other options and the scene are those of pathtracer "
            "(pathtracer --help); --threads is the number of threads of each worker, 1 by default."
        ),
        allow_abbrev=False,
    )
    parser.add_argument(
        "--ray-address",
        metavar="ADDRESS",
        help="cluster: auto, local or HOST:PORT; by default the one that Ray finds, or a "
        "new one on this machine",
    )
    parser.add_argument(
        "--ray-workers",
        type=int,
        metavar="N",
        help="maximum number of tasks at a time; by default one for each --threads processors",
    )
    parser.add_argument(
        "--ray-task-seconds",
        type=float,
        default=2.0,
        metavar="SECONDS",
        help="intended duration of a task; 2 by default",
    )
    return parser.parse_known_args(arguments)


def main(arguments: Sequence[str]) -> int:
    """Render with these arguments, and return the exit status.

    The samples are taken on the cluster, into the films beside the images. Then the program itself
    writes the image of each film, so that all of its options about images apply.
    """
    ours, others = _options(arguments)
    commands: list[dict[str, Any]] = []
    written: list[int] = []
    try:
        commands = cluster_commands(others)
        first = commands[0]
        images = render_many(
            _jobs(commands),
            address=ours.ray_address,
            workers=ours.ray_workers,
            task_seconds=ours.ray_task_seconds,
            checkpoint_every=first["checkpoint_every"],
            progress=not first["quiet"],
            threads=first["settings"].get("threads"),
        )
        for command, image in zip(commands, images):
            written.append(_write(command, is_complete=image.complete, is_alone=len(commands) == 1))
    except pathtracer.Interrupted:
        _write(commands[len(written)], is_complete=False, is_alone=len(commands) == 1)
        return _INTERRUPTED
    except (OSError, RuntimeError, TypeError, ValueError) as error:
        sys.stderr.write(f"error: {error}\n")
        return _FAILURE
    if len(commands) > 1 and not first["quiet"]:
        last = commands[-1]
        sys.stderr.write(f"saved {len(commands)} images, {first['output']} to {last['output']}\n")
    return max(written)


def _jobs(commands: Iterable[dict[str, Any]]) -> Iterator[Job]:
    """Return the images of commands. Those of one scene share it."""
    last: tuple[object, pathtracer.Scene] | None = None
    for command in commands:
        film: Path = command["film"]
        if command["restart"]:
            for path in (film, film.with_name(film.name + ".old")):
                path.unlink(missing_ok=True)
        options = dict(command["load"])
        camera: str | None = None
        if options["camera"] not in _PLACEMENTS:
            camera = options.pop("camera")
        source = (command["scene"], options)
        if last is None or last[0] != source:
            last = (source, _scene(*source))
        scene = last[1]
        if camera is not None and with_camera(scene, camera) is None:
            scene, camera = _scene(source[0], {**options, "camera": camera}), None
        yield Job(scene, command["settings"], film, camera)


def _scene(path: Path | None, options: dict[str, Any]) -> pathtracer.Scene:
    return pathtracer.default_scene() if path is None else pathtracer.load(path, **options)


def _write(command: dict[str, Any], *, is_complete: bool, is_alone: bool) -> int:
    """Write the image of the film by the program, which takes no more samples."""
    if sys.prefix != sys.base_prefix:
        # The program finds the library of the package pyoidn.
        os.environ.setdefault("VIRTUAL_ENV", sys.prefix)
    limit = [] if is_complete else ["--time-limit=1e-9"]
    quiet = [] if is_alone or command["quiet"] else ["--quiet"]
    return program(["pathtracer", *command["arguments"], *limit, *quiet])
