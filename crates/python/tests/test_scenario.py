"""Scenarios: names, changes, errors, pickling."""

import json
import pickle
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT, command

import maglev_cosim as maglev


def test_issue_all_shipped_scenarios_and_units_are_in_the_package():
    shipped = {path.stem for path in (ROOT / "scenarios").glob("*.json")} - {"schema"}
    assert set(maglev.scenarios()) == shipped
    for name in shipped:
        assert maglev.load(name).signals, name
    assert {"ems", "guideway", "vehicle", "vehicle-one-bogie"} <= set(maglev.units())
    with pytest.raises(ValueError, match="choose controller, ems"):
        maglev.unit("emss")


def test_invariant_a_scenario_never_changes(magnet):
    changed = magnet.set("ems_*.gain_gap", 6).set({"vehicle.initial_position": 10.5, "guideway.chirp_on": False})
    assert magnet.settings == {}
    assert changed.settings == {"ems_*.gain_gap": "6", "vehicle.initial_position": "10.5", "guideway.chirp_on": "false"}
    starts = {it["name"]: it["start"] for it in changed.variables("*.*")}
    assert starts["ems_01.gain_gap"] == 6 and starts["guideway.chirp_on"] is False
    recorded = magnet.record("vehicle.gap_01", interval=0.01)
    assert recorded.signals == ["vehicle.gap_01"] and len(recorded.run()) == 11
    assert magnet.change({"algorithm": {"name": "jacobi", "order": None}}).content["algorithm"]["name"] == "jacobi"


@pytest.mark.parametrize("value", [np.float64(6), np.int64(6), np.float32(6), 6, 6.0])
def test_issue_numbers_of_numpy_are_numbers(magnet, value):
    assert magnet.set("ems_01.gain_gap", value).settings == {"ems_01.gain_gap": "6"}


def test_issue_errors_have_the_text_of_the_command(magnet, tmp_path):
    bad = magnet.set("ems_99.gain_gap", 6)
    with pytest.raises(maglev.InputError) as caught:
        bad.run()
    path = tmp_path / "one-magnet.json"
    path.write_text(json.dumps(magnet.content))
    said = command("run", path, "--set", "ems_99.gain_gap=6", "--out", tmp_path / "out", status=2).stderr
    assert said == f"error: {caught.value}\n"
    assert caught.value.causes[0] == "invalid scenario" and 'did you mean "ems_01"?' in caught.value.causes[1]
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and type(again) is maglev.InputError


def test_refusal_bad_values_and_files(magnet, tmp_path):
    with pytest.raises(TypeError, match="a number, True, False, a text or a path, not list"):
        magnet.set("ems_01.gain_gap", [6])
    with pytest.raises(TypeError, match="no value"):
        magnet.set("ems_01.gain_gap")
    with pytest.raises(maglev.InputError, match="nonsense"):
        magnet.change({"nonsense": 1})
    with pytest.raises(maglev.InputError, match="No such file"):
        maglev.load(tmp_path / "none.json")
    with pytest.raises(maglev.InputError, match="outside of the range"):
        magnet.set("ems_01.turns", -6).start()
    with pytest.raises(ValueError, match="a report needs a folder"):
        magnet.run(report=True)


def test_invariant_a_pickled_scenario_gives_the_same_bits_in_another_process(magnet, tmp_path):
    scenario = magnet.set("ems_01.gain_gap", 6)
    (tmp_path / "scenario.pickle").write_bytes(pickle.dumps(scenario))
    code = (
        "import pickle; s = pickle.load(open('scenario.pickle', 'rb'));"
        "pickle.dump(s.run(), open('results.pickle', 'wb'))"
    )
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, timeout=120)
    there = pickle.loads((tmp_path / "results.pickle").read_bytes())
    here = scenario.run()
    assert there.names == here.names and there.units == here.units and there.status == "finished"
    assert all(there[name].tobytes() == here[name].tobytes() for name in ["time", *here.names])


def test_issue_a_unit_runs_alone_and_a_scenario_may_be_a_dict(tmp_path):
    alone = maglev.load(maglev.unit("ems")).times(stop=0.01, step=0.001)
    assert alone.run().status == "finished" and "ems.force" in alone.signals
    content = {
        "units": {"ems": str(maglev.unit("ems"))},
        "instances": {"m": {"unit": "ems"}},
        "experiment": {"stop": 0.01, "step": 0.001},
        "record": {"signals": ["m.force"]},
    }
    assert maglev.load(content).run()["m.force"].shape == (11,)


def test_issue_a_change_reaches_a_layout():
    heavier = maglev.load("one-magnet").change({"units": {"vehicle": {"resources": {"vehicle.json": {"title": "changed"}}}}})
    assert heavier.content["units"]["vehicle"]["resources"]


def test_issue_notebooks_show_scenarios(magnet):
    html = magnet.set("ems_01.gain_gap", 6)._repr_html_()
    assert "One magnet on a 250 kg mass" in html and "0.0 s to 0.1 s in steps of 0.001 s" in html and "ems_01.gain_gap" in html
    assert repr(magnet.set("ems_01.gain_gap", 6)) == "<Scenario one-magnet, ems_01.gain_gap=6>"
