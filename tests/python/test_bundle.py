"""Bundles, whole systems as one unit: the bits of `maglev run` in fmpy, libcosim and ecos, alone and inside each other."""

import csv
import json
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from conftest import MAGLEV, ROOT, UNITS, maglev, results
from fmpy.fmi2 import FMU2Slave, defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.validation import validate_fmu

LIBRARY = UNITS / "bundle-library.zip"
STOP = 0.05
# there everything moves from the beginning: the girder does not carry the bogie yet
ON_THE_SPAN = "vehicle.initial_position=12"


@pytest.fixture(scope="module")
def bogie(tmp_path_factory):
    """The bogie as one unit, and a run of the same scenario."""
    folder = tmp_path_factory.mktemp("bogie")
    unit = folder / "bogie.fmu"
    scenario = ROOT / "scenarios" / "one-bogie.json"
    maglev("bundle", scenario, "--out", unit, "--library", LIBRARY, "--set", ON_THE_SPAN)
    maglev("run", scenario, "--stop", STOP, "--no-report", "--out", folder / "run", "--set", ON_THE_SPAN)
    return unit, results(folder / "run")


def names(unit):
    return {v.name: v for v in fmpy.read_model_description(str(unit)).modelVariables}


def in_bundle(signal):
    return signal.replace(".", "_")


def same(run, found, time="time"):
    """The signals of a run and of a tool, bit by bit."""
    signals = [name for name in run if name != "time"]
    assert signals
    for signal in signals:
        assert np.array_equal(found[in_bundle(signal)], run[signal]), signal


@pytest.mark.parametrize("every", [1, 5])
def test_crosstool_fmpy_gets_the_bits_of_a_run(bogie, every):
    unit, run = bogie
    found = fmpy.simulate_fmu(
        str(unit), stop_time=STOP, step_size=every * 1e-3, output_interval=every * 1e-3, output=[in_bundle(name) for name in run if name != "time"]
    )
    same({name: values[::every] for name, values in run.items()}, found)


def test_crosstool_values_of_the_importer_are_those_of_set(bogie, tmp_path):
    """One variable stands for the gains of all magnets."""
    unit, _ = bogie
    scenario = ROOT / "scenarios" / "one-bogie.json"
    options = ["--set", "ems_*.gain_gap=6", "--set", "vehicle.travel_speed=3", "--set", ON_THE_SPAN]
    maglev("run", scenario, "--stop", STOP, "--no-report", "--out", tmp_path / "run", *options)
    run = results(tmp_path / "run")
    found = fmpy.simulate_fmu(
        str(unit),
        stop_time=STOP,
        step_size=1e-3,
        output_interval=1e-3,
        start_values={"ems_gain_gap": 6.0, "vehicle_travel_speed": 3.0},
        output=[in_bundle(name) for name in run if name != "time"],
    )
    same(run, found)


class Opened:
    """A unit in fmpy, call by call."""

    def __init__(self, unit, folder, name="one", logger=None):
        self.description = fmpy.read_model_description(str(unit))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.fmu = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        callbacks = None
        if logger is not None:
            callbacks = fmi2CallbackFunctions()
            callbacks.logger = fmi2CallbackLoggerTYPE(lambda _1, _2, _3, _4, text: logger.append(text.decode()))
            callbacks.allocateMemory = defaultCallbacks.allocateMemory
            callbacks.freeMemory = defaultCallbacks.freeMemory
        self.callbacks = callbacks
        self.fmu.instantiate(callbacks=callbacks)

    def start(self, stop=STOP, **values):
        self.fmu.setupExperiment(startTime=0.0, stopTime=stop)
        for name, value in values.items():
            self.fmu.setReal([self.references[name]], [value])
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def get(self, name):
        return self.fmu.getReal([self.references[name]])[0]

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


@pytest.fixture
def folder(bogie, tmp_path):
    return fmpy.extract(str(bogie[0]), tmp_path / "unit with blanks")


def test_invariant_states_of_the_whole_system_return_the_same_bits(bogie, folder):
    unit, run = bogie
    one = Opened(unit, folder)
    one.start()
    steps = [n * 1e-3 for n in range(50)]
    for t in steps[:20]:
        one.fmu.doStep(t, 1e-3)
    saved = one.fmu.getFMUstate()
    text = one.fmu.serializeFMUstate(saved)
    gap = "vehicle_gap_04"
    first = []
    for t in steps[20:]:
        one.fmu.doStep(t, 1e-3)
        first.append(one.get(gap))
    one.fmu.setFMUstate(saved)
    again = []
    for t in steps[20:]:
        one.fmu.doStep(t, 1e-3)
        again.append(one.get(gap))
    # a new instance continues, too
    other = Opened(unit, folder, "other")
    other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(text))
    third = []
    for t in steps[20:]:
        other.fmu.doStep(t, 1e-3)
        third.append(other.get(gap))
    assert first == again == third == list(run["vehicle.gap_04"][21:])
    one.fmu.freeFMUstate(saved)
    # and reset starts from the beginning
    one.fmu.reset()
    one.start()
    one.fmu.doStep(0.0, 1e-3)
    assert one.get(gap) == run["vehicle.gap_04"][1]
    one.end()
    other.end()


def test_analytic_steps_need_not_be_multiples(bogie, folder):
    """Steps of 0.7 ms: the values at common points differ by the coupling error of shorter steps."""
    unit, run = bogie
    one = Opened(unit, folder)
    one.start()
    for n in range(50):
        one.fmu.doStep(n * 0.7e-3, 0.7e-3)
    found, expected = one.get("vehicle_gap_04"), run["vehicle.gap_04"][35]
    assert found != expected and abs(found - expected) < 1e-3 * abs(expected - run["vehicle.gap_04"][0])
    one.end()


def test_analytic_an_input_force_moves_the_car(bogie, folder):
    """Held, and with derivatives: a force that grows linearly, given every 10 ms."""
    unit, _ = bogie
    force = next(name for name in names(unit) if name.endswith("external_force_z"))
    position = "vehicle_car_1_vertical_displacement"

    def run(step, derivative):
        one = Opened(unit, folder)
        one.start()
        for n in range(round(STOP / step)):
            one.fmu.setReal([one.references[force]], [1e6 * n * step])
            if derivative:
                one.fmu.setRealInputDerivatives([one.references[force]], [1], [1e6])
            one.fmu.doStep(n * step, step)
        moved = one.get(position)
        one.end()
        return moved

    fine, exact, held = run(1e-3, True), run(1e-2, True), run(1e-2, False)
    assert abs(exact - fine) < 1e-9 * abs(fine), "derivatives pass to the units inside"
    assert abs(held - fine) > 1e-2 * abs(fine)


def test_issue_tunable_parameters_change_as_by_an_event(bogie, folder, tmp_path):
    unit, _ = bogie
    base = json.loads((ROOT / "scenarios" / "one-bogie.json").read_text())
    base["units"] = {key: str(UNITS / Path(path).name) for key, path in base["units"].items()}
    base["events"] = [{"at": 0.02, "set": {"ems_*.gain_gap": 6.0}}]
    base["instances"]["vehicle"]["parameters"]["initial_position"] = 12.0
    del base["$schema"]
    (tmp_path / "event.json").write_text(json.dumps(base))
    maglev("run", tmp_path / "event.json", "--stop", STOP, "--no-report", "--out", tmp_path / "run")
    run = results(tmp_path / "run")
    one = Opened(unit, folder)
    one.start()
    for n in range(50):
        if n == 20:
            one.fmu.setReal([one.references["ems_gain_gap"]], [6.0])
        one.fmu.doStep(n * 1e-3, 1e-3)
        assert one.get("vehicle_gap_04") == run["vehicle.gap_04"][n + 1], n
    one.end()


def test_issue_a_bundle_leaves_nothing_behind(bogie, folder, tmp_path, monkeypatch):
    place = tmp_path / "tmp"
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    before = sorted(p for p in Path(folder).rglob("*"))
    one, two = Opened(bogie[0], folder, "one"), Opened(bogie[0], folder, "two")
    one.start()
    two.start(vehicle_travel_speed=5.0)
    for n in range(20):
        one.fmu.doStep(n * 1e-3, 1e-3)
        two.fmu.doStep(n * 1e-3, 1e-3)
    assert one.get("vehicle_gap_04") == bogie[1]["vehicle.gap_04"][20] != two.get("vehicle_gap_04")
    one.end()
    two.end()
    assert not list(place.iterdir())
    assert before == sorted(p for p in Path(folder).rglob("*"))


def test_issue_validate_and_fmpy_find_nothing():
    unit = UNITS / "magnet-on-girder.fmu"
    for each in (unit, UNITS / "train.fmu"):
        assert validate_fmu(str(each)) == []
        assert json.loads(maglev("validate", "--json", each).stdout) == []
    report = json.loads(maglev("validate", "--dynamic", "--json", unit).stdout)
    findings = report.get("findings", []) + [f for check in report["checks"] for f in check["findings"]]
    assert [it for it in findings if it["severity"] != "note"] == []


def test_issue_licences_and_documentation_are_inside(bogie):
    with zipfile.ZipFile(bogie[0]) as archive:
        files = archive.namelist()
        licence = archive.read("documentation/licenses/license.txt").decode()
        page = archive.read("documentation/index.html").decode()
    for unit in ["vehicle", "guideway", "ems"]:
        assert f"documentation/units/{unit}/licenses/license.txt" in files
        assert f"documentation/units/{unit}/index.html" in files
        assert f"documentation/units/{unit}" in licence and f"units/{unit}/index.html" in page


def test_issue_dependencies_lead_through_the_connections(bogie):
    """A gap depends on no input directly: the vehicle's state is between. A force depends on the voltage's inputs through currents only."""
    description = fmpy.read_model_description(str(bogie[0]))
    inputs = {v.name for v in description.modelVariables if v.causality == "input"}
    gap = next(u for u in description.outputs if u.variable.name == "vehicle_gap_01")
    assert inputs and gap.dependencies == []
    initial = next(u for u in description.initialUnknowns if u.variable.name == "vehicle_gap_01")
    assert {v.name for v in initial.dependencies} < {v.name for v in description.modelVariables if v.causality in ("input", "parameter")}


@pytest.mark.parametrize("master", ["libcosim", "ecos"])
def test_crosstool_other_masters_get_the_bits_of_a_run(bogie, master, tmp_path):
    unit, run = bogie
    scenario = {
        "units": {"bogie": str(unit)},
        "instances": {"bogie": {"unit": "bogie"}},
        "connections": [],
        "experiment": {"start": 0.0, "stop": STOP, "step": 0.001},
        "record": {"signals": []},
    }
    path = tmp_path / "alone.json"
    path.write_text(json.dumps(scenario))
    signals = ["bogie.vehicle_gap_04", "bogie.guideway_midspan_displacement_01"]
    script = ROOT / "tests" / "python" / "foreign_masters.py"
    done = subprocess.run([sys.executable, script, master, path, str(STOP), *signals], capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    rows = [row for row in csv.reader(done.stdout.splitlines()) if row and row[0][0] in "0123456789"]
    found = np.array([[float(x) for x in row] for row in rows])
    assert len(found) == 50
    assert np.array_equal(found[:, 1], run["vehicle.gap_04"][1:])
    assert np.array_equal(found[:, 2], run["guideway.midspan_displacement_01"][1:])


def test_issue_a_bundle_in_a_scenario_and_in_a_bundle(bogie, tmp_path):
    """Its modes are those of the system; inside another bundle it gives the same bits."""
    unit, run = bogie
    outer = {
        "units": {"bogie": str(unit)},
        "instances": {"bogie": {"unit": "bogie"}},
        "experiment": {"stop": STOP, "step": 0.001},
        "record": {"signals": ["bogie.vehicle_gap_04"]},
    }
    path = tmp_path / "outer.json"
    path.write_text(json.dumps(outer))
    maglev("run", path, "--no-report", "--out", tmp_path / "run")
    assert np.array_equal(results(tmp_path / "run")["bogie.vehicle_gap_04"], run["vehicle.gap_04"])

    def modes(scenario, *options):
        found = subprocess.run([MAGLEV, "modes", scenario, "--json", "--count", "0", *options], capture_output=True, text=True, timeout=100)
        return sorted(mode["continuous"]["frequency_hz"] for mode in json.loads(found.stdout)["modes"]["modes"])

    inner, whole = modes(path), modes(ROOT / "scenarios" / "one-bogie.json", "--set", ON_THE_SPAN)
    assert len(inner) == len(whole) > 10 and np.allclose(inner, whole, rtol=1e-6, atol=1e-6)
    twice = tmp_path / "twice.fmu"
    maglev("bundle", path, "--out", twice, "--library", LIBRARY)
    found = fmpy.simulate_fmu(str(twice), stop_time=STOP, step_size=1e-3, output_interval=1e-3)
    assert np.array_equal(found["bogie_vehicle_gap_04"], run["vehicle.gap_04"])


@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_issue_the_c_host_steps_in_real_time(bogie, folder, tmp_path):
    program = tmp_path / "real_time"
    headers = Path(fmpy.__file__).parent / "c-code"
    source = ROOT / "examples" / "real_time.c"
    subprocess.run(["gcc", "-O2", "-Wall", "-Werror", "-I", headers, source, "-ldl", "-o", program], check=True)
    done = subprocess.run([program, folder, "vehicle_gap_04", str(STOP), "0.001", "0"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split()[2]) == pytest.approx(bogie[1]["vehicle.gap_04"][50], rel=1e-8)
    assert "50 steps of 1 ms" in done.stdout and "0 overruns" in done.stdout


def test_issue_what_a_unit_inside_cannot_do_is_declared_with_its_name(tmp_path):
    """Magnets that say that they can neither save states nor vary their steps."""
    ems = tmp_path / "ems.fmu"
    with zipfile.ZipFile(UNITS / "ems.fmu") as source, zipfile.ZipFile(ems, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                for flag in [b"canSerializeFMUstate", b"canHandleVariableCommunicationStepSize"]:
                    content = content.replace(flag + b'="true"', flag + b'="false"')
            target.writestr(name, content)
    base = json.loads((ROOT / "scenarios" / "one-magnet.json").read_text())
    base["units"] = {key: str(UNITS / Path(path).name) for key, path in base["units"].items()} | {"ems": str(ems)}
    del base["$schema"]
    (tmp_path / "magnet.json").write_text(json.dumps(base))
    unit = tmp_path / "magnet.fmu"
    told = maglev("bundle", tmp_path / "magnet.json", "--out", unit, "--library", LIBRARY).stdout
    assert told.count("note: ") == 2 and told.count("ems_01 (unit Levitation electromagnet with controller)") == 2
    flags = fmpy.read_model_description(str(unit)).coSimulation
    assert not (flags.canGetAndSetFMUstate or flags.canSerializeFMUstate or flags.canHandleVariableCommunicationStepSize)
    with zipfile.ZipFile(unit) as archive:
        assert "its state cannot be saved: ems_01" in archive.read("documentation/index.html").decode()
    messages = []
    one = Opened(unit, fmpy.extract(str(unit), tmp_path / "unpacked"), logger=messages)
    one.start()
    one.fmu.doStep(0.0, 2e-3)
    for refused, part in [(one.fmu.getFMUstate, "cannot save its state: ems_01"), (lambda: one.fmu.doStep(2e-3, 5e-4), "multiples of 0.001 s: ems_01")]:
        with pytest.raises(Exception):
            refused()
        assert part in messages[-1], messages
    one.end()


def test_issue_errors_inside_carry_the_names_of_the_instances(bogie, folder):
    messages = []
    one = Opened(bogie[0], folder, logger=messages)
    one.fmu.setupExperiment(startTime=0.0, stopTime=STOP)
    one.fmu.setString([one.references["guideway_irregularity_file"]], ["/nowhere.csv"])
    one.fmu.setBoolean([one.references["guideway_irregularity_on"]], [True])
    one.fmu.enterInitializationMode()
    with pytest.raises(Exception):
        one.fmu.exitInitializationMode()
    assert "guideway" in messages[-1] and "/nowhere.csv" in messages[-1], messages
    # and the unit can be used again after a reset
    one.fmu.reset()
    one.start()
    one.fmu.doStep(0.0, 1e-3)
    assert one.get("vehicle_gap_04") == bogie[1]["vehicle.gap_04"][1]
    one.end()


@pytest.mark.parametrize(
    "options, part",
    [
        (["--expose", "vehicle.gap_99"], "vehicle.gap_99"),
        (["--expose", "vehicle"], "instance.variable"),
        (["--expose", "vehicle.speed=a name"], "is not a valid name"),
        (["--expose", "vehicle.gap_*=gap"], "an output shows only one"),
        (["--expose", "ems_01.gain_gap=x", "--expose", "ems_02.gain_gap=x"], "is used twice"),
        (["--expose", "ems_01.gain_*=x"], "cannot share the name x"),
        (["--only-exposed"], "--expose"),
        (["--set", "ems_01.gain_gap=-x"], "gain_gap"),
        (["--library", "nothing.zip"], "nothing.zip"),
    ],
)
def test_refusal_bad_orders_say_what_is_wrong(options, part, tmp_path):
    library = [] if "--library" in options else ["--library", LIBRARY]
    done = maglev("bundle", ROOT / "scenarios" / "one-bogie.json", "--out", tmp_path / "x.fmu", *library, *options, status=2)
    assert part in done.stderr, done.stderr
    assert not list(tmp_path.iterdir())


def test_issue_names_and_patterns_choose_the_variables(tmp_path):
    unit = tmp_path / "gains.fmu"
    options = ["--only-exposed", "--expose", "ems_*.gain_gap=gain", "--expose", "vehicle.gap_0[1..2]", "--expose", "vehicle.force_01=load"]
    maglev("bundle", ROOT / "scenarios" / "one-bogie.json", "--out", unit, "--library", LIBRARY, *options)
    found = {name: v.causality for name, v in names(unit).items()}
    assert found == {"gain": "parameter", "vehicle_gap_01": "output", "vehicle_gap_02": "output", "load": "output"}


def test_issue_the_guides_code_runs_with_the_shipped_train(tmp_path):
    """The ten lines of the page, with an early stop."""
    code = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "bundle.md").read_text(), re.DOTALL)[1]
    assert "stop_time=40.0" in code
    code = "import matplotlib\nmatplotlib.use('Agg')\n" + code.replace("stop_time=40.0", "stop_time=0.2")
    code = code.replace("target/fmu", str(UNITS))
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "figure-13.png").stat().st_size > 1000


def test_analytic_a_force_from_outside_is_the_chirp_inside(tmp_path):
    """The page's two programs, with an early stop: the same chirp from the guideway and from fmpy."""
    first, second = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "bundle.md").read_text(), re.DOTALL)[:2]
    code = first.split("gap =")[0] + second
    assert code.count("stop_time=40.0") == 2 and "times - 0.0025" in code
    code = code.replace("stop_time=40.0", "stop_time=1.0").replace("target/fmu", str(UNITS))
    late = second.replace("times - 0.0025", "times").replace("own =", "late =")
    late = late.replace("stop_time=40.0", "stop_time=1.0").replace("target/fmu", str(UNITS))
    found = {}
    exec("import matplotlib\nmatplotlib.use('Agg')\n" + code + late, found)  # ours, from the page
    run, own, late = (found[name]["vehicle_gap_25"] for name in ("run", "own", "late"))
    moved = np.max(np.abs(run - run[0]))
    assert moved > 1e-5 and len(run) == len(own) == 201
    assert np.max(np.abs(own - run)) < 1e-3 * moved
    assert np.max(np.abs(late - run)) > 1e-2 * moved


def test_crosstool_the_shipped_train_gets_the_bits_of_a_run(tmp_path):
    maglev("run", ROOT / "scenarios" / "low-speed.json", "--stop", "0.1", "--no-report", "--out", tmp_path / "run")
    run = results(tmp_path / "run")
    signals = [in_bundle(name) for name in run if name != "time"]
    found = fmpy.simulate_fmu(str(UNITS / "train.fmu"), stop_time=0.1, step_size=0.005, output_interval=0.005, output=signals)
    same(run, found)


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "iterated"])
def test_analytic_a_part_of_a_system_couples_with_the_rest(algorithm, tmp_path):
    """Magnet and mass as one unit, the girder outside: the motion of the three units by themselves, within the coupling's error.

    The iterated algorithm saves and restores the bundle in each step."""
    base = json.loads((ROOT / "scenarios" / "one-magnet.json").read_text())
    units = {key: str(UNITS / Path(path).name) for key, path in base["units"].items()}
    inside = [it for it in base["connections"] if "guideway" not in json.dumps(it)]
    inside.append({"from": "ems_[01..01].force", "to": "vehicle.force_[01..01]"})
    part = {
        "units": {key: units[key] for key in ("vehicle", "ems")},
        "instances": {key: it for key, it in base["instances"].items() if key != "guideway"},
        "connections": inside,
        "experiment": {"stop": 1.0, "step": 0.001},
        "record": {"signals": ["vehicle.gap_01", "vehicle.position_01", "vehicle.speed", "ems_01.force"]},
    }
    (tmp_path / "part.json").write_text(json.dumps(part))
    unit = tmp_path / "part.fmu"
    maglev("bundle", tmp_path / "part.json", "--out", unit, "--library", LIBRARY)
    whole = {
        "units": {"part": str(unit), "guideway": units["guideway"]},
        "instances": {"part": {"unit": "part"}, "guideway": base["instances"]["guideway"]},
        "connections": [
            {"from": "part.ems_01_force", "to": "guideway.force_01"},
            {"from": "part.vehicle_position_01", "to": "guideway.position_01"},
            {"from": "part.vehicle_speed", "to": "guideway.speed"},
            {"from": "guideway.displacement_01", "to": "part.vehicle_track_displacement_01"},
            {"from": "guideway.rate_01", "to": "part.vehicle_track_rate_01"},
        ],
        "experiment": {"stop": 1.0, "step": 0.001},
        "algorithm": {"name": algorithm},
        "record": {"signals": ["part.vehicle_gap_01"]},
    }
    (tmp_path / "whole.json").write_text(json.dumps(whole))
    maglev("run", tmp_path / "whole.json", "--no-report", "--out", tmp_path / "whole")
    maglev("run", ROOT / "scenarios" / "one-magnet.json", "--stop", "1", "--no-report", "--out", tmp_path / "plain")
    found, plain = results(tmp_path / "whole")["part.vehicle_gap_01"], results(tmp_path / "plain")["vehicle.gap_01"]
    motion = np.ptp(plain)
    assert motion > 1e-7 and np.max(np.abs(found - plain)) < 1e-3 * motion


def test_crosstool_patches_signals_and_events_of_the_scenario_are_inside(tmp_path):
    """Everything that a scenario may name by a path travels with the bundle."""
    (tmp_path / "wind.csv").write_text("time,force\n" + "".join(f"{0.01 * k},{1e4 * k}\n" for k in range(10)))
    base = json.loads((ROOT / "scenarios" / "one-bogie.json").read_text())
    base["units"] = {key: str(UNITS / Path(path).name) for key, path in base["units"].items()}
    base["units"]["guideway"] = {"fmu": base["units"]["guideway"], "resources": {"guideway.json": {"pole": {"length": 0.9}}}}
    base["instances"]["vehicle"]["parameters"]["initial_position"] = 12.0
    base["inputs"] = [{"to": "vehicle.car_1_external_force_y", "signal": {"type": "csv", "file": "wind.csv", "column": "force"}}]
    base["events"] = [{"at": 0.0105, "set": {"ems_*.gain_gap": 6.0}}]
    base["experiment"]["stop"] = STOP
    del base["$schema"]
    (tmp_path / "windy.json").write_text(json.dumps(base))
    unit = tmp_path / "windy.fmu"
    maglev("bundle", tmp_path / "windy.json", "--out", unit, "--library", LIBRARY)
    maglev("run", tmp_path / "windy.json", "--no-report", "--out", tmp_path / "run")
    (tmp_path / "wind.csv").unlink()
    assert "vehicle_car_1_external_force_y" not in names(unit)
    run = results(tmp_path / "run")
    found = fmpy.simulate_fmu(str(unit), step_size=1e-3, output_interval=1e-3, output=[in_bundle(name) for name in run if name != "time"])
    same(run, found)
