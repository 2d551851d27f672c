"""Results of real units: Parquet as another reader sees it, and a killed run that goes on."""

import json
import signal
import subprocess
import time

import duckdb
import numpy as np
from conftest import MAGLEV, ROOT, maglev, results

SCENARIO = ROOT / "scenarios" / "one-bogie.json"


def test_crosstool_parquet_holds_the_bits_of_the_table(tmp_path):
    """DuckDB's reader, which shares no code with the writer."""
    maglev("run", SCENARIO, "--out", tmp_path, "--stop", 1.0, "--format", "csv,parquet")
    table = results(tmp_path)
    path = tmp_path / "results.parquet"
    columns = duckdb.sql(f"select * from read_parquet('{path}')").fetchnumpy()
    assert list(columns) == list(table) and len(table["time"]) > 10
    for name, values in table.items():
        assert columns[name].dtype == np.float64
        assert np.array_equal(np.asarray(columns[name]).view(np.uint64), values.view(np.uint64)), name
    pairs = duckdb.sql(f"select key, value from parquet_kv_metadata('{path}')").fetchall()
    units = json.loads(dict(pairs)[b"units"])
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert units == {name: it["unit"] for name, it in summary["signals"].items() if it["unit"]}


def test_crosstool_values_that_are_not_due_are_null(tmp_path):
    scenario = json.loads(SCENARIO.read_text())
    scenario["units"] = {name: str(SCENARIO.parent / path) for name, path in scenario["units"].items()}
    step = scenario["experiment"]["step"]
    scenario["record"] = {
        "interval": step,
        "signals": ["ems_01.force", {"signals": ["vehicle.gap_01"], "interval": 10 * step}],
    }
    (tmp_path / "scenario.json").write_text(json.dumps(scenario))
    maglev("run", tmp_path / "scenario.json", "--out", tmp_path, "--stop", 100 * step, "--format", "parquet")
    query = "select count(*), count(\"ems_01.force\"), count(\"vehicle.gap_01\")"
    counts = duckdb.sql(f"{query} from read_parquet('{tmp_path / 'results.parquet'}')").fetchall()
    assert counts == [(101, 101, 11)]


def test_invariant_a_killed_run_of_the_units_resumes_to_the_same_bytes(tmp_path):
    """Magnet, guideway and vehicle give all of their state: the bytes do not tell of the kills."""
    options = ["--stop", "2", "--format", "csv,parquet", "--checkpoint-every", "0.05", "--quiet", "--out"]
    maglev("run", SCENARIO, *options, tmp_path / "whole")
    out = tmp_path / "out"
    order = ["run", SCENARIO, *options, out]
    killed = 0
    for _ in range(3):
        checkpoint = out / "checkpoint.bin"
        before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
        process = subprocess.Popen([MAGLEV, *map(str, order)])
        while process.poll() is None and not (checkpoint.exists() and checkpoint.stat().st_mtime_ns > before):
            time.sleep(0.001)
        time.sleep(0.005)
        process.kill()
        killed += process.wait() == -signal.SIGKILL
        if not checkpoint.exists():
            break  # it was faster
        order = ["resume", out, "--quiet"]
    assert killed > 0
    if (out / "checkpoint.bin").exists():
        maglev(*order)
    for name in ["results.csv", "results.parquet"] + [p.name for p in out.glob("*.svg")]:
        assert (out / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name
    signals = [json.loads((folder / "summary.json").read_text())["signals"] for folder in (out, tmp_path / "whole")]
    assert signals[0] == signals[1]
