"""Simulations that are stepped by hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from . import _native
from ._errors import Interrupted, RunError
from .results import Results

if TYPE_CHECKING:
    from .scenario import Value


class Simulation:
    """A running co-simulation. `Scenario.start` makes one.

        with maglev.load("one-magnet").start() as simulation:
            while simulation.time < 5:
                simulation.step()
            simulation.set("ems_01.gain_gap_velocity", 20)
            results = simulation.run()

    At the end of the block the units are terminated. It can be used by several threads, one after the other.
    """

    def __init__(self, native: _native.Simulation) -> None:
        self._native = native

    @property
    def time(self) -> float:
        """The time that has been reached (s)."""
        return self._native.time

    @property
    def done(self) -> int:
        """Finished communication steps."""
        return self._native.steps()[0]

    @property
    def remaining(self) -> int:
        """Communication steps until the stop time."""
        return self._native.steps()[1]

    @property
    def status(self) -> str:
        """`started`, `running`, `finished`, `stopped` (by a stop condition), `terminated` (by a unit) or `failed`."""
        return str(json.loads(self._native.outcome())["status"])

    def step(self, count: int = 1) -> Simulation:
        """Makes communication steps, fewer if the run ends."""
        self._native.step(count)
        return self

    def at(self, time: float) -> Simulation:
        """Goes to a time (s): steps forward, or goes back to the latest saved state before it and steps from there.

        The state at the start is always saved, if all units can save their states. Values that `set` changed after the
        saved state are then those of the saved state again.
        """
        self._native.go_to(time)
        return self

    def get(self, name: str) -> Any:
        """The present value of a variable, in its own unit. For a name with ranges or stars: a dict of values by name."""
        values = dict(self._native.get(name))
        return values[name] if list(values) == [name] else values

    def set(self, name: str, value: Value) -> Simulation:
        """Sets a tunable parameter or an unconnected input, from the next step on. The name may have ranges and stars."""
        self._native.set(name, value)
        return self

    def save(self) -> bytes:
        """The present state of all units and couplings. `restore` continues from it, also in another process."""
        return self._native.save()

    def restore(self, state: bytes) -> Simulation:
        """Continues from a state that a simulation of the same scenario has saved. Recorded rows after it are forgotten."""
        self._native.restore(state)
        return self

    def results(self) -> Results:
        """What has been recorded so far."""
        return Results(self._native.table(), json.loads(self._native.outcome()))

    def run(self, *, progress: Callable[[float], object] | None = None) -> Results:
        """Steps to the end, terminates the units, and returns the results. As `Scenario.run` without a folder."""
        try:
            self._native.step(None, progress)
            self._native.close()
        except RunError as error:
            error.results = self._taken()
            raise
        except KeyboardInterrupt:
            kept = self._taken(status="interrupted")
            raise Interrupted(f"interrupted at {kept.reached} s; the results until then are kept", kept) from None
        return self._taken()

    def close(self) -> None:
        """Terminates the units."""
        self._native.close()

    def _taken(self, **changes: Any) -> Results:
        outcome = json.loads(self._native.outcome()) | changes
        return Results(self._native.table(take=True), outcome)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        try:
            self.close()
        except RunError:
            # the first error counts
            if error is None:
                raise

    def __repr__(self) -> str:
        return f"<Simulation at {self.time} s, {self.status}>"
