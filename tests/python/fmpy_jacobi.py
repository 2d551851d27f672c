"""A plain co-simulation master on fmpy: Jacobi, inputs held over the step, nothing clever.

It reads the same scenario files as `maglev` (instances, parameters, connections, experiment), so that
a difference in the results is a difference between the masters, not between two set-ups.
"""

import math
import shutil

import fmpy
from fmpy.fmi2 import FMU2Slave
from scenario import Scenario


class Unit:
    """One instance: its fmpy slave and its variables by name."""

    def __init__(self, name, folder, description, parameters, start, stop):
        self.name = name
        self.variables = {v.name: v for v in description.modelVariables}
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate()
        for variable, value in parameters.items():
            self.set(variable, value)
        self.slave.setupExperiment(startTime=start, stopTime=stop)
        self.slave.enterInitializationMode()

    def set(self, name, value):
        v = self.variables[name]
        kind = {"Real": "Real", "Integer": "Integer", "Boolean": "Boolean", "String": "String"}[v.type]
        getattr(self.slave, f"set{kind}")([v.valueReference], [value])

    def get(self, names):
        return self.slave.getReal([self.variables[n].valueReference for n in names])

    def put(self, names, values):
        self.slave.setReal([self.variables[n].valueReference for n in names], values)


def step_between(begin, end):
    """The step whose end, as a unit computes it, is the next communication point or just before."""
    size = end - begin
    while begin + size > end:
        size = math.nextafter(size, 0.0)
    return size


def simulate(path, signals, stop=None, step=None, settled=0.0):
    """Steps the scenario and returns (times, one row of `signals` per communication point).

    `settled` is the change of initial values that counts as none, relative to the value or the nominal value of its
    variable: at rest many signals are zero but for rounding.
    """
    scenario = Scenario(path, stop, step)
    start, step = scenario.start, scenario.step
    loaded, units = {}, {}
    for name, (file, parameters) in scenario.instances.items():
        if file not in loaded:
            loaded[file] = fmpy.extract(str(file)), fmpy.read_model_description(str(file))
        units[name] = Unit(name, *loaded[file], parameters, start, scenario.stop)

    reads, writes = {}, {}
    for source, output, target, variable in scenario.wires:
        if output not in reads.setdefault(source, []):
            reads[source].append(output)
        writes.setdefault(target, []).append((variable, source, output))

    def exchange(units_to_read):
        values = {}
        for name in units_to_read:
            values.update(((name, o), x) for o, x in zip(reads[name], units[name].get(reads[name])))
        return values

    def send(target, values):
        pairs = writes.get(target, [])
        if pairs:
            units[target].put([v for v, _, _ in pairs], [values[s, o] for _, s, o in pairs])

    # Initialization: pass the values round until they no longer change.
    def close(name, output, value, before):
        nominal = float(units[name].variables[output].nominal or 1.0)
        return abs(value - before) <= settled * max(abs(value), nominal)

    known = None
    for _ in range(100):
        values = exchange(reads)
        if known is not None and all(close(*k, x, known[k]) for k, x in values.items()):
            break
        known = values
        for target in units:
            send(target, values)
    else:
        raise RuntimeError("the initial values did not settle in 100 rounds")
    for unit in units.values():
        unit.slave.exitInitializationMode()

    recorded = [signal.split(".") for signal in signals]

    def record():
        return [units[u].get([v])[0] for u, v in recorded]

    times, rows = [start], [record()]
    for n in range(scenario.steps):
        values = exchange(reads)
        for target in units:
            send(target, values)
        for unit in units.values():
            unit.slave.doStep(times[-1], step_between(times[-1], start + (n + 1) * step))
        times.append(start + (n + 1) * step)
        rows.append(record())
    for unit in units.values():
        unit.slave.terminate()
        unit.slave.freeInstance()
    for folder, _ in loaded.values():
        shutil.rmtree(folder, ignore_errors=True)
    return times, rows
