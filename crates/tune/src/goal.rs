//! The objective and the constraints as numbers.

use crate::figures::{Figures, LEAST};
use crate::file::{Constraints, Objective};

/// What the search keeps of a limit in reserve, so that a result that is exact to four digits keeps it.
const RESERVE: f64 = 0.003;
/// Largest value of a constraint that is kept: far from its limit it does not matter.
const FAR: f64 = 2.0;

/// A limit that is kept or exceeded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Limit {
    Damping,
    Outside,
    ModulusOne,
    ModulusAll,
    DelayOne,
    DelayAll,
    Voltage,
}

impl Limit {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Damping => "damping ratio",
            Self::Outside => "decay of modes out of the band or left out",
            Self::ModulusOne => "modulus margin of one loop",
            Self::ModulusAll => "modulus margin of all loops alike",
            Self::DelayOne => "delay margin of one loop",
            Self::DelayAll => "delay margin of all loops alike",
            Self::Voltage => "r.m.s. voltage",
        }
    }
}

/// What is wanted.
#[derive(Debug, Clone)]
pub(crate) struct Goal {
    pub objective: Objective,
    pub limits: Constraints,
    /// Whether a reserve is kept.
    pub reserved: bool,
}

impl Goal {
    /// The objective of the worst condition; the larger the better.
    pub fn value(&self, all: &[Figures]) -> f64 {
        all.iter().map(|it| self.of(it)).fold(f64::INFINITY, f64::min)
    }

    fn of(&self, it: &Figures) -> f64 {
        match self.objective {
            Objective::Damping => it.damping,
            Objective::Decay => it.decay,
            Objective::Modulus => it.modulus(),
            Objective::Voltage => -it.voltage,
        }
    }

    /// The parts of the objective, scaled so that changes of some hundredths matter. The least of them counts.
    pub fn parts(&self, all: &[Figures]) -> Vec<f64> {
        let of = |it: &Figures| -> Vec<f64> {
            match self.objective {
                Objective::Damping => padded(&it.least, 1.0),
                Objective::Decay => vec![0.1 * it.decay],
                Objective::Modulus => vec![it.modulus_one, it.modulus_all],
                Objective::Voltage => vec![-0.3 * it.voltage.max(1e-12).ln()],
            }
        };
        all.iter().flat_map(of).collect()
    }

    /// All constraints of one condition; positive where kept.
    pub fn constraints(&self, it: &Figures) -> Vec<(Limit, f64)> {
        let mut all = Vec::new();
        let reserve = if self.reserved { RESERVE } else { 0.0 };
        let Constraints { damping, modulus, delay, voltage } = self.limits;
        // all modes must decay in any case, with a little to spare
        let least = damping.unwrap_or(1e-4) + 0.1 * reserve;
        all.push((Limit::Damping, it.damping - least));
        all.push((Limit::Outside, (it.outside - 1e-4 - 0.1 * reserve).min(FAR)));
        // margins of a system that grows mean nothing: the nearer to the border, the better
        let sign = if it.stable() { 1.0 } else { -1.0 };
        if let Some(least) = modulus {
            all.push((Limit::ModulusOne, sign * it.modulus_one - least - reserve));
            all.push((Limit::ModulusAll, sign * it.modulus_all - least - reserve));
        }
        if let Some(least) = delay {
            let relative = |value: f64| (value / least - 1.0 - reserve).min(FAR);
            let kept = |value: f64| {
                if it.stable() {
                    relative(value)
                } else {
                    it.damping.min(it.outside).min(0.0) - 0.01
                }
            };
            all.push((Limit::DelayOne, kept(it.delay_one)));
            all.push((Limit::DelayAll, kept(it.delay_all)));
        }
        if let Some(most) = voltage {
            all.push((Limit::Voltage, ((most / it.voltage.max(1e-12)).ln() - reserve).min(FAR)));
        }
        all
    }

    /// Sum of what is exceeded.
    pub fn violation(&self, all: &[Figures]) -> f64 {
        all.iter().flat_map(|it| self.constraints(it)).map(|it| (-it.1).max(0.0)).sum()
    }

    /// Whether a set of values is better than another: first by what it exceeds, then by the objective.
    pub fn better(&self, one: &[Figures], other: &[Figures]) -> bool {
        let (a, b) = (self.violation(one), self.violation(other));
        if a == b { self.value(one) > self.value(other) } else { a < b }
    }
}

fn padded(least: &[f64], with: f64) -> Vec<f64> {
    let mut all = least.to_vec();
    all.resize(LEAST, with);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_constraints_are_positive_where_kept() {
        let goal = Goal {
            objective: Objective::Damping,
            limits: Constraints { voltage: Some(2.0), ..Constraints::default() },
            reserved: false,
        };
        let good = Figures {
            damping: 0.2,
            outside: 1.0,
            least: vec![0.2],
            modulus_one: 0.7,
            modulus_all: 0.5,
            delay_one: 0.002,
            delay_all: 0.001,
            voltage: 2.0,
            ..Figures::default()
        };
        assert_eq!(goal.violation(std::slice::from_ref(&good)), 0.0);
        assert_eq!(goal.parts(std::slice::from_ref(&good)), [0.2, 1.0, 1.0, 1.0]);
        let bad = Figures { modulus_all: 0.4, ..good.clone() };
        assert!((goal.violation(&[good.clone(), bad.clone()]) - 0.1).abs() < 1e-12);
        assert!(goal.better(std::slice::from_ref(&good), std::slice::from_ref(&bad)));
        let growing = Figures { damping: -0.1, ..good.clone() };
        assert!(goal.violation(&[growing]) > 1.0);
        let loud = Figures { voltage: 4.0, ..good };
        assert!((goal.violation(&[loud]) - 2.0_f64.ln()).abs() < 1e-12);
    }
}
