//! Lift-off and set-down: the course of the reference gap and of the voltage that goes with it.
//!
//! The reference of the control law is a gap c_r(t) and a flux linkage λ_r(t). In the nonlinear law
//! the force F = λ²/(4K) depends on the flux linkage alone, so λ_op = 2·√(K·F_s) carries the load at
//! every gap. A lift-off therefore has two phases: the flux rises to λ_op while the reference gap
//! stays, then the gap moves while the flux stays. The voltage of this course,
//!
//! v_r = R·i_r + λ_r', i_r = λ_r·c_r/(2K),
//!
//! replaces R·i_op, and the filter sees the deviations Δc = c − c_r and q̈ − c_r'', so that eqs 3-5
//! act about the moving reference as they do about the resting one. With the flux as its state the
//! coil follows Δλ' = Δv − R/(2K)·(λ_r·Δc + c_r·Δλ) and the force ΔF = λ_r/(2K)·Δλ. While the gap
//! moves, c_r is all that varies, and it multiplies the slowest part, the decay of the flux: the loop
//! that is stable at the nominal gap is stable on the way. A set-down is the same course backwards,
//! after which the voltage is switched off.

use serde::{Deserialize, Serialize};

use crate::{
    Error,
    parameters::{finite, positive},
};

/// Fraction of a transition in which the flux changes; in the rest the gap does.
const FLUX_FRACTION: f64 = 0.25;

/// Largest gap at which a set-down may end, in m: a larger one is a mistake in the unit.
const LARGEST_LANDING_GAP: f64 = 1.0;

/// Times this close, relative to the time or 1 s, are the same: the reference has not moved by then.
const SIMULTANEOUS: f64 = 1e-9;

/// When a magnet lifts off and sets down. The nonlinear law with the current limited to 0 and above
/// is required.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sequence {
    /// Time at which the lift-off begins, in s. The magnet starts without current, at a gap that
    /// something else holds, and the reference starts at that gap. `None`: it starts levitating.
    pub lift_off: Option<f64>,
    /// Time at which the set-down begins, in s.
    pub set_down: Option<f64>,
    /// Duration of either transition, in s.
    pub transition: f64,
    /// Reference gap at which the set-down ends, in m.
    pub landing_gap: f64,
}

/// Part of the sequence. In one phase the reference is smooth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Phase {
    /// The nominal gap.
    #[default]
    Levitating,
    /// No voltage.
    Off,
    /// The flux rises at the gap of the start.
    Magnetising,
    /// The reference gap moves to the nominal one.
    Lifting,
    /// The reference gap moves to the landing gap.
    Lowering,
    /// The flux falls at the landing gap.
    Demagnetising,
}

/// What the control law refers to at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reference {
    /// c_r, in m.
    pub gap: f64,
    /// c_r'', in m/s².
    pub acceleration: f64,
    /// c_r''', in m/s³.
    pub jerk: f64,
    /// v_r and its rate, in V and V/s.
    pub voltage: [f64; 2],
}

/// The resting point that a reference starts from and leads to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Resting {
    /// c₀, in m.
    pub nominal_gap: f64,
    /// Gap at which the magnet started, in m.
    pub start_gap: f64,
    /// λ_op, in Wb.
    pub flux: f64,
    /// R, in Ω.
    pub resistance: f64,
    /// K, in N·m²/A².
    pub constant: f64,
}

impl Sequence {
    pub(crate) fn check(&self, nominal_gap: f64) -> Result<(), Error> {
        positive("transition time (s)", self.transition)?;
        positive("landing gap (m)", self.landing_gap)?;
        if let Some(time) = self.lift_off {
            finite("lift-off time (s)", time)?;
        }
        let Some(down) = self.set_down else { return Ok(()) };
        finite("set-down time (s)", down)?;
        if !(nominal_gap < self.landing_gap && self.landing_gap <= LARGEST_LANDING_GAP) {
            return Err(Error::OutOfRange {
                name: "landing gap (m)",
                value: self.landing_gap,
                must: "above the nominal gap, from which the magnet moves down, and at most 1",
            });
        }
        match self.lift_off {
            Some(up) if down < up + self.transition => Err(Error::OutOfRange {
                name: "set-down time (s)",
                value: down,
                must: "at or after the end of the lift-off, lift_off_time + transition_time",
            }),
            _ => Ok(()),
        }
    }

    /// Whether a sequence can be replaced by another one at `time` (s) without a jump of the reference:
    /// what has begun stays as it is, and nothing begins in the past.
    pub(crate) fn check_change(
        from: Option<Self>,
        to: Option<Self>,
        time: f64,
    ) -> Result<(), Error> {
        let now = time - SIMULTANEOUS * time.abs().max(1.0);
        let none = Self { lift_off: None, set_down: None, transition: 0.0, landing_gap: 0.0 };
        let [from, to] = [from, to].map(|it| it.unwrap_or(none).begins());
        for ((name, from), (_, to)) in from.into_iter().zip(to) {
            if from != to && [from, to].into_iter().flatten().any(|begin| begin < now) {
                return Err(Error::LateChange { name, from, to, time });
            }
        }
        Ok(())
    }

    /// The times of lift-off and set-down, with their names.
    pub(crate) fn begins(&self) -> [(&'static str, Option<f64>); 2] {
        [("lift-off time (s)", self.lift_off), ("set-down time (s)", self.set_down)]
    }

    /// The instants at which a phase begins, and that phase, in order.
    pub(crate) fn instants(&self) -> [(Option<f64>, Phase); 6] {
        let after = |begin: Option<f64>, part: f64| begin.map(|t| t + part * self.transition);
        [
            (self.lift_off, Phase::Magnetising),
            (after(self.lift_off, FLUX_FRACTION), Phase::Lifting),
            (after(self.lift_off, 1.0), Phase::Levitating),
            (self.set_down, Phase::Lowering),
            (after(self.set_down, 1.0 - FLUX_FRACTION), Phase::Demagnetising),
            (after(self.set_down, 1.0), Phase::Off),
        ]
    }

    /// The phase at `time` (s).
    pub(crate) fn phase(&self, time: f64) -> Phase {
        let first = if self.lift_off.is_some() { Phase::Off } else { Phase::Levitating };
        let begun =
            |(begin, phase): (Option<f64>, Phase)| begin.filter(|t| *t <= time).map(|_| phase);
        self.instants().into_iter().rev().find_map(begun).unwrap_or(first)
    }

    /// The reference at `time` (s), which is in `phase` up to rounding.
    pub(crate) fn reference(&self, phase: Phase, time: f64, rest: &Resting) -> Reference {
        let (flux_time, gap_time) =
            (FLUX_FRACTION * self.transition, (1.0 - FLUX_FRACTION) * self.transition);
        let up = time - self.lift_off.unwrap_or(time);
        let down = time - self.set_down.unwrap_or(time);
        let (nominal, landing) = (rest.nominal_gap, self.landing_gap);
        let still = |gap: f64| Course { value: gap, ..Course::default() };
        let start = rest.start_gap;
        let (gap, flux) = match phase {
            Phase::Levitating => (still(nominal), still(rest.flux)),
            Phase::Off => {
                let gap = if down > 0.0 { landing } else { start };
                (still(gap), still(0.0))
            }
            Phase::Magnetising => (still(start), Course::new(0.0, rest.flux, up, flux_time)),
            Phase::Lifting => {
                (Course::new(start, nominal, up - flux_time, gap_time), still(rest.flux))
            }
            Phase::Lowering => (Course::new(nominal, landing, down, gap_time), still(rest.flux)),
            Phase::Demagnetising => {
                (still(landing), Course::new(rest.flux, 0.0, down - gap_time, flux_time))
            }
        };
        let per_flux = rest.resistance / (2.0 * rest.constant);
        let voltage = if phase == Phase::Off {
            [0.0; 2]
        } else {
            [
                per_flux * flux.value * gap.value + flux.rate,
                per_flux * (flux.rate * gap.value + flux.value * gap.rate) + flux.second,
            ]
        };
        Reference { gap: gap.value, acceleration: gap.second, jerk: gap.third, voltage }
    }
}

/// A quantity with its derivatives by time.
#[derive(Debug, Clone, Copy, Default)]
struct Course {
    value: f64,
    rate: f64,
    second: f64,
    third: f64,
}

impl Course {
    /// From `from` to `to` in `duration` (s), at `time` (s) after the start: the polynomial of fifth
    /// degree that begins and ends at rest.
    fn new(from: f64, to: f64, time: f64, duration: f64) -> Self {
        let u = (time / duration).clamp(0.0, 1.0);
        let (v, span) = (1.0 - u, to - from);
        Self {
            value: from + span * (u * u * u * (10.0 + u * (6.0 * u - 15.0))),
            rate: span / duration * (30.0 * u * u * v * v),
            second: span / duration.powi(2) * (60.0 * u * v * (v - u)),
            third: span / duration.powi(3) * (60.0 * (1.0 - 6.0 * u * v)),
        }
    }
}
