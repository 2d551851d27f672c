"""Poles of one magnet that carries 250 kg, read off the stepped `ems` unit.

    python poles.py target/fmu/ems.fmu [step in s]

The unit is coupled through fmpy to a mass under a rigid rail. Steps are of 0.1 ms, with a one-pass
scheme without memory: gap, gap rate and acceleration are extrapolated as polynomials from the mass's
state, the force and the force's rate; the unit steps; the mass then follows the cubic force through
both ends' values and rates exactly. So one step is a map of eight states: the filter's five (four
are estimates, the third follows from the acceleration estimate), the current, position and velocity.
The map is identified from steps out of many independent small states; the poles are the logarithms
of its eigenvalues over the step.

They must agree with eqs 1-5 closed over the mass, set up here independently, and with the numbers of
the documentation, within 0.5 % of their modulus. The scheme itself is of second order or better:
its own error is below a tenth of that.
"""

import shutil
import sys

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

MASS, GRAVITY, GAP = 250.0, 9.81, 0.008
TOLERANCE = 5e-3
# Operating current: documented poles, upper half plane, as far as documented.
CASES = {
    24.0: [-500.71 + 865.62j, -10, -7.99 + 47.15j, -5.00 + 8.72j, -4.93],
    14.353: [-2.18 + 37.04j],
}
ESTIMATES = [
    f"estimate_{name}" for name in ("gap", "gap_velocity", "acceleration", "velocity", "position")
]


def closed_loop(current):
    """Poles of eqs 1-5 with table 2's numbers and M q'' = -dF; states x1 ... x5, di, q, q'."""
    inductance = 4e-7 * np.pi * 400**2 * 0.036 / (2 * GAP)
    ki = inductance * current / GAP
    kc = ki * current / GAP
    acceleration = np.zeros(8)
    acceleration[[5, 6]] = -ki / MASS, kc / MASS
    u1, u2, unit = 250 * np.eye(8)[6], 0.25 * acceleration, np.eye(8)
    x1, x2, x3, x4, x5 = unit[:5]
    y3 = x2 - x3 - x4 + u2
    voltage = 7 * y3 + 40 * x4 + 4 * x5 + 40 * x2 + 7 * x1
    matrix = [
        100 * x2,
        -1e4 * x1 - 1e3 * x2 + 1e4 * u1,
        -10 * x2 + 10 * x4,
        10 * x2 - 10 * x3 - 10 * x4 + 10 * u2,
        100 * x4 - 10 * x5 + 10 * u1,
        kc / ki * unit[7] - 0.6 / inductance * unit[5] + voltage / inductance,
        unit[7],
        acceleration,
    ]
    return np.linalg.eigvals(np.array(matrix))


class Loop:
    """The unit and the mass that it carries."""

    def __init__(self, description, folder, current, step):
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.current, self.step = current, step
        self.unit = FMU2Slave(guid=description.guid, unzipDirectory=folder, instanceName="magnet",
                              modelIdentifier=description.coSimulation.modelIdentifier)
        self.unit.instantiate()

    def get(self, *names):
        return self.unit.getReal([self.references[name] for name in names])

    def set(self, **values):
        self.unit.setReal([self.references[name] for name in values], list(values.values()))

    def start(self, random):
        """A state off the equilibrium, different each time: some steps of arbitrary small inputs."""
        self.unit.reset()
        self.set(operating_current=self.current)
        self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        self.set(gap=GAP, gap_rate=0.0, acceleration=0.0, static_force=MASS * GRAVITY)
        self.unit.exitInitializationMode()
        self.time = 0.0
        for _ in range(8):
            gap, rate, acceleration = random.uniform(-1, 1, 3) * [1e-4, 1e-2, 1.0]
            self.set(gap=GAP + gap, gap_rate=rate, acceleration=acceleration)
            self.advance(20 * self.step)
        self.q, self.v = random.uniform(-1, 1, 2) * [1e-4, 5e-3]

    def advance(self, size):
        self.unit.doStep(self.time, size)
        self.time += size

    def settle(self):
        """Makes the unit's inputs those of the mass; returns its acceleration and jerk."""
        self.set(gap=GAP + self.q, gap_rate=self.v)
        acceleration = GRAVITY - self.get("force")[0] / MASS
        self.set(acceleration=acceleration)
        return acceleration, -self.force_rate() / MASS

    def force_rate(self):
        return self.unit.getRealOutputDerivatives([self.references["force"]], [1])[0]

    def state(self):
        acceleration, _ = self.settle()
        y1, y2, y3, y4, y5, current = self.get(*ESTIMATES, "current")
        x3 = y2 - y4 + 0.25 * acceleration - y3
        # Position and velocity in the filter's scales, so that all states are of one size.
        return [y1, y2, x3, y4, y5, current - self.current, 250 * self.q, 2.5 * self.v]

    def go(self):
        """One coupled step."""
        h, mass = self.step, MASS
        a, jerk = self.settle()
        for name, derivatives in {
            "gap": [self.v, a, jerk], "gap_rate": [a, jerk], "acceleration": [jerk],
        }.items():
            for order, value in enumerate(derivatives, 1):
                self.unit.setRealInputDerivatives([self.references[name]], [order], [value])
        self.advance(h)
        b, jerk_b = GRAVITY - self.get("force")[0] / mass, -self.force_rate() / mass
        # Acceleration a + jerk t + p t^2 + r t^3 through both ends, integrated once and twice.
        p = (3 * (b - a) / h - 2 * jerk - jerk_b) / h
        r = (2 * (a - b) / h + jerk + jerk_b) / h**2
        self.q += h * (self.v + h * (a / 2 + h * (jerk / 6 + h * (p / 12 + h * r / 20))))
        self.v += h * (a + h * (jerk / 2 + h * (p / 3 + h * r / 4)))


def identified(loop):
    """Poles of the coupled step, and how well a linear map of eight states explains it."""
    random = np.random.default_rng(1)
    before, after = [], []
    for _ in range(24):
        loop.start(random)
        before.append(loop.state())
        loop.go()
        after.append(loop.state())
    before, after = np.array(before), np.array(after)
    transposed, _, rank, _ = np.linalg.lstsq(before, after, rcond=None)
    assert rank == 8, f"the states visited span {rank} dimensions only"
    residual = np.abs(before @ transposed - after).max() / np.abs(after).max()
    return np.log(np.linalg.eigvals(transposed.astype(complex))) / loop.step, residual


def nearest(pole, poles):
    return min(poles, key=lambda p: abs(p - pole))


def show(pole):
    return f"{pole.real:9.3f} {pole.imag:+9.3f}j"


def main():
    path, step = sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 1e-4
    description, folder = read_model_description(path), extract(path)
    worst = 0.0
    print(f"one magnet under {MASS:.0f} kg, coupled in steps of {1e3 * step:g} ms")
    for current, documented in CASES.items():
        loop = Loop(description, folder, current, step)
        found, residual = identified(loop)
        loop.unit.freeInstance()
        expected = closed_loop(current)
        print(f"\ncoefficients at {current} A (the map is linear to {residual:.0e})")
        print("  read off the unit           expected               off by (% of modulus)")
        # One to one: sorted the same way, both lists pair up.
        order = lambda p: (round(p.imag, 1), p.real)
        for pole, target in zip(sorted(found, key=order), sorted(expected, key=order)):
            error = abs(pole - target) / abs(target)
            worst = max(worst, error)
            print(f"  {show(pole)}    {show(target)}    {100 * error:.4f}")
        for target in documented:
            pole = nearest(target, found)
            worst = max(worst, abs(pole - target) / abs(target))
        assert residual < 1e-9, "a step depends on more than eight states"
    shutil.rmtree(folder)
    print(f"\nlargest error {100 * worst:.4f} % of the modulus, {100 * TOLERANCE} % allowed")
    return int(worst > TOLERANCE)


if __name__ == "__main__":
    sys.exit(main())
