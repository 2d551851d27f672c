"""Step and algorithm by the accuracy that a scenario asks for: in runs, simulations and studies."""

import json
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import pytest
from conftest import command

import maglev_cosim as maglev

WANTED = {"accuracy": 1e-3, "accuracy_over": 0.2, "record": {"interval": 0.016}}


@pytest.fixture
def wanted():
    """0.32 s of one magnet under a girder that is shaken fast."""
    scenario = maglev.load("one-magnet").times(stop=0.32).set("guideway.chirp_end_frequency", 20)
    return scenario.change(WANTED)


def test_issue_21_a_run_in_memory_chooses_step_and_algorithm(wanted, tmp_path):
    chosen, report = wanted.choose()
    assert report["wanted"] == 1e-3 >= report["estimate"] and report["over"] == pytest.approx(0.2, abs=0.02)
    content = chosen.content
    assert content.get("accuracy") is None and content["experiment"]["step"] != 0.001
    assert chosen.settings == wanted.settings and pickle.loads(pickle.dumps(chosen)).content == content
    assert chosen.run().accuracy is None
    results = wanted.run()
    assert results.accuracy["wanted"] == 1e-3 and results.accuracy["explanation"] in "".join(results.notes)
    # what was chosen runs by itself with the same bits
    name, step = results.summary["algorithm"]["name"], results.summary["step"]
    last = [it for it in results.accuracy["trials"] if it["algorithm"].startswith(name)][-1]
    assert last["step"] == step and last["error"] == results.accuracy["estimate"]
    with wanted.start() as simulation:
        assert simulation.remaining == round(0.32 / simulation.run().summary["step"])
    # and a run with a folder says it in summary.json
    kept = wanted.run(tmp_path / "run")
    assert kept.accuracy["wanted"] == 1e-3
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["algorithm"]["accuracy"] == kept.accuracy
    plain = maglev.load(tmp_path / "run" / "scenario-as-run.json").run()
    assert np.array_equal(plain["vehicle.gap_01"], kept["vehicle.gap_01"])


def test_refusal_of_an_accuracy_that_cannot_be_had(wanted, magnet):
    with pytest.raises(maglev.InputError, match="asks for no accuracy"):
        magnet.choose()
    with pytest.raises(maglev.RunError, match="no step gives the accuracy"):
        wanted.change({"accuracy": 1e-15, "accuracy_over": 0.02}).start()
    with pytest.raises(maglev.InputError, match="between 0 and 1"):
        wanted.change({"accuracy": 2}).start()
    with pytest.raises(maglev.InputError, match="no signals are recorded"):
        wanted.change({"record": {"signals": []}}).run()


def test_issue_21_a_study_has_one_step_for_all_points(wanted, tmp_path):
    (tmp_path / "wanted.json").write_text(json.dumps(wanted.content))
    content = {
        "scenario": str(tmp_path / "wanted.json"),
        "set": wanted.settings,
        "factors": {"gain": {"target": "ems_01.gain_gap_velocity", "values": [20, 40, 80]}},
        "objectives": {"gap_rms": {"signal": "vehicle.gap_rate_01", "figure": "rms"}},
    }
    study = maglev.load_study(content, "wanted")
    chosen = study.choose()
    assert chosen["accuracy"]["explanation"].startswith("One step for all points; tried at points 1, 2, 3 only")
    assert maglev.load_study(content, "wanted").choose() == chosen
    assert study.scenario(2).content["experiment"]["step"] == chosen["step"]
    results = study.run(folder=tmp_path / "study", workers=2)
    assert json.loads((tmp_path / "study" / "study.json").read_text())["as_run"]["chosen"] == chosen
    # each point is what the command gives with that step
    rows = results.to_pandas()["gap_rms"]
    assert study.compute(3)["gap_rms"] == rows[3]
    by_hand = study.scenario(3).run()
    assert by_hand.metrics["gap_rms"] == rows[3] and by_hand.accuracy is None
    (tmp_path / "study.json").write_text(json.dumps(content))
    command("study", "run", tmp_path / "study.json", "--out", tmp_path / "by-command", "--quiet")
    metrics = [(tmp_path / name / "metrics.csv").read_bytes() for name in ("study", "by-command")]
    assert metrics[0] == metrics[1]
    # points apart, as on the workers of a cluster
    from maglev_cosim.study import _chunk

    for span in ((1, 1), (2, 3)):
        task = (study._native.json(), str(study._native.path), str(tmp_path / "apart"), False, study._native.choose())
        assert _chunk(span, task) == span[1] - span[0] + 1
    command("study", "merge", tmp_path / "apart")
    assert (tmp_path / "apart" / "metrics.csv").read_bytes() == metrics[0]


def test_refusal_of_a_study_whose_points_have_no_such_step(wanted, tmp_path):
    (tmp_path / "wanted.json").write_text(json.dumps(wanted.content | {"accuracy": 1e-15, "accuracy_over": 0.02}))
    content = {
        "scenario": str(tmp_path / "wanted.json"),
        "factors": {"gain": {"target": "ems_01.gain_gap_velocity", "values": [20]}},
        "objectives": {"gap_rms": {"signal": "vehicle.gap_rate_01", "figure": "rms"}},
    }
    with pytest.raises(maglev.RunError, match="no step gives the accuracy"):
        maglev.load_study(content, "wanted").compute(1)
    content["factors"]["step"] = {"target": {"key": "experiment.step"}, "values": [0.001]}
    with pytest.raises(maglev.InputError, match='"experiment.step" cannot be a factor'):
        maglev.load_study(content, "wanted")


@pytest.mark.skipif(os.name == "nt", reason="SIGINT to another process")
@pytest.mark.parametrize("folder", ["None", "'kept'"])
def test_issue_21_ctrl_c_ends_the_choice(folder, tmp_path):
    script = textwrap.dedent(
        f"""
        import maglev_cosim as maglev
        scenario = maglev.load("one-magnet").times(stop=1000).change({{"accuracy": 1e-14, "accuracy_over": 900}})
        print("begins", flush=True)
        try:
            scenario.run({folder}, progress=print)
        except KeyboardInterrupt as error:
            print("ended", type(error).__name__, flush=True)
        """
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    assert process.stdout.readline() == "begins\n"
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    # no progress is reported before the run itself
    assert process.communicate(timeout=60)[0] == "ended KeyboardInterrupt\n"
    assert process.returncode == 0 and not (tmp_path / "kept").exists()
