"""The templates of a controller of one's own in C and Python (examples/controllers): built as their README says, they hold
the shipped magnets. The template in Rust is in tests/tests/controllers.rs."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from conftest import MAGLEV, ROOT, maglev, results
from test_foreign_units import python_library

TEMPLATES = ROOT / "examples" / "controllers"
SCENARIOS = ROOT / "scenarios"
LOAD = 250.0 * 9.81  # N, of one magnet
# static stiffness ki k_gap/R - kc of both laws without their integral, from table 2's numbers
KI = 2e-7 * np.pi * 0.036 * 400**2 * 24 / 0.008**2
STIFFNESS = KI * 4000.0 / 0.6 - KI * 24 / 0.008


@pytest.fixture(scope="module")
def pid(tmp_path_factory):
    """The template in C."""
    file = tmp_path_factory.mktemp("c") / "pid.fmu"
    built = subprocess.run(["sh", TEMPLATES / "c" / "build.sh", file], capture_output=True, text=True)
    assert built.returncode == 0 and "warning" not in built.stderr, built.stderr
    return file


@pytest.fixture(scope="module")
def feedback(tmp_path_factory):
    """The template in Python."""
    folder = tmp_path_factory.mktemp("python")
    shutil.copy(TEMPLATES / "python" / "state_feedback.py", folder)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "state_feedback.py"]
    subprocess.run(build, cwd=folder, check=True, capture_output=True)
    return folder / "StateFeedback.fmu"


def own(folder, base, unit, **patch):
    """A scenario that puts `unit` in the place of controller.fmu, as the README shows."""
    file = folder / f"own-{base}"
    file.write_text(json.dumps({"extends": str(SCENARIOS / base), "units": {"controller": str(unit)}} | patch))
    return file


def run(file, *options, python=False, status=0):
    out = file.with_suffix("")
    command = [MAGLEV, "run", file, "--no-report", "--quiet", "--out", out, *options]
    env = os.environ | ({"LD_PRELOAD": python_library()} if python else {})
    done = subprocess.run(list(map(str, command)), env=env, capture_output=True, text=True, timeout=600)
    assert done.returncode == status, done.stderr
    return results(out) if status == 0 else done.stderr


def swing(columns):
    """Largest deviation of all recorded gaps from 8 mm."""
    gaps = [values for name, values in columns.items() if name.startswith("vehicle.gap_0")]
    return max(np.abs(gap - 0.008).max() for gap in gaps)


def lighter(folder, unit):
    """One magnet at rest that starts with 95 % of its load."""
    connections = json.loads((SCENARIOS / "one-magnet-controller.json").read_text())["connections"]
    for connection in connections:
        if connection["from"] == "vehicle.static_load_[01..01]":
            connection["factor"] = 0.95
    return own(folder, "one-magnet-controller.json", unit, connections=connections)


AT_REST = ("--set", "vehicle.travel_speed=0")
QUIET = ("--set", "guideway.chirp_on=false")


def test_analytic_the_template_in_c_brings_the_gap_back(pid, tmp_path):
    maglev("validate", "--dynamic", pid)
    gap = run(lighter(tmp_path, pid), *QUIET, "--stop", "20")["vehicle.gap_01"]
    # with the proportional part alone it would stay 0.05 LOAD/STIFFNESS below; the integral's pole is -1.06 1/s
    assert gap.max() > 0.008 + 0.3 * 0.05 * LOAD / STIFFNESS
    assert abs(gap[-1] - 0.008) < 1e-9, gap[-1]


def test_analytic_the_template_in_python_holds_the_gap(feedback, tmp_path):
    columns = run(lighter(tmp_path, feedback), *QUIET, "--stop", "20", python=True)
    # the girder rings out with 0.57 1/s
    assert abs(columns["vehicle.gap_01"][-1] - 0.008 - 0.05 * LOAD / STIFFNESS) < 1e-9


@pytest.mark.parametrize("unit", ["pid", "feedback"])
def test_analytic_a_bogie_starts_at_rest_and_crosses(unit, request, tmp_path):
    python = unit == "feedback"
    file = own(tmp_path, "one-bogie-controllers.json", request.getfixturevalue(unit))
    assert swing(run(file, *AT_REST, "--stop", "1", python=python)) < 1e-6
    crossing = run(file, "--stop", "4" if python else "20", python=python)
    assert swing(crossing) < 5e-6
    assert np.abs(crossing["controller_01.voltage"]).max() > 5e-4
    assert crossing["guideway.midspan_displacement_01"].min() < -2e-4


def train(folder, unit):
    """The two-car train with 64 controllers of one's own."""
    base = json.loads((SCENARIOS / "low-speed.json").read_text())
    row, connections = "[01..64]", []
    for connection in base["connections"]:
        if connection["from"] in [f"vehicle.{name}_{row}" for name in ("gap", "gap_rate", "acceleration")]:
            to = connection["to"]
            connection["to"] = [to, to.replace("ems_", "controller_")]
        connections.append(connection)
    connections += [
        {"from": f"controller_{row}.voltage", "to": f"ems_{row}.voltage_command"},
        {"from": f"controller_{row}.transient_voltage", "to": f"ems_{row}.transient_voltage"},
    ]
    return own(
        folder,
        "low-speed.json",
        unit,
        instances={
            f"controller_{row}": {"unit": "controller"},
            f"ems_{row}": {"parameters": {"external_controller": True}},
        },
        connections=connections,
        algorithm={"order": [f"controller_{row}", *base["algorithm"]["order"]]},
        record={"signals": [f"vehicle.gap_{row}"]},
        plots=None,
    )


@pytest.mark.parametrize("unit", ["pid", "feedback"])
def test_analytic_the_train_levitates(unit, request, tmp_path):
    """At rest on a smooth track; then, in C, in motion on a rough girder, where ems keeps within 1.3 mm."""
    python = unit == "feedback"
    file = train(tmp_path, request.getfixturevalue(unit))
    smooth = ("--set", "guideway.irregularity_on=false")
    assert swing(run(file, *smooth, "--stop", "0.2" if python else "1", python=python)) < 1e-6
    if not python:
        rough = run(file, "--set", "vehicle.initial_position=30", "--stop", "1")
        assert 1e-4 < swing(rough) < 1.3e-3


def test_issue_15_bad_values_of_the_templates_are_named(pid, feedback, tmp_path):
    file = own(tmp_path, "one-magnet-controller.json", pid)
    message = run(file, "--set", "controller_01.set_point=0", status=2)
    assert "0 is outside of the range of controller_01.set_point" in message
    assert "kx" in run(file, "--set", "controller_01.kx=1", status=2)
    file = own(tmp_path, "one-magnet-controller.json", feedback)
    # PythonFMU states an exception only with debug messages on
    wrong = ("--set", "controller_01.set_point=-1", "--log-level", "debug")
    assert "set_point is -1.0, but must be positive" in run(file, *wrong, python=True, status=1)
