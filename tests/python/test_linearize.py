"""`maglev linearize` against scipy, python-control and the units' own linearisations."""

import json

import control
import numpy as np
import pytest
import scipy.io
from conftest import ROOT, maglev

SCENARIO = ROOT / "scenarios" / "one-magnet.json"
NAMES = ("A", "B", "C", "D")


def models(file):
    return {model["name"]: model for model in json.loads(file.read_text())["models"]}


def matrices(model):
    """A, B, C, D; JSON has no empty matrix with columns."""
    x, u, y = (len(model[name]) for name in ("states", "inputs", "outputs"))
    shapes = {"A": (x, x), "B": (x, u), "C": (y, x), "D": (y, u)}
    return [np.array(model[name], dtype=float).reshape(shapes[name]) for name in NAMES]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("linearize")
    files = [folder / f"models.{kind}" for kind in ("json", "mat", "npz")]
    maglev("linearize", SCENARIO, *(option for file in files for option in ("--out", file)))
    return files


def test_all_formats_hold_the_same(written):
    json_file, mat_file, npz_file = written
    mat = scipy.io.loadmat(mat_file, simplify_cells=True)
    npz = np.load(npz_file)
    found = models(json_file)
    assert set(found) == {
        name + end for name in ("coupled", "vehicle", "guideway", "ems_01") for end in ("", "_stepped")
    }
    for name, model in found.items():
        for key, matrix in zip(NAMES, matrices(model)):
            assert np.array_equal(npz[f"{name}.{key}"], matrix), (name, key)
            assert np.array_equal(np.reshape(mat[name][key], matrix.shape), matrix), (name, key)
        for key in ("states", "inputs", "input_units", "outputs", "output_units"):
            texts = model[key]
            assert list(npz[f"{name}.{key}"]) == texts, (name, key)
            # simplify_cells makes an array of one cell its content, and an empty text an empty array
            read = np.atleast_1d(mat[name][key]).tolist() if texts else []
            assert [it if isinstance(it, str) else "" for it in read] == texts, (name, key)
        assert float(npz[f"{name}.step"][0, 0]) == mat[name]["step"] == (model["step"] or 0)
        assert mat[name]["source"] == model["source"] == str(npz[f"{name}.source"])


@pytest.mark.parametrize("unit", ["vehicle", "guideway", "ems_01"])
def test_units_as_stepped_are_their_zero_order_hold(written, unit):
    found = models(written[0])
    a, b, c, d = matrices(found[unit])
    step = found[f"{unit}_stepped"]["step"]
    hold = control.c2d(control.ss(a, b, c, d), step, "zoh")
    stepped = matrices(found[f"{unit}_stepped"])
    # outputs are those at the end of the step
    for ours, theirs in zip(stepped, (hold.A, hold.B, c @ hold.A, c @ hold.B + d)):
        assert np.allclose(ours, theirs, rtol=1e-9, atol=1e-9 * max(1, abs(theirs).max(initial=0)))


def test_coupled_system_is_what_python_control_connects(written):
    found = models(written[0])
    units = ["ems_01", "vehicle", "guideway"]
    system = control.append(*(control.ss(*matrices(found[unit])) for unit in units))
    inputs = [f"{unit}.{name}" for unit in units for name in found[unit]["inputs"]]
    outputs = [f"{unit}.{name}" for unit in units for name in found[unit]["outputs"]]
    feed = np.zeros((len(inputs), len(outputs)))
    for connection in json.loads(SCENARIO.read_text())["connections"]:
        targets = connection["to"] if isinstance(connection["to"], list) else [connection["to"]]
        source = connection["from"].replace("[01..01]", "01")
        for target in targets:
            target = target.replace("[01..01]", "01")
            if source in outputs and target in inputs:
                feed[inputs.index(target), outputs.index(source)] = 1
    closed = control.feedback(system, feed, sign=1)
    ours = matrices(found["coupled"])[0]

    def poles(matrix):
        return np.sort_complex(np.linalg.eigvals(matrix).round(6))

    assert np.allclose(poles(ours), poles(closed.A), rtol=1e-6, atol=1e-4)
    # the response of the gap to a free input, at three frequencies
    coupled = control.ss(*matrices(found["coupled"]))
    row = found["coupled"]["outputs"].index("vehicle.gap_01")
    for column, name in enumerate(found["coupled"]["inputs"]):
        for omega in (10.0, 45.0, 300.0):
            mine = coupled(1j * omega, squeeze=False)[row, column]
            other = closed(1j * omega, squeeze=False)[outputs.index("vehicle.gap_01"), inputs.index(name)]
            assert mine == pytest.approx(other, rel=1e-6, abs=1e-15), (name, omega)


def test_coupled_poles_are_the_modes(written):
    found = models(written[0])
    modes = json.loads(maglev("modes", SCENARIO, "--json").stdout)["modes"]["modes"]
    poles = np.linalg.eigvals(matrices(found["coupled"])[0])
    multipliers = np.linalg.eigvals(matrices(found["coupled_stepped"])[0])
    step = found["coupled_stepped"]["step"]
    for mode in modes:
        pole = complex(mode["continuous"]["real"], mode["continuous"]["imaginary"])
        assert min(abs(poles - pole)) < 1e-7 * abs(pole)
        stepped = complex(mode["stepped"]["real"], mode["stepped"]["imaginary"])
        assert min(abs(multipliers - np.exp(stepped * step))) < 1e-9


def response(model, frequency, step):
    a, b, c, d = matrices(model)
    z = np.exp(2j * np.pi * frequency * step)
    return c @ np.linalg.solve(z * np.eye(len(a)) - a, b) + d


def test_identified_models_are_what_the_units_report(written, tmp_path):
    """The magnet, which reports its linearisation, seen from outside."""
    file = tmp_path / "identified.json"
    maglev("linearize", SCENARIO, "--identify", "ems_*", "--out", file)
    reported, identified = models(written[0])["ems_01_stepped"], models(file)["ems_01_stepped"]
    assert identified["source"] == "identified from steps" and identified["error"] < 1e-4
    assert "coupled" not in models(file)
    step = identified["step"]
    rows = [identified["outputs"].index(name) for name in reported["outputs"] if name in ("force", "current")]
    known = [reported["outputs"].index(identified["outputs"][row]) for row in rows]
    columns = [identified["inputs"].index(name) for name in ("gap", "acceleration")]
    theirs = [reported["inputs"].index(name) for name in ("gap", "acceleration")]
    for frequency in (2.0, 7.0, 30.0, 100.0):
        ours = response(identified, frequency, step)[np.ix_(rows, columns)]
        wanted = response(reported, frequency, step)[np.ix_(known, theirs)]
        assert np.allclose(ours, wanted, rtol=2e-3, atol=1e-3 * abs(wanted).max(axis=0)), frequency


def test_sampled_controllers_have_a_discrete_model(tmp_path):
    """At 2 ms with steps of 1 ms the magnet repeats itself every two steps."""
    file = tmp_path / "sampled.json"
    said = maglev("linearize", SCENARIO, "--set", "ems_01.sample_time=0.002", "--out", file).stdout
    model = models(file)["ems_01_stepped"]
    assert model["step"] == pytest.approx(0.002) and model["error"] < 1e-3, model["error"]
    assert max(abs(np.linalg.eigvals(matrices(model)[0]))) < 1
    assert "no model of the coupled system: only identified models of ems_01" in said


def test_a_pattern_that_names_nothing_is_refused(tmp_path):
    done = maglev("linearize", SCENARIO, "--outputs", "vehicle.gab_*", "--out", tmp_path / "x.json", status=2)
    assert "no unit reports the input or output vehicle.gab_*" in done.stderr
