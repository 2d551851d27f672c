//! The size of the communication step, from an estimate of the coupling error.
//!
//! A step is accepted if the estimate e is at most one, where e is the largest error of a signal
//! relative to the allowed error; else it is repeated, smaller, from saved states. The next
//! step is larger or smaller by the factor 0.9 · e^(−0.7/k) · e₋^(0.4/k), between 0.2 and 2: a
//! proportional-integral controller (Gustafsson 1991; Hairer & Wanner, "Solving Ordinary
//! Differential Equations II", IV.2) with the last estimate e₋ and the order k of the estimate in h.
//!
//! - `predictor`: e compares extrapolated signals with their actual ends (Milne's device;
//!   Busch & Schweizer 2011). Costs nothing; k = N + 1.
//! - `doubling`: e compares one step with two of half the size, whose results are kept, and is divided
//!   by 2^p − 1 for the order p = N + 1 of the coupling. Costs 50 % more; k = N + 2.
//!
//! Steps divide a span exactly: sizes are whole numbers of ticks, 2⁻²⁰ of the span, and the last step
//! ends at the end of the span. If a unit cannot save its state, every step is accepted and only the
//! next one is smaller.

use results::summary::ControlReport;

use super::coupled::Coupling;
use super::exchange::{Exchange, ExchangeState};
use super::index::SignalIndex;
use super::unit::{CONTROL, Unit};
use fmi2_import::span::{between, parts};
use scenario::algorithm::{Estimate, VariableStep};

/// Ticks in a span.
const TICKS: u32 = 1 << 20;
/// The first step as a fraction of a span.
const FIRST: f64 = 1.0 / 16.0;
const SAFETY: f64 = 0.9;

/// Chooses the size of the steps.
pub struct Control {
    settings: VariableStep,
    degree: usize,
    signals: Vec<SignalIndex>,
    /// size of the next step in ticks
    next: f64,
    /// the span whose ticks these are (s)
    span: f64,
    last_error: f64,
    before: ExchangeState,
    long: Vec<f64>,
    report: ControlReport,
}

/// What changes in a control from step to step.
pub(super) type ControlMark = ([f64; 3], ControlReport);

/// A step within a span.
#[derive(Clone, Copy)]
struct Piece {
    time: f64,
    size: f64,
}

impl Control {
    /// Controls the error of these signals; `degree` is that of their extrapolation.
    #[must_use]
    pub fn new(settings: VariableStep, degree: usize, signals: Vec<SignalIndex>) -> Self {
        Self {
            settings,
            degree,
            long: vec![0.0; signals.len()],
            signals,
            next: FIRST * f64::from(TICKS),
            span: 0.0,
            last_error: 1.0,
            before: ExchangeState::default(),
            report: ControlReport {
                accepted: 0,
                rejected: 0,
                forced: 0,
                smallest: f64::INFINITY,
                largest: 0.0,
            },
        }
    }

    /// Counts and extremes of the steps so far.
    #[must_use]
    pub fn report(&self) -> &ControlReport {
        &self.report
    }

    /// What it remembers from step to step, for a checkpoint: the next size, the last estimate, and the last span.
    #[must_use]
    pub fn state(&self) -> [f64; 3] {
        [self.next, self.last_error, self.span]
    }

    /// Everything that changes, counts included.
    pub(super) fn mark(&self) -> ControlMark {
        (self.state(), self.report)
    }

    pub(super) fn return_to(&mut self, (state, report): ControlMark) {
        self.restore(state);
        self.report = report;
    }

    /// Restores such a state.
    pub fn restore(&mut self, [next, last_error, span]: [f64; 3]) {
        (self.next, self.last_error, self.span) = (next, last_error, span);
    }

    /// Steps all units over a span, given by begin and length, in as many steps as needed. `after`
    /// is called after each accepted step with the exchange, the end and the size. Of two halves it
    /// sees the second.
    ///
    /// # Errors
    /// A unit fails.
    pub fn advance<U: Unit>(
        &mut self,
        coupling: &mut Coupling<U>,
        exchange: &mut Exchange,
        units: &mut [U],
        (begin, span): (f64, f64),
        after: &mut dyn FnMut(&Exchange, f64, f64),
    ) -> Result<(), U::Error> {
        // spans differ by more than rounding where an event cuts one
        if self.span > 0.0 && (span - self.span).abs() > 1e-6 * span {
            self.next *= self.span / span;
        }
        self.span = span;
        let able = units.iter().all(|unit| unit.capabilities().restore);
        let (mut time, end) = (begin, begin + span);
        let at = |ticks: u32| match ticks {
            TICKS => end,
            _ => end.min(begin + span * (f64::from(ticks) / f64::from(TICKS))),
        };
        let ticks_of = |size: f64| (size / span * f64::from(TICKS)).max(1.0);
        let least = ticks_of(self.settings.min_step.unwrap_or(0.0));
        let mut done = 0;
        let mut again = false;
        while done < TICKS {
            let left = TICKS - done;
            let ticks = piece(left, self.next.max(least));
            let it = Piece { time, size: between(time, at(done + ticks)) };
            let error = self.attempt(coupling, exchange, units, it, able)?;
            let good = error <= 1.0;
            let factor = self.factor(error, again || !good);
            self.next = (f64::from(ticks) * factor).max(least);
            if good || !able || f64::from(ticks) <= least {
                done += ticks;
                // where the units are, which may be a rounding error before the tick
                time = it.time + it.size;
                again = false;
                self.last_error = error.max(1e-4);
                self.accept(it.size, good);
                after(exchange, time, it.size);
                continue;
            }
            for unit in units.iter_mut() {
                unit.restore(CONTROL)?;
            }
            // it fits: it is a state of this exchange
            let _ = exchange.restore(&self.before);
            again = true;
            self.report.rejected += 1;
        }
        Ok(())
    }

    fn accept(&mut self, size: f64, good: bool) {
        let report = &mut self.report;
        report.accepted += 1;
        report.forced += u64::from(!good);
        report.smallest = report.smallest.min(size);
        report.largest = report.largest.max(size);
    }

    /// Makes one step and estimates its error.
    fn attempt<U: Unit>(
        &mut self,
        coupling: &mut Coupling<U>,
        exchange: &mut Exchange,
        units: &mut [U],
        Piece { time, size }: Piece,
        able: bool,
    ) -> Result<f64, U::Error> {
        if able {
            for unit in units.iter_mut() {
                unit.save(CONTROL)?;
            }
            self.before.clone_from(exchange.state());
        }
        coupling.step(exchange, units, time, size)?;
        let mut converged = coupling.converged();
        let tolerance = self.settings.tolerance;
        let mut error = 0.0;
        if able && self.settings.estimate == Estimate::Doubling {
            for (long, &signal) in self.long.iter_mut().zip(&self.signals) {
                *long = exchange.signal(signal).now()[0];
            }
            for unit in units.iter_mut() {
                unit.restore(CONTROL)?;
            }
            let _ = exchange.restore(&self.before);
            for (time, size) in parts(time, size, 2) {
                coupling.step(exchange, units, time, size)?;
                converged &= coupling.converged();
            }
            let gain = f64::from((1_u32 << (self.degree + 1)) - 1);
            for (long, &signal) in self.long.iter().zip(&self.signals) {
                let difference = (exchange.signal(signal).now()[0] - long).abs() / gain;
                error = f64::max(error, difference / exchange.allowed_error(signal, tolerance));
            }
        } else {
            for &signal in &self.signals {
                let difference = exchange.prediction_error(signal);
                error = f64::max(error, difference / exchange.allowed_error(signal, tolerance));
            }
        }
        // an iteration that has not converged is repeated with a smaller step
        Ok(if converged { error } else { error.max(2.0) })
    }

    fn factor(&self, error: f64, shrink: bool) -> f64 {
        let doubling = usize::from(self.settings.estimate == Estimate::Doubling);
        #[expect(clippy::cast_precision_loss, reason = "at most 5")]
        let k = (self.degree + 1 + doubling) as f64;
        let error = error.max(1e-10);
        let factor = SAFETY * error.powf(-0.7 / k) * self.last_error.powf(0.4 / k);
        let most = if shrink { 0.9 } else { 2.0 };
        factor.clamp(0.2, most)
    }
}

/// Size of the next step: the rest in equal parts, none larger than proposed.
fn piece(left: u32, proposed: f64) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 1 and 2^20: proposed is at least one tick"
    )]
    let pieces = (f64::from(left) / proposed).ceil().max(1.0) as u32;
    left.div_ceil(pieces)
}
