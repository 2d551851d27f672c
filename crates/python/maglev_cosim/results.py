"""Results of runs: signals over time."""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow
    import xarray
    from numpy.typing import NDArray

#: Signals that a notebook shows of one run.
_SHOWN = 40
#: Points of the small curves in a notebook.
_POINTS = 120


def read(folder: str | os.PathLike[str]) -> Results:
    """Reads a results folder of `maglev run`, also of a run that failed or is still running. Texts are left out."""
    table, summary = _native.read_results(Path(folder))
    return Results(table, json.loads(summary) or {}, Path(folder))


class Results:
    """Signals over time, in SI base units, and how the run ended.

    `results["vehicle.gap_01"]` is a NumPy array that shares the memory of the results and is read-only; `results.time` the
    times. pyarrow, pandas, polars and DuckDB take `results` itself by the Arrow PyCapsule interface, without a copy:
    `polars.DataFrame(results)`, `pyarrow.table(results)`.
    """

    def __init__(self, table: _native.Table, summary: dict[str, Any], folder: Path | None = None) -> None:
        self._table = table
        self.summary = summary
        self.folder = folder

    # how it ended

    @property
    def status(self) -> str:
        """`finished`, `stopped` (by a stop condition), `terminated` (by a unit), `interrupted` or `failed`."""
        return str(self.summary.get("status", "running"))

    @property
    def ended_by(self) -> str | None:
        """Why the run ended before its stop time."""
        return self.summary.get("ended_by")

    @property
    def reached(self) -> float:
        """Time at the end (s)."""
        last = float(self.time[-1]) if len(self) else float("nan")
        return float(self.summary.get("reached", last))

    @property
    def notes(self) -> list[str]:
        """What the run assumed or could not do, in sentences. Of a folder that was read, events.csv has them."""
        return list(self.summary.get("notes", []))

    @property
    def accuracy(self) -> dict[str, Any] | None:
        """How step and algorithm were chosen, if the scenario asks for an accuracy: `estimate`, `explanation`, `trials`, …"""
        found: dict[str, Any] | None = self.summary.get("algorithm", {}).get("accuracy")
        return found

    @property
    def metrics(self) -> dict[str, float | None]:
        """Figures of the scenario's objectives and limits, in SI units; None if one is not judged."""
        return {it["name"]: it["value"] for it in self.verdicts}

    @property
    def verdicts(self) -> list[dict[str, Any]]:
        """The figures of `metrics` with bounds, margins and outcomes."""
        return list(self.summary.get("metrics", []))

    # signals

    @property
    def names(self) -> list[str]:
        """Names of the signals."""
        return self._table.names[1:]

    @property
    def units(self) -> dict[str, str]:
        """Units of measure by signal, where they are known."""
        return self._table.units

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the rows (s)."""
        return self["time"]

    def __getitem__(self, name: str) -> NDArray[Any]:
        """The values of a signal. NaN, or None for texts, in rows at which it was not due."""
        if name != "time" and name not in self.names:
            near = difflib.get_close_matches(name, self.names, 1)
            raise KeyError(f'no signal "{name}" is recorded' + (f'; did you mean "{near[0]}"?' if near else ""))
        numbers = self._table.numbers(name)
        if numbers is None:
            return np.array(self._table.texts(name), dtype=object)
        return np.frombuffer(memoryview(numbers)) if len(numbers) else np.empty(0)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self._table)

    # for other libraries

    def __arrow_c_schema__(self) -> object:
        return self._table.__arrow_c_schema__()

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        return self._table.__arrow_c_stream__(requested_schema)

    def to_arrow(self) -> pyarrow.Table:
        """As a table of pyarrow, without a copy. Units of measure are in the metadata of the fields."""
        import pyarrow

        return pyarrow.table(self)

    def to_pandas(self) -> pandas.DataFrame:
        """As a data frame with the time as index. `attrs["units"]` has the units of measure."""
        import pandas

        frame = pandas.DataFrame({name: self[name] for name in self.names}, index=pandas.Index(self.time, name="time"), copy=False)
        frame.attrs["units"] = self.units
        return frame

    def to_polars(self) -> polars.DataFrame:
        """As a data frame of polars, without a copy."""
        import polars

        return polars.DataFrame(self)

    def to_xarray(self) -> xarray.Dataset:
        """As a dataset over `time`. Each variable has its unit of measure as attribute `units`."""
        import xarray

        units = self.units
        variables = {name: ("time", self[name], {"units": units[name]} if name in units else {}) for name in self.names}
        attributes = {key: self.summary[key] for key in ("title", "status") if self.summary.get(key)}
        return xarray.Dataset(variables, coords={"time": ("time", self.time, {"units": "s"})}, attrs=attributes)

    def __repr__(self) -> str:
        return f"<Results: {self.status} at {self.reached} s, {len(self)} rows of {len(self.names)} signals>"

    def _repr_html_(self) -> str:
        end = f", {self.ended_by}" if self.ended_by else ""
        head = f"<p><b>{escape(str(self.summary.get('title') or ''))}</b></p><p>{escape(f'{self.status} at {self.reached:g} s{end}')}</p>"
        cells = "".join(f"<th style='text-align:left'>{text}</th>" for text in ("signal", "", "min", "max", "last", "unit"))
        rows = "".join(self._row(name) for name in self.names[:_SHOWN])
        more = len(self.names) - _SHOWN
        note = f"<p>and {more} more signals</p>" if more > 0 else ""
        return f"{head}<table><tr>{cells}</tr>{rows}</table>{note}"

    def _row(self, name: str) -> str:
        values = self[name]
        unit = escape(self.units.get(name, ""))
        known = values[~np.isnan(values)] if values.dtype == np.float64 else values[:0]
        if len(known) == 0:
            last = escape(str(values[-1])) if len(values) else ""
            return f"<tr><td>{escape(name)}</td><td></td><td></td><td></td><td>{last}</td><td>{unit}</td></tr>"
        numbers = "".join(f"<td>{it:.4g}</td>" for it in (known.min(), known.max(), known[-1]))
        return f"<tr><td>{escape(name)}</td><td>{_curve(known)}</td>{numbers}<td>{unit}</td></tr>"

    def __reduce__(self) -> tuple[Any, ...]:
        units = self.units
        columns = [(name, units.get(name), self[name]) for name in self._table.names]
        return _unpickled, (columns, self.summary, self.folder)


def _unpickled(columns: list[tuple[str, str | None, NDArray[Any]]], summary: dict[str, Any], folder: Path | None) -> Results:
    plain = [(name, unit, values.tolist() if values.dtype == object else values) for name, unit, values in columns]
    return Results(_native.Table.of(plain), summary, folder)


def _curve(values: NDArray[np.float64]) -> str:
    """A small curve as SVG: least and greatest value of each slice."""
    slices = np.array_split(values, min(_POINTS, len(values)))
    points = np.concatenate([[it.min(), it.max()] if it.argmin() < it.argmax() else [it.max(), it.min()] for it in slices])
    low, high = points.min(), points.max()
    scaled = 22 - 20 * (points - low) / (high - low) if high > low else np.full(len(points), 12.0)
    across = np.linspace(1, 139, len(points))
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, scaled))
    return f"<svg width='140' height='24'><polyline points='{path}' fill='none' stroke='#26527c'/></svg>"
