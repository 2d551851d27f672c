"""The systems of stepping.rs in masters that others make: fmpy, libcosim and ecos, all from PyPI.

    cargo bench -p maglev-cli --bench stepping -- --units /tmp/units
    python crates/maglev/benches/others.py /tmp/units

prints us per communication step and unit, nothing recorded, the median of five measurements. fmpy steps
single units, so the master is a loop in Python over its calls, as its own examples do it. libcosim and ecos
step all units in C++; ecos is told a whole span at once, and a step at a time as a user of its Python
interface would, libcosim a whole span. They need `tests/python/requirements.txt`.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "python"))

STEP = 0.001
REPEATS = 5
PORTS = 64


def ring(count):
    names = [f"u{k:02}" for k in range(count)]
    return dict.fromkeys(names, "lag"), [(a, 0, b, 0) for a, b in zip(names, names[1:] + names[:1])]


def star():
    names = [f"u{k:02}" for k in range(PORTS)]
    wires = [(name, 0, "hub", k) for k, name in enumerate(names)]
    wires += [("hub", k, name, 0) for k, name in enumerate(names)]
    return {**dict.fromkeys(names, "lag"), "hub": "hub"}, wires


def ports(unit):
    return PORTS if unit == "hub" else 1


def median(step, count, units):
    """us per step and unit of `step(count)`, after one call to warm up."""
    step(count)
    values = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        step(count)
        values.append((time.perf_counter() - begin) * 1e6 / (count * units))
    return statistics.median(values)


def with_fmpy(folder, units, wires):
    import fmpy
    from fmpy.fmi2 import FMU2Slave

    slaves, links = [], []
    for name, unit in units.items():
        where = tempfile.mkdtemp()
        fmpy.extract(str(folder / f"{unit}.fmu"), where)
        slave = FMU2Slave(guid=unit, unzipDirectory=where, modelIdentifier=unit, instanceName=name)
        slave.instantiate()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        n = ports(unit)
        sources = {into: (source, port) for source, port, target, into in wires if target == name}
        links.append([sources[k] for k in range(n)])
        slaves.append((name, slave, list(range(n)), list(range(n, 2 * n))))

    def step(count):
        values = {name: slave.getReal(outputs) for name, slave, _, outputs in slaves}
        for n in range(count):
            for (_, slave, inputs, _), sources in zip(slaves, links):
                slave.setReal(inputs, [values[name][port] for name, port in sources])
            for _, slave, _, _ in slaves:
                slave.doStep(currentCommunicationPoint=n * STEP, communicationStepSize=STEP)
            for name, slave, _, outputs in slaves:
                values[name] = slave.getReal(outputs)

    yield "fmpy", median(step, max(20_000 // len(units), 200), len(units))


def with_libcosim(folder, units, wires):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_step_size(STEP * 1e9)
    slaves = {
        name: execution.add_local_slave(CosimLocalSlave(str(folder / f"{unit}.fmu"), name))
        for name, unit in units.items()
    }
    for source, output, target, into in wires:
        reference = ports(units[source]) + output
        execution.connect_real_variables(slaves[source], reference, slaves[target], into)
    count = max(50_000 // len(units), 500)
    yield "libcosim", median(lambda n: execution.step(n), count, len(units))


def with_ecos(folder, units, wires):
    from foreign_masters import load_tbb

    load_tbb()
    from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    for name, unit in units.items():
        structure.add_model(name, str(folder / f"{unit}.fmu"))
    for source, output, target, into in wires:
        structure.make_real_connection(f"{source}::y_{output}", f"{target}::u_{into}")
    with EcosSimulation(STEP, structure=structure) as simulation:
        assert simulation.init(0.0), EcosLib.get_last_error()
        count = max(200_000 // len(units), 2000)
        yield "ecos", median(lambda n: simulation.step(n), count, len(units))
        simulation.terminate()


def main():
    folder = Path(sys.argv[1])
    systems = {f"ring of {n}": ring(n) for n in (2, 16, 64)} | {"star of 1 + 64": star()}
    for name, (units, wires) in systems.items():
        for master in (with_fmpy, with_libcosim, with_ecos):
            for label, value in master(folder, units, wires):
                print(f"{name:<16}{label:<10}{value:>9.3f}", flush=True)


if __name__ == "__main__":
    main()
