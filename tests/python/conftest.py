"""What the tests share: where the built units and the master lie, and how the master is run."""

import csv
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
UNITS = ROOT / "target" / "fmu"
# units that contain others; they have tests of their own
BUNDLES = ("magnet-on-girder", "train")
MAGLEV = ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release" / ("maglev.exe" if os.name == "nt" else "maglev")


def single_units():
    """The units that are not bundles."""
    return sorted(unit for unit in UNITS.glob("*.fmu") if unit.stem not in BUNDLES)


@pytest.fixture(scope="session", autouse=True)
def built():
    """The tests look at what `cargo xtask package` built; without it nothing here means anything."""
    missing = [str(p) for p in (MAGLEV, UNITS / "ems.fmu") if not p.exists()]
    assert not missing, f"not built: {missing}; run `cargo xtask test`, or `cargo xtask package` first"


def maglev(*args, status=0):
    """Runs the command and checks its exit status."""
    done = subprocess.run([MAGLEV, *map(str, args)], capture_output=True, text=True, timeout=900)
    assert done.returncode == status, f"maglev {args}: status {done.returncode}\n{done.stderr}"
    return done


def run(scenario, out, *options):
    """Runs a scenario; returns its signals as {name: array} and its summary."""
    maglev("run", ROOT / "scenarios" / scenario, "--out", out, *options)
    return results(out), json.loads((Path(out) / "summary.json").read_text())


def results(out):
    """results.csv as {name: array}."""
    with open(Path(out) / "results.csv", newline="") as file:
        rows = csv.reader(file)
        header = next(rows)
        data = np.array([[float(x) for x in row] for row in rows])
    return dict(zip(header, data.T))
