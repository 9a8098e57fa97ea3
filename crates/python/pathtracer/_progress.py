"""Progress bars on standard error."""

from __future__ import annotations

import importlib
import sys
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._native import Progress

# Seconds between two updates of the line.
_INTERVAL = 0.1
# Characters of a full bar.
_WIDTH = 30


def bar() -> _Line | _Tqdm | None:
    """Return a progress bar, or None if standard error is neither a terminal nor a notebook."""
    stream = sys.stderr
    if stream is None or not (_in_notebook() or stream.isatty()):
        return None
    try:
        return _Tqdm(importlib.import_module("tqdm.auto").tqdm)
    except ImportError:
        return _Line()


def _in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return type(shell).__name__ == "ZMQInteractiveShell"


class _Tqdm:
    """Bar of tqdm."""

    def __init__(self, tqdm: Any) -> None:
        self._bar = tqdm(unit="sample", unit_scale=True)

    def __call__(self, state: Progress) -> None:
        self._bar.total = state.total
        self._bar.update(state.samples - self._bar.n)

    def close(self) -> None:
        self._bar.close()


class _Line:
    """Bar in one line of a terminal."""

    def __init__(self) -> None:
        self._next = 0.0
        self._text = ""

    def __call__(self, state: Progress) -> None:
        now = time.monotonic()
        if now < self._next and state.samples < state.total:
            return
        self._next = now + _INTERVAL
        full = round(_WIDTH * state.fraction)
        bar = "#" * full + "." * (_WIDTH - full)
        self._show(f"{bar} {state.fraction:4.0%}  {_remaining(state)}")

    def close(self) -> None:
        if self._text:
            sys.stderr.write("\n")
            sys.stderr.flush()

    def _show(self, text: str) -> None:
        sys.stderr.write(f"\r{text:{len(self._text)}}")
        sys.stderr.flush()
        self._text = text


def _remaining(state: Progress) -> str:
    """Elapsed time, and the remaining one at the same speed."""
    elapsed = f"{state.seconds:.0f} s"
    if not 0.0 < state.fraction < 1.0:
        return elapsed
    return f"{elapsed}, {state.seconds * (1.0 / state.fraction - 1.0):.0f} s left"
