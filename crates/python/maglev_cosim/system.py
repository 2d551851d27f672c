"""Systems of units that are connected by hand."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .results import Results
from .scenario import Scenario, load
from .simulation import Simulation

if TYPE_CHECKING:
    from .scenario import Value


class System:
    """Units and connections, added one by one; `scenario` makes a scenario of them.

        system = maglev.System(stop=2, step=0.001)
        system.add(maglev.unit("vehicle-one-magnet"), "vehicle", initial_position=12.5)
        system.add("my-magnet.fmu", "magnet")
        system.connect("vehicle.gap_01", "magnet.gap").connect("magnet.force", "vehicle.force_01")
        results = system.record("vehicle.gap_01").run()
    """

    def __init__(self, *, stop: float, step: float, start: float = 0.0, title: str = "") -> None:
        self._content: dict[str, Any] = {
            "title": title,
            "units": {},
            "instances": {},
            "connections": [],
            "experiment": {"start": start, "stop": stop, "step": step},
            "record": {"signals": []},
        }

    def add(self, fmu: str | os.PathLike[str], name: str | None = None, start: Mapping[str, Value] | None = None, **parameters: Value) -> System:
        """Adds an instance of an .fmu file, named after the file by default.

        `parameters` are values of parameters, `start` values of inputs and other variables. `ems_[01..08]` is a row of equal
        instances.
        """
        path = Path(fmu)
        name = name or path.stem
        content = self._content
        files = {file: key for key, file in content["units"].items()}
        key = files.get(str(path.absolute()), path.stem)
        while content["units"].setdefault(key, str(path.absolute())) != str(path.absolute()):
            key += "_"
        if name in content["instances"]:
            raise ValueError(f'there is an instance "{name}" already')
        settings = {"parameters": dict(parameters), "start": dict(start or {})}
        content["instances"][name] = {"unit": key} | {list_: _plain(it) for list_, it in settings.items() if it}
        return self

    def connect(self, source: str, target: str | list[str], **options: Any) -> System:
        """Connects an output to an input, or to several. `options` are other keys of a connection, such as `factor`."""
        self._content["connections"].append({"from": source, "to": target} | options)
        return self

    def record(self, *signals: str, interval: float | None = None) -> System:
        """Records these signals too, patterns allowed, at this interval (s) or in every step."""
        entries = list(signals) if interval is None else [{"signals": list(signals), "interval": interval}]
        self._content["record"]["signals"] += entries
        return self

    def algorithm(self, name: str, **options: Any) -> System:
        """Chooses the coupling algorithm, with its keys of the scenario file."""
        self._content["algorithm"] = {"name": name} | options
        return self

    def scenario(self) -> Scenario:
        """The system as a scenario."""
        return load(self._content)

    def run(self) -> Results:
        """Runs it to the end."""
        return self.scenario().run()

    def start(self) -> Simulation:
        """Starts it, to be stepped."""
        return self.scenario().start()

    def __repr__(self) -> str:
        content = self._content
        return f"<System of {', '.join(content['instances']) or 'nothing'}, {len(content['connections'])} connections>"


def _plain(values: dict[str, Value]) -> dict[str, Any]:
    """Values as in a scenario file."""
    return {name: {"path": str(Path(it).absolute())} if isinstance(it, os.PathLike) else it for name, it in values.items()}
