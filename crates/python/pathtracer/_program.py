"""The program of the package."""

import signal
import sys

from ._native import program


def main() -> int:
    """Run the program with the arguments of the process and return its exit status."""
    # The program handles Ctrl-C itself; Python would wait for it to end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return program(["pathtracer", *sys.argv[1:]])
