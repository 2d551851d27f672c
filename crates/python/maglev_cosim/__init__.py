"""Co-simulation of maglev trains on elevated guideways, and of any FMI 2.0 units.

    import maglev_cosim as maglev

    results = maglev.load("one-bogie").set("ems_*.gain_gap", 6).run()
    results["vehicle.gap_01"].min()

`load` reads a scenario: a file of yours, or one that ships with the package (`scenarios()` lists them). A `Scenario` runs to
its end, or `start`s as a `Simulation` that you step. Both give `Results`: signals over time, as NumPy arrays, Arrow, pandas
and xarray. `System` connects units by hand. `load_study` reads a study: many points of one scenario.
"""

from importlib.metadata import version as _version

from . import _command, _native
from ._errors import BusyError, Error, InputError, Interrupted, RunError
from .linear import Mode, Modes, StateSpace
from .results import Results, read
from .scenario import Scenario, load, scenarios, unit, units
from .simulation import Simulation
from .study import Study, StudyResults, load_study
from .system import System

# isolated units run in processes of the command, since a Python interpreter cannot be one
_native.isolate_in(_command.PROGRAM)

__version__ = _version("maglev-cosim")

__all__ = [
    "BusyError",
    "Error",
    "InputError",
    "Interrupted",
    "Mode",
    "Modes",
    "Results",
    "RunError",
    "Scenario",
    "Simulation",
    "StateSpace",
    "Study",
    "StudyResults",
    "System",
    "load",
    "load_study",
    "read",
    "scenarios",
    "unit",
    "units",
]
