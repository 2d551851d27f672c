//! What a scenario says of the coupling.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name of a coupling algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Default)]
#[serde(rename_all = "kebab-case")]
pub enum AlgorithmName {
    /// All units step at once, on inputs extrapolated from the step's beginning.
    Jacobi,
    /// The units step one after the other; inputs whose source has stepped are interpolated.
    #[default]
    GaussSeidel,
    /// Gauss-Seidel steps are made again from saved states until the inputs fit the outputs.
    Iterated,
    /// The same with Newton's method on the Jacobian of the interface.
    Newton,
}

impl AlgorithmName {
    /// All algorithms.
    pub const ALL: [Self; 4] = [Self::Jacobi, Self::GaussSeidel, Self::Iterated, Self::Newton];

    /// The name as scenarios write it.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Jacobi => "jacobi",
            Self::GaussSeidel => "gauss-seidel",
            Self::Iterated => "iterated",
            Self::Newton => "newton",
        }
    }
}

impl std::str::FromStr for AlgorithmName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|name| name.as_str() == text).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|name| name.as_str()).collect();
            format!("there is no algorithm \"{text}\"; there are {}", names.join(", "))
        })
    }
}

/// How the units are coupled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Algorithm")]
pub struct AlgorithmSettings {
    /// The coupling algorithm.
    pub name: AlgorithmName,
    /// Degree of the polynomials that inputs are extrapolated with: 0 holds them. Left out: 2, and 0 in
    /// loops of direct feed-through that the algorithm does not solve.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 3))]
    pub extrapolation: Option<u8>,
    /// Use derivatives of outputs where units offer them; otherwise history alone.
    pub derivatives: bool,
    /// What to do when a unit discards a step.
    pub on_discard: OnDiscard,
    /// Sequence of the units' steps: instance names, patterns allowed. Instances left out follow
    /// in the order that the dependencies suggest.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<String>,
    /// Threads that step units which do not wait for each other; results are the same bits for any
    /// number.
    #[schemars(range(min = 1))]
    pub threads: usize,
    /// For algorithms that iterate.
    pub iteration: IterationSettings,
    /// Instances with an algorithm of their own. Groups step one after the other.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<AlgorithmGroup>,
    /// Choose the step by an estimate of the coupling error; `experiment.step` is then the largest
    /// step, at whose multiples signals are recorded. Left out: all steps are equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variable: Option<VariableStep>,
    /// What tolerances of signals are relative to, by `instance.output` (patterns allowed) in the
    /// output's unit of measurement. Left out: the value or the nominal value, whichever is larger.
    #[serde(skip_serializing_if = "IndexMap::is_empty")]
    pub sizes: IndexMap<String, f64>,
    /// Pairs of effort and flow, such as force and velocity, whose residual energy is reported.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub power: Vec<PowerPair>,
}

impl Default for AlgorithmSettings {
    fn default() -> Self {
        Self {
            name: AlgorithmName::default(),
            extrapolation: None,
            derivatives: true,
            on_discard: OnDiscard::default(),
            order: Vec::new(),
            threads: 1,
            iteration: IterationSettings::default(),
            groups: Vec::new(),
            variable: None,
            sizes: IndexMap::new(),
            power: Vec::new(),
        }
    }
}

/// Degree of the extrapolation where nothing else is said and it is safe.
const DEGREE: u8 = 2;

impl AlgorithmSettings {
    /// Degree of the extrapolation of signals that have no other.
    #[must_use]
    pub fn degree(&self) -> usize {
        usize::from(self.extrapolation.unwrap_or(DEGREE))
    }

    /// The first setting that is outside of its range: which, its value, what is allowed.
    #[must_use]
    pub fn out_of_range(&self) -> Option<(&'static str, String, &'static str)> {
        const PART: &str = "0 to 1, both exclusive";
        const POSITIVE: &str = "positive numbers";
        let part = |x: f64| x > 0.0 && x < 1.0;
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let wrong = |what, value: &dyn ToString, allowed| Some((what, value.to_string(), allowed));
        if let Some(degree) = self.extrapolation.filter(|degree| *degree > 3) {
            return wrong("algorithm.extrapolation", &degree, "0 to 3");
        }
        if self.threads == 0 {
            return wrong("algorithm.threads", &self.threads, "1 or more");
        }
        for it in self.groups.iter().map(|group| &group.iteration).chain([&self.iteration]) {
            if !part(it.tolerance) {
                return wrong("algorithm: iteration.tolerance", &it.tolerance, PART);
            }
            if it.sweeps == 0 {
                return wrong("algorithm: iteration.sweeps", &it.sweeps, "1 or more");
            }
            if !(positive(it.relaxation) && it.relaxation <= 2.0) {
                return wrong("algorithm: iteration.relaxation", &it.relaxation, "0 to 2, not 0");
            }
        }
        if let Some(variable) = &self.variable {
            if !part(variable.tolerance) {
                return wrong("algorithm.variable.tolerance", &variable.tolerance, PART);
            }
            if let Some(least) = variable.min_step.filter(|least| !positive(*least)) {
                return wrong("algorithm.variable.min_step", &least, POSITIVE);
            }
        }
        let size = self.sizes.values().find(|size| !positive(**size))?;
        wrong("algorithm.sizes", size, POSITIVE)
    }
}

/// What to do when a unit discards a step (`fmi2Discard`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Default)]
#[serde(rename_all = "kebab-case")]
pub enum OnDiscard {
    /// Put its state back and make the same step in 2, 4, 8 … up to 1024 parts. Units that cannot
    /// save their state, or take steps of one size only, end the run.
    #[default]
    Retry,
    /// End the run. Spares saving the state before every step.
    Fail,
}

/// Instances with an algorithm of their own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Group")]
pub struct AlgorithmGroup {
    /// Instance names, patterns allowed.
    pub instances: Vec<String>,
    /// The coupling algorithm.
    pub name: AlgorithmName,
    /// If it iterates.
    #[serde(default)]
    pub iteration: IterationSettings,
}

/// How the next iterate is made of the last ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Acceleration {
    /// A fixed part of the residual is added.
    None,
    /// The part is adapted to what the last one achieved.
    Aitken,
    /// Quasi-Newton from the differences of the last iterates (IQN-ILS).
    Anderson,
}

/// Where Newton's method has the units' derivatives from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JacobianSource {
    /// `fmi2GetDirectionalDerivative`, differences of steps for units without.
    Directional,
    /// Differences of steps made again from saved states.
    Steps,
}

/// When and how iterations end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct IterationSettings {
    /// A step is settled when no signal at its end differs by more than this part of its size from
    /// what the others have gone by.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Most sweeps over the units in a step; a step that has not settled by then stands, and is
    /// counted.
    #[schemars(range(min = 1))]
    pub sweeps: u32,
    /// How the next iterate is made, of "iterated".
    pub acceleration: Acceleration,
    /// Part of the residual that is added, at first or always.
    pub relaxation: f64,
    /// Where derivatives come from, of "newton".
    pub jacobian: JacobianSource,
}

impl Default for IterationSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            sweeps: 20,
            acceleration: Acceleration::Anderson,
            relaxation: 1.0,
            jacobian: JacobianSource::Directional,
        }
    }
}

/// How a step's error is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Estimate {
    /// By the difference between extrapolated signals and what they turned out to be.
    #[default]
    Predictor,
    /// By the difference between one step and two of half the size.
    Doubling,
}

/// Steps of variable size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariableStep {
    /// Largest error of a signal in a step, as a part of its size.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// How the error is estimated.
    #[serde(default)]
    pub estimate: Estimate,
    /// Smallest step (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_step: Option<f64>,
}

/// A pair of signals whose product is a power.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerPair {
    /// `instance.output`, patterns allowed.
    pub effort: String,
    /// `instance.output`, as many as efforts.
    pub flow: String,
}
