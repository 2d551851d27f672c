"""Simulations that are stepped by hand, Ctrl-C, threads."""

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import maglev_cosim as maglev


def test_invariant_steps_by_hand_give_the_bits_of_a_run(magnet):
    whole = magnet.run()
    with magnet.start() as simulation:
        assert (simulation.status, simulation.done, simulation.remaining) == ("started", 0, 100)
        simulation.step()
        assert simulation.time == 0.001 and simulation.status == "running"
        simulation.step(40).at(0.05)
        assert simulation.done == 50
        assert simulation.get("vehicle.gap_01") == whole["vehicle.gap_01"][50]
        assert simulation.get("vehicle.gap_[01..01]") == {"vehicle.gap_01": whole["vehicle.gap_01"][50]}
        results = simulation.run()
    assert results.status == "finished" and len(results) == 101
    assert all(results[name].tobytes() == whole[name].tobytes() for name in whole.names)


def test_invariant_saved_states_continue_with_the_same_bits(magnet, tmp_path):
    with magnet.start() as simulation:
        saved = simulation.at(0.04).save()
        first = simulation.at(0.1).results()
        # back: the rows after the state are forgotten and computed again
        simulation.restore(saved)
        assert simulation.done == 40 and len(simulation.results()) == 41
        second = simulation.run()
    assert all(first[name].tobytes() == second[name].tobytes() for name in first.names)
    (tmp_path / "state").write_bytes(saved)
    (tmp_path / "scenario").write_bytes(pickle.dumps(magnet))
    code = """
        import pickle
        scenario = pickle.load(open("scenario", "rb"))
        with scenario.start() as simulation:
            simulation.restore(open("state", "rb").read())
            assert simulation.done == 40
            pickle.dump(simulation.run(), open("results", "wb"))
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], cwd=tmp_path, check=True, timeout=120)
    third = pickle.loads((tmp_path / "results").read_bytes())
    assert third["vehicle.gap_01"][-60:].tobytes() == first["vehicle.gap_01"][-60:].tobytes()


def test_invariant_at_goes_back_to_a_saved_state(magnet):
    with magnet.start() as simulation:
        late = simulation.at(0.09).get("vehicle.gap_01")
        early = simulation.at(0.02).get("vehicle.gap_01")
        assert simulation.done == 20
        assert simulation.at(0.09).get("vehicle.gap_01") == late != early
        with pytest.raises(maglev.InputError, match="0.2 s is not between the start and the stop"):
            simulation.at(0.2)


def test_issue_values_are_set_while_it_runs(magnet):
    with magnet.start() as simulation:
        simulation.at(0.05).set("ems_*.gain_gap_velocity", np.float64(20))
        assert simulation.get("ems_01.gain_gap_velocity") == 20
        changed = simulation.run()
    whole = magnet.run()
    assert (changed["ems_01.voltage"][:51] == whole["ems_01.voltage"][:51]).all()
    assert (changed["ems_01.voltage"][60:] != whole["ems_01.voltage"][60:]).any()
    with magnet.start() as simulation, pytest.raises(maglev.InputError, match="neither tunable nor an unconnected input"):
        simulation.set("vehicle.initial_position", 3)


def test_refusal_states_and_names(magnet):
    with magnet.start() as simulation:
        with pytest.raises(maglev.InputError, match="not the state of a simulation"):
            simulation.restore(b"x")
        with pytest.raises(maglev.InputError, match='did you mean "gap_01"'):
            simulation.get("vehicle.gapp_01")
        saved = simulation.save()
    with pytest.raises(maglev.InputError, match="closed"):
        simulation.step()
    with maglev.load(maglev.unit("ems")).start() as other, pytest.raises(maglev.InputError, match="does not fit this scenario"):
        other.restore(saved)


def test_issue_a_stop_condition_ends_a_run_as_a_result(magnet):
    scenario = magnet.change({"stop_when": [{"when": {"signal": "vehicle.gap_01", "above": 0, "after": 0.05}}]})
    results = scenario.run()
    assert results.status == "stopped" and "vehicle.gap_01" in results.ended_by and results.reached == 0.05


def test_issue_a_magnet_at_the_rail_ends_a_run_as_a_result(tmp_path):
    fallen = maglev.load("one-magnet").set({"ems_01.gain_gap_velocity": 0, "ems_01.gain_velocity": 0})
    here, there = fallen.run(), fallen.run(tmp_path)
    assert here.status == there.status == "terminated" and here.ended_by == there.ended_by
    assert "the magnet has reached the rail" in here.ended_by and here.reached == here.time[-1] < 3
    assert all(here[name].tobytes() == there[name].tobytes() for name in here.names)


def children():
    """Processes that this one has started."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            if stat.read_text().rpartition(")")[2].split()[1] == str(os.getpid()):
                found.append(int(stat.parent.name))
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="isolation works on Linux")
@pytest.mark.parametrize("into_folder", [False, True])
def test_issue_a_unit_that_crashes_ends_the_run_but_not_python(into_folder, tmp_path):
    scenario = maglev.load("one-magnet").times(stop=1000).change({"isolation": {"all": True}})
    before = set(children())

    def kill(now):
        if now > 0.2:
            for child in set(children()) - before:
                os.kill(child, signal.SIGKILL)

    with pytest.raises(maglev.RunError) as caught:
        scenario.run(tmp_path if into_folder else None, progress=kill)
    error = caught.value
    assert error.causes[0].startswith("the run failed at") and "SIGKILL" in str(error)
    assert error.results.status == "failed" and error.results.time[-1] > 0.1
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and len(again.results) == len(error.results)


def test_issue_an_exception_of_the_callback_ends_the_run():
    class Enough(Exception):
        pass

    times = []

    def progress(now):
        times.append(now)
        if len(times) == 3:
            raise Enough

    scenario = maglev.load("one-bogie")
    with scenario.start() as simulation:
        with pytest.raises(Enough):
            simulation.run(progress=progress)
        assert simulation.time >= times[2] > times[0] > 0


def test_refusal_a_callback_that_uses_the_simulation():
    with maglev.load("one-bogie").start() as simulation, pytest.raises(maglev.InputError, match="while it steps"):
        simulation.run(progress=lambda now: simulation.get("vehicle.gap_01"))


def test_issue_a_run_that_does_not_start_keeps_no_results_of_another(magnet, tmp_path):
    magnet.run(tmp_path)
    missing = {"guideway.irregularity_on": True, "guideway.irregularity_file": tmp_path / "none.csv"}
    with pytest.raises(maglev.RunError, match="No such file") as caught:
        magnet.set(missing).run(tmp_path)
    assert caught.value.results is None or caught.value.results.status == "failed"


CTRL_C = """
    import os, signal, sys, threading, time
    import maglev_cosim as maglev
    folder = sys.argv[1] or None
    threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        maglev.load("one-bogie").times(stop=2000).run(folder)
    except maglev.Interrupted as interrupted:
        results = interrupted.results
        assert results.status == "interrupted", results
        assert results.time[-1] == results.reached > 0.1 and results["vehicle.gap_01"].min() > 0.005
        print(len(results), results.reached)
        sys.exit(3)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of Unix")
@pytest.mark.parametrize("folder", ["", "out"])
def test_issue_ctrl_c_leaves_complete_results(folder, tmp_path):
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(CTRL_C), folder], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 3, done.stderr
    rows, reached = done.stdout.split()
    assert int(rows) == round(float(reached) / 0.001) + 1
    if folder:
        results = maglev.read(tmp_path / "out")
        assert results.status == "interrupted" and len(results) == int(rows)


def test_issue_other_python_threads_work_during_a_run():
    counted, go = [0], threading.Event()

    def count():
        while not go.is_set():
            counted[0] += 1
            time.sleep(0.001)

    other = threading.Thread(target=count)
    other.start()
    begin = time.perf_counter()
    maglev.load("one-bogie").times(stop=4).run()
    seconds = time.perf_counter() - begin
    go.set()
    other.join()
    # without a released lock it would count a few times at most
    assert counted[0] > 50 * seconds


def test_invariant_threads_run_scenarios_side_by_side(magnet):
    expected = magnet.run()
    found = [None] * 4

    def work(k):
        found[k] = magnet.run()

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(it["vehicle.gap_01"].tobytes() == expected["vehicle.gap_01"].tobytes() for it in found)


@pytest.mark.skipif(sys.platform != "linux", reason="isolation works on Linux")
def test_issue_isolated_units_run_in_processes_of_the_command(magnet):
    isolated = magnet.change({"isolation": {"all": True}}).run()
    plain = magnet.run()
    assert all(isolated[name].tobytes() == plain[name].tobytes() for name in plain.names)
