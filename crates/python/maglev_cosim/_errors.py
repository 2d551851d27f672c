"""Errors. Their text is what the command `maglev` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .results import Results


class Error(Exception):
    """An error of this package.

    `causes` are the messages of the error and its causes, outermost first; `help` says how to fix it, if that is known.
    """

    causes: list[str]
    help: str | None

    def __init__(self, causes: list[str], help: str | None = None) -> None:
        super().__init__(causes, help)
        self.causes = causes
        self.help = help

    def __str__(self) -> str:
        lines = [f"{'  ' * depth}{'because: ' if depth else ''}{text}" for depth, text in enumerate(self.causes)]
        return "\n".join(lines + ([f"help: {self.help}"] if self.help else []))


class InputError(Error, ValueError):
    """A scenario, a value or a file is invalid."""


class RunError(Error, RuntimeError):
    """A run failed. `results` is what it had recorded until then, if it had started."""

    results: Results | None = None


class BusyError(Error, RuntimeError):
    """Another process computes the same points of a study, or a disk is full; try again later."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a run. `results` is what it had recorded until then."""

    results: Results

    def __init__(self, text: str, results: Results) -> None:
        super().__init__(text)
        self.results = results
