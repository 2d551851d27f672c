"""SSP archives in other masters: libcosim and ecos, both from PyPI.

`libcosim(…)` and `ecos(…)` return (times, one row of `signals` for each) of the communication points after the start.
Both read the archive by themselves: components, connections and values.

    python ssp_masters.py {libcosim,ecos} FILE.ssp STEP STOP SIGNAL… > results.csv
"""

import argparse

from foreign_masters import NANOSECONDS, load_tbb


def libcosim(path, step, stop, signals):
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_ssp_file(str(path), step * NANOSECONDS)
    steps = round(stop / step)
    observer = CosimObserver.create_time_series(buffer_size=steps + 1)
    assert execution.add_observer(observer)
    places = []
    for name, variable in (signal.split(".", 1) for signal in signals):
        slave = execution.slave_index_from_instance_name(name)
        reference = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}[variable]
        places.append((slave, reference))
        assert observer.start_time_series(slave, reference, CosimVariableType.REAL)
    assert execution.step(steps), f"libcosim stopped: {execution.status()}"
    columns = []
    for slave, reference in places:
        times, _, values = observer.time_series_real_samples(slave, reference, 1, steps)
        columns.append(list(values))
    return [time / NANOSECONDS for time in times], list(zip(*columns))


def ecos(path, step, stop, signals):
    load_tbb()
    from ecospy import EcosLib, EcosSimulation

    names = [signal.replace(".", "::", 1) for signal in signals]
    with EcosSimulation(step, ssp_path=str(path)) as simulation:
        # the name that ecos gives to the values in an archive
        assert simulation.init(0.0, "initialValues"), EcosLib.get_last_error()
        times, rows = [], []
        for _ in range(round(stop / step)):
            times.append(simulation.step())
            rows.append([simulation.get_real(name) for name in names])
        simulation.terminate()
    return times, rows


def main():
    parser = argparse.ArgumentParser(description="An SSP archive in a foreign master, as CSV")
    parser.add_argument("master", choices=["libcosim", "ecos"])
    parser.add_argument("archive")
    parser.add_argument("step", type=float)
    parser.add_argument("stop", type=float)
    parser.add_argument("signals", nargs="+")
    given = parser.parse_args()
    simulate = {"libcosim": libcosim, "ecos": ecos}[given.master]
    times, rows = simulate(given.archive, given.step, given.stop, given.signals)
    print(",".join(["time", *given.signals]))
    for time, row in zip(times, rows):
        print(",".join(map(repr, [time, *row])))


if __name__ == "__main__":
    main()
