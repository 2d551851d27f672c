"""SSP archives: the standard's schemas, the round trip, other tools.

The schemas of 1.0 are in fmpy, those of 2.0 in pyssp-standard, as the Modelica Association publishes them.
"""

import csv
import json
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pyssp_standard
import pytest
from conftest import MAGLEV, ROOT, maglev, results
from lxml import etree
from test_guide import blocks, commands

SCENARIOS = sorted(it for it in (ROOT / "scenarios").glob("*.json") if it.name != "schema.json")
SCHEMAS = {
    "1.0": Path(fmpy.__file__).parent / "ssp" / "schema",
    "2.0": Path(pyssp_standard.__file__).parent / "resources" / "ssp2",
}
NAMES = {"SystemStructureDescription": "SystemStructureDescription", "ParameterSet": "SystemStructureParameterValues"}
# a run of each kind: one magnet, a controller of its own, eight magnets, skids with sums
CHEAP = ["one-magnet", "one-magnet-controller", "one-bogie", "levitation", "unstable-limited"]
SCRIPT = ROOT / "tests" / "python" / "ssp_masters.py"


def description(archive):
    return zipfile.ZipFile(archive).read("SystemStructure.ssd")


def check_schema(text, version, schemas={}):
    """The description, and the parameter sets in it, which its schema leaves open."""
    root = etree.fromstring(text)
    assert root.get("version") == version
    for element in [root, *root.iter("{http://ssp-standard.org/SSP1/SystemStructureParameterValues}ParameterSet")]:
        name = NAMES[etree.QName(element).localname]
        if (version, name) not in schemas:
            schemas[version, name] = etree.XMLSchema(etree.parse(str(SCHEMAS[version] / f"{name}.xsd")))
        schemas[version, name].assertValid(etree.fromstring(etree.tostring(element)))


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda it: it.stem)
def test_crosstool_exports_are_valid_and_the_same_after_a_round_trip(scenario, tmp_path):
    """The second export is made of the first: equal texts say that nothing of the setup got lost on the way."""
    version = "2.0" if SCENARIOS.index(scenario) % 2 else "1.0"
    first, second = tmp_path / "first.ssp", tmp_path / "second" / "first.ssp"
    said = maglev("export", scenario, "--ssp", first, "--ssp-version", version).stdout
    unseen = said.split("other tools do not see: ")[1].split(" (")[0].split(", ")
    assert "experiment" in unseen
    check_schema(description(first), version)
    maglev("export", first, "--ssp", second, "--ssp-version", version)
    assert description(first) == description(second)
    for name in zipfile.ZipFile(first).namelist():
        assert zipfile.ZipFile(first).read(name) == zipfile.ZipFile(second).read(name), name


@pytest.mark.parametrize("name", CHEAP)
def test_invariant_a_round_trip_keeps_the_bits(name, tmp_path):
    maglev("export", ROOT / "scenarios" / f"{name}.json", "--ssp", tmp_path / f"{name}.ssp")
    for source, out in [(ROOT / "scenarios" / f"{name}.json", "before"), (tmp_path / f"{name}.ssp", "after")]:
        maglev("run", source, "--stop", 0.5, "--no-report", "--out", tmp_path / out)
    before, after = ((tmp_path / it / "results.csv").read_bytes() for it in ("before", "after"))
    assert before == after and len(before) > 1000
    # the scenario as run finds its units in the results folder
    maglev("run", tmp_path / "after" / "scenario-as-run.json", "--stop", 0.5, "--no-report", "--out", tmp_path / "again")
    assert (tmp_path / "again" / "results.csv").read_bytes() == before


@pytest.mark.parametrize("master", ["libcosim", "ecos"])
def test_crosstool_other_masters_run_our_archive(master, tmp_path):
    """They hold inputs over the step, as `jacobi` does without extrapolation; see test_foreign_masters.py for the bound."""
    archive = tmp_path / "one-bogie.ssp"
    maglev("export", ROOT / "scenarios" / "one-bogie.json", "--ssp", archive)
    options = ["--algorithm", "jacobi", "--extrapolation", 0, "--stop", 1, "--record-interval", 0.001]
    maglev("run", archive, *options, "--no-report", "--out", tmp_path / "ours")
    ours = results(tmp_path / "ours")
    signals = ["ems_01.force", "guideway.midspan_displacement_01"]
    command = [sys.executable, SCRIPT, master, archive, 0.001, 1, *signals]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"status {done.returncode}\n{done.stdout}\n{done.stderr}"
    times, *columns = np.array(list(csv.reader(done.stdout.splitlines()))[1:], dtype=float).T
    shift = np.abs(ours["time"][1:] - times).max()
    found = {}
    for signal, values in zip(signals, columns):
        expected = ours[signal]
        largest, slope = np.abs(expected).max(), np.abs(np.diff(expected)).max() / 0.001
        off = np.abs(expected[1:] - values).max()
        found[signal] = off / largest
        assert np.ptp(expected) > 0 and off <= 1e-12 * largest + slope * shift, f"{signal} is off by {off}"
    print(master, f"times differ by {shift:.1e} s", found)


def test_inspect_validate_and_errors(tmp_path):
    archive = tmp_path / "one-magnet.ssp"
    maglev("export", ROOT / "scenarios" / "one-magnet.json", "--ssp", archive)
    said = maglev("inspect", archive).stdout
    assert "ems_01" in said and "connections" in said and "step 0.001 s" in said
    assert "0 errors" in maglev("validate", archive).stdout
    maglev("export", archive, "--scenario", tmp_path / "folder")
    assert "may have been edited" in maglev("export", archive, "--scenario", tmp_path / "folder", status=2).stderr
    maglev("run", tmp_path / "folder" / "scenario.json", "--stop", 0.01, "--no-report", "--out", tmp_path / "out")
    assert "is not a system" in maglev("export", ROOT / "scenarios" / "one-magnet.json", "--scenario", tmp_path, status=2).stderr
    assert "cannot be opened" in maglev("run", tmp_path / "none.ssp", status=2).stderr
    assert "one unit, not a system" in maglev("validate", "--dynamic", archive, status=2).stderr


def test_the_commands_of_the_page_print_what_it_shows(tmp_path):
    (shown,) = blocks("ssp.md", "text")
    said = ""
    for _, *options in commands("ssp.md"):
        options = [str(ROOT / option) if option.startswith("scenarios/") else option for option in options]
        if options[0] == "run":
            options[options.index("--stop") + 1] = "0.05"
            options.append("--no-report")
        done = subprocess.run([MAGLEV, *options], cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        said += done.stdout
    assert shown in said
    maglev("run", tmp_path / "my-system" / "scenario.json", "--stop", 0.01, "--no-report", "--out", tmp_path / "out")


def test_issue_archives_take_the_place_of_scenarios(tmp_path):
    """`modes` and `linearize` of an archive, and a run of an archive inside another system."""
    scenario, archive = ROOT / "scenarios" / "one-magnet.json", tmp_path / "one-magnet.ssp"
    maglev("export", scenario, "--ssp", archive)

    def modes(path, *options):
        found = json.loads(maglev("modes", path, "--json", "--count", "0", *options).stdout)
        return [mode["continuous"] for mode in found["modes"]["modes"]]

    assert modes(archive, "--out", tmp_path / "out") == modes(scenario)
    assert (tmp_path / "out" / "system" / "scenario.json").is_file() and (tmp_path / "out" / "modes.json").is_file()
    for path, file in [(scenario, "a.json"), (archive, "b.json")]:
        maglev("linearize", path, "--out", tmp_path / file)
    assert (tmp_path / "a.json").read_text() == (tmp_path / "b.json").read_text()

    study = {
        "factors": {
            "gain": {"target": "ems_*.gain_gap", "values": [8.0, 9.0]},
            "stop": {"target": {"key": "experiment.stop"}, "values": [0.05]},
        },
        "objectives": {"gap": {"signal": "vehicle.gap_01", "figure": "rms"}},
    }
    rows = []
    for path, name in [(archive, "a"), (scenario, "b")]:
        (tmp_path / "study.json").write_text(json.dumps(study | {"scenario": str(path)}))
        maglev("study", "run", tmp_path / "study.json", "--out", tmp_path / name, "--quiet")
        with (tmp_path / name / "metrics.csv").open() as file:
            rows.append([(row["gain"], row["gap"]) for row in csv.DictReader(file)])
    assert rows[0] == rows[1] and len(set(rows[0])) == 2

    outer = tmp_path / "outer.ssd"
    outer.write_text(
        '<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription version="1.0" name="outer" '
        'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"><ssd:System name="root"><ssd:Elements>'
        '<ssd:Component name="part" source="one-magnet.ssp"/></ssd:Elements></ssd:System>'
        '<ssd:DefaultExperiment startTime="0" stopTime="0.05"/></ssd:SystemStructureDescription>'
    )
    check_schema(outer.read_bytes(), "1.0")
    options = ["--stop", "0.05", "--step", "0.001", "--algorithm", "jacobi", "--extrapolation", "0", "--no-report"]
    said = maglev("run", outer, *options, "--out", tmp_path / "part").stderr
    assert "settings of the system that is used here as a part are not used: " in said
    maglev("run", scenario, *options, "--out", tmp_path / "whole")
    part, whole = results(tmp_path / "part"), results(tmp_path / "whole")
    assert np.array_equal(part["part/vehicle.gap_01"], whole["vehicle.gap_01"])
