"""Renders for asyncio, and progress bars."""

import asyncio
import importlib.util
import os
import subprocess
import sys
import threading
import time
from typing import Any

import numpy as np
import pytest

import pathtracer

SMALL: dict[str, Any] = {"width": 24, "height": 16, "spp": 4}
LONG: dict[str, Any] = {"width": 400, "height": 400, "spp": 1_000_000}


def renders() -> int:
    """Number of renders under way."""
    return sum(thread.name == "pathtracer" for thread in threading.enumerate())


def test_several_renders_run_while_the_loop_runs(scene: pathtracer.Scene) -> None:
    async def main() -> tuple[list[pathtracer.Image], int]:
        ticks = 0

        async def tick() -> None:
            nonlocal ticks
            while True:
                await asyncio.sleep(0.001)
                ticks += 1

        ticker = asyncio.create_task(tick())
        seeds = range(12)
        images = await asyncio.gather(
            *(pathtracer.render_async(scene, **SMALL, seed=seed, threads=1) for seed in seeds),
        )
        ticker.cancel()
        return images, ticks

    images, ticks = asyncio.run(main())
    assert ticks > 0
    for seed, image in enumerate(images):
        expected = pathtracer.render(scene, **SMALL, seed=seed)
        np.testing.assert_array_equal(image["color"], expected["color"])


def test_cancelling_a_task_stops_the_render(scene: pathtracer.Scene) -> None:
    async def main() -> float:
        began = asyncio.Event()
        task = asyncio.create_task(
            pathtracer.render_async(scene, **LONG, progress=lambda _: began.set())
        )
        await asyncio.wait_for(began.wait(), 60)
        assert renders() == 1
        start = time.monotonic()
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        while renders():
            await asyncio.sleep(0.001)
        return time.monotonic() - start

    # 0.1 s on an idle machine.
    assert asyncio.run(main()) < 1.0


def test_progress_is_called_by_the_loop_and_its_exceptions_end_the_render(
    scene: pathtracer.Scene,
) -> None:
    states: list[tuple[int, int]] = []

    def report(state: pathtracer.Progress) -> None:
        states.append((state.samples, threading.get_ident()))

    def fail(_: pathtracer.Progress) -> None:
        raise LookupError("enough")

    async def main() -> None:
        await pathtracer.render_async(scene, width=100, height=100, spp=64, progress=report)
        with pytest.raises(LookupError, match="enough"):
            await pathtracer.render_async(scene, **LONG, progress=fail)
        with pytest.raises(ValueError, match="max_depth"):
            await pathtracer.render_async(scene, max_dept=3)  # type: ignore[call-arg]
        with pytest.raises(TypeError, match="progress: found int"):
            await pathtracer.render_async(scene, progress=3)  # type: ignore[arg-type]

    asyncio.run(main())
    assert states[-1] == (100 * 100 * 64, threading.get_ident())
    deadline = time.monotonic() + 10
    while renders() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert renders() == 0


WITH_BAR = """
import sys
sys.modules.update(dict.fromkeys(sys.argv[1:]))
import pathtracer

pathtracer.render(pathtracer.default_scene(), width=100, height=100, spp=64, progress=True)
"""


def test_bars_are_quiet_without_a_terminal() -> None:
    command = [sys.executable, "-c", WITH_BAR]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of POSIX")
@pytest.mark.parametrize("missing", [[], ["tqdm", "tqdm.auto"]])
def test_bars_end_at_100_percent_on_terminals(missing: list[str]) -> None:
    if sys.platform == "win32":
        return
    import fcntl
    import pty
    import struct
    import termios

    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    command = [sys.executable, "-c", WITH_BAR, *missing]
    with subprocess.Popen(command, stderr=slave) as render:
        os.close(slave)
        shown = b""
        while True:
            try:
                part = os.read(master, 4096)
            except OSError:
                break
            if not part:
                break
            shown += part
    os.close(master)
    assert render.returncode == 0
    last = shown.decode().rstrip().rsplit("\r", 1)[-1]
    assert "100%" in last
    has_tqdm = not missing and importlib.util.find_spec("tqdm") is not None
    assert ("sample/s" in last) == has_tqdm


def test_large_modules_are_imported_when_they_are_needed() -> None:
    code = "import sys, pathtracer; print({'asyncio', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
