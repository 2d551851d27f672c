"""The scenarios in two co-simulation platforms that others make: libcosim and ecos, both from PyPI.

Both step all units with inputs held over the step (Jacobi) in a step of one size, which is what
`maglev run --algorithm jacobi --extrapolation 0` does. `libcosim(…)` and `ecos(…)` return
(times, one row of `signals` for each) of the communication points after the start. `starts` gives
start values {"instance.variable": value} beyond the scenario's parameters.

    python foreign_masters.py {libcosim,ecos} [--start I.V=X]… SCENARIO.json STOP SIGNAL… > results.csv
"""

import argparse
import ctypes
from importlib import metadata
from pathlib import Path

import fmpy
from scenario import Scenario

NANOSECONDS = 1e9


def split(signals):
    return [signal.split(".") for signal in signals]


def libcosim(path, signals, stop=None, starts=None):
    """The scenario in libcosim, which steps the units in several threads at once."""
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.WARNING)
    scenario = Scenario(path, stop, starts=starts)
    execution = CosimExecution.from_step_size(scenario.step * NANOSECONDS)
    descriptions, slaves, variables = {}, {}, {}
    for name, (file, parameters) in scenario.instances.items():
        if file not in descriptions:
            found = fmpy.read_model_description(str(file)).modelVariables
            descriptions[file] = {v.name: v for v in found}
        variables[name] = descriptions[file]
        slaves[name] = execution.add_local_slave(CosimLocalSlave(str(file), name))
        setters = {
            "Real": execution.real_initial_value,
            "Integer": execution.integer_initial_value,
            "Boolean": execution.boolean_initial_value,
            "String": execution.string_initial_value,
        }
        for variable, value in parameters.items():
            v = variables[name][variable]
            assert setters[v.type](slaves[name], v.valueReference, value), f"{name}.{variable} refused"
    for source, output, target, variable in scenario.wires:
        execution.connect_real_variables(
            slaves[source],
            variables[source][output].valueReference,
            slaves[target],
            variables[target][variable].valueReference,
        )
    observer = CosimObserver.create_time_series(buffer_size=scenario.steps + 1)
    assert execution.add_observer(observer)
    for name, variable in split(signals):
        reference = variables[name][variable].valueReference
        assert observer.start_time_series(slaves[name], reference, CosimVariableType.REAL)
    assert execution.step(scenario.steps), f"libcosim stopped: {execution.status()}"
    columns = []
    for name, variable in split(signals):
        reference = variables[name][variable].valueReference
        # sample 0 is the state before the first step, which the wrapper cannot hand over
        times, _, values = observer.time_series_real_samples(slaves[name], reference, 1, scenario.steps)
        columns.append(list(values))
    times = [time / NANOSECONDS for time in times]
    return times, list(zip(*columns))


def load_tbb():
    """ecos links Intel's TBB; PyPI's wheel lays it beside Python, where the loader does not look."""
    files = metadata.files("tbb") or []
    found = [Path(f.locate()).resolve() for f in files if f.name == "libtbb.so.12"]
    if found:
        ctypes.CDLL(str(found[0]), mode=ctypes.RTLD_GLOBAL)


def ecos(path, signals, stop=None, starts=None):
    """The scenario in ecos."""
    load_tbb()
    from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure

    scenario = Scenario(path, stop, starts=starts)
    structure = EcosSimulationStructure()
    given = {}
    for name, (file, parameters) in scenario.instances.items():
        structure.add_model(name, str(file))
        given.update({f"{name}::{variable}": value for variable, value in parameters.items()})
    structure.add_parameter_set("scenario", given)
    for source, output, target, variable in scenario.wires:
        structure.make_real_connection(f"{source}::{output}", f"{target}::{variable}")
    names = ["::".join(signal) for signal in split(signals)]
    with EcosSimulation(scenario.step, structure=structure) as simulation:
        assert simulation.init(scenario.start, "scenario"), EcosLib.get_last_error()
        times, rows = [], []
        for _ in range(scenario.steps):
            times.append(simulation.step())
            rows.append([simulation.get_real(name) for name in names])
        simulation.terminate()
    return times, rows


def main():
    parser = argparse.ArgumentParser(description="A scenario in a foreign master, as CSV")
    parser.add_argument("--start", action="append", default=[], metavar="INSTANCE.VARIABLE=VALUE")
    parser.add_argument("master", choices=["libcosim", "ecos"])
    parser.add_argument("scenario")
    parser.add_argument("stop", type=float)
    parser.add_argument("signals", nargs="+")
    given = parser.parse_args()
    starts = {name: float(value) for name, value in (start.split("=") for start in given.start)}
    simulate = {"libcosim": libcosim, "ecos": ecos}[given.master]
    times, rows = simulate(given.scenario, given.signals, given.stop, starts)
    print(",".join(["time", *given.signals]))
    for time, row in zip(times, rows):
        print(",".join(map(repr, [time, *row])))


if __name__ == "__main__":
    main()
