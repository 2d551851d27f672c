"""Our units in a foreign tool: fmpy validates them, and scripts that know only fmpy drive them."""

import subprocess
import sys

import pytest
from conftest import MAGLEV, ROOT, UNITS, maglev, single_units
from fmpy.validation import validate_fmu

HERE = ROOT / "tests" / "python"


def script(path, *args):
    """Runs a script of evidence; its output is the message where it fails."""
    done = subprocess.run([sys.executable, path, *map(str, args)], capture_output=True, text=True, timeout=600)
    print(done.stdout)
    assert done.returncode == 0, f"{path.name}: status {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def units():
    """The packed units; the list is empty before `cargo xtask package`, which `built` reports."""
    return single_units()


@pytest.mark.parametrize("unit", units(), ids=lambda p: p.stem)
def test_crosstool_fmpy_validates_without_a_message(unit):
    assert validate_fmu(str(unit)) == []


@pytest.mark.parametrize("unit", units(), ids=lambda p: p.stem)
def test_crosstool_maglev_validates(unit):
    maglev("validate", unit)


def test_there_are_units_of_every_kind():
    stems = {unit.stem.split("-")[0] for unit in units()}
    assert stems == {"controller", "ems", "guideway", "vehicle"}


def test_analytic_poles_of_one_magnet_under_250_kg():
    script(HERE / "poles.py", UNITS / "ems.fmu")


def test_analytic_moving_force_on_a_beam():
    script(HERE / "moving_force.py", UNITS / "guideway-moving-force.fmu")


def test_example_levitates_a_mass(tmp_path):
    picture = tmp_path / "gap.png"
    script(ROOT / "examples" / "levitate_mass.py", UNITS / "ems.fmu", picture)
    assert picture.stat().st_size > 5000
