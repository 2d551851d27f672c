"""The export kit alone: its example, packed by its own command, in a foreign tool."""

import math
import subprocess

import fmpy
import numpy as np
import pytest
from conftest import MAGLEV, ROOT, maglev
from fmpy.validation import validate_fmu


@pytest.fixture(scope="module")
def dahlquist(tmp_path_factory):
    """The README's recipe."""
    build = ["cargo", "build", "--release", "--quiet", "-p", "fmi2-export", "--example", "dahlquist"]
    subprocess.run(build, cwd=ROOT, check=True, timeout=900)
    subprocess.run([*build[:4], "-p", "fmi2-package"], cwd=ROOT, check=True, timeout=900)
    release = MAGLEV.parent
    file = tmp_path_factory.mktemp("kit") / "dahlquist.fmu"
    library = release / "examples" / "libdahlquist.so"
    subprocess.run([release / "fmi2-package", library, "--out", file], check=True, timeout=60)
    return file


def test_crosstool_the_example_validates(dahlquist):
    assert validate_fmu(str(dahlquist)) == []
    maglev("validate", dahlquist)


def test_crosstool_fmpy_runs_the_example(dahlquist):
    """ẋ = −k·(x − u) from x0, with u held: x = u + (x0 − u)·e^(−kt)."""
    k, x0, u = 1.5, 3.0, 0.5
    result = fmpy.simulate_fmu(
        str(dahlquist), start_values={"k": k, "x0": x0, "u": u}, stop_time=4.0, output_interval=0.25, output=["x"]
    )
    exact = np.array([u + (x0 - u) * math.exp(-k * t) for t in result["time"]])
    assert len(exact) == 17
    # exact steps: an ε or so for each of 16, damped
    assert np.abs(result["x"] - exact).max() < 16 * np.finfo(float).eps * x0
