"""Systems by hand."""

import pytest

import maglev_cosim as maglev


def test_invariant_a_system_by_hand_is_the_scenario(magnet):
    content = magnet.content
    system = maglev.System(stop=0.1, step=0.001)
    system.add(maglev.unit("vehicle-one-magnet"), "vehicle", initial_position=12.5)
    system.add(
        maglev.unit("guideway-one-magnet"),
        "guideway",
        irregularity_on=False,
        chirp_on=True,
        chirp_amplitude=1000.0,
        chirp_position=6.25,
    )
    system.add(maglev.unit("ems"), "ems_[01..01]")
    for it in content["connections"]:
        system.connect(it["from"], it["to"])
    system.algorithm("gauss-seidel", extrapolation=2, derivatives=True, order=["ems_[01..01]", "vehicle", "guideway"])
    system.record(*content["record"]["signals"])
    found, expected = system.run(), magnet.run()
    assert found.names == expected.names
    assert all(found[name].tobytes() == expected[name].tobytes() for name in found.names)
    assert repr(system) == "<System of vehicle, guideway, ems_[01..01], 11 connections>"


def test_refusal_connections_that_do_not_fit():
    system = maglev.System(stop=0.1, step=0.001)
    system.add(maglev.unit("ems"), "a", start={"gap": 0.008}).add(maglev.unit("ems"), "b")
    with pytest.raises(ValueError, match='there is an instance "a" already'):
        system.add(maglev.unit("ems"), "a")
    system.connect("a.force", "b.nothing")
    with pytest.raises(maglev.InputError, match="nothing"):
        system.run()
