"""Reads the scenario files of `maglev`, for the foreign masters: instances, connections, experiment."""

import json
import re
from pathlib import Path


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


class Scenario:
    """What every master needs to know.

    instances: {name: (the .fmu file, {parameter: value})}
    wires: one (source instance, output, target instance, input) for each connection
    """

    def __init__(self, path, stop=None, step=None, starts=None):
        path = Path(path)
        given = json.loads(path.read_text())
        experiment = given["experiment"]
        self.start = experiment["start"]
        self.step = step or experiment["step"]
        self.stop = experiment["stop"] if stop is None else stop
        self.steps = round((self.stop - self.start) / self.step)
        files = {unit: (path.parent / file).resolve() for unit, file in given["units"].items()}
        self.instances = {
            name: (files[one["unit"]], dict(one.get("parameters", {})))
            for pattern, one in given["instances"].items()
            for name in expand(pattern)
        }
        for variable, value in (starts or {}).items():
            name, variable = variable.split(".")
            self.instances[name][1][variable] = value
        self.wires = [wire for connection in given["connections"] for wire in wires(connection)]


def wires(connection):
    """One connection of the file, from one output or a row of them to one input or rows of them."""
    targets = connection["to"] if isinstance(connection["to"], list) else [connection["to"]]
    for target in targets:
        sources, sinks = expand(connection["from"]), expand(target)
        if len(sources) == 1:
            sources = sources * len(sinks)
        assert len(sources) == len(sinks), connection
        yield from ((*a.split("."), *b.split(".")) for a, b in zip(sources, sinks))
