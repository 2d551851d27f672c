//! Energy that the coupling creates or loses between pairs of effort and flow, such as force and
//! velocity.
//!
//! One unit returns the effort e, another uses ẽ; the flow f comes back as f̃. At the end of a
//! step, δP = ẽ f − e f̃ is the power that one side gives and the other does not receive; δP · h is the
//! step's residual energy (Sadjina, Kyllingstad, Skjong & Pedersen 2017, "Energy conservation and
//! power bonds in co-simulations", Engineering with Computers 33).

use results::summary::PowerReport;

use super::exchange::Exchange;
use super::index::SignalIndex;

/// One side of a pair.
#[derive(Debug, Clone, Copy)]
struct Side {
    signal: SignalIndex,
    /// whether its target takes it extrapolated
    extrapolated: bool,
}

impl Side {
    /// The values that the source returns and the target uses.
    fn ends(self, exchange: &Exchange) -> (f64, f64) {
        let signal = exchange.signal(self.signal);
        let given = signal.now()[0];
        (given, if self.extrapolated { signal.assumed() } else { given })
    }
}

/// Measures the residual power of pairs.
#[derive(Debug, Clone, Default)]
pub struct PowerMeter {
    pairs: Vec<(Side, Side)>,
    report: PowerReport,
}

impl PowerMeter {
    /// Measures these pairs of effort and flow. `extrapolated` are the signals that some unit takes
    /// before their source has stepped.
    #[must_use]
    pub fn new(pairs: &[(SignalIndex, SignalIndex)], extrapolated: &[SignalIndex]) -> Self {
        let side = |signal| Side { signal, extrapolated: extrapolated.contains(&signal) };
        let pairs: Vec<_> = pairs.iter().map(|&(e, f)| (side(e), side(f))).collect();
        let report = PowerReport { pairs: pairs.len(), ..PowerReport::default() };
        Self { pairs, report }
    }

    /// Adds a step that ended at `time`.
    pub fn add(&mut self, exchange: &Exchange, time: f64, size: f64) {
        let report = &mut self.report;
        for (effort, flow) in &self.pairs {
            let (e, e_taken) = effort.ends(exchange);
            let (f, f_taken) = flow.ends(exchange);
            let residual = e_taken * f - e * f_taken;
            report.transmitted += (e * f).abs() * size;
            report.residual += residual.abs() * size;
            report.net += residual * size;
            if residual.abs() > report.largest {
                report.largest = residual.abs();
                report.time_of_largest = time;
            }
        }
    }

    /// The sums so far, for a mark.
    pub(super) fn mark(&self) -> PowerReport {
        self.report
    }

    pub(super) fn return_to(&mut self, report: PowerReport) {
        self.report = report;
    }

    /// The residual so far; `None` without pairs.
    #[must_use]
    pub fn report(&self) -> Option<PowerReport> {
        (!self.pairs.is_empty()).then_some(self.report)
    }
}
