"""The command line of renders on clusters."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pathtracer

from .._native import cluster_command, program
from . import render

if TYPE_CHECKING:
    from collections.abc import Sequence

# Exit status of errors, and of renders that Ctrl-C ended, as those of the program.
_FAILURE = 2
_INTERRUPTED = 130


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

    The samples are taken on the cluster, into the film beside the image. Then the program itself
    writes the image of this film, so that all of its options about images apply.
    """
    ours, others = _options(arguments)
    try:
        command = cluster_command(others)
        film = Path(command["film"])
        if command["restart"]:
            for path in (film, film.with_name(film.name + ".old")):
                path.unlink(missing_ok=True)
        of_scene = command["scene"]
        scene = (
            pathtracer.default_scene()
            if of_scene is None
            else pathtracer.load(of_scene, **command["load"])
        )
        image = render(
            scene,
            address=ours.ray_address,
            workers=ours.ray_workers,
            task_seconds=ours.ray_task_seconds,
            checkpoint=film,
            checkpoint_every=command["checkpoint_every"],
            progress=not command["quiet"],
            **command["settings"],
        )
        is_complete = image.complete
    except pathtracer.Interrupted:
        _write(command["arguments"], is_complete=False)
        return _INTERRUPTED
    except (OSError, RuntimeError, TypeError, ValueError) as error:
        sys.stderr.write(f"error: {error}\n")
        return _FAILURE
    return _write(command["arguments"], is_complete=is_complete)


def _write(arguments: Sequence[str], *, is_complete: bool) -> int:
    """Write the image of the film by the program, which takes no more samples."""
    if sys.prefix != sys.base_prefix:
        # The program finds the library of the package pyoidn.
        os.environ.setdefault("VIRTUAL_ENV", sys.prefix)
    limit = [] if is_complete else ["--time-limit=1e-9"]
    return program(["pathtracer", *arguments, *limit])
