"""What bundles pass through: shapes of modes, inputs of degree 5, a step that is chosen for an accuracy."""

import json
import re
import zipfile

import fmpy
import numpy as np
from conftest import ROOT, UNITS, maglev, results
from test_bundle import LIBRARY, Opened, in_bundle


# exact in binary, so that differences of times are equal
STEP = 1 / 128


def alone(unit, **more):
    """A scenario of one unit."""
    return {
        "units": {"unit": str(unit)},
        "instances": {"unit": {"unit": "unit"}},
        "experiment": {"stop": 0.1, "step": 0.01},
        **more,
    }


def write(path, scenario):
    path.write_text(json.dumps(scenario))
    return path


def bundle(scenario, unit, *options):
    return maglev("bundle", scenario, "--out", unit, "--library", LIBRARY, *options).stdout


def shapes(scenario, folder):
    """Frequencies and decay rates of the modes, and for each what moves: (part, direction, place): amplitude."""
    maglev("modes", scenario, "--out", folder)
    found = json.loads((folder / "mode-shapes.json").read_text())
    modes = json.loads((folder / "modes.json").read_text())["modes"]["modes"]
    parts = [(it["part"], it["direction"], it.get("at"), it["unit"]) for it in found["parts"]]
    return modes, [[(parts[k], complex(re, im)) for k, re, im in it["moves"]] for it in found["modes"]], found["parts"]


def test_issue_21_shapes_of_modes_are_those_of_the_scenario(tmp_path):
    scenario = ROOT / "scenarios" / "one-magnet.json"
    unit = tmp_path / "magnet.fmu"
    bundle(scenario, unit)
    outer = alone(unit, experiment={"stop": 0.1, "step": 0.001}, record={"signals": ["unit.vehicle_gap_01"]})
    whole, expected, parts = shapes(scenario, tmp_path / "whole")
    inner, found, inner_parts = shapes(write(tmp_path / "outer.json", outer), tmp_path / "inner")
    # the parts have the names of the instances in front
    assert [(f"{it['instance']} {it['part']}", it["direction"], it.get("at"), it["unit"]) for it in parts] == [
        (it["part"], it["direction"], it.get("at"), it["unit"]) for it in inner_parts
    ]
    names = {(it["part"], it["direction"], it.get("at"), it["unit"]): f"{it['instance']} {it['part']}" for it in parts}
    frequencies = [[mode["continuous"]["frequency_hz"] for mode in modes] for modes in (whole, inner)]
    assert len(frequencies[0]) > 5 and np.allclose(*frequencies, rtol=1e-6, atol=1e-6)
    assert len(expected) == len(found) > 5
    compared = 0
    for one, other in zip(expected, found):
        other = dict(other)
        assert {(names[key], *key[1:]) for key, _ in one} == other.keys()
        for key, value in one:
            compared += 1
            assert abs(value - other[names[key], *key[1:]]) < 1e-5, (key, value)
    assert compared > 20


def test_analytic_inputs_of_degree_five_reach_the_units_inside(tmp_path):
    """A force that rises with the fifth power of time over 8 ms, given to the girder itself and to a bundle of it.

    With one step inside, the girder gets the same numbers, and so answers with the same bits; with eight, the polynomial is
    shifted to each of them. A girder that got a cubic would not move."""
    girder = UNITS / "guideway-one-magnet.fmu"
    signals = ["unit.midspan_displacement_01", "unit.displacement_01"]
    path = write(tmp_path / "girder.json", alone(girder, experiment={"stop": 10 * STEP, "step": STEP}, record={"signals": signals}))
    found = []
    for count in (1, 8):
        unit = tmp_path / f"girder-{count}.fmu"
        bundle(path, unit, "--step", str(STEP / count))
        found.append(unit)
    # declared as by the girder
    text = zipfile.ZipFile(found[0]).read("modelDescription.xml").decode()
    listed = re.search(r'<Inputs order="5" variables="([^"]+)"', text)[1].split()
    spans = [[int(it) for it in word.split("-")] for word in listed]
    variables = [it.name for it in fmpy.read_model_description(str(found[0])).modelVariables]
    taken = {variables[k - 1] for first, *last in spans for k in range(first, (last or [first])[0] + 1)}
    assert "unit_force_01" in taken and all(name.startswith("unit_") for name in taken)

    def answer(unit, prefix, parts=1):
        """Deflections after each step; a step may be made in parts, each with the polynomial about its own beginning."""
        one = Opened(unit, fmpy.extract(str(unit), tmp_path / f"{unit.stem}-{parts}"))
        one.fmu.setupExperiment(startTime=0.0, stopTime=10 * STEP)
        one.fmu.setBoolean([one.references[f"{prefix}irregularity_on"]], [False])
        one.fmu.setReal([one.references[f"{prefix}position_01"]], [12.5])
        one.fmu.enterInitializationMode()
        one.fmu.exitInitializationMode()
        force = one.references[f"{prefix}force_01"]
        deflections = []
        for n in range(5):
            for k in range(parts):
                rise = np.polynomial.Polynomial([2.5e3 * n, 0, 0, 0, 0, 2.5e3 / STEP**5])
                values = [rise.deriv(order)(k * STEP / parts) if order else rise(k * STEP / parts) for order in range(6)]
                one.fmu.setReal([force], values[:1])
                one.fmu.setRealInputDerivatives([force] * 5, [1, 2, 3, 4, 5], values[1:])
                one.fmu.doStep(n * STEP + k * STEP / parts, STEP / parts)
            deflections.append(one.get(f"{prefix}midspan_displacement_01"))
        one.end()
        return np.array(deflections)

    itself = answer(girder, "")
    assert np.ptp(itself) > 1e-8
    assert np.array_equal(answer(found[0], "unit_"), itself)
    fine = answer(girder, "", 8)
    assert np.allclose(answer(found[1], "unit_"), fine, rtol=1e-11, atol=0)
    # the girder's own error of a large step; a cubic would be far off
    assert np.allclose(itself, fine, rtol=1e-4, atol=0)


def test_issue_21_the_step_inside_is_chosen_when_a_bundle_is_packed(tmp_path):
    scenario = write(
        tmp_path / "wanted.json",
        {"extends": str(ROOT / "scenarios" / "one-magnet.json"), "accuracy": 1e-3, "accuracy_over": 0.5, "record": {"interval": 0.032}},
    )
    units = [tmp_path / name / "magnet.fmu" for name in ("one", "again")]
    for unit in units:
        unit.parent.mkdir()
        told = bundle(scenario, unit, "--set", "guideway.chirp_end_frequency=20")
        assert "note: accuracy: gauss-seidel, steps of " in told and "inputs at their start values" in told
    # no clock decides
    assert units[0].read_bytes() == units[1].read_bytes()
    description = fmpy.read_model_description(str(units[0]))
    step = float(re.search(r"the step inside, (\S+) s, was chosen for an accuracy of 1e-3", description.description)[1])
    assert step != 0.001 and description.defaultExperiment.stepSize == str(step)
    archive = zipfile.ZipFile(units[0])
    assert "It was chosen when the unit was packed" in archive.read("documentation/index.html").decode()
    inside = json.loads(archive.read("resources/scenario.json"))
    assert inside["experiment"]["step"] == step and "accuracy" not in inside
    # what it computes are the bits of a run with that step
    plain = write(tmp_path / "plain.json", {"extends": str(scenario), "accuracy": None, "accuracy_over": None})
    options = ["--step", step, "--stop", 0.32, "--set", "guideway.chirp_end_frequency=20"]
    maglev("run", plain, "--no-report", "--out", tmp_path / "run", *options)
    run = results(tmp_path / "run")
    signals = [it for it in run if it != "time"]
    found = fmpy.simulate_fmu(
        str(units[0]), stop_time=0.32, step_size=0.032, output_interval=0.032, output=[in_bundle(it) for it in signals]
    )
    for signal in signals:
        assert np.array_equal(found[in_bundle(signal)], run[signal]), signal


def test_refusal_a_bundle_of_a_scenario_without_such_a_step(tmp_path):
    base = {"extends": str(ROOT / "scenarios" / "one-magnet.json"), "accuracy": 1e-15, "accuracy_over": 0.05}
    told = maglev("bundle", write(tmp_path / "a.json", base), "--out", tmp_path / "a.fmu", "--library", LIBRARY, status=1).stderr
    assert "no step gives the accuracy" in told and "larger accuracy" in told
    base["record"] = {"signals": []}
    told = maglev("bundle", write(tmp_path / "a.json", base), "--out", tmp_path / "a.fmu", "--library", LIBRARY, status=2).stderr
    assert "no signals are recorded" in told and not (tmp_path / "a.fmu").exists()
