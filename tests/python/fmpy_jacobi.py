"""A plain co-simulation master on fmpy: Jacobi, inputs held over the step, nothing clever.

It reads the same scenario files as `maglev` (instances, parameters, connections, experiment), so that
a difference in the results is a difference between the masters, not between two set-ups.
"""

import json
import re
import shutil
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave


def expand(pattern):
    """`ems_[01..64].gap` -> [`ems_01.gap`, …]; a name without a range stands for itself."""
    found = re.search(r"\[(\d+)\.\.(\d+)\]", pattern)
    if not found:
        return [pattern]
    first, last = found.groups()
    return [
        pattern[: found.start()] + f"{k:0{len(first)}d}" + pattern[found.end() :]
        for k in range(int(first), int(last) + 1)
    ]


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


def connect(scenario):
    """The connections, one (source unit, output, target unit, input) each."""
    wires = []
    for connection in scenario["connections"]:
        targets = connection["to"] if isinstance(connection["to"], list) else [connection["to"]]
        for target in targets:
            sources, sinks = expand(connection["from"]), expand(target)
            if len(sources) == 1:
                sources = sources * len(sinks)
            assert len(sources) == len(sinks), connection
            wires += [(*a.split("."), *b.split(".")) for a, b in zip(sources, sinks)]
    return wires


def simulate(path, signals, stop=None, step=None):
    """Steps the scenario and returns (times, one row of `signals` per communication point)."""
    path = Path(path)
    scenario = json.loads(path.read_text())
    experiment = scenario["experiment"]
    start, step = experiment["start"], step or experiment["step"]
    stop = experiment["stop"] if stop is None else stop
    loaded = {}
    for name, file in scenario["units"].items():
        file = path.parent / file
        loaded[name] = fmpy.extract(str(file)), fmpy.read_model_description(str(file))
    units = {}
    for pattern, given in scenario["instances"].items():
        for name in expand(pattern):
            folder, description = loaded[given["unit"]]
            units[name] = Unit(name, folder, description, given.get("parameters", {}), start, stop)

    wires = connect(scenario)
    reads, writes = {}, {}
    for source, output, target, variable in wires:
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
    known = None
    for _ in range(100):
        values = exchange(reads)
        if values == known:
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
    for n in range(round((stop - start) / step)):
        values = exchange(reads)
        for target in units:
            send(target, values)
        for unit in units.values():
            unit.slave.doStep(start + n * step, step)
        times.append(start + (n + 1) * step)
        rows.append(record())
    for unit in units.values():
        unit.slave.terminate()
        unit.slave.freeInstance()
    for folder, _ in loaded.values():
        shutil.rmtree(folder, ignore_errors=True)
    return times, rows
