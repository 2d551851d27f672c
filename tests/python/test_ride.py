"""Ride quality in summary.json against scipy: the analogue filters of ISO 2631-1 integrated in time."""

import json

import numpy as np
import scipy.signal
from conftest import ROOT, maglev, results

SCENARIO = ROOT / "scenarios" / "one-bogie.json"
VERTICAL = "vehicle.car_1_vertical_acceleration_01"


def weighting_wk():
    """W_k as ISO 2631-1, annex A, has it, in p = jω."""
    w = 2 * np.pi
    f1, f2, f3, q4, f5, q5, f6, q6 = 0.4, 100.0, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91

    def second(f, q):
        return np.poly1d([1 / (w * f) ** 2, 1 / (q * w * f), 1])

    high = np.poly1d([1 / (w * f1) ** 2, 0, 0])
    above = high * np.poly1d([1 / (w * f3), 1]) * second(f5, q5) * (f5 / f6) ** 2
    below = second(f1, 0.5**0.5) * second(f2, 0.5**0.5) * second(f3, q4) * second(f6, q6)
    return scipy.signal.TransferFunction(above.coeffs, below.coeffs).to_ss()


def test_crosstool_ride_quality_is_that_of_the_filters_in_time(tmp_path):
    """The recorded samples, resampled to 2 kHz without content above half their rate, drive the filters."""
    scenario = json.loads(SCENARIO.read_text())
    scenario["units"] = {name: str(SCENARIO.parent / path) for name, path in scenario["units"].items()}
    scenario["record"] = {"interval": 0.005, "signals": [VERTICAL]}
    scenario["ride_quality"] = [{"name": "middle", "vertical": VERTICAL, "from": 1.0}]
    scenario["plots"] = []
    (tmp_path / "scenario.json").write_text(json.dumps(scenario))
    rough = ["--stop", 10.0, "--set", "guideway.irregularity_on=true"]
    maglev("run", tmp_path / "scenario.json", "--out", tmp_path / "out", *rough)
    table = results(tmp_path / "out")
    fine, rate = 10, 200.0
    samples = scipy.signal.resample_poly(table[VERTICAL], fine, 1)[: (len(table["time"]) - 1) * fine + 1]
    times = np.arange(len(samples)) / (fine * rate)
    _, weighted, _ = scipy.signal.lsim(weighting_wk(), samples, times)
    judged = weighted[int(fine * rate) :]
    second = np.ones(int(fine * rate)) / (fine * rate)
    expected = {
        "weighted_rms": np.sqrt(np.mean(judged**2)),
        "maximum_transient": np.sqrt(np.convolve(judged**2, second, "valid").max()),
        "vibration_dose": (np.sum(judged**4) / (fine * rate)) ** 0.25,
        "weighted_peak": np.abs(judged).max(),
    }
    [point] = json.loads((tmp_path / "out" / "summary.json").read_text())["ride_quality"]["points"]
    assert expected["weighted_rms"] > 1e-4
    for key, value in expected.items():
        # ten times as many samples see peaks and ends a little better: below 1e-3; lsim's hold, 1e-4
        assert abs(point["vertical"][key] / value - 1) < 2e-3, (key, point["vertical"][key], value)
    assert point["comfort"] == ["not uncomfortable"]
