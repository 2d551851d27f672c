"""The scenarios in libcosim and ecos, equal to `maglev`'s held Jacobi scheme to rounding.

Equal bits cannot be had: `maglev` counts t = n·h, libcosim divides nanoseconds, ecos adds up t += h,
and the units step from exactly the time that they are told. So a signal may differ by its steepest
slope times the difference of the times, and by rounding: positions of metres are sums of ten terms,
1e-15 m, and the magnets make 8e5 N/m of them, 1e-9 N of some 2.5e3 N. Hence 1e-12 of a signal's
largest value beside the slope; a scheme that differs shows at 1e-6.
"""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT, UNITS, run, single_units
from fmpy import read_model_description
from fmpy_jacobi import simulate

SCRIPT = ROOT / "tests" / "python" / "foreign_masters.py"
ROUNDING = 1e-12


def foreign(master, scenario, signals, stop, starts=()):
    """The table that the script prints, which runs by itself: a crash over there is a failure here."""
    options = [word for start in starts for word in ("--start", start)]
    command = [sys.executable, SCRIPT, *options, master, ROOT / "scenarios" / scenario, stop, *signals]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"status {done.returncode}\n{done.stdout}\n{done.stderr}"
    rows = [row for row in csv.reader(done.stdout.splitlines())]
    return np.array(rows[1:], dtype=float).T


def held(scenario, out, stop):
    """The scenario in `maglev` as the foreign masters couple it."""
    options = ["--algorithm", "jacobi", "--extrapolation", 0, "--stop", stop, "--record-interval", 0.001]
    return run(scenario, out, *options)[0]


def compare(tmp_path, master, scenario, signals, stop, starts=()):
    """Asserts equality; prints how far each signal is off, as a part of its largest value."""
    ours = held(scenario, tmp_path, stop)
    # ecos sends the inputs before it reads: outputs that follow an input directly are those of the
    # next step's beginning. The gap as the magnet got it is the vehicle's of the step's end.
    got = {signal: signal for signal in signals}
    if master == "ecos":
        got.update({s: s.replace("vehicle.gap_", "ems_") + ".gap" for s in signals if "vehicle.gap_" in s})
    times, *columns = foreign(master, scenario, got.values(), stop, starts)
    shift = np.abs(ours["time"][1:] - times).max()
    assert shift < 1e-12
    found = {}
    for signal, values in zip(signals, columns):
        expected = ours[signal]
        assert np.ptp(expected) > 0, f"{signal} stands still: nothing was compared"
        largest = np.abs(expected).max()
        slope = np.abs(np.diff(expected)).max() / (ours["time"][1] - ours["time"][0])
        off = np.abs(expected[1:] - values).max()
        found[signal] = off / largest
        assert off <= ROUNDING * largest + slope * shift, f"{signal} is off by {off}"
    print(master, scenario, f"times differ by {shift:.1e} s", found)


MASTERS = pytest.mark.parametrize("master", ["libcosim", "ecos"])


@MASTERS
def test_crosstool_one_bogie_at_the_beginning_of_its_run(tmp_path, master):
    signals = [f"vehicle.gap_{k:02d}" for k in range(1, 9)] + ["ems_01.force", "guideway.midspan_displacement_01"]
    # 3 s at 5 km/h: the front magnets are 2 m into the span
    compare(tmp_path, master, "one-bogie.json", signals, 3.0)


@MASTERS
def test_crosstool_one_magnet_under_a_shaken_girder(tmp_path, master):
    """Both tools pass initial values round as often as there are instances. Here the way from a weight to
    the girder's deflection under it and back takes four rounds, one more than three instances get, so
    the way is shortened by the start value of the weight: 250 kg · 9.81 m/s²."""
    signals = ["vehicle.gap_01", "ems_01.force", "guideway.midspan_displacement_01"]
    compare(tmp_path, master, "one-magnet.json", signals, 3.0, ["ems_01.static_force=2452.5"])


@MASTERS
def test_crosstool_the_two_car_train_with_64_magnets(tmp_path, master):
    signals = ["vehicle.gap_01", "vehicle.gap_64", "ems_01.force", "vehicle.position_01"]
    compare(tmp_path, master, "low-speed.json", signals, 0.5)


@pytest.mark.parametrize("master", ["fmpy", "libcosim", "ecos"])
def test_crosstool_every_unit_by_itself(tmp_path, master):
    """One instance of each packed unit in one process, nothing connected: the same numbers as ours."""
    units = {unit.stem: unit for unit in single_units()}
    names = {stem: stem.replace("-", "_") for stem in units}
    signals = []
    for stem, unit in units.items():
        variables = read_model_description(str(unit)).modelVariables
        outputs = [v.name for v in variables if v.causality == "output" and v.type == "Real"]
        signals += [f"{names[stem]}.{name}" for name in outputs]
    scenario = tmp_path / "all.json"
    content = {
        "title": "Every unit by itself",
        "units": {stem: str(unit) for stem, unit in units.items()},
        "instances": {name: {"unit": stem} for stem, name in names.items()},
        "connections": [],
        "experiment": {"start": 0.0, "stop": 0.02, "step": 0.001},
        "algorithm": {"name": "jacobi", "extrapolation": 0},
        "record": {"signals": signals},
    }
    scenario.write_text(json.dumps(content))
    ours = held(scenario, tmp_path / "out", 0.02)
    if master == "fmpy":
        rows = simulate(scenario, signals)[1][1:]
    else:
        rows = foreign(master, scenario, signals, 0.02)[1:].T
    for n, row in enumerate(rows, start=1):
        for signal, value in zip(signals, row):
            # nothing travels or shakes here, so that times a rounding apart give the same but for roundings
            assert value == pytest.approx(ours[signal][n], rel=1e-12, abs=1e-12), signal


def test_crosstool_a_different_scheme_would_show(tmp_path):
    ours, _ = run("one-magnet.json", tmp_path, "--stop", 1.0)
    _, force = foreign("libcosim", "one-magnet.json", ["ems_01.force"], 1.0, ["ems_01.static_force=2452.5"])
    assert np.abs(ours["ems_01.force"][1:] / force - 1).max() > 1e-6
