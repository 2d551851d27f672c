"""Modes and linear models of coupled systems."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas
    from numpy.typing import NDArray

#: Modes that a notebook shows.
_SHOWN = 12


@dataclass(frozen=True)
class Mode:
    """One mode of a coupled system. Times are in seconds."""

    #: |λ|/2π (Hz)
    frequency: float
    #: −Re λ/|λ|; negative: it grows
    damping: float
    #: λ (1/s), the one with positive imaginary part of a pair
    eigenvalue: complex
    #: The same mode as the coupling steps it, if one was found: its eigenvalue ln z/h (1/s)
    stepped: complex | None
    #: Shares of the instances, the largest first
    participation: dict[str, float]


@dataclass(frozen=True)
class Modes:
    """Modes of a coupled system about its start, the least damped first."""

    modes: list[Mode]
    #: Whether every mode as modelled decays
    stable: bool
    #: Whether every mode as stepped decays, those of the coupling included
    stepped_stable: bool
    #: Everything that `maglev modes --json` prints
    report: dict[str, Any]

    @staticmethod
    def parse(text: str) -> Modes:
        """Reads the report of the command."""
        report = json.loads(text)

        def number(it: dict[str, float] | None) -> complex | None:
            return None if it is None else complex(it["real"], it["imaginary"])

        modes = [
            Mode(
                it["continuous"]["frequency_hz"],
                it["continuous"]["damping_ratio"],
                complex(it["continuous"]["real"], it["continuous"]["imaginary"]),
                number(it.get("stepped")),
                it["participation"],
            )
            for it in report["modes"]
        ]
        return Modes(modes, report["stable"], report["stepped_stable"], report)

    def __len__(self) -> int:
        return len(self.modes)

    def __iter__(self) -> Iterator[Mode]:
        return iter(self.modes)

    def __getitem__(self, place: int) -> Mode:
        return self.modes[place]

    def oscillating(self, *, above: float = 0.0) -> list[Mode]:
        """The modes that oscillate, and those that grow, above a frequency (Hz)."""
        return [it for it in self.modes if it.frequency > above and (it.eigenvalue.imag > 0 or it.eigenvalue.real > 0)]

    def to_pandas(self) -> pandas.DataFrame:
        """As a data frame: frequency (Hz), damping, eigenvalues (1/s), the largest participants."""
        import pandas

        rows = [(it.frequency, it.damping, it.eigenvalue, it.stepped, _parts(it)) for it in self.modes]
        return pandas.DataFrame(rows, columns=["frequency", "damping", "eigenvalue", "stepped", "participation"])

    def __repr__(self) -> str:
        return f"<Modes: {len(self)}, {'stable' if self.stable else 'unstable'}, as stepped {'stable' if self.stepped_stable else 'unstable'}>"

    def _repr_html_(self) -> str:
        head = "".join(f"<th style='text-align:left'>{text}</th>" for text in ("Hz", "damping", "eigenvalue (1/s)", "participation"))
        rows = "".join(
            f"<tr><td>{it.frequency:.4f}</td><td>{it.damping:.4f}</td>"
            f"<td>{it.eigenvalue.real:.4g} ± {it.eigenvalue.imag:.4g} i</td><td>{escape(_parts(it))}</td></tr>"
            for it in self.modes[:_SHOWN]
        )
        return f"<p>{escape(repr(self)[1:-1])}</p><table><tr>{head}</tr>{rows}</table>"


def _parts(mode: Mode) -> str:
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in list(mode.participation.items())[:4])


@dataclass(frozen=True)
class StateSpace:
    """ẋ = A x + B u, y = C x + D u: small motions about a point, in SI base units of the variables."""

    A: NDArray[np.float64]
    B: NDArray[np.float64]
    C: NDArray[np.float64]
    D: NDArray[np.float64]
    #: Names of the states
    states: list[str]
    #: Names of the inputs
    inputs: list[str]
    #: Names of the outputs
    outputs: list[str]
    #: Units of measure of inputs and outputs, where they are known
    units: dict[str, str]

    @staticmethod
    def of(
        matrices: Sequence[tuple[int, int, Any]],
        states: list[str],
        inputs: list[tuple[str, str | None]],
        outputs: list[tuple[str, str | None]],
    ) -> StateSpace:
        """Makes a system of the buffers of its matrices, row after row."""
        a, b, c, d = (np.frombuffer(memoryview(data)).reshape(rows, columns) if rows * columns else np.zeros((rows, columns)) for rows, columns, data in matrices)
        units = {name: unit for name, unit in [*inputs, *outputs] if unit is not None}
        return StateSpace(a, b, c, d, states, [name for name, _ in inputs], [name for name, _ in outputs], units)

    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of A (1/s)."""
        return np.linalg.eigvals(self.A).astype(np.complex128)

    def response(self, frequencies: NDArray[np.float64] | Sequence[float]) -> NDArray[np.complex128]:
        """The frequency response C (iω − A)⁻¹ B + D at frequencies (Hz): an array of frequencies × outputs × inputs."""
        identity = np.eye(len(self.A))
        at = [self.C @ np.linalg.solve(2j * np.pi * f * identity - self.A, self.B) + self.D for f in frequencies]
        return np.array(at, dtype=np.complex128)

    def __repr__(self) -> str:
        return f"<StateSpace: {len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs>"
