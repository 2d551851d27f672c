"""The shipped scenarios and the schema that editors use: what `maglev` takes is valid, what it refuses is not."""

import copy
import json

import jsonschema
import pytest
from conftest import ROOT, maglev

FOLDER = ROOT / "scenarios"
SCHEMA = json.loads((FOLDER / "schema.json").read_text())
# folders of resources that scenarios use
RESOURCES = ["girders", "lines", "motors"]
SCENARIOS = sorted(
    path.relative_to(FOLDER).as_posix()
    for path in FOLDER.rglob("*.json")
    if path.name != "schema.json" and path.parent.name not in RESOURCES
)
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)

WHOLE = json.loads((FOLDER / "one-magnet.json").read_text())
PATCH = {"extends": "one-magnet.json", "experiment": {"stop": 1.0}}


def test_the_schema_is_one():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("name", SCENARIOS)
def test_issue_every_scenario_is_valid(name):
    VALIDATOR.validate(json.loads((FOLDER / name).read_text()))


@pytest.mark.parametrize("name", SCENARIOS)
def test_issue_every_scenario_says_what_it_is(name):
    """By itself, not by what it extends."""
    scenario = json.loads((FOLDER / name).read_text())
    assert scenario["$schema"] == "../" * name.count("/") + "schema.json"
    assert len(scenario["title"]) > 10 and len(scenario["description"]) > 50


def changed(scenario, path, value):
    """A copy with one member set; `...` removes it."""
    scenario = copy.deepcopy(scenario)
    *way, last = path
    at = scenario
    for key in way:
        at = at[key]
    if value is ...:
        del at[last]
    else:
        at[last] = value
    return scenario


VEHICLE = ["instances", "vehicle"]
GOOD = [
    changed(WHOLE, ["$comment"], ["two", "lines"]),
    changed(WHOLE, ["units", "$comment"], "the files"),
    changed(WHOLE, [*VEHICLE, "parameters", "$comment"], "where it stands"),
    changed(WHOLE, ["connections", 0, "$comment"], "the gap"),
    PATCH,
    changed(PATCH, ["instances"], {"vehicle": {"parameters": {"initial_position": 10.0}}}),
    changed(PATCH, ["instances"], {"vehicle": {"parameters": {"initial_position": None}}}),
    changed(PATCH, ["plots"], None),
    changed(PATCH, ["algorithm"], {"iteration": {"sweeps": 3}, "order": None}),
    changed(PATCH, ["units"], {"$comment": "another vehicle", "vehicle": "../target/fmu/vehicle-one-magnet.fmu"}),
    changed(WHOLE, ["units", "vehicle"], {"fmu": WHOLE["units"]["vehicle"]}),
    changed(PATCH, ["units"], {"vehicle": {"resources": {"vehicle.json": {"bodies": {"mass": {"mass": 251.0}}}}}}),
    changed(PATCH, ["units"], {"vehicle": {"resources": {"vehicle.json": [{"name": "x"}, {"$comment": "y"}]}}}),
]
BAD = [
    changed(WHOLE, ["experiment"], ...),
    changed(WHOLE, ["experiment", "stop"], "late"),
    changed(WHOLE, [*VEHICLE, "unit"], ...),
    changed(WHOLE, [*VEHICLE, "unti"], "vehicle"),
    changed(WHOLE, [*VEHICLE, "unit"], None),
    changed(WHOLE, ["experiment", "step"], "fast"),
    changed(WHOLE, ["$comment"], {"hidden": "object"}),
    changed(WHOLE, ["connections", 0, "to"], 3),
    changed(WHOLE, ["units", "vehicle"], {"resources": {}}),
    changed(WHOLE, ["units", "vehicle"], 3),
    changed(PATCH, ["units"], {"vehicle": {"resources": {"vehicle.json": 3}}}),
    changed(PATCH, ["units"], {"vehicle": {"resource": {}}}),
    changed(PATCH, ["extends"], 7),
    changed(PATCH, ["experiment", "stopp"], 2.0),
    changed(PATCH, ["instances"], {"vehicle": {"parameters": {"initial_position": [1.0]}}}),
    changed(PATCH, ["plots"], [{"file": "a.svg"}]),
    changed(PATCH, ["algorithm"], {"name": "magic"}),
]


def written(scenario, folder):
    """The scenario as a file beside a copy of the one that it extends."""
    def with_units(one):
        units = one.get("units", {})

        def place(unit):
            if isinstance(unit, dict):
                return unit | ({"fmu": place(unit["fmu"])} if "fmu" in unit else {})
            return str((FOLDER / unit).resolve()) if isinstance(unit, str) else unit

        units = {k: place(v) if k != "$comment" else v for k, v in units.items()}
        return one | ({"units": units} if units else {})

    (folder / "one-magnet.json").write_text(json.dumps(with_units(WHOLE)))
    path = folder / "scenario.json"
    path.write_text(json.dumps(with_units(scenario)))
    return path


@pytest.mark.parametrize("scenario", GOOD)
def test_issue_what_the_schema_takes_runs(scenario, tmp_path):
    VALIDATOR.validate(scenario)
    maglev("run", written(scenario, tmp_path), "--stop", "0.01", "--out", tmp_path / "out")


@pytest.mark.parametrize("scenario", BAD)
def test_issue_what_the_schema_refuses_does_not_run(scenario, tmp_path):
    assert not VALIDATOR.is_valid(scenario)
    said = maglev("run", written(scenario, tmp_path), "--stop", "0.01", "--out", tmp_path / "out", status=2).stderr
    assert "scenario.json: at " in said, said
