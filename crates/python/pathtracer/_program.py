"""The program of the package."""

import os
import signal
import sys

from ._native import program


def main() -> int:
    """Run the program with the arguments of the process and return its exit status."""
    if sys.argv[1:2] == ["ray"]:
        from .ray._program import main as on_cluster

        return on_cluster(sys.argv[2:])
    # Without activation, too, the program finds the library of the package pyoidn.
    if sys.prefix != sys.base_prefix:
        os.environ.setdefault("VIRTUAL_ENV", sys.prefix)
    # The program handles Ctrl-C itself; Python would wait for it to end.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return program(["pathtracer", *sys.argv[1:]])
