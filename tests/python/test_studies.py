"""`maglev study` with our units: what the guide says, layouts, and the statistics of the irregularity."""

import csv
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import MAGLEV, ROOT, UNITS, maglev

DOCS = ROOT / "docs"
CLUSTER = ROOT / "examples" / "cluster"


def page_blocks(page, language):
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def rows(folder):
    with open(Path(folder) / "metrics.csv", newline="") as file:
        return list(csv.DictReader(file))


def write(path, content):
    path.write_text(json.dumps(content))
    return path


@pytest.fixture
def track(tmp_path):
    """A scenario of 50 m of rough track alone, at 1 m/s."""
    guideway = {"unit": "guideway", "parameters": {"irregularity_on": True, "irregularity_averaged": False}, "start": {"speed": 1.0}}
    ramp = {"type": "ramp", "start": 0, "end": 50, "from": 20, "to": 70}
    write(
        tmp_path / "track.json",
        {
            "units": {"guideway": str(UNITS / "guideway-one-magnet.fmu")},
            "instances": {"guideway": guideway},
            "inputs": [{"to": "guideway.position_01", "signal": ramp}],
            "experiment": {"stop": 50, "step": 0.1},
        },
    )
    return tmp_path


def test_rms_of_the_irregularity_is_distributed_as_theory_says(track):
    """Mean and variance over seeds of the mean square over 50 m, for a Gaussian profile of the one-sided density A/W²:
    E = ∫S dW, Var = 4/L²·∫(L - t)·R(t)² dt with the correlation R(t) = ∫S·cos(Wt) dW."""
    study = {
        "scenario": "track.json",
        "factors": {"seed": {"target": "guideway.irregularity_seed", "seeds": 400}},
        "objectives": {"rms": {"signal": "guideway.irregularity_01", "figure": "rms"}},
    }
    maglev("study", "run", write(track / "study.json", study), "--quiet", "--out", track / "out")
    square = np.array([float(row["rms"]) for row in rows(track / "out")]) ** 2
    length, waves = 50.0, np.linspace(2 * np.pi / 50, 2 * np.pi / 0.5, 20001)
    density = 7e-7 / waves**2
    mean = np.trapezoid(density, waves)
    lag = np.linspace(0, length, 2001)
    correlation = np.array([np.trapezoid(density * np.cos(waves * t), waves) for t in lag])
    deviation = np.sqrt(4 / length**2 * np.trapezoid((length - lag) * correlation**2, lag))
    # four standard errors; that of the deviation is wider than of a normal distribution, by its long tail
    assert abs(square.mean() - mean) < 4 * deviation / np.sqrt(400)
    assert abs(square.std(ddof=1) / deviation - 1) < 0.25
    # seeds are independent: neighbours do not correlate
    assert abs(np.corrcoef(square[:-1], square[1:])[0, 1]) < 4 / np.sqrt(400)


def test_a_key_of_a_layout_is_a_factor(tmp_path):
    """The frequency of a girder from its layout, as a figure finds it."""
    study = {
        "scenario": str(ROOT / "scenarios" / "one-magnet.json"),
        "factors": {
            "stop": {"target": {"key": "experiment.stop"}, "values": [0.05]},
            "length": {"target": {"unit": "guideway", "file": "guideway.json", "key": "girders.table_3.length"}, "values": [25, 30]},
        },
        "objectives": {"fl": {"quantity": "frequency_times_span"}},
    }
    maglev("study", "run", write(tmp_path / "study.json", study), "--quiet", "--out", tmp_path / "out")
    # the layout gives 7.1 Hz
    for row in rows(tmp_path / "out"):
        assert row["status"] == "finished"
        assert float(row["fl"]) == pytest.approx(7.1 * float(row["length"]), rel=1e-12)


def test_dataset_has_the_rows_of_the_table(track):
    duckdb = pytest.importorskip("duckdb")
    study = {
        "scenario": "track.json",
        "factors": {
            "seed": {"target": "guideway.irregularity_seed", "seeds": 3},
            "averaged": {"target": "guideway.irregularity_averaged", "values": [True, False]},
            "amplitude": {"target": "guideway.irregularity_amplitude", "distribution": {"lognormal": {"median": 7e-7, "sigma": 0.2}}},
        },
        "design": {"kind": "sobol", "points": 4},
        "objectives": {"rms": {"signal": "guideway.irregularity_01", "figure": "rms"}},
        "keep": {"signals": ["guideway.irregularity_01"]},
    }
    out = track / "out"
    maglev("study", "run", write(track / "study.json", study), "--quiet", "--out", out)
    table = rows(out)
    assert len(table) == 12
    select = f"SELECT point, seed, averaged, amplitude, status, rms, run FROM read_parquet('{out}/dataset/*/*.parquet', hive_partitioning=true) ORDER BY point"
    for row, (point, seed, averaged, amplitude, status, rms, run) in zip(table, duckdb.sql(select).fetchall(), strict=True):
        assert (int(row["point"]), int(row["seed"]), row["averaged"], row["status"], row["run"]) == (point, seed, averaged, status, run)
        assert (float(row["amplitude"]), float(row["rms"])) == (amplitude, rms)
    # the figure follows from the kept signal
    select = f'SELECT run, sqrt(avg("guideway.irregularity_01" ** 2)) FROM read_parquet(\'{out}/signals/*/*.parquet\', hive_partitioning=true) GROUP BY run'
    found = dict(duckdb.sql(select).fetchall())
    for row in table:
        assert found[row["run"]] == pytest.approx(float(row["rms"]), rel=0.02)


def shortened_scenarios(folder):
    """The scenario of the guide's study beside it, cut short."""
    base = json.loads((ROOT / "scenarios" / "one-bogie.json").read_text())
    base["units"] = {name: str(UNITS / Path(unit).name) for name, unit in base["units"].items()}
    base["experiment"]["stop"] = 0.2
    (folder / "scenarios").mkdir()
    write(folder / "scenarios" / "one-bogie.json", base)
    (text,) = page_blocks("studies.md", "json")
    (folder / "scenarios" / "speed-and-gain.json").write_text(text)


@pytest.mark.parametrize("page", ["studies.md", "cluster.md"])
def test_commands_of_the_pages_run(page, tmp_path):
    """As they are printed, in order. The study is cut short."""
    shortened_scenarios(tmp_path)
    lines = "".join(page_blocks(page, "sh")).replace("\\\n", " ").splitlines()
    for line in lines:
        command = shlex.split(line, comments=True)
        if command:
            assert command[0] == "maglev"
            done = subprocess.run([MAGLEV, *command[1:]], cwd=tmp_path, capture_output=True, text=True, timeout=300)
            assert done.returncode == 0, f"{line}\n{done.stderr}"
    if page == "studies.md":
        found = rows(tmp_path / "results" / "speed-and-gain")
        assert [row["speed"] for row in found] == [str(v) for v in (5, 10, 20, 40, 80) for _ in range(2)]
        (shown, *_) = page_blocks(page, "text")
        assert shown.splitlines()[0] == ",".join(found[0])
    else:
        # the parts and the whole agree, byte for byte
        maglev("study", "run", tmp_path / "scenarios" / "speed-and-gain.json", "--quiet", "--out", tmp_path / "whole")
        for name in ("metrics.csv", "dataset/chunk=0/points.parquet"):
            assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "results" / "shared" / name).read_bytes()


def environment():
    """The `PATH` with `maglev`."""
    return os.environ | {"PATH": f"{MAGLEV.parent}:{Path(sys.executable).parent}:{os.environ['PATH']}"}


def test_slurm_array_computes_all_points(tmp_path):
    """Tasks as Slurm starts them, by their environment; one is started twice."""
    shortened_scenarios(tmp_path)
    study, out = tmp_path / "scenarios" / "speed-and-gain.json", tmp_path / "out"
    for task in (5, 6, 7, 6):
        slurm = {"SLURM_ARRAY_TASK_ID": str(task), "SLURM_ARRAY_TASK_MIN": "5", "SLURM_ARRAY_TASK_COUNT": "3", "SLURM_CPUS_PER_TASK": "1"}
        done = subprocess.run(["bash", CLUSTER / "slurm.sh", study, out], env=environment() | slurm, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
    assert len(list((out / "journal").glob("points-*.jsonl"))) == 3
    maglev("study", "merge", out)
    assert [row["point"] for row in rows(out)] == [str(k) for k in range(1, 11)]


def test_snakefile_computes_all_points(tmp_path):
    snakemake = shutil.which("snakemake", path=environment()["PATH"])
    assert snakemake, "install tests/python/requirements.txt"
    shortened_scenarios(tmp_path)
    config = ["study=scenarios/speed-and-gain.json", "out=out", "parts=4"]
    command = [snakemake, "--snakefile", CLUSTER / "Snakefile", "--cores", "2", "--config", *config]
    done = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert len(rows(tmp_path / "out")) == 10


def test_dakota_driver_answers_as_dakota_expects(tmp_path):
    """Called as Dakota calls it, with a parameters file of the standard format. Then a run that cannot start."""
    shortened_scenarios(tmp_path)
    scenario = json.loads((tmp_path / "scenarios" / "one-bogie.json").read_text())
    scenario["objectives"] = {
        "deflection": {"signal": "guideway.midspan_displacement_01", "figure": "max_abs"},
        "gap": {"signal": "vehicle.gap_[01..08]", "figure": "max"},
    }
    write(tmp_path / "scenario.json", scenario)
    parameters = """\
                                          2 variables
                      {speed} vehicle.travel_speed
                      7.000000000000000e+00 ems_*.gain_gap
                                          2 functions
                                          1 ASV_1:deflection
                                          1 ASV_2:gap
                                          2 derivative_variables
                                          1 DVV_1:vehicle.travel_speed
                                          2 DVV_2:ems_*.gain_gap
                                          0 analysis_components
                                          1 eval_id
"""

    def call(speed):
        (tmp_path / "params.in").write_text(parameters.format(speed=speed))
        command = [sys.executable, CLUSTER / "driver.py", "params.in", "results.out"]
        subprocess.run(command, cwd=tmp_path, env=environment(), check=True, capture_output=True, timeout=300)
        return (tmp_path / "results.out").read_text()

    lines = [line.split() for line in call("1.388888888888889e+00").splitlines()]
    assert [name for _, name in lines] == ["deflection", "gap"]
    assert 0.007 < float(lines[1][0]) < 0.009
    assert call("1e9999") == "FAIL\n"
