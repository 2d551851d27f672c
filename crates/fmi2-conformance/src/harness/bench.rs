//! The FMU under test: its library, its description and the findings so far.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use super::Observation;
use super::trace::CallTrace;
use crate::CheckError;
use fmi2_import::description::{
    Causality, Initial, ModelDescription, Severity, Type, Value, Variability, Variable,
};
use fmi2_import::library::Functions;
use fmi2_import::package::Package;
use fmi2_import::span::between;

/// Number of steps of an ordinary run in a check.
pub(crate) const STEPS: usize = 8;
/// Step if the description has neither a step nor an interval (s).
const STEP: f64 = 1e-3;

/// The FMU under test.
pub(crate) struct Bench {
    package: Package,
    functions: Functions,
    trace: CallTrace,
    severity: Severity,
    found: Mutex<Vec<Observation>>,
}

impl Bench {
    /// Opens and loads the FMU. Findings have the severity unless a check gives another.
    ///
    /// # Errors
    /// It cannot be opened or loaded.
    pub(crate) fn new(
        unit: &Path,
        severity: Severity,
        trace: Option<std::fs::File>,
    ) -> Result<Self, CheckError> {
        // an FMU may change the working directory
        let unit = std::path::absolute(unit).unwrap_or_else(|_| unit.to_owned());
        let package = Package::open(&unit)?;
        let functions = Functions::load(&package)?;
        let found = Mutex::default();
        Ok(Self { package, functions, trace: CallTrace::new(trace), severity, found })
    }

    pub(crate) fn package(&self) -> &Package {
        &self.package
    }

    pub(crate) fn description(&self) -> &ModelDescription {
        self.package.description()
    }

    pub(crate) fn functions(&self) -> &Functions {
        &self.functions
    }

    pub(crate) fn trace(&self) -> &CallTrace {
        &self.trace
    }

    /// Records a finding; the check continues.
    pub(crate) fn find(&self, message: impl Into<String>) {
        self.observe(self.severity, message);
    }

    /// Records a finding with another severity; the check continues.
    pub(crate) fn observe(&self, severity: Severity, message: impl Into<String>) {
        let observation =
            Observation { severity, message: message.into(), calls: self.trace.last() };
        self.found.lock().unwrap_or_else(PoisonError::into_inner).push(observation);
    }

    /// Takes the findings so far.
    pub(crate) fn take(&self) -> Vec<Observation> {
        std::mem::take(&mut *self.found.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Starts a new part of the check. Findings in it do not show the calls before it.
    pub(crate) fn part(&self, what: &str) {
        self.trace.begin(what);
    }

    /// Start of the default experiment (s).
    pub(crate) fn start(&self) -> f64 {
        self.description().default_experiment.start_time.unwrap_or(0.0)
    }

    /// Communication step (s): that of the default experiment, or a hundredth of its interval.
    pub(crate) fn step(&self) -> f64 {
        let experiment = &self.description().default_experiment;
        experiment.step_size.filter(|size| *size > 0.0).unwrap_or_else(|| {
            let interval = experiment.stop_time.map(|stop| stop - self.start());
            interval.filter(|it| *it > 0.0).map_or(STEP, |interval| interval / 100.0)
        })
    }

    /// Time of communication point n (s).
    pub(crate) fn time(&self, n: usize) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "small counts")]
        let n = n as f64;
        self.start() + n * self.step()
    }

    /// Size of the step from communication point n (s). It is smaller than the step where rounding would take the end
    /// past the next point, which may be the stop time.
    pub(crate) fn size(&self, n: usize) -> f64 {
        let (time, end, step) = (self.time(n), self.time(n + 1), self.step());
        if time + step <= end { step } else { between(time, end) }
    }

    /// The variables that satisfy a condition.
    pub(crate) fn variables(
        &self,
        test: impl Fn(&Variable) -> bool,
    ) -> impl Iterator<Item = &Variable> {
        self.description().variables.iter().filter(move |variable| test(variable))
    }

    /// Value references of the variables of a type that satisfy a condition, each once.
    pub(crate) fn references(&self, kind: Type, test: impl Fn(&Variable) -> bool) -> Vec<u32> {
        let mut references: Vec<u32> = self
            .variables(|variable| carried(variable.kind) == kind && test(variable))
            .map(|variable| variable.value_reference)
            .collect();
        references.sort_unstable();
        references.dedup();
        references
    }

    /// Real inputs with their start values and how far a check may move them.
    pub(crate) fn inputs(&self) -> Vec<RealInput> {
        self.variables(|variable| {
            variable.causality == Causality::Input && variable.kind == Type::Real
        })
        .map(RealInput::of)
        .collect()
    }

    /// Reals that can be set before initialization.
    pub(crate) fn starts(&self) -> Vec<RealInput> {
        self.variables(|variable| variable.kind == Type::Real && is_start(variable))
            .map(RealInput::of)
            .collect()
    }

    /// Whether the FMU supports model exchange too.
    pub(crate) fn offers_model_exchange(&self) -> bool {
        self.description().offers_model_exchange
    }

    /// Continuous Real inputs.
    pub(crate) fn continuous_inputs(&self) -> Vec<RealInput> {
        self.variables(|variable| {
            variable.causality == Causality::Input
                && variable.kind == Type::Real
                && variable.variability == Variability::Continuous
        })
        .map(RealInput::of)
        .collect()
    }
}

/// The type by which a variable is read and set.
pub(crate) fn carried(kind: Type) -> Type {
    if kind == Type::Enumeration { Type::Integer } else { kind }
}

/// Whether a variable can be set before initialization.
pub(crate) fn is_start(variable: &Variable) -> bool {
    matches!(variable.initial, Some(Initial::Exact | Initial::Approx))
        && variable.variability != Variability::Constant
}

/// A Real that can be set.
#[derive(Debug, Clone)]
pub(crate) struct RealInput {
    pub(crate) name: String,
    pub(crate) reference: u32,
    pub(crate) start: f64,
    /// A small change, twice of which stays within the range; may be negative.
    pub(crate) small: f64,
}

impl RealInput {
    pub(crate) fn of(variable: &Variable) -> Self {
        let start = match variable.start {
            Some(Value::Real(start)) => start,
            _ => 0.0,
        };
        let scale = [start.abs(), variable.nominal.unwrap_or(0.0)].into_iter().fold(0.0, f64::max);
        let mut small = 1e-3 * if scale > 0.0 { scale } else { 1.0 };
        if let (Some(min), Some(max)) = (variable.min, variable.max) {
            small = small.min((max - min) / 16.0);
        }
        if variable.max.is_some_and(|max| start + 2.0 * small > max) {
            small = -small;
        }
        let name = variable.name.clone();
        Self { name, reference: variable.value_reference, start, small }
    }
}
