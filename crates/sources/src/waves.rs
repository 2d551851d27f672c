//! Signals by formulas.

use std::f64::consts::TAU;

use scenario::{ChirpSignal, PulseSignal, RampSignal, SineSignal};

use crate::Break;

/// A jump smaller than this part of the amplitude is rounding.
const ROUNDING: f64 = 1e-9;

/// A signal by a formula between two times, constant before and after.
#[derive(Debug, Clone)]
pub enum Wave {
    #[doc(hidden)]
    Ramp(RampSignal),
    #[doc(hidden)]
    Pulse(PulseSignal),
    #[doc(hidden)]
    Sine(SineSignal),
    #[doc(hidden)]
    Chirp(ChirpSignal),
}

impl Wave {
    /// Begin and end of the formula (s).
    fn interval(&self) -> (f64, f64) {
        match self {
            Self::Ramp(it) => (it.start, it.end),
            Self::Pulse(it) => (it.start, it.end),
            Self::Sine(it) => (it.start.unwrap_or(f64::NEG_INFINITY), f64::INFINITY),
            Self::Chirp(it) => (it.start, it.end),
        }
    }

    /// 0 before the formula, 1 within, 2 after.
    pub(crate) fn index(&self, time: f64) -> i64 {
        let (start, end) = self.interval();
        i64::from(time >= start) + i64::from(time >= end)
    }

    pub(crate) fn piece(&self, index: i64, time: f64) -> [f64; 4] {
        let constant = |value| [value, 0.0, 0.0, 0.0];
        match self {
            Self::Ramp(it) => match index {
                0 => constant(it.from),
                1 => {
                    let slope = (it.to - it.from) / (it.end - it.start);
                    [it.from + slope * (time - it.start), slope, 0.0, 0.0]
                }
                _ => constant(it.to),
            },
            Self::Pulse(it) if index == 1 => {
                let omega = TAU / (it.end - it.start);
                let (sin, cos) = (omega * (time - it.start)).sin_cos();
                let half = it.height / 2.0;
                [
                    it.base + half * (1.0 - cos),
                    half * omega * sin,
                    half * omega.powi(2) * cos,
                    -half * omega.powi(3) * sin,
                ]
            }
            Self::Pulse(it) => constant(it.base),
            Self::Sine(it) if index == 1 => {
                let omega = TAU * it.frequency;
                let (sin, cos) = (omega * (time - it.start.unwrap_or(0.0)) + it.phase).sin_cos();
                [
                    it.mean + it.amplitude * sin,
                    it.amplitude * omega * cos,
                    -it.amplitude * omega.powi(2) * sin,
                    -it.amplitude * omega.powi(3) * cos,
                ]
            }
            Self::Sine(it) => constant(it.mean),
            Self::Chirp(it) if index == 1 => {
                let tau = time - it.start;
                let rate = TAU * (it.to - it.from) / (it.end - it.start);
                let omega = TAU * it.from + rate * tau;
                let (sin, cos) = (tau * (TAU * it.from + rate * tau / 2.0)).sin_cos();
                [
                    it.mean + it.amplitude * sin,
                    it.amplitude * omega * cos,
                    it.amplitude * (rate * cos - omega.powi(2) * sin),
                    it.amplitude * (-3.0 * omega * rate * sin - omega.powi(3) * cos),
                ]
            }
            Self::Chirp(it) => constant(it.mean),
        }
    }

    /// Begin and end of the formula.
    pub(crate) fn breaks(&self, start: f64, stop: f64) -> Vec<Break> {
        let (first, last) = self.interval();
        let size = match self {
            Self::Ramp(it) => it.to - it.from,
            Self::Pulse(it) => it.height,
            Self::Sine(it) => it.amplitude,
            Self::Chirp(it) => it.amplitude,
        };
        let at = |time: f64, index: i64| {
            let change = self.piece(index + 1, time)[0] - self.piece(index, time)[0];
            Break { time, jump: change.abs() > ROUNDING * size.abs() }
        };
        let within = |time: &f64| (start..stop).contains(time);
        let ends = [(first, 0), (last, 1)].into_iter().filter(|(time, _)| within(time));
        ends.map(|(time, index)| at(time, index)).collect()
    }
}
