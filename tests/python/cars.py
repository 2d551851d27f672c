"""Trains of 1 to 32 cars over girders, with a unit for each magnet: CPU time of the start and per step.

The time of a step is the difference of a long and a short run, user and system time of the process with its threads;
the shortest of the repeats counts. The exponent is a least-squares fit over the logarithms.

    python cars.py [--cars 1 2 4 8 16 32] [--stop 0.3] [--step 0.001] [--maglev PATH]
"""

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
UNITS = ROOT / "target/fmu"
MAGNETS_PER_CAR = 32
CAR, SPAN = 12.3, 25.0  # m


def link(source, target):
    return {"from": source, "to": target}


def scenario(folder, cars, step):
    """Writes a scenario of so many cars in the middle of a row of girders, and returns its path."""
    magnets = MAGNETS_PER_CAR * cars
    row = f"[{1:0{max(len(str(magnets)), 2)}d}..{magnets}]"
    spans = int((cars * CAR + 20) / SPAN) + 4
    # the vehicle's file is replaced, the guideway's patched
    train = folder / f"vehicle-{cars}.json"
    train.write_text(json.dumps({"name": f"cars-{cars}", "train": {"cars": cars}}))
    girders = {"magnets": magnets, "spans": [{"girder": "table_3", "count": spans}]}
    units = {
        name: {"fmu": str(UNITS / f"{name}.fmu"), "resources": {f"{name}.json": layout}}
        for name, layout in [("vehicle", train.name), ("guideway", girders)]
    }
    vehicle = {"travel_speed": 5 / 3.6, "initial_position": SPAN * spans / 2}
    inputs = {"gap": "gap", "gap_rate": "gap_rate", "acceleration": "acceleration", "lateral_offset": "lateral_offset"}
    inputs["static_load"] = "static_force"
    links = [link(f"vehicle.{output}_{row}", f"ems_{row}.{name}") for output, name in inputs.items()]
    links += [
        link(f"ems_{row}.force", [f"vehicle.force_{row}", f"guideway.force_{row}"]),
        link(f"ems_{row}.lateral_force", f"vehicle.lateral_force_{row}"),
        link(f"vehicle.position_{row}", f"guideway.position_{row}"),
        link("vehicle.speed", "guideway.speed"),
        link(f"guideway.displacement_{row}", f"vehicle.track_displacement_{row}"),
        link(f"guideway.rate_{row}", f"vehicle.track_rate_{row}"),
    ]
    document = {
        "title": f"{cars} cars over girders",
        "units": {**units, "ems": str(UNITS / "ems.fmu")},
        "instances": {
            "vehicle": {"unit": "vehicle", "parameters": vehicle},
            "guideway": {"unit": "guideway"},
            f"ems_{row}": {"unit": "ems"},
        },
        "connections": links,
        "experiment": {"start": 0, "stop": 1.0, "step": step},
        "algorithm": {
            "name": "gauss-seidel",
            "extrapolation": 2,
            "derivatives": True,
            "order": [f"ems_{row}", "vehicle", "guideway"],
        },
        "record": {"interval": 0.1, "signals": [f"vehicle.gap_{row}"]},
    }
    path = folder / f"{cars}.json"
    path.write_text(json.dumps(document))
    return path


def run(maglev, path, stop):
    """CPU time of a run."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [maglev, "run", path, "--stop", stop, "--out", path.with_suffix(""), "--no-report", "--quiet"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def exponent(points):
    xs, ys = ([math.log(point[k]) for point in points] for k in range(2))
    x, y = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((a - x) * (b - y) for a, b in zip(xs, ys)) / sum((a - x) ** 2 for a in xs)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cars", type=int, nargs="+", default=[1, 2, 4, 8, 16, 32])
    parser.add_argument("--stop", type=float, default=0.3, help="s")
    parser.add_argument("--step", type=float, default=0.001, help="s")
    parser.add_argument("--repeat", type=int, default=3, help="runs, of which the shortest counts")
    parser.add_argument("--maglev", default=ROOT / "target/release/maglev")
    options = parser.parse_args()
    short = 2 * options.step
    steps = round((options.stop - short) / options.step)
    print("| cars | start s | step µs | per car µs |\n|---:|---:|---:|---:|")
    points = []
    with tempfile.TemporaryDirectory() as folder:
        for cars in options.cars:
            path = scenario(Path(folder), cars, options.step)
            times = [[run(options.maglev, path, stop) for stop in (short, options.stop)] for _ in range(options.repeat)]
            start, whole = map(min, zip(*times))
            points.append((cars, (whole - start) / steps))
            micros = points[-1][1] * 1e6
            print(f"| {cars} | {start:.2f} | {micros:.0f} | {micros / cars:.0f} |", flush=True)
    several = [point for point in points if point[0] > 1]
    if len(several) > 1:
        print(f"\nexponent from {several[0][0]} cars on: {exponent(several):.3f}")


if __name__ == "__main__":
    main()
