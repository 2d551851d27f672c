"""Scenarios: what to simulate."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from . import _native
from ._errors import Interrupted, RunError
from .linear import Modes, StateSpace
from .results import Results, read
from .simulation import Simulation

#: The value of a variable: a number, True or False, a text, or the path of a file.
Value = float | bool | str | os.PathLike[str]

_HOME = Path(__file__).parent


def scenarios() -> list[str]:
    """Names of the scenarios that ship with the package, for `load`."""
    return sorted(path.stem for path in (_HOME / "scenarios").glob("*.json") if path.stem != "schema")


def units() -> list[str]:
    """Names of the units that ship with the package, for `unit`."""
    return sorted(path.stem for path in (_HOME / "units").glob("*.fmu"))


def unit(name: str) -> Path:
    """The path of a unit that ships with the package, such as `unit("ems")`."""
    path = _HOME / "units" / f"{name}.fmu"
    if not path.exists():
        raise ValueError(f'no unit "{name}" ships with the package; choose {", ".join(units())}')
    return path


def load(source: str | os.PathLike[str] | Mapping[str, Any]) -> Scenario:
    """Reads a scenario.

    `source` is the path of a scenario file, the name of a scenario that ships with the package (`"one-bogie"`), the path of
    an .fmu file that runs alone, or a scenario as a dict, whose paths are relative to the working directory.
    """
    if isinstance(source, Mapping):
        return Scenario(_native.Scenario.parse(json.dumps(source), Path.cwd(), "scenario"))
    return Scenario(_native.Scenario.load(path_of(source)))


def path_of(source: str | os.PathLike[str]) -> Path:
    """The path of a scenario file, also of one that ships with the package."""
    path = Path(source)
    if isinstance(source, str) and source in scenarios() and not path.is_file():
        path = _HOME / "scenarios" / f"{source}.json"
    return path


class Scenario:
    """What to simulate: units, connections, times, what to record, and values that replace those of the file.

    A scenario never changes; `set` and `change` return new ones. It can be pickled: it contains its settings, and the
    absolute paths of the units.
    """

    def __init__(self, native: _native.Scenario) -> None:
        self._native = native

    # what it is

    @property
    def name(self) -> str:
        """Name of the file without its extension."""
        return self._native.name

    @property
    def content(self) -> dict[str, Any]:
        """The scenario as in its file, completed by defaults, without the values of `settings`."""
        content: dict[str, Any] = json.loads(self._native.json())
        return content

    @property
    def settings(self) -> dict[str, str]:
        """The values that `set` gave, by name; the last one for a variable counts."""
        return dict(self._native.settings())

    @property
    def signals(self) -> list[str]:
        """Names of the recorded signals."""
        return self._native.check()

    def variables(self, pattern: str = "*.*") -> list[dict[str, Any]]:
        """Variables of the instances, with unit, causality, variability, start value and description.

        >>> [it["name"] for it in load("one-magnet").variables("ems_01.gain_*")][:2]
        ['ems_01.gain_gap', 'ems_01.gain_gap_velocity']
        """
        found: list[dict[str, Any]] = json.loads(self._native.variables(pattern))
        return found

    # changes

    def set(self, name: str | Mapping[str, Value], value: Value | None = None) -> Scenario:
        """The scenario with another value for a parameter or start value, as `maglev run --set` gives it.

        A name may have ranges and stars: `set("ems_*.gain_gap", 6)`. A dict sets several.
        """
        if isinstance(name, str):
            if value is None:
                raise TypeError(f"set: there is no value for {name}")
            return Scenario(self._native.set(name, value))
        changed = self
        for each, it in name.items():
            changed = changed.set(each, it)
        return changed

    def change(self, change: Mapping[str, Any]) -> Scenario:
        """The scenario with other keys, as a file that extends it would change them (JSON Merge Patch).

        `change({"experiment": {"stop": 2}, "record": {"signals": ["vehicle.*"]}})`. Paths are relative to the working
        directory; a null or None removes a key.
        """
        return Scenario(self._native.changed(json.dumps(change), Path.cwd()))

    def times(self, *, stop: float | None = None, step: float | None = None) -> Scenario:
        """The scenario with another stop time or communication step (s)."""
        given = {"stop": stop, "step": step}
        return self.change({"experiment": {key: value for key, value in given.items() if value is not None}})

    def record(self, *signals: str, interval: float | None = None) -> Scenario:
        """The scenario with these recorded signals, patterns allowed, and this interval between rows (s)."""
        return self.change({"record": {"signals": list(signals), **({} if interval is None else {"interval": interval})}})

    # runs

    def run(
        self,
        folder: str | os.PathLike[str] | None = None,
        *,
        report: bool = False,
        progress: Callable[[float], object] | None = None,
    ) -> Results:
        """Runs to the stop time, or until a stop condition ends the run.

        Without a folder, results stay in memory. With one, it gets all files that `maglev run` writes; `report` adds
        report.html. `progress` is called every 50 ms with the simulated time (s); if it raises, the run ends there.

        If the scenario has the key `accuracy`, step and algorithm are chosen first; `results.accuracy` says how.

        A run that fails raises `RunError`, Ctrl-C raises `Interrupted`. Both have `results`: all rows until then.
        """
        if folder is None:
            if report:
                raise ValueError("a report needs a folder")
            with self.start() as simulation:
                return simulation.run(progress=progress)
        folder = Path(folder)
        before = _run(folder)
        try:
            notes = self._native.run_into(folder, report, progress)
        except RunError as error:
            # the folder may have an earlier run, if this one did not start
            if _run(folder) != before:
                error.results = read(folder)
            raise
        except KeyboardInterrupt:
            if _run(folder) == before:
                # before the run itself, while step and algorithm were chosen
                raise
            kept = read(folder)
            raise Interrupted(f"interrupted at {kept.reached} s; the results until then are kept", kept) from None
        results = read(folder)
        results.summary["notes"] = notes
        return results

    def start(self) -> Simulation:
        """Loads and initializes the units, and returns the simulation to step.

        If the scenario has the key `accuracy`, step and algorithm are chosen first, as `choose` does.
        """
        return Simulation(self._native.start())

    def choose(self) -> tuple[Scenario, dict[str, Any]]:
        """The scenario with step and algorithm chosen for its key `accuracy`, and how they were chosen.

        `run` and `start` choose anew each time. Choose once where many variants are run: they then have the same step.
        """
        chosen, report = self._native.choose()
        return Scenario(chosen), json.loads(report)

    # stability

    def modes(self) -> Modes:
        """Modes of the coupled system about its start, as modelled and as stepped, the least damped first."""
        return Modes.parse(self._native.modes())

    def linearize(
        self,
        instance: str | None = None,
        *,
        inputs: Sequence[str] | None = None,
        outputs: Sequence[str] | None = None,
    ) -> StateSpace:
        """The coupled system about its start as a linear system, or one instance on its own: ẋ = A x + B u, y = C x + D u.

        `inputs` and `outputs` choose variables of the coupled system, patterns allowed. An input that is connected gets the
        chosen one in addition. By default these are all inputs without a connection and the recorded outputs.
        """
        if instance is not None:
            if inputs is not None or outputs is not None:
                raise ValueError("inputs and outputs are chosen of the coupled system, not of one instance")
            return StateSpace.of(*self._native.linear_unit(instance))
        names = [None if it is None else list(it) for it in (inputs, outputs)]
        return StateSpace.of(*self._native.linear_system(*names))

    def __repr__(self) -> str:
        values = "".join(f", {name}={value}" for name, value in self.settings.items())
        return f"<Scenario {self.name}{values}>"

    def _repr_html_(self) -> str:
        content = self.content
        experiment = content["experiment"]
        rows = [
            ("units", ", ".join(content["units"])),
            ("instances", ", ".join(content["instances"])),
            ("time", f"{experiment['start']} s to {experiment['stop']} s in steps of {experiment['step']} s"),
            ("algorithm", content["algorithm"]["name"]),
            ("recorded signals", str(len(self.signals))),
            *((name, value) for name, value in self.settings.items()),
        ]
        body = "".join(f"<tr><th style='text-align:left'>{escape(key)}</th><td>{escape(text)}</td></tr>" for key, text in rows)
        return f"<p><b>{escape(content['title'] or self.name)}</b></p><p>{escape(content['description'])}</p><table>{body}</table>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (self._native.json(), self.name, self._native.settings())


def _unpickled(text: str, name: str, settings: list[tuple[str, str]]) -> Scenario:
    native = _native.Scenario.parse(text, Path.cwd(), name)
    for target, value in settings:
        native = native.set(target, value)
    return Scenario(native)


def _run(folder: Path) -> str | None:
    """Identifier of the run whose results are in a folder."""
    try:
        return str(json.loads((folder / "run-files.json").read_text(encoding="utf-8"))["run"])
    except (OSError, ValueError, KeyError):
        return None
