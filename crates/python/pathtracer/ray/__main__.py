"""``python -m pathtracer.ray``: the program with a cluster in place of its own threads."""

import sys

from ._program import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
