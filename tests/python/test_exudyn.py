"""Our multibody library against Exudyn: the same vehicle files, the same shaking.

Exudyn integrates by generalised-alpha, of second order; ours by a Runge-Kutta scheme of fourth order,
whose error at 1 ms is thousands of times smaller (docs/exudyn.md). So what lies between them has to be
Exudyn's discretisation error, and that is known without us: of two runs in steps of 2h and h, the finer
one is off by a third of what lies between the two. A model error of any kind would not shrink with h.
"""

import json
import os
import subprocess
from pathlib import Path

import exudyn_vehicle as peer
import pytest


@pytest.fixture(scope="session")
def shaken():
    """The library's side; `cargo test` has built it already."""
    cargo = os.environ.get("CARGO", "cargo")
    command = [cargo, "build", "--release", "--quiet", "-p", "multibody", "--example", "shaken"]
    subprocess.run(command, cwd=peer.ROOT, check=True)


@pytest.mark.parametrize("name, bodies", [("one-bogie", 11), ("two-car", 80)])
def test_crosstool_exudyn_follows_the_same_path(shaken, name, bodies):
    vehicle = peer.VEHICLES / name / "vehicle.json"
    own = peer.ours(vehicle, peer.CASE)
    assert len(own["bodies"]) == bodies
    description = json.loads(Path(vehicle).read_text())

    def run(step):
        model = peer.Vehicle(description, peer.CASE, own["loads"])
        model.begin(own["bodies"], own["equilibrium"])
        return model.run(own["bodies"], peer.CASE, step, tolerance=1e-8)[:2]

    (places_2, attitudes_2), (places_1, attitudes_1) = run(2e-3), run(1e-3)
    places, attitudes = peer.poses(own["rows"])
    assert peer.rms(places - places[0]) > 5e-4, "hardly shaken: nothing was compared"
    assert peer.rms(peer.angles(attitudes[:1], attitudes)) > 2e-4
    # a tenth for the next term of the error, which is of fourth order in h
    for apart, between in [
        (peer.rms(places_1 - places), peer.rms(places_1 - places_2)),
        (
            peer.rms(peer.angles(attitudes, attitudes_1)),
            peer.rms(peer.angles(attitudes_1, attitudes_2)),
        ),
    ]:
        print(name, apart, between / 3)
        assert apart <= 1.1 * between / 3
