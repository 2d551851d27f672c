"""What importers do beyond the standard's order of calls, accepted with the result of the proper order."""

import shutil

import fmpy
import pytest
from conftest import UNITS
from fmpy.fmi2 import FMU2Slave, fmi2OK

START = {"gap": 0.0081, "gap_rate": 0.002, "static_force": 5000.0}
GAIN = {"gain_gap": 6.0}


class Unit:
    """An instance of `ems` with its variables by name."""

    def __init__(self, description, folder):
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.outputs = [v.valueReference for v in description.modelVariables if v.causality == "output"]
        self.slave.instantiate()

    def give(self, values):
        self.slave.setReal([self.reference[name] for name in values], list(values.values()))

    def take(self):
        return self.slave.getReal(self.outputs)

    def begin(self):
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()

    def ready(self):
        self.slave.exitInitializationMode()

    def step(self, n=0):
        self.slave.doStep(n * 1e-3, 1e-3)

    def run(self):
        """Outputs after initialization and after each of twenty steps."""
        self.ready()
        rows = [self.take()]
        for n in range(20):
            self.step(n)
            rows.append(self.take())
        self.slave.terminate()
        return rows


@pytest.fixture(scope="module")
def unit():
    """Makes instances of `ems`; fmpy raises an exception where a call returns anything but fmi2OK."""
    file = str(UNITS / "ems.fmu")
    folder, description = fmpy.extract(file), fmpy.read_model_description(file)
    made = []

    def make():
        made.append(Unit(description, folder))
        return made[-1]

    yield make
    for one in made:
        one.slave.freeInstance()
    shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="module")
def proper(unit):
    """The standard's order: parameters while instantiated, inputs in initialization mode."""
    one = unit()
    one.slave.setupExperiment(startTime=0.0)
    one.give(GAIN)
    one.slave.enterInitializationMode()
    one.give(START)
    rows = one.run()
    assert rows[0] != rows[-1]
    return rows


def test_issue_inputs_set_while_instantiated(unit, proper):
    """fmpy and fmuCheck."""
    one = unit()
    one.slave.setupExperiment(startTime=0.0)
    one.give(GAIN | START)
    one.slave.enterInitializationMode()
    assert one.run() == proper


def test_issue_start_values_before_setup_experiment(unit, proper):
    """OMSimulator."""
    one = unit()
    one.give(GAIN | START)
    one.begin()
    assert one.run() == proper


def test_issue_parameters_set_in_initialization_mode(unit, proper):
    """ecos."""
    one = unit()
    one.begin()
    one.give(GAIN | START)
    assert one.run() == proper


def test_issue_inputs_set_and_outputs_read_in_turns(unit, proper):
    """ecos sends inputs and reads outputs twice for each step, also right after initialization."""
    one = unit()
    one.begin()
    one.give(GAIN | START)
    one.ready()
    rows = [one.take()]
    for n in range(20):
        for _ in range(2):
            one.give(START)
            one.take()
        one.step(n)
        rows.append(one.take())
    assert rows == proper


@pytest.mark.parametrize("steps_before", [0, 1, 2, 3], ids=["instantiated", "initializing", "ready", "stepped"])
def test_issue_terminate_early_and_twice(unit, steps_before):
    """libcosim frees what it could not start; others terminate in whatever state a unit is."""
    one = unit()
    for call in [one.begin, one.ready, one.step][:steps_before]:
        call()
    for _ in range(2):
        assert one.slave.fmi2Terminate(one.slave.component) == fmi2OK
    one.slave.reset()
    one.begin()
    one.run()


def test_issue_time_that_is_added_up(unit, proper):
    """ecos counts t += h; the units follow within rounding."""
    one = unit()
    one.begin()
    one.give(GAIN | START)
    one.ready()
    time, last = 0.0, None
    for _ in range(20):
        one.slave.doStep(time, 1e-3)
        time += 1e-3
        last = one.take()
    assert time != 20 * 1e-3
    # rounding of 20 steps, by outputs' gains; the outputs are up to 5e3 N
    assert last == pytest.approx(proper[-1], rel=1e-13, abs=1e-15)
