"""Studies: on this machine, on a cluster of Dask, with SALib."""

import csv
import json
import os
import pickle
import signal
import subprocess
import sys
import textwrap

import numpy as np
import polars
import pytest
from conftest import command

import maglev_cosim as maglev

CONTENT = {
    "scenario": "one-magnet",
    "factors": {
        "gain": {"target": "ems_01.gain_gap_velocity", "range": {"from": 10, "to": 80, "count": 8}},
        "mass": {"target": "guideway.mass_factor", "values": [0.5, 1, -1]},
    },
    "objectives": {"gap_rms": {"signal": "vehicle.gap_rate_01", "figure": "rms"}},
    "limits": {"least_gap": {"signal": "vehicle.gap_01", "figure": "min", "min": 0.007}},
}


@pytest.fixture(scope="module")
def study():
    """24 points of half a second, of which 8 have a negative mass and fail."""
    return maglev.load_study(CONTENT | {"factors": CONTENT["factors"] | {"stop": {"target": {"key": "experiment.stop"}, "values": [0.5]}}}, "gains")


def files(folder):
    """What must be equal: the table and the dataset."""
    paths = [folder / "metrics.csv", *sorted((folder / "dataset").rglob("*.parquet"))]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def test_issue_points_scenarios_and_rows(study):
    assert len(study) == 24 and study.factors == ["gain", "mass", "stop"] and study.metrics == ["gap_rms", "least_gap"]
    assert study[1] == {"gain": 10.0, "mass": 0.5, "stop": 0.5} and [it["mass"] for it in study][:3] == [0.5, 1, -1]
    again = pickle.loads(pickle.dumps(study))
    assert list(again) == list(study) and repr(again) == "<Study gains: 24 points of gain, mass, stop>"
    row, results = study.compute(2), study.scenario(2).run()
    assert row["status"] == "finished" and results.reached == row["reached"] == 0.5
    assert row["gap_rms"] == results.metrics["gap_rms"] and results.metrics["least_gap"] == row["least_gap"]
    failed = study.compute(3)
    assert failed["status"] == "failed" and "mass_factor" in failed["message"] and failed["gap_rms"] is None
    with pytest.raises(maglev.InputError, match="the points 1 to 24"):
        study[25]


def test_invariant_python_and_the_command_write_the_same_bytes(study, tmp_path):
    calls = []
    results = study.run(folder=tmp_path / "here", workers=2, progress=lambda done, all: calls.append((done, all)))
    assert (results.points, results.done, results.failed) == (24, 24, 8) and calls[-1] == (24, 24)
    path = tmp_path / "here" / "study.json"
    command("study", "run", path, "--workers", "1", "--quiet", "--out", tmp_path / "there")
    assert files(tmp_path / "here") == files(tmp_path / "there")
    frame = results.to_pandas()
    assert frame["status"].value_counts().to_dict() == {"finished": 16, "failed": 8}
    assert frame.loc[2, "gap_rms"] == study.compute(2)["gap_rms"]
    assert polars.read_parquet(results.dataset)["gap_rms"].null_count() == 8
    assert "24 of 24 points" in results._repr_html_()


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
def test_invariant_a_cluster_with_a_killed_worker_writes_the_same_bytes(study, tmp_path):
    from distributed import Client, LocalCluster

    study.run(folder=tmp_path / "one", workers=1)
    killed = []
    with LocalCluster(n_workers=3, threads_per_worker=1, processes=True, dashboard_address=None) as cluster, Client(cluster) as client:

        def kill(done, all):
            if not killed:
                killed.append(min(client.run(os.getpid).values()))
                os.kill(killed[0], signal.SIGKILL)

        results = study.run(client, folder=tmp_path / "many", progress=kill)
        # what is there is not computed again
        journals = {path: path.stat().st_size for path in (tmp_path / "many" / "journal").glob("*.jsonl")}
        again = study.run(client, folder=tmp_path / "many")
    assert killed and results == again and (results.done, results.failed) == (24, 8)
    assert {path: path.stat().st_size for path in journals} == journals
    assert files(tmp_path / "one") == files(tmp_path / "many")


CTRL_C = """
    import os, signal, sys, threading
    import maglev_cosim as maglev
    study = maglev.load_study({
        "scenario": "one-magnet",
        "factors": {"gain": {"target": "ems_01.gain_gap_velocity", "range": {"from": 10, "to": 80, "count": 4000}}},
        "objectives": {"gap_rms": {"signal": "vehicle.gap_rate_01", "figure": "rms"}},
    })
    def end(done, all):
        if done == 3:
            os.kill(os.getpid(), signal.SIGINT)
    try:
        study.run(folder="out", workers=1, progress=end)
    except KeyboardInterrupt:
        sys.exit(3)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
def test_issue_ctrl_c_keeps_the_points_that_are_computed(tmp_path):
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(CTRL_C)], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 3, done.stderr
    with open(tmp_path / "out" / "metrics.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert 3 <= len(rows) < 4000 and all(row["status"] == "finished" for row in rows)


def test_issue_errors_name_the_key(tmp_path):
    with pytest.raises(maglev.InputError, match="factors"):
        maglev.load_study({"scenario": "one-magnet", "factors": {}})
    with pytest.raises(maglev.InputError, match="cannot read the study"):
        maglev.load_study(tmp_path / "none.json")
    with pytest.raises(ValueError, match="own number of workers"):
        maglev.load_study(CONTENT).run(client=object(), workers=2)


def test_analytic_salib_finds_what_matters(tmp_path):
    """A gain that varies widely, and one that hardly varies: Sobol's indices tell which is which."""
    from SALib.analyze import sobol
    from SALib.sample import sobol as sample

    (tmp_path / "scenario.json").write_text(json.dumps(maglev.load("one-magnet").times(stop=0.5).content))
    problem = {"num_vars": 2, "names": ["gain", "position"], "bounds": [[10, 80], [0.01, 0.02]]}
    values = sample.sample(problem, 64, calc_second_order=False)
    np.savetxt(tmp_path / "points.csv", values, delimiter=",", header="gain,position", comments="", fmt="%.17g")
    study = maglev.load_study(
        {
            "scenario": str(tmp_path / "scenario.json"),
            "factors": {"gain": {"target": "ems_01.gain_gap_velocity"}, "position": {"target": "ems_01.gain_position"}},
            "design": {"kind": "table", "file": str(tmp_path / "points.csv")},
            "objectives": {"gap_rms": {"signal": "vehicle.gap_rate_01", "figure": "rms"}},
        }
    )
    assert len(study) == len(values)
    frame = study.run(folder=tmp_path / "out").to_pandas()
    indices = sobol.analyze(problem, frame["gap_rms"].to_numpy(), calc_second_order=False)
    assert indices["ST"][0] > 0.9 > 0.1 > indices["ST"][1]
