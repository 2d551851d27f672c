//! The result of a tuning.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use crate::counting::Ignored;
use crate::figures::Figures;
use crate::file::{Constraints, Objective};

/// A parameter with its values before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tuned {
    /// `instance.variable`, as for `--set`.
    pub target: String,
    /// The instances that it changes.
    pub instances: Vec<String>,
    /// Unit of measure.
    pub unit: Option<String>,
    /// Bounds.
    pub bounds: (f64, f64),
    /// The scenario's own value.
    pub before: f64,
    /// The value found.
    pub after: f64,
}

/// A limit or bound that holds the objective back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Active {
    /// In words, with the condition.
    pub what: String,
    /// What the objective gains, in its own unit, if the limit is relaxed by 1 % (a bound: by 1 % of its range). To first
    /// order, from differences; null where no differences were made.
    pub gain_per_percent: Option<f64>,
}

/// The system started anew with the values found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verified {
    /// Least damping ratio of the whole system's eigenvalues that belong to the modes of the table that count.
    pub damping: f64,
    /// Largest distance of the six least damped modes that count from their eigenvalues of the whole system, relative.
    pub distance: f64,
    /// Modulus and delay (s) margins of one loop and of all loops alike, computed as `maglev response` does.
    pub margins: Option<[f64; 4]>,
    /// Modes of the whole system that none of the varied units reaches: frequency (Hz) and damping ratio of those with
    /// the least damping.
    pub untouched: Vec<(f64, f64)>,
    /// Modes of the new start that are neither among those of the table nor among those that the varied units did not
    /// reach before: frequency (Hz) and damping ratio. None, unless the operating point has moved much.
    pub unknown: Vec<(f64, f64)>,
}

/// A condition before and after.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionResult {
    /// Its name.
    pub name: String,
    /// What it sets.
    pub set: IndexMap<String, String>,
    /// With the scenario's own values.
    pub before: Figures,
    /// With the values found.
    pub after: Figures,
    /// The least damped eigenvalues (1/s) before and after, also of modes that do not count.
    pub eigenvalues: [Vec<(f64, f64)>; 2],
    /// How it is computed.
    pub method: String,
    /// Modes that the parameters hardly move, at the start; they do not count.
    pub ignored: Vec<Ignored>,
    /// The same with the values found: frequency (Hz) and damping ratio, those in the band first, then by damping.
    pub ignored_after: Vec<(f64, f64)>,
    /// A new start, with all eigenvalues.
    pub verified: Verified,
}

/// A point of the front of damping against modulus margin: none is better in both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrontPoint {
    /// Least damping ratio of all conditions.
    pub damping: f64,
    /// Least modulus margin of all conditions.
    pub modulus: f64,
    /// The parameters, in the order of `parameters`.
    pub values: Vec<f64>,
}

/// Everything.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TuneResult {
    /// Title of the tuning, or of the scenario.
    pub title: String,
    /// What was optimised.
    pub objective: Objective,
    /// Modes are left out if no parameter changes their damping ratio by this fraction.
    pub influence: f64,
    /// Frequencies (Hz) between which modes count.
    pub band: Option<[f64; 2]>,
    /// What had to be kept.
    pub constraints: Constraints,
    /// Whether all constraints are kept.
    pub kept: bool,
    /// The parameters.
    pub parameters: Vec<Tuned>,
    /// The conditions.
    pub conditions: Vec<ConditionResult>,
    /// What holds the objective back.
    pub active: Vec<Active>,
    /// The front.
    pub front: Vec<FrontPoint>,
    /// What was assumed, and what fell short.
    pub notes: Vec<String>,
    /// Evaluations of all conditions.
    pub evaluations: usize,
    /// Wall time (s).
    pub seconds: f64,
}

impl TuneResult {
    /// The values found as `instance.variable` and value.
    #[must_use]
    pub fn patch(&self) -> Vec<(String, f64)> {
        self.parameters.iter().map(|it| (it.target.clone(), it.after)).collect()
    }

    /// The worst of all conditions, before and after.
    #[must_use]
    pub fn worst(&self) -> [FrontPoint; 2] {
        let of = |figures: &dyn Fn(&ConditionResult) -> Figures, values: Vec<f64>| {
            let all: Vec<Figures> = self.conditions.iter().map(figures).collect();
            let least =
                |of: &dyn Fn(&Figures) -> f64| all.iter().map(of).fold(f64::INFINITY, f64::min);
            // an unstable system has no margin
            let modulus = |it: &Figures| if it.stable() { it.modulus() } else { 0.0 };
            FrontPoint { damping: least(&|it| it.damping), modulus: least(&modulus), values }
        };
        [
            of(&|it| it.before.clone(), self.parameters.iter().map(|it| it.before).collect()),
            of(&|it| it.after.clone(), self.parameters.iter().map(|it| it.after).collect()),
        ]
    }
}
