"""What the tests of the package share. They run in an environment in which the wheel is installed: `cargo xtask wheel --test`."""

import subprocess
from pathlib import Path

import pytest

import maglev_cosim as maglev
from maglev_cosim import _command

ROOT = Path(__file__).resolve().parents[3]


def command(*arguments, status=0):
    """Runs the command of the package, and checks its exit status."""
    done = subprocess.run([_command.PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    assert done.returncode == status, f"maglev {arguments}: status {done.returncode}\n{done.stderr}"
    return done


@pytest.fixture
def magnet():
    """A tenth of a second of one magnet under a girder that is shaken."""
    return maglev.load("one-magnet").times(stop=0.1)
