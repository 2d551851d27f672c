"""Types: the stub of the native module tells the truth, and the package passes its own check."""

import subprocess
import sys
from pathlib import Path

import maglev_cosim

HOME = Path(maglev_cosim.__file__).parent


def test_issue_the_package_is_typed(tmp_path):
    for tool in (["mypy", "--strict", "--package", "maglev_cosim"], ["mypy.stubtest", "maglev_cosim._native"]):
        done = subprocess.run([sys.executable, "-m", *tool], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr


def test_issue_everything_public_is_documented():
    for name in maglev_cosim.__all__:
        it = getattr(maglev_cosim, name)
        assert it.__doc__, name
        for key, member in vars(it).items() if isinstance(it, type) else ():
            if not key.startswith("_") and callable(member):
                assert member.__doc__, f"{name}.{key}"
