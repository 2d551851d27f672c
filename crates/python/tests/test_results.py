"""Results: without a copy, for other libraries, and the same as the command's."""

import csv
import json

import numpy as np
import pandas
import polars
import pyarrow
import pytest
from conftest import command

import maglev_cosim as maglev


def address(array):
    return array.__array_interface__["data"][0]


def test_invariant_numpy_and_arrow_share_the_memory(magnet):
    results = magnet.run()
    gap = results["vehicle.gap_01"]
    assert address(gap) == address(results["vehicle.gap_01"])
    column = results.to_arrow().column("vehicle.gap_01").chunk(0)
    assert column.buffers()[1].address == address(gap)
    assert polars.DataFrame(results)["vehicle.gap_01"].to_numpy().tolist() == gap.tolist()
    with pytest.raises(ValueError, match="read-only"):
        gap[0] = 1
    # an array keeps the memory alive
    copy = gap.copy()
    del results, column
    assert (gap == copy).all()


def test_invariant_values_are_those_of_the_command_bit_for_bit(magnet, tmp_path):
    path = tmp_path / "scenario.json"
    path.write_text(json.dumps(magnet.content))
    command("run", path, "--set", "ems_01.gain_gap=6", "--out", tmp_path / "there", "--no-report")
    with open(tmp_path / "there" / "results.csv", newline="") as file:
        header, *rows = csv.reader(file)
    there = np.array(rows, dtype=float).T
    scenario = magnet.set("ems_01.gain_gap", 6)
    for results in (scenario.run(), scenario.run(tmp_path / "here")):
        assert ["time", *results.names] == header
        assert all(results[name].tobytes() == column.tobytes() for name, column in zip(header, there))
    assert (tmp_path / "here" / "results.csv").read_bytes() == (tmp_path / "there" / "results.csv").read_bytes()


def test_issue_a_folder_has_all_files_and_can_be_read_again(magnet, tmp_path):
    results = magnet.run(tmp_path / "out", report=True)
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"results.csv", "events.csv", "summary.json", "report.html", "gap-and-deflection.svg"} <= files
    again = maglev.read(tmp_path / "out")
    assert again.status == results.status == "finished" and again.folder == tmp_path / "out"
    assert again.summary["signals"]["vehicle.gap_01"]["min"] == again["vehicle.gap_01"].min()
    with pytest.raises(maglev.InputError, match="not a results folder"):
        maglev.read(tmp_path)


def test_invariant_every_library_gets_the_same_numbers(magnet):
    results = magnet.run()
    frame, dataset, table = results.to_pandas(), results.to_xarray(), results.to_arrow()
    assert frame.index.name == "time" and frame.attrs["units"]["vehicle.gap_01"] == "m"
    assert dataset["vehicle.gap_01"].attrs["units"] == "m" and dataset.attrs["status"] == "finished"
    assert table.schema.field("vehicle.gap_01").metadata == {b"unit": b"m"}
    assert table.schema == pyarrow.schema(results)
    for name in results.names:
        values = results[name].tolist()
        assert frame[name].tolist() == dataset[name].values.tolist() == table[name].to_pylist() == values
    assert pandas.DataFrame.from_arrow(results)["time"].tolist() == results.time.tolist()


def test_issue_rows_in_which_a_signal_is_not_due_are_null(magnet):
    signals = ["vehicle.gap_01", {"signals": ["ems_01.force"], "interval": 0.01}]
    results = magnet.change({"record": {"signals": signals}}).run()
    table = results.to_arrow()
    assert (table["ems_01.force"].null_count, table["vehicle.gap_01"].null_count) == (90, 0)
    assert np.isnan(results["ems_01.force"]).sum() == 90
    assert np.isfinite(results["ems_01.force"][::10]).all()
    assert "ems_01.force" in results._repr_html_()


def test_issue_texts_are_recorded(magnet):
    results = magnet.record("vehicle.gap_01", "guideway.irregularity_file").run()
    assert results["guideway.irregularity_file"].tolist() == [""] * 101
    assert results.to_arrow()["guideway.irregularity_file"].to_pylist() == [""] * 101
    assert "irregularity_file" in results._repr_html_()


def test_issue_figures_of_a_run_in_memory_are_those_of_a_folder(magnet, tmp_path):
    scenario = magnet.change(
        {
            "objectives": {"gap_rms": {"signal": "vehicle.gap_01", "figure": "rms"}},
            "limits": {"least_gap": {"signal": "vehicle.gap_01", "figure": "min", "min": 0.004}},
        }
    )
    there, here = scenario.run(tmp_path), scenario.run()
    assert here.metrics == there.metrics and list(here.metrics) == ["gap_rms", "least_gap"]
    assert here.verdicts == there.verdicts and here.verdicts[1]["outcome"] == "passed"
    assert here.metrics["least_gap"] == here["vehicle.gap_01"].min()


def test_issue_notes_on_the_run_are_kept(tmp_path):
    alone = maglev.load(maglev.unit("ems"))
    expected = ["running this unit alone from 0 s to 10 s in steps of 0.001 s"]
    assert alone.run().notes == alone.run(tmp_path).notes == expected
    # other times were not completed from the unit
    assert alone.times(stop=0.01).run().notes == []


def test_refusal_signals_that_are_not_recorded(magnet):
    with pytest.raises(KeyError, match='did you mean "vehicle.gap_01"'):
        magnet.run()["vehicle.gap_1"]


def test_issue_notebooks_show_results(magnet):
    html = magnet.run()._repr_html_()
    assert html.count("<svg") == 8 and "finished at 0.1 s" in html and "vehicle.gap_01" in html
