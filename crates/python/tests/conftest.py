"""Fixtures of the tests, which run outside of the source tree against the installed package."""

import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

import pathtracer


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--scenes", required=True, help="folder of the scenes of the project")


@pytest.fixture(scope="session")
def scenes(pytestconfig: pytest.Config) -> Path:
    """Folder of the scenes of the project."""
    return Path(str(pytestconfig.getoption("--scenes")))


@pytest.fixture(scope="session")
def scene() -> pathtracer.Scene:
    """The embedded scene."""
    return pathtracer.default_scene()


@pytest.fixture(scope="session")
def program() -> Callable[[Sequence[object]], str]:
    """Runs the program of the package and returns what it prints to standard error."""

    def run(arguments: Sequence[object]) -> str:
        command = [sys.executable, "-m", "pathtracer", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stderr

    return run
