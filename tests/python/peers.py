"""The same system in five masters at the same step: CPU time and error of each, as a Markdown table.

Every master runs in a process of its own. Its time is the user and system time of that process, threads
included; the start is a run of one step, and the time per step that of the rest. The error is the RMS over
all gaps and communication points of the difference from `maglev` with a twentieth of the step, over the RMS of the
gaps' deviation from the nominal gap.

    python peers.py [--scenario low-speed.json] [--stop 2] [--step 0.001] [--maglev PATH]
"""

import argparse
import csv
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scenario import expand

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
NOMINAL = 0.008
FMPY = """
import sys, fmpy_jacobi
path, stop, step, *signals = sys.argv[1:]
times, rows = fmpy_jacobi.simulate(path, signals, float(stop), float(step), 1e-10)
print(",".join(["time", *signals]))
for time, row in zip(times, rows):
    print(",".join(map(repr, [time, *row])))
"""


def timed(command, environment=None):
    """Standard output and CPU time of a command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=HERE, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))[:300]}\nstatus {done.returncode}\n{done.stderr}")
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return done.stdout, cpu


def gaps(text, after_start):
    """The table without its times; rows of communication points after the start."""
    rows = np.array(list(csv.reader(text.splitlines()))[1:], dtype=float)
    return rows[0 if after_start else 1 :, 1:]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", default="low-speed.json", help="a file in scenarios/ without `extends`")
    parser.add_argument("--stop", type=float, default=2.0, help="s")
    parser.add_argument("--step", type=float, default=0.001, help="s")
    parser.add_argument("--repeat", type=int, default=3, help="runs, of which the shortest counts")
    parser.add_argument("--only", default="", help="masters whose name begins so")
    parser.add_argument("--position", type=float, default=37.5, help="of the vehicle at the start, m")
    parser.add_argument("--maglev", default=ROOT / "target" / "release" / "maglev")
    given = parser.parse_args()
    source = ROOT / "scenarios" / given.scenario
    system = json.loads(source.read_text())
    system["units"] = {k: str((source.parent / file).resolve()) for k, file in system["units"].items()}
    magnets = [name for pattern in system["instances"] for name in expand(pattern) if name.startswith("ems_")]
    numbers = [name.removeprefix("ems_") for name in magnets]
    signals = [f"vehicle.gap_{k}" for k in numbers]
    system["experiment"].update(start=0.0, stop=given.stop, step=given.step)
    system.update(record={"signals": signals, "interval": given.step}, plots=[])
    for key in ["$schema", "ride_quality"]:
        system.pop(key, None)
    if "vehicle" in system["instances"]:
        # the vehicle's own steps end at the communication points
        vehicle = system["instances"]["vehicle"].setdefault("parameters", {})
        # and it stands on the girders from the beginning
        vehicle.update(max_step=max(given.step, 0.001), initial_position=given.position)

    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        path = folder / "system.json"
        path.write_text(json.dumps(system))

        def maglev(stop, *options, step=given.step):
            out = folder / "out"
            command = [given.maglev, "run", path, "--out", out, "--stop", stop, "--step", step]
            command += ["--record-interval", given.step, "--no-report", "--quiet", *options]
            _, cpu = timed(command)
            return (out / "results.csv").read_text(), cpu

        def foreign(master, stop):
            asked = [f"ems_{k}.gap" for k in numbers] if master == "ecos" else signals
            return timed([sys.executable, HERE / "foreign_masters.py", master, path, stop, *asked])

        def fmpy(stop):
            environment = {**os.environ, "PYTHONPATH": str(HERE)}
            return timed([sys.executable, "-c", FMPY, path, stop, given.step, *signals], environment)

        held = ["--algorithm", "jacobi", "--extrapolation", 0]
        masters = {
            "maglev, as shipped (Gauss-Seidel, extrapolation 2)": (maglev, False),
            "maglev, Jacobi, held inputs": (lambda stop: maglev(stop, *held), False),
            "libcosim": (lambda stop: foreign("libcosim", stop), True),
            "ecos": (lambda stop: foreign("ecos", stop), True),
            "fmpy, Jacobi in Python": (fmpy, False),
        }
        reference = gaps(maglev(given.stop, step=given.step / 20)[0], False)
        scale = np.sqrt(np.mean((reference - NOMINAL) ** 2))
        steps = round(given.stop / given.step)
        print(f"{given.scenario}, {given.stop} s, steps of {1e3 * given.step} ms\n")
        print("| master | error | CPU time per step | start | real-time factor by CPU time |")
        print("|---|---:|---:|---:|---:|")
        for name, (run, after_start) in masters.items():
            if not name.startswith(given.only):
                continue
            # the shortest: other programs and threads that wait only add to it
            start = min(run(given.step)[1] for _ in range(given.repeat))
            runs = [run(given.stop) for _ in range(given.repeat)]
            text, cpu = runs[0][0], min(run[1] for run in runs)
            error = np.sqrt(np.mean((gaps(text, after_start) - reference) ** 2)) / scale
            each = (cpu - start) / (steps - 1)
            factor = given.step / each
            print(f"| {name} | {100 * error:.2g} % | {1e6 * each:.0f} µs | {start:.2f} s | {factor:.1f} |")


if __name__ == "__main__":
    main()
