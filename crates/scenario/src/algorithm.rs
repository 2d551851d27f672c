//! Settings of the coupling algorithm.

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name of a coupling algorithm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Default)]
#[serde(rename_all = "kebab-case")]
pub enum AlgorithmName {
    /// All units step at once, with inputs extrapolated from the start of the step.
    Jacobi,
    /// The units step one after the other. Inputs whose source has already stepped are interpolated.
    #[default]
    GaussSeidel,
    /// Gauss-Seidel steps are repeated from saved states until inputs and outputs agree.
    Iterated,
    /// Steps are repeated by Newton's method with the Jacobian of the interface until inputs and outputs agree.
    Newton,
}

impl AlgorithmName {
    /// All algorithms, simplest first.
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
            format!("unknown algorithm \"{text}\"; choose one of {}", names.join(", "))
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
    /// Degree of the polynomials that extrapolate inputs; 0 holds them. Default: 2, but 0 in loops of direct
    /// feed-through that the algorithm does not solve.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 3))]
    pub extrapolation: Option<u8>,
    /// Use derivatives of outputs for the extrapolation where units provide them. False: use past values only.
    pub derivatives: bool,
    /// What to do when a unit discards a step.
    pub on_discard: OnDiscard,
    /// Order in which instances step: instance names, patterns allowed. The other instances follow in an order that is
    /// derived from their dependencies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub order: Vec<String>,
    /// Number of threads for units that can step at the same time. The results are bit-identical for any number.
    #[schemars(range(min = 1))]
    pub threads: usize,
    /// Settings of the algorithms that iterate.
    pub iteration: IterationSettings,
    /// Groups of instances with a separate algorithm. Groups step one after the other.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<AlgorithmGroup>,
    /// Variable step size, controlled by an estimate of the coupling error. `experiment.step` is then the largest step,
    /// and signals are recorded at its multiples. Default: all steps are equal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variable: Option<VariableStep>,
    /// Scale of a signal's relative tolerance, by `instance.output` (patterns allowed), in the output's unit of
    /// measurement. Default: the value or the nominal value, whichever is larger.
    #[serde(skip_serializing_if = "IndexMap::is_empty")]
    pub sizes: IndexMap<String, f64>,
    /// Pairs of effort and flow, such as force and velocity. Their residual energy is reported.
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

/// Default degree of the extrapolation.
const DEGREE: u8 = 2;

impl AlgorithmSettings {
    /// Degree of the extrapolation for signals without a degree of their own.
    #[must_use]
    pub fn degree(&self) -> usize {
        usize::from(self.extrapolation.unwrap_or(DEGREE))
    }

    /// The first setting outside its range: its path, its value and what is allowed.
    #[must_use]
    pub fn out_of_range(&self) -> Option<(&'static str, String, &'static str)> {
        const PART: &str = "between 0 and 1, both exclusive";
        const POSITIVE: &str = "a positive number";
        let part = |x: f64| x > 0.0 && x < 1.0;
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let wrong = |what, value: &dyn ToString, allowed| Some((what, value.to_string(), allowed));
        if let Some(degree) = self.extrapolation.filter(|degree| *degree > 3) {
            return wrong("algorithm.extrapolation", &degree, "from 0 to 3");
        }
        if self.threads == 0 {
            return wrong("algorithm.threads", &self.threads, "1 or more");
        }
        for it in self.groups.iter().map(|group| &group.iteration).chain([&self.iteration]) {
            if !part(it.tolerance) {
                return wrong("algorithm: iteration.tolerance", &it.tolerance, PART);
            }
            if ![ORDER, 6].contains(&it.order) {
                return wrong("algorithm: iteration.order", &it.order, "4 or 6");
            }
            if it.sweeps == 0 {
                return wrong("algorithm: iteration.sweeps", &it.sweeps, "1 or more");
            }
            if !(positive(it.relaxation) && it.relaxation <= 2.0) {
                return wrong(
                    "algorithm: iteration.relaxation",
                    &it.relaxation,
                    "above 0 and at most 2",
                );
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
    /// Restore the state of the unit and repeat the step in 2, 4, 8 … up to 1024 parts. If the unit cannot save its
    /// state or vary its step size, the run ends.
    #[default]
    Retry,
    /// End the run. This saves the time for saving the state before every step.
    Fail,
}

/// A group of instances with a separate algorithm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Group")]
pub struct AlgorithmGroup {
    /// Instance names, patterns allowed.
    pub instances: Vec<String>,
    /// The coupling algorithm of the group.
    pub name: AlgorithmName,
    /// Settings of the iteration, if the algorithm iterates.
    #[serde(default)]
    pub iteration: IterationSettings,
}

/// How the next iterate is computed from the last ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Acceleration {
    /// Add a fixed fraction of the residual.
    None,
    /// Adapt the fraction in every iteration (Aitken's method).
    Aitken,
    /// Quasi-Newton method with the differences of the last iterates (IQN-ILS).
    Anderson,
}

/// Source of the derivatives for Newton's method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JacobianSource {
    /// `fmi2GetDirectionalDerivative`; for units without it, differences of repeated steps.
    Directional,
    /// Differences of steps that are repeated from saved states.
    Steps,
}

/// Settings of the iteration within a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct IterationSettings {
    /// Relative tolerance. A step has converged when every output at its end differs by at most this fraction of its
    /// scale from the value that the other units used.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance: f64,
    /// Largest number of iterations in a step. A step that has not converged by then is accepted and counted.
    #[schemars(range(min = 1))]
    pub sweeps: u32,
    /// Acceleration of the algorithm `iterated`.
    pub acceleration: Acceleration,
    /// Fraction of the residual that is added: in every iteration without acceleration, otherwise in the first one.
    pub relaxation: f64,
    /// Source of the derivatives for the algorithm `newton`.
    pub jacobian: JacobianSource,
    /// Order of the coupling of smooth signals: 4 interpolates with values and first derivatives of outputs, 6 with
    /// second derivatives too, where units declare them.
    #[serde(skip_serializing_if = "is_default_order")]
    #[schemars(extend("enum" = [4, 6]))]
    pub order: u8,
}

/// Order of the coupling unless set.
const ORDER: u8 = 4;

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_default_order(order: &u8) -> bool {
    *order == ORDER
}

impl Default for IterationSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-6,
            sweeps: 20,
            acceleration: Acceleration::Anderson,
            relaxation: 1.0,
            jacobian: JacobianSource::Directional,
            order: ORDER,
        }
    }
}

/// How the error of a step is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Estimate {
    /// By the difference between the extrapolated and the computed signals.
    #[default]
    Predictor,
    /// By the difference between one step and two steps of half the size.
    Doubling,
}

/// Settings of the variable step size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariableStep {
    /// Largest error of a signal in a step, as a fraction of its scale.
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
    /// `instance.output`, patterns allowed; as many signals as `effort`.
    pub flow: String,
}
