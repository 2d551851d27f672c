"""A controller of your own for a levitation magnet, as an FMI 2.0 co-simulation unit in Python (PythonFMU):

    pip install pythonfmu
    pythonfmu build -f state_feedback.py        # writes StateFeedback.fmu

A digital controller: it takes a sample at the start of each communication step; the voltage acts from the end of that
step on and is held for one step.

    v = k_gap (gap - set_point) + k_rate gap_rate + k_acceleration acceleration      in V, beyond the operating point

Your own law goes into `law`, and what it remembers into `do_step`. PythonFMU calls the interpreter for every value, so a
step of a unit in Python takes some 30 microseconds, hundreds of times longer than in C or Rust.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

INPUTS = {"gap": 0.008, "gap_rate": 0.0, "acceleration": 0.0}
PARAMETERS = {"set_point": 0.008, "k_gap": 4000.0, "k_rate": 250.0, "k_acceleration": 4.0}


class StateFeedback(Fmi2Slave):
    description = "State feedback of the air gap"

    def __init__(self, **given):
        super().__init__(**given)
        self.held = None  # the voltage since the last sample; none before the first
        for name, start in INPUTS.items():
            setattr(self, name, start)
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name, start in PARAMETERS.items():
            setattr(self, name, start)
            kind = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
            self.register_variable(Real(name, **kind))
        # discrete: held between the samples
        for name in ("voltage", "transient_voltage"):
            kind = {"causality": Fmi2Causality.output, "variability": Fmi2Variability.discrete}
            self.register_variable(Real(name, **kind))

    def law(self, acceleration):
        deviation = self.gap - self.set_point
        return self.k_gap * deviation + self.k_rate * self.gap_rate + self.k_acceleration * acceleration

    @property
    def voltage(self):
        """The start is at rest: without the acceleration, which would depend on the voltage."""
        return self.law(0.0) if self.held is None else self.held

    @property
    def transient_voltage(self):
        """The part at the start that does not last, for the magnet's coil."""
        return self.k_rate * self.gap_rate if self.held is None else 0.0

    def exit_initialization_mode(self):
        if not self.set_point > 0.0:
            raise ValueError(f"set_point is {self.set_point}, but must be positive: it is the air gap in m")

    def do_step(self, current_time, step_size):
        self.held = self.law(self.acceleration)
        return True
