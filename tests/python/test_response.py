"""`maglev response` against python-control and against runs.

The model of one magnet under a girder is set up here from the equations of docs/physics.md, not from the
units; python-control computes its responses and margins.
"""

import json

import control
import numpy as np
import pytest
from conftest import ROOT, maglev, results

MASS, GAP, CURRENT, RESISTANCE = 250.0, 0.008, 24.0, 0.6
INDUCTANCE = 4e-7 * np.pi * 400**2 * 0.036 / (2 * GAP)
KI = INDUCTANCE * CURRENT / GAP
KC = KI * CURRENT / GAP
LENGTH, POLE, CHIRP = 25.0, 0.65, 6.25
MODAL_MASS = 0.5 * LENGTH * 22000 * 1.24 / 9.81
GIRDER = [(7.1, 0.0108), (24.9, 0.0241)]
GAINS = dict(acceleration=7, velocity=40, position=4, gap_velocity=40, gap=7)
# The units' numbers differ from these in the last digits only; the rest is rounding.
TOLERANCE = 1e-6


def magnet_under_girder():
    """From (voltage added, chirp force) to (voltage, gap); states x1 ... x5, flux, z, z', q, q'."""
    n = 8 + 2 * len(GIRDER)
    unit = np.eye(n)
    x1, x2, x3, x4, x5, flux, z, rate = unit[:8]
    q, q_rate = unit[8 : 8 + len(GIRDER)], unit[8 + len(GIRDER) :]
    orders = np.arange(1, len(GIRDER) + 1)
    shape = np.sin(orders * np.pi / 2) * np.sinc(orders * POLE / (2 * LENGTH))
    shaken = np.sin(orders * np.pi * CHIRP / LENGTH)
    force = KI / INDUCTANCE * flux
    gap = shape @ q - z
    u1, u2 = 250 * gap, 0.25 * -force / MASS
    y3 = x2 - x3 - x4 + u2
    voltage = (
        GAINS["acceleration"] * y3 + GAINS["velocity"] * x4 + GAINS["position"] * x5
        + GAINS["gap_velocity"] * x2 + GAINS["gap"] * x1
    )
    a = [
        100 * x2,
        -1e4 * x1 - 1e3 * x2 + 1e4 * u1,
        -10 * x2 + 10 * x4,
        10 * x2 - 10 * x3 - 10 * x4 + 10 * u2,
        100 * x4 - 10 * x5 + 10 * u1,
        voltage - RESISTANCE * (flux / INDUCTANCE + KC / KI * gap),
        rate,
        force / MASS,
        *q_rate,
    ]
    b = np.zeros((n, 2))
    b[5, 0] = 1.0
    for k, (frequency, damping) in enumerate(GIRDER):
        omega = 2 * np.pi * frequency
        a.append(-2 * damping * omega * q_rate[k] - omega**2 * q[k] - shape[k] / MODAL_MASS * force)
        b[8 + len(GIRDER) + k, 1] = -shaken[k] / MODAL_MASS
    return np.array(a), b, np.array([voltage, gap])


def voltage_loop():
    """L, broken at the voltage, of the sign with which 1 + L = 0 at a pole of the closed loop."""
    a, b, c = magnet_under_girder()
    return control.ss(a - np.outer(b[:, 0], c[0]), b[:, :1], -c[:1], 0)


def response(*options, status=0):
    done = maglev("response", *options, "--json", status=status)
    return json.loads(done.stdout)


def values(curve):
    return np.array(curve["frequency_hz"]), np.array(curve["real"]) + 1j * np.array(curve["imaginary"])


def test_crosstool_the_response_of_one_magnet_is_that_of_python_control():
    found = response(
        ROOT / "scenarios" / "one-magnet.json", "--from", "guideway.chirp_force", "--to", "vehicle.gap_01"
    )
    assert found["stable"]
    (one,) = found["responses"]
    assert one["unit"] == "m/N"
    frequency, value = values(one["curve"])
    a, b, c = magnet_under_girder()
    system = control.ss(a, b[:, 1:], c[1:], 0)
    wanted = np.array([system(2j * np.pi * f) for f in frequency]).ravel()
    assert np.abs(value - wanted).max() < TOLERANCE * np.abs(wanted).max()
    assert np.all(np.abs(value - wanted) < 1e-4 * np.abs(wanted))
    # the peak is refined between the frequencies
    dense = np.linspace(one["peak"][1] - 0.01, one["peak"][1] + 0.01, 2001)
    largest = max(abs(system(2j * np.pi * f)) for f in dense)
    assert one["peak"][0] == pytest.approx(largest, rel=1e-6)


def check_margins(found, loop):
    """Margins of one loop against python-control."""
    margins = found["loops"]["single"][0]["margins"]
    gains, phases, modulus, at_gain, at_phase, at_modulus = control.stability_margins(loop, returnall=True)
    found_gains = [gain for _, gain in found["loops"]["single"][0]["critical"]]
    print("maglev", margins, "python-control", gains, phases, modulus)
    for gain in gains:
        assert min(abs(gain / other - 1) for other in found_gains) < 1e-5, (gain, found_gains)
    smallest = np.argmin(np.abs(phases))
    assert margins["phase"]["degrees"] == pytest.approx(abs(phases[smallest]), rel=1e-5)
    assert margins["phase"]["frequency_hz"] == pytest.approx(at_phase[smallest] / (2 * np.pi), rel=1e-5)
    assert margins["modulus"]["value"] == pytest.approx(np.min(modulus), rel=1e-5)
    delays = np.radians(np.asarray(phases) % 360) / at_phase
    assert margins["delay"]["seconds"] == pytest.approx(np.min(delays), rel=1e-5)


def test_crosstool_the_margins_of_one_magnet_are_those_of_python_control():
    found = response(ROOT / "scenarios" / "one-magnet.json", "--loop", "ems_01.voltage")
    loop = voltage_loop()
    loops = found["loops"]
    growing = int(np.sum(loop.poles().real > 1e-9))
    assert (loops["open_growing"], loops["closed_growing"]) == (growing, 0)
    assert loops["encirclements"] == pytest.approx(-growing, abs=1e-6)
    check_margins(found, loop)
    frequency, value = values(loops["single"][0]["curve"])
    wanted = np.array([loop(2j * np.pi * f) for f in frequency]).ravel()
    assert np.abs(value - wanted).max() < TOLERANCE * np.abs(wanted).max()


def test_crosstool_a_digital_controller_has_the_margins_of_python_control():
    found = response(
        ROOT / "scenarios" / "one-magnet.json", "--loop", "ems_01.voltage", "--hold", 0.001, "--delay", 1
    )
    loop = control.c2d(voltage_loop(), 0.001, "zoh")
    delayed = loop * control.ss([[0.0]], [[1.0]], [[1.0]], [[0.0]], 0.001)
    # as samples: polynomials of z with fourteen zeros near 1 have none of their digits right
    omega = np.geomspace(0.1, 3141, 4000)
    value = np.array([delayed(np.exp(0.001j * w)) for w in omega]).ravel()
    check_margins(found, (np.abs(value), np.degrees(np.unwrap(np.angle(value))), omega))


def test_analytic_at_the_margins_the_loop_is_on_the_border():
    """The gain factors of `critical` put a closed pole on the imaginary axis, as does the delay margin."""
    found = response(ROOT / "scenarios" / "one-magnet.json", "--loop", "ems_01.voltage")
    loop = voltage_loop()
    for frequency, gain in found["loops"]["single"][0]["critical"]:
        poles = np.linalg.eigvals(loop.A - gain * loop.B @ loop.C)
        assert np.abs(poles - 2j * np.pi * frequency).min() < 1e-5 * (1 + 2 * np.pi * frequency)
    delay = found["loops"]["single"][0]["margins"]["delay"]
    s = 2j * np.pi * delay["frequency_hz"]
    assert abs(1 + loop(s).item() * np.exp(-s * delay["seconds"])) < 1e-6


def transfer_of_run(signals, source, answer, low, high):
    """Spectrum of the answer over that of the source, of signals that have come to rest at the end."""
    spectrum = np.fft.rfft(signals[answer] - signals[answer][0]) / np.fft.rfft(signals[source])
    frequency = np.fft.rfftfreq(len(signals["time"]), signals["time"][1])
    inside = (low < frequency) & (frequency < high)
    return frequency[inside], spectrum[inside]


def test_analytic_one_magnet_answers_the_chirp_as_predicted(tmp_path):
    signals = ["vehicle.gap_01", "guideway.midspan_displacement_01", "ems_01.force"]
    scenario = {
        "extends": str(ROOT / "scenarios" / "one-magnet.json"),
        "record": {"signals": [*signals, "guideway.chirp_force"]},
        "plots": [],
    }
    file = tmp_path / "chirp.json"
    file.write_text(json.dumps(scenario))
    maglev(
        "run", file, "--out", tmp_path / "run", "--stop", 24, "--no-report",
        "--set", "guideway.chirp_end_frequency=12",
    )
    run = results(tmp_path / "run")
    found = response(
        ROOT / "scenarios" / "one-magnet.json", "--from", "guideway.chirp_force", "--band", "1:20",
        "--per-decade", 2000, *[word for name in signals for word in ("--to", name)],
    )
    for one in found["responses"]:
        frequency, value = transfer_of_run(run, one["from"], one["to"], 2, 10)
        at, predicted = values(one["curve"])
        predicted = np.interp(frequency, at, predicted)
        error = np.abs(value - predicted).max() / np.abs(predicted).max()
        print(one["to"], error)
        # the error of the coupling, and of the interpolation
        assert error < 2e-3, one["to"]


def test_refusal_names_and_ranges_that_are_wrong():
    scenario = ROOT / "scenarios" / "one-magnet.json"
    for options, wanted in [
        ([], "nothing to compute"),
        (["--from", "guideway.chirp_forc", "--to", "vehicle.gap_01"], "did you mean guideway.chirp_force?"),
        (["--from", "guideway.chirp_force", "--to", "vehicle.gap_9*"], "vehicle.gap_9*"),
        (["--loop", "vehicle.skid"], "no unit has the input or output vehicle.skid"),
        (["--loop", "guideway.midspan_displacement_01"], "nothing receives it"),
        (["--loop", "ems_01.voltage", "--hold", "0"], "not a valid sample time"),
        (["--root-locus", "loop=1:2:3"], "needs --loop"),
        (["--root-locus", "ems_01.gain_gap=1:2"], "instance.variable=first:last:count"),
        (["--root-locus", "ems_01.gain_gap=1:2:1"], "number of values"),
        (["--loop", "ems_01.voltage", "--band", "5:1"], "not a range of frequencies"),
    ]:
        done = maglev("response", scenario, *options, status=2)
        assert wanted in done.stderr, (options, done.stderr)


def test_issue_an_unstable_system_has_no_margins():
    options = [ROOT / "scenarios" / "one-magnet.json", "--loop", "ems_01.voltage", "--set", "ems_01.gain_gap=60"]
    found = response(*options, status=1)
    assert not found["stable"] and found["growing"]
    (one,) = found["loops"]["single"]
    assert one["margins"] is None and one["critical"]
    text = maglev("response", *options, status=1).stdout
    assert "there are no margins" in text and "UNSTABLE" in text
