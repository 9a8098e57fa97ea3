"""Renders for asyncio."""

from __future__ import annotations

import contextlib
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

from ._native import render_until

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from typing_extensions import Unpack

    from ._native import Image, Progress, Scene, _Integer, _Settings


async def render_async(
    scene: Scene,
    *,
    width: _Integer | None = None,
    height: _Integer | None = None,
    aovs: Sequence[str] | None = None,
    progress: Callable[[Progress], object] | bool | None = None,
    **settings: Unpack[_Settings],
) -> Image:
    """Render a scene while the event loop runs.

    Cancelling the task stops the render. Several renders may run at the same time; each one has the
    number of threads of its setting `threads`.

    Parameters
    ----------
    scene, width, height, aovs, progress, **settings
        As for :func:`render`. A callable `progress` is called by the event loop.

    Returns
    -------
    Image
        The image of :func:`render`.

    Raises
    ------
    SceneError, TypeError, ValueError
        As :func:`render`.
    """
    # Its import takes as long as that of the package without it.
    import asyncio

    loop = asyncio.get_running_loop()
    image: asyncio.Future[Image] = loop.create_future()
    stopped = threading.Event()

    def in_loop(function: Callable[..., object], *arguments: object) -> None:
        # A closed loop does not wait for the image any more.
        with contextlib.suppress(RuntimeError):
            loop.call_soon_threadsafe(function, *arguments)

    def settle(set_outcome: Callable[[Any], None], outcome: object) -> None:
        if not image.done():
            set_outcome(outcome)

    def report(state: Progress) -> None:
        if image.done() or not callable(progress):
            return
        try:
            progress(state)
        except Exception as error:
            stopped.set()
            image.set_exception(error)

    def work() -> None:
        reported = partial(in_loop, report) if callable(progress) else progress
        sizes: dict[str, Any] = {"width": width, "height": height, "aovs": aovs}
        try:
            done = render_until(scene, stopped.is_set, progress=reported, **sizes, **settings)
        except BaseException as error:
            in_loop(settle, image.set_exception, error)
        else:
            in_loop(settle, image.set_result, done)

    # A thread of its own: the loop's pool has few, and other tasks use them.
    threading.Thread(target=work, name="pathtracer").start()
    try:
        return await image
    finally:
        stopped.set()
