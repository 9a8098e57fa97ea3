"""What the programs that time peers have in common: their arguments, clocks, and results."""

import argparse
import json
import pathlib
import sys
import time


def parse(description, *more):
    """The arguments of a program; `more` are those that only it has, as name and keywords."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--scene", type=pathlib.Path, required=True)
    for name in ("--res", "--spp", "--threads", "--depth"):
        parser.add_argument(name, type=int, required=True)
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--result", type=pathlib.Path, required=True)
    parser.add_argument("--started", type=float, help="when the process was started, since 1970")
    for name, keywords in more:
        parser.add_argument(name, **keywords)
    return parser.parse_args()


class Clock:
    """Wall-clock and processor seconds of what happens within it; those of all threads together."""

    def __enter__(self):
        self.begin = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_):
        self.wall = time.perf_counter() - self.begin[0]
        self.cpu = time.process_time() - self.begin[1]


def race(arguments, imported, render):
    """Times renders; `imported` is when all modules were there, `render(spp)` makes an image and
    returns the clock of its samples.

    The start of rendering is the end of a first image of one sample per pixel, less what a second
    one takes: building and compiling are done then. Images that are timed come after another one.
    """
    render(1)
    first = time.time()
    start = first - render(1).wall - arguments.started
    clocks = [render(arguments.spp) for _ in range(max(arguments.repeats, 1))]
    write(
        arguments,
        wall=min(c.wall for c in clocks),
        cpu=min(c.cpu for c in clocks) / arguments.threads,
        start=start,
        imports=imported - arguments.started,
        peak_bytes=peak_bytes(),
    )


def write(arguments, **numbers):
    """Keeps what was measured."""
    arguments.result.write_text(json.dumps(numbers))


def peak_bytes():
    """The largest amount of physical memory that this process has held."""
    status = pathlib.Path("/proc/self/status")
    if not status.is_file():
        sys.exit("how much memory was used is not known: there is no /proc/self/status")
    line = next(l for l in status.read_text().splitlines() if l.startswith("VmHWM:"))
    return 1024 * int(line.split()[1])
