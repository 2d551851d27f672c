"""The wheel in an environment of its own, on a machine without a compiler."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

WHEEL = Path(os.environ["MAGLEV_WHEEL"])


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clean")
    subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:", WHEEL]
    subprocess.run(pip, check=True, timeout=300)
    return python


def run(clean, arguments, folder, **more):
    environment = {key: value for key, value in os.environ.items() if key in ("SYSTEMROOT", "HOME", "TMPDIR")}
    # no compiler, no Rust, not even the system's programs
    done = subprocess.run(arguments, cwd=folder, env=environment | {"PATH": ""}, capture_output=True, text=True, timeout=120, **more)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_issue_the_wheel_is_for_every_python_and_old_systems():
    name, version, python, abi, platform = WHEEL.stem.split("-")
    assert (name, python, abi) == ("maglev_cosim", "cp311", "abi3")
    if sys.platform == "linux":
        assert platform.startswith("manylinux")
    with zipfile.ZipFile(WHEEL) as archive:
        names = set(archive.namelist())
    assert {"maglev_cosim/py.typed", "maglev_cosim/_native.pyi", "maglev_cosim/units/ems.fmu"} <= names
    assert any(name.endswith("licenses/license.txt") for name in names)


def test_issue_it_runs_in_a_clean_environment(clean, tmp_path):
    code = "import maglev_cosim as m; print(m.load('one-magnet').times(stop=0.01).run().status)"
    assert run(clean, [clean, "-c", code], tmp_path) == "finished\n"
    said = run(clean, [clean.parent / "maglev", "run", "--help"], tmp_path)
    assert "maglev run" in said
    scenario = run(clean, [clean, "-c", "import maglev_cosim as m; print(m.scenario._HOME)"], tmp_path).strip()
    out = run(clean, [clean.parent / "maglev", "run", f"{scenario}/scenarios/one-magnet.json", "--stop", "0.01", "--out", "out"], tmp_path)
    assert "results.csv" in out and (tmp_path / "out" / "report.html").exists()
