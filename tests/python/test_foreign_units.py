"""Units that another exporter makes, in `maglev`: PythonFMU, from PyPI."""

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from conftest import MAGLEV, ROOT, results
from fmpy_jacobi import step_between

LAG = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Lag(Fmi2Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.u, self.y, self.T = 0.0, 0.0, 0.5
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self.register_variable(
            Real("T", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
        )

    def do_step(self, time, size):
        self.y += size * (self.u - self.y) / self.T
        return True
"""


def python_library():
    """The units' libraries do not name the Python library that they need: the host must have it."""
    name = Path(sysconfig.get_config_var("LIBDIR") or "/") / (sysconfig.get_config_var("LDLIBRARY") or "")
    if not (sysconfig.get_config_var("Py_ENABLE_SHARED") and name.is_file()):
        pytest.skip("this Python has no shared library that a unit of PythonFMU could use")
    return str(name)


@pytest.fixture
def chain(tmp_path):
    """A scenario of two lags in a row, the first fed with 1."""
    (tmp_path / "lag.py").write_text(LAG)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "lag.py"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    scenario = {
        "units": {"lag": "Lag.fmu"},
        "instances": {
            "a": {"unit": "lag", "start": {"u": 1.0}},
            "b": {"unit": "lag", "parameters": {"T": 0.25}},
        },
        "connections": [{"from": "a.y", "to": "b.u"}],
        "experiment": {"stop": 1.0, "step": 0.01},
        "algorithm": {"name": "jacobi", "extrapolation": 0},
        "record": {"signals": ["a.y", "b.y"]},
    }
    (tmp_path / "chain.json").write_text(json.dumps(scenario))
    return tmp_path


def run(folder, *options, **extra):
    command = [MAGLEV, "run", folder / "chain.json", "--out", folder / "out", *options]
    return subprocess.run(command, env=os.environ | extra, capture_output=True, text=True)


def test_analytic_units_of_pythonfmu_step_as_their_python_does(chain):
    done = run(chain, LD_PRELOAD=python_library())
    assert done.returncode == 0, done.stderr
    assert "PythonFMU" in done.stderr and "InitialUnknowns" in done.stderr
    a, b, rows = 0.0, 0.0, [(0.0, 0.0)]
    for n in range(100):
        h = step_between(0.01 * n, 0.01 * (n + 1))
        # the same sums in the same order: equal to the last bit
        a, b = a + h * (1.0 - a) / 0.5, b + h * (a - b) / 0.25
        rows.append((a, b))
    ours = results(chain / "out")
    assert list(zip(ours["a.y"], ours["b.y"])) == rows


def test_issue_a_strict_run_refuses_them_and_says_why(chain):
    done = run(chain, "--strict")
    assert done.returncode == 2 and "does not allow" in done.stderr, done.stderr


NOISE = """
import random
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Noise(Fmi2Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.random, self.y = random.Random(1), 0.0
        self.register_variable(
            Real("y", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete)
        )

    def do_step(self, time, size):
        self.y = self.random.gauss(0.0, 1e-5)
        return True
"""


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_analytic_noise_on_a_gap_is_held(tmp_path, algorithm):
    """White noise of 10 um on a magnet's gap gives 0.78 V of noise in its voltage, as with a controller that
    samples; put through polynomials it gave 1.93 V. 4500 values: the standard deviation is sure to 1.1 % of
    itself times what neighbouring values have in common, so to 5 %."""
    (tmp_path / "noise.py").write_text(NOISE)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "noise.py"]
    subprocess.run(build, cwd=tmp_path, check=True, capture_output=True)
    scenario = json.loads((ROOT / "scenarios" / "one-magnet.json").read_text())
    units = {name: str((ROOT / "scenarios" / path).resolve()) for name, path in scenario["units"].items()}
    scenario |= {"units": units | {"noise": "Noise.fmu"}, "plots": []}
    scenario["instances"]["noise"] = {"unit": "noise"}
    for connection in scenario["connections"]:
        if connection["from"] == "vehicle.gap_[01..01]":
            connection["from"] = [connection["from"], "noise.y"]
    scenario["experiment"] = {"stop": 5.0, "step": 0.001}
    scenario["algorithm"] = {"name": algorithm, "extrapolation": 2}
    scenario["record"] = {"signals": ["ems_01.voltage"]}
    (tmp_path / "chain.json").write_text(json.dumps(scenario))
    done = run(tmp_path, LD_PRELOAD=python_library())
    assert done.returncode == 0, done.stderr
    voltage = results(tmp_path / "out")["ems_01.voltage"]
    assert abs(voltage[500:].std() - 0.78) < 0.04, voltage[500:].std()
