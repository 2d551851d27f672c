//! Integration where no closed form applies: the classical fourth-order Runge-Kutta method, which
//! locates the instants at which a limit becomes active or inactive.
//!
//! Between those instants the right-hand side is smooth: the method keeps its order 4 across them,
//! which it would lose if it stepped over the kinks. Two switches of the same limit within one
//! step of the method are not seen; they change the state by less than the method's own error as
//! long as the excursion is shorter than the step (`integration_step`).

use crate::{
    Error,
    conditions::Seen,
    inputs::InputCourse,
    lift_loss::Place,
    limits::{LimitSide, LimitsAtWork, Point},
    sensors::SensorKnots,
    state::State,
    system::Magnet,
};

/// Filter states x₁ … x₅ and flux deviation Δλ.
type Vector = [f64; 6];

/// Switches of the limits allowed in one call. A continuous controller with poles below 1000 1/s
/// switches a few times in any useful step; hundreds indicate a fault.
const MAX_EVENTS: usize = 1000;

/// Halvings when a switch is located: to 2⁻⁴⁰ of the method's step, below its error.
const HALVINGS: usize = 40;

/// The inputs of the state during an integration.
pub(crate) struct Excitation<'a> {
    /// Inputs, relative to the start of the communication step.
    pub course: &'a InputCourse,
    /// Time at the start of the communication step, for messages.
    pub time: f64,
    /// Total voltage held by a sampled controller, in V, 0 without supply; `None` for a continuous
    /// controller.
    pub held: Option<f64>,
    /// Caches of the sensors' noise.
    pub knots: &'a SensorKnots,
}

/// Advances the state from `from` to `to`, both relative to the start of the communication step.
pub(crate) fn integrate(
    magnet: &Magnet,
    state: &mut State,
    drive: &Excitation,
    from: f64,
    to: f64,
) -> Result<(), Error> {
    let begin = *state;
    let operating = state.operating_current;
    let off = magnet.is_off(state);
    let limited = !off && !magnet.parameters().limits.none();
    let frozen = magnet.force_is_off(state);
    let mut run =
        Integration { magnet, drive, begin: &begin, operating, limited, frozen, events: 0 };
    let mut z = pack(state);
    // The small allowance keeps a span of exactly n steps at n in spite of rounding.
    let count = ((to - from) / magnet.parameters().integration_step - 1e-9).ceil().max(1.0);
    let size = (to - from) / count;
    let mut start = from;
    for k in 1..=count as u64 {
        let end = if k as f64 == count { to } else { from + k as f64 * size };
        run.advance(&mut z, start, end)?;
        start = end;
    }
    unpack(state, &z);
    Ok(())
}

fn pack(state: &State) -> Vector {
    let [a, b, c, d, e] = state.filter;
    [a, b, c, d, e, state.flux_deviation]
}

fn unpack(state: &mut State, z: &Vector) {
    state.filter.copy_from_slice(&z[..5]);
    state.flux_deviation = z[5];
}

struct Integration<'a> {
    magnet: &'a Magnet,
    drive: &'a Excitation<'a>,
    /// What does not change during the integration: condition and operating current.
    begin: &'a State,
    operating: f64,
    /// Whether limits can be active.
    limited: bool,
    /// Whether the flux stays, since the force is switched off.
    frozen: bool,
    events: usize,
}

impl Integration<'_> {
    /// One step of the method, split where a limit becomes active or inactive.
    fn advance(&mut self, z: &mut Vector, start: f64, end: f64) -> Result<(), Error> {
        self.check_gap(0.5 * (start + end))?;
        self.check_gap(end)?;
        let mut at = start;
        while at < end {
            self.limit_current(z, at);
            let mode = self.mode(z, at);
            let whole = self.step(z, at, end - at, mode);
            if self.holds(mode, &whole, end) {
                *z = whole;
                return Ok(());
            }
            let size = self.locate(z, at, end - at, mode);
            *z = self.step(z, at, size, mode);
            at = (at + size).max(at.next_up());
            self.events += 1;
            if self.events > MAX_EVENTS {
                let (time, step) = (self.drive.time + at, end - start);
                return Err(Error::Chattering { time, step, events: MAX_EVENTS });
            }
        }
        Ok(())
    }

    /// Shortest step, to 2⁻⁴⁰ of `size`, after which the mode no longer holds, by bisection: the
    /// result is on the far side of the switch, so that the next set of active limits differs.
    fn locate(&self, z: &Vector, at: f64, size: f64, mode: LimitsAtWork) -> f64 {
        let (mut holds, mut fails) = (0.0, size);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (holds + fails);
            if self.holds(mode, &self.step(z, at, middle, mode), at + middle) {
                holds = middle;
            } else {
                fails = middle;
            }
        }
        fails
    }

    fn step(&self, z: &Vector, at: f64, size: f64, mode: LimitsAtWork) -> Vector {
        let k1 = self.rates(z, at, mode);
        let k2 = self.rates(&along(z, &k1, 0.5 * size), at + 0.5 * size, mode);
        let k3 = self.rates(&along(z, &k2, 0.5 * size), at + 0.5 * size, mode);
        let k4 = self.rates(&along(z, &k3, size), at + size, mode);
        let mut result = *z;
        for (j, value) in result.iter_mut().enumerate() {
            *value += size / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]);
        }
        let limits = &self.magnet.parameters().limits;
        if let (Some(bound), Some(range)) = (mode.current.bound(), limits.current) {
            // The limiter holds the current, so the flux follows the gap.
            result[5] = self.flux(self.place(at + size), bound(range));
        }
        result
    }

    fn rates(&self, z: &Vector, at: f64, mode: LimitsAtWork) -> Vector {
        let magnet = self.magnet;
        let x = [z[0], z[1], z[2], z[3], z[4]];
        let seen = self.seen(at);
        let [a, b, c, d, e] = if magnet.parameters().external_controller {
            [0.0; 5]
        } else {
            magnet.filter().rates(&x, seen.deviation, seen.direct.acceleration)
        };
        let flux_rate = if mode.current == LimitSide::Free && !self.frozen {
            let voltage = match (mode.voltage, magnet.parameters().limits.voltage) {
                (LimitSide::Upper, Some(range)) => range.max,
                (LimitSide::Lower, Some(range)) => range.min,
                _ => self.command(&x, &seen),
            };
            voltage - magnet.electromagnet().resistance * self.current(z, self.place(at))
        } else {
            // The current limiter's flux is set by `step`.
            0.0
        };
        [a, b, c, d, e, flux_rate]
    }

    fn seen(&self, at: f64) -> Seen {
        let signals = self.drive.course.signals(at);
        self.magnet.seen(self.begin, self.drive.time + at, &signals, self.drive.knots)
    }

    fn command(&self, x: &[f64; 5], seen: &Seen) -> f64 {
        self.drive.held.unwrap_or_else(|| self.magnet.command(x, seen))
    }

    fn point(&self, z: &Vector, at: f64) -> Point {
        let place = self.place(at);
        let gap_rate = self.drive.course.gap_slope(at);
        let command = self.command(&[z[0], z[1], z[2], z[3], z[4]], &self.seen(at));
        let aside = self.magnet.lift_loss().map_or([0.0; 2], |_| self.drive.course.aside(at));
        Point { gap: place.gap, gap_rate, aside, current: self.current(z, place), command }
    }

    fn mode(&self, z: &Vector, at: f64) -> LimitsAtWork {
        if !self.limited {
            return LimitsAtWork::FREE;
        }
        self.magnet.mode(&self.point(z, at))
    }

    fn holds(&self, mode: LimitsAtWork, z: &Vector, at: f64) -> bool {
        !self.limited || self.magnet.holds(mode, &self.point(z, at))
    }

    /// Removes the last bits by which a located switch overshoots a current bound.
    fn limit_current(&self, z: &mut Vector, at: f64) {
        let limits = &self.magnet.parameters().limits;
        if limits.current.is_none() || !self.limited {
            return;
        }
        let place = self.place(at);
        let current = self.current(z, place);
        let limited = limits.clamp_current(current);
        if limited != current {
            z[5] = self.flux(place, limited);
        }
    }

    /// Total current, in A.
    fn current(&self, z: &Vector, place: Place) -> f64 {
        self.magnet.current_of_flux(place, self.operating, z[5])
    }

    /// Δλ, in Wb, of a total current (A).
    fn flux(&self, place: Place, current: f64) -> f64 {
        self.magnet.flux_of_current(place, self.operating, current)
    }

    /// Gap and offset; without lift loss the offset is not needed.
    fn place(&self, at: f64) -> Place {
        let [gap, _] = self.drive.course.at(at);
        let offset = self.magnet.lift_loss().map_or(0.0, |_| self.drive.course.aside(at)[0]);
        Place { gap, offset }
    }

    fn check_gap(&self, at: f64) -> Result<(), Error> {
        let Place { gap, offset } = self.place(at);
        self.magnet.check_offset(offset, self.drive.time + at)?;
        if gap > 0.0 {
            return Ok(());
        }
        Err(Error::GapClosed { time: self.drive.time + at, gap })
    }
}

fn along(z: &Vector, rate: &Vector, size: f64) -> Vector {
    let mut result = *z;
    for (value, rate) in result.iter_mut().zip(rate) {
        *value += size * rate;
    }
    result
}
