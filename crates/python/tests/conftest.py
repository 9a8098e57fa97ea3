"""Fixtures of the tests, which run outside of the source tree against the installed package."""

import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
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


# Shells start programs in the background with SIGINT ignored, which Python inherits.
HANDLE_SIGINT = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"


@pytest.fixture
def interruptible() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts a program in Python that SIGINT interrupts, and kills it at the end of the test."""
    started = []

    def start(program: str, *arguments: object) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", f"{HANDLE_SIGINT}\n{program}", *map(str, arguments)]
        started.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()
