"""Modes and linear models: those of the command, and of each other."""

import json

import numpy as np
import pytest
from conftest import command

import maglev_cosim as maglev


@pytest.fixture(scope="module")
def scenario():
    return maglev.load("one-magnet")


def test_invariant_modes_are_those_of_the_command(scenario, tmp_path):
    path = tmp_path / "scenario.json"
    path.write_text(json.dumps(scenario.content))
    said = json.loads(command("modes", "--json", path).stdout)["modes"]
    modes = scenario.modes()
    assert modes.stable == said["stable"] and len(modes) == len(said["modes"]) and modes.report == said
    assert [it.damping for it in modes] == sorted(it.damping for it in modes)
    least = modes.oscillating(above=0.1)[0]
    assert abs(least.eigenvalue) == pytest.approx(2 * np.pi * least.frequency)
    assert least.damping == pytest.approx(-least.eigenvalue.real / abs(least.eigenvalue))
    assert sum(least.participation.values()) == pytest.approx(1, abs=0.01)
    assert modes.to_pandas()["frequency"].tolist() == [it.frequency for it in modes]
    assert "participation" in modes._repr_html_()


def test_analytic_eigenvalues_of_the_matrix_are_the_modes(scenario):
    system, modes = scenario.linearize(), scenario.modes()
    assert system.A.shape == (len(system.states),) * 2 and not system.A.flags.writeable
    found = system.eigenvalues()
    for mode in modes:
        # a double eigenvalue splits by the square root of the rounding error
        assert np.abs(found - mode.eigenvalue).min() < 1e-5 * max(1, abs(mode.eigenvalue)), mode
    assert system.outputs == [it for it in scenario.signals if it in system.outputs] and "vehicle.gap_01" in system.outputs
    assert system.units["vehicle.gap_01"] == "m"


def test_analytic_the_response_of_a_unit_is_the_sum_of_its_modes(scenario):
    unit = scenario.linearize("ems_01")
    assert all(it.startswith("ems_01.") is False for it in unit.states) and unit.D.shape == (len(unit.outputs), len(unit.inputs))
    frequency = 3.0
    values, vectors = np.linalg.eig(unit.A)
    modal = np.linalg.solve(vectors, unit.B.astype(complex))
    expected = unit.C @ vectors @ (modal / (2j * np.pi * frequency - values)[:, None]) + unit.D
    found = unit.response([frequency])[0]
    assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()


def test_analytic_a_static_force_bends_the_girder(scenario):
    """The girder alone at mid-span is nearly its first mode, at 7.1 Hz. The force of a magnet pulls it down."""
    alone = scenario.linearize("guideway")
    force, middle = alone.inputs.index("force_01"), alone.outputs.index("midspan_displacement_01")
    static = alone.response([0.0])[0, middle, force].real
    dynamic = alone.response([0.0, 3.55, 7.1])[:, middle, force]
    assert static < 0
    # at half of the natural frequency: 1/(1 - 1/4)
    assert dynamic[1].real == pytest.approx(static / 0.75, rel=0.02) and abs(dynamic[2]) > 20 * abs(static)
    # the magnet moves with the girder, so that the resonance is damped
    together = scenario.linearize(inputs=["guideway.force_01"], outputs=["guideway.midspan_displacement_01"])
    assert abs(together.response([7.1])[0, 0, 0]) < 0.8 * abs(dynamic[2])


def test_refusal_names_that_are_not_there(scenario):
    with pytest.raises(maglev.InputError, match='did you mean "ems_01"'):
        scenario.linearize("ems_02")
    with pytest.raises(maglev.InputError, match='did you mean "vehicle.gap_01"'):
        scenario.linearize(outputs=["vehicle.gapp_01"])
    with pytest.raises(ValueError, match="not of one instance"):
        scenario.linearize("ems_01", outputs=["force"])
    chosen = scenario.linearize(outputs=["vehicle.gap_01", "ems_*.force"])
    assert chosen.outputs == ["vehicle.gap_01", "ems_01.force"] and chosen.C.shape == (2, len(chosen.states))
