"""Problems of the literature as scenarios, against integrations of their equations that share no code with the units.

Every reference is computed here: equations of motion with scipy's DOP853.
"""

import numpy as np
import pytest
from conftest import run
from scipy.integrate import solve_ivp

# Yang and Yau: beam (E I in N.m2, m in kg/m), sprung mass
LENGTH, BENDING, BEAM, MASS, SPRING, SPEED, GRAVITY = 25.0, 2.87e9 * 2.9, 2303.0, 5750.0, 1595e3, 27.78, 9.81
# the run-up over rigid ground
ENTRY = 1.5


def solved(equations, start, stop, tolerance=1e-9):
    found = solve_ivp(equations, (0.0, stop), start, method="DOP853", rtol=tolerance, atol=1e-3 * tolerance, dense_output=True)
    assert found.success
    return found.sol


def modes_of_the_beam(count):
    wave = np.arange(1, count + 1) * np.pi / LENGTH
    return wave, wave**2 * np.sqrt(BENDING / BEAM)


def sprung_mass(count):
    """Mid-span deflection over time: q'' + w^2 q = 2/(m L) phi(vt) (M g + k (z - phi q)), M z'' = -k (z - phi q)."""
    wave, natural = modes_of_the_beam(count)

    def equations(t, y):
        q, rate, (z, speed) = y[:count], y[count : 2 * count], y[2 * count :]
        shape = np.sin(wave * SPEED * t)
        spring = SPRING * (z - shape @ q)
        force = 2.0 / (BEAM * LENGTH) * (MASS * GRAVITY + spring)
        return np.concatenate([rate, force * shape - natural**2 * q, [speed, -spring / MASS]])

    course = solved(equations, np.zeros(2 * count + 2), LENGTH / SPEED)
    return lambda t: np.sin(wave * LENGTH / 2) @ course(t)[:count]


def rigid_mass(count):
    """The same with the mass on the beam: the force is M (g - D2w/Dt2), D2w/Dt2 = phi q'' + 2 v phi' q' + v^2 phi'' q."""
    wave, natural = modes_of_the_beam(count)
    share = 2.0 * MASS / (BEAM * LENGTH)

    def equations(t, y):
        q, rate = y[:count], y[count:]
        shape, slope = np.sin(wave * SPEED * t), wave * np.cos(wave * SPEED * t)
        load = GRAVITY - 2.0 * SPEED * (slope @ rate) + SPEED**2 * ((wave**2 * shape) @ q)
        matrix = np.eye(count) + share * np.outer(shape, shape)
        return np.concatenate([rate, np.linalg.solve(matrix, share * load * shape - natural**2 * q)])

    course = solved(equations, np.zeros(2 * count), LENGTH / SPEED)
    return lambda t: np.sin(wave * LENGTH / 2) @ course(t)[:count]


@pytest.mark.parametrize(
    "scenario, reference, count, published, tolerance",
    [
        # the coupling in steps of 0.5 ms is right to 5e-8 of the peak
        ("moving-sprung-mass.json", sprung_mass, 1, 2.38398, 1e-6),
        ("moving-sprung-mass.json", sprung_mass, 5, 2.40836, 1e-6),
        ("moving-sprung-mass.json", sprung_mass, 20, 2.40740, 1e-6),
        # the mass bounces on the spring of 10 GN/m, with 210 Hz and 2e-4 of the deflection
        ("moving-mass.json", rigid_mass, 5, None, 4e-4),
    ],
)
def test_analytic_a_mass_crosses_a_beam(scenario, reference, count, published, tolerance, tmp_path):
    signals, _ = run(f"benchmarks/{scenario}", tmp_path, "--no-report", "--record-interval", 0.001, "--set", f"guideway.modes={count}")
    time, deflection = signals["time"] - ENTRY, -1e3 * signals["guideway.midspan_displacement_01"]
    on_the_beam = (time >= 0.0) & (time <= LENGTH / SPEED)
    # nothing moves before
    assert np.abs(deflection[time < 0]).max() == 0.0
    course = reference(count)
    exact, peak = 1e3 * course(time[on_the_beam]), 1e3 * course(np.linspace(0.3, 0.45, 3001)).max()
    error = np.abs(deflection[on_the_beam] - exact).max() / peak
    print(f"{scenario}, {count} modes: peak {deflection.max():.6f} mm, exact {peak:.6f} mm, largest difference {error:.1e}")
    assert error < tolerance
    if published:
        assert peak == pytest.approx(published, abs=6e-6)


def magnet(speed, start, stop):
    """Gap and mid-span deflection of one magnet with its controller, 250 kg and two modes of a girder: docs/physics.md."""
    mass, gap, current, resistance = 250.0, 0.008, 24.0, 0.6
    pole = 4e-7 * np.pi * 400.0**2 * 0.036
    inductance, by_current, by_gap = pole / (2 * gap), pole * current / (2 * gap**2), pole * current**2 / (2 * gap**3)
    girder, length = 22000.0 * 1.24 / 9.81, 25.0
    natural, damping = 2 * np.pi * np.array([7.1, 24.9]), np.array([0.0108, 0.0241])
    wave = np.array([1, 2]) * np.pi / length
    weight = mass * GRAVITY

    def equations(t, y):
        z, rise, q, rate, flux, x = y[0], y[1], y[2:4], y[4:6], y[6], y[7:]
        place = start + speed * t
        shape = np.sin(wave * place) if 0.0 < place < length else np.zeros(2)
        opening = shape @ q - z
        lift = by_current / inductance * flux
        down = -lift / mass
        u1, u2 = 250.0 * opening, 0.25 * down
        estimates = [x[1] - x[2] - x[3] + u2, x[3], x[4], x[1], x[0]]
        volts = np.dot([7.0, 40.0, 4.0, 40.0, 7.0], estimates)
        amperes = flux / inductance + by_gap / by_current * opening
        return np.concatenate([
            [rise, lift / mass],
            rate,
            -2 / (girder * length) * (weight + lift) * shape - 2 * damping * natural * rate - natural**2 * q,
            [volts - resistance * amperes],
            [
                100 * x[1],
                -10000 * x[0] - 1000 * x[1] + 10000 * u1,
                -10 * x[1] + 10 * x[3],
                10 * x[1] - 10 * x[2] - 10 * x[3] + 10 * u2,
                100 * x[3] - 10 * x[4] + 10 * u1,
            ],
        ])

    # the force begins and ends at the supports: pieces between these times are smooth
    edges = [0.0, -start / speed, (length - start) / speed, stop]
    state, courses = np.zeros(12), []
    for begin, end in zip(edges, edges[1:]):
        if end <= begin:
            continue
        piece = solve_ivp(lambda t, y: equations(t, y), (begin, end), state, method="DOP853", rtol=1e-9, atol=1e-13, dense_output=True)
        assert piece.success
        courses.append((begin, end, piece.sol))
        state = piece.y[:, -1]

    def at(t):
        begin, end, course = next(it for it in courses if t <= it[1] + 1e-12)
        y = course(min(max(t, begin), end))
        place = start + speed * t
        shape = np.sin(wave * place) if 0.0 < place < length else np.zeros(2)
        return gap + shape @ y[2:4] - y[0], np.sin(wave * length / 2) @ y[2:4]

    return at


@pytest.mark.parametrize("speed, step", [(1.4, 0.001), (20.0, 0.001), (50.0, 0.0005), (100.0, 0.0002)])
def test_analytic_one_magnet_crosses_a_girder(speed, step, tmp_path):
    stop = round((26.0 / speed + 0.3) / 0.01) * 0.01
    signals, _ = run("benchmarks/magnet-crossing.json", tmp_path, "--no-report", "--set", f"vehicle.travel_speed={speed}", "--stop", stop, "--step", step, "--record-interval", 10 * step)
    times = signals["time"]
    exact = np.array([magnet_at(t) for magnet_at in [magnet(speed, -1.0, stop)] for t in times])
    for column, signal, rest in [(0, "vehicle.gap_01", 0.008), (1, "guideway.midspan_displacement_01", 0.0)]:
        found = signals[signal]
        size = np.abs(exact[:, column] - rest).max()
        error = np.abs(found - exact[:, column]).max() / size
        print(f"{speed} m/s, {signal}: largest deviation {1e3 * size:.5f} mm, difference {error:.1e} of it")
        # differences of 1.3e-5 and less are those of the coupling in these steps
        assert error < 3e-5
