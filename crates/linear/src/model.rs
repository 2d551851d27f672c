//! Named state-space models, as they are written to files.

use faer::Mat;
use results::modes::OperatingPoint;

use super::coupled::StateSpace;
use super::error::LinearError;
use super::stepped::Stepped;
use super::steps::UnitSteps;
use super::system::{LinearSystem, Linearised, Port};
use super::unit::{LinearUnit, Quantity};

/// Where a model comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Units of the scenario, joined by its connections.
    Coupled,
    /// The report `linear` of the unit.
    Reported,
    /// Directional derivatives of the unit with respect to its states (FMI 2.0, section 2.2.8).
    Derivatives,
    /// Steps from a saved state; its states have no meaning of their own.
    Identified,
}

impl Source {
    /// As written to files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Coupled => "coupled",
            Self::Reported => "report",
            Self::Derivatives => "directional derivatives",
            Self::Identified => "identified from steps",
        }
    }
}

/// A linear model: ẋ = A x + B u, y = C x + D u, or x⁺ = A x + B u, y = C x + D u for steps, where inputs are held
/// over a step and outputs are those at its end.
#[derive(Debug, Clone)]
pub struct Model {
    /// `coupled`, or the name of an instance; `_stepped` is added for steps.
    pub name: String,
    /// Where it comes from.
    pub source: Source,
    /// Step of a discrete model (s).
    pub step: Option<f64>,
    /// Relative error of an identified model.
    pub error: Option<f64>,
    /// The matrices and names.
    pub system: StateSpace,
}

/// All models of a scenario about its start.
#[derive(Debug, Clone)]
pub struct Models {
    /// The coupled system first, then the units in the order of the scenario.
    pub models: Vec<Model>,
    /// The point of linearisation.
    pub point: OperatingPoint,
    /// What could not be done, and why.
    pub notes: Vec<String>,
}

impl Models {
    /// The models of a scenario that was linearised. `inputs` and `outputs` select the free inputs and the outputs
    /// of the coupled system by their names `instance.variable`.
    ///
    /// # Errors
    /// The units cannot be coupled, or a unit is too fast for the step.
    pub fn of(
        linearised: &Linearised,
        inputs: impl Fn(&str, bool) -> bool,
        outputs: impl Fn(&str) -> bool,
    ) -> Result<Self, LinearError> {
        let Linearised { system, stepping, .. } = linearised;
        let mut models = Vec::new();
        let mut notes = Vec::new();
        if linearised.unreported.is_empty() {
            let chosen = Chosen::new(system, &inputs, &outputs);
            let closed = system.open(&super::Open {
                inputs: chosen.inputs.clone(),
                outputs: chosen.outputs.clone(),
                ..Default::default()
            })?;
            models.push(Model::continuous("coupled", Source::Coupled, closed));
            let map = Stepped::with_free_inputs(&system.units, stepping)?;
            let steps = map.open(system, &chosen.inputs, &chosen.outputs)?;
            models.push(Model::steps("coupled", Source::Coupled, stepping.step, steps));
        } else {
            let names: Vec<&str> =
                linearised.unreported.iter().map(|(name, _)| name.as_str()).collect();
            notes.push(format!(
                "no model of the coupled system: only identified models of {}",
                names.join(", ")
            ));
        }
        for (unit, source) in system.units.iter().zip(&linearised.sources) {
            let found = linearised.unreported.iter().find(|(name, _)| *name == unit.name);
            if let Some((name, steps)) = found {
                models.push(Model::identified(name, steps));
                continue;
            }
            models.push(Model::continuous(&unit.name, *source, unit.dense()));
            let steps = unit.steps(stepping.step)?;
            models.push(Model::steps(&unit.name, *source, stepping.step, steps));
        }
        Ok(Self { models, point: system.point.clone(), notes })
    }
}

/// Free inputs and shown outputs of the coupled system.
struct Chosen {
    inputs: Vec<Port>,
    outputs: Vec<Port>,
}

impl Chosen {
    fn new(
        system: &LinearSystem,
        inputs: &impl Fn(&str, bool) -> bool,
        outputs: &impl Fn(&str) -> bool,
    ) -> Self {
        let mut chosen = Self { inputs: Vec::new(), outputs: Vec::new() };
        for (k, unit) in system.units.iter().enumerate() {
            for index in 0..unit.inputs.len() {
                let port = Port { unit: k, index };
                if inputs(&system.input_name(port).name, index < unit.connected_inputs) {
                    chosen.inputs.push(port);
                }
            }
            for index in 0..unit.outputs.len() {
                let port = Port { unit: k, index };
                if outputs(&system.output_name(port).name) {
                    chosen.outputs.push(port);
                }
            }
        }
        chosen
    }
}

impl Model {
    fn continuous(name: &str, source: Source, system: StateSpace) -> Self {
        Self { name: name.to_owned(), source, step: None, error: None, system }
    }

    fn steps(name: &str, source: Source, step: f64, system: StateSpace) -> Self {
        Self { name: format!("{name}_stepped"), source, step: Some(step), error: None, system }
    }

    fn identified(name: &str, steps: &UnitSteps) -> Self {
        let model = steps.model.clone();
        let system = StateSpace {
            states: (1..=model.a.nrows()).map(|k| format!("state {k}")).collect(),
            inputs: steps.inputs.clone(),
            outputs: steps.outputs.clone(),
            a: model.a,
            b: model.b,
            c: model.c,
            d: model.d,
        };
        let error = Some(steps.error);
        Self { error, ..Self::steps(name, Source::Identified, steps.step, system) }
    }
}

impl LinearUnit {
    /// The unit with dense matrices.
    #[must_use]
    pub fn dense(&self) -> StateSpace {
        let (n, m, p) = (self.states.len(), self.inputs.len(), self.outputs.len());
        let filled = |rows: &super::Rows, height: usize, width: usize| {
            let mut matrix = Mat::<f64>::zeros(height, width);
            rows.iter().for_each(|(i, j, value)| matrix[(i, j)] += value);
            matrix
        };
        StateSpace {
            states: self.states.clone(),
            inputs: self.inputs.clone(),
            outputs: self.outputs.clone(),
            a: filled(&self.a, n, n),
            b: filled(&self.b, n, m),
            c: filled(&self.c, p, n),
            d: filled(&self.d, p, m),
        }
    }

    /// The unit over a step with held inputs: x⁺ = Φ x + Γ u, y = C x⁺ + D u at the end of the step.
    ///
    /// # Errors
    /// The unit is too fast for the step.
    pub fn steps(&self, step: f64) -> Result<StateSpace, LinearError> {
        let map = super::unit_map::UnitMap::new(self, 3, &[], step, true)?;
        let StateSpace { states, inputs, outputs, c, d, .. } = self.dense();
        let b = map.by_input.into_iter().next().map_or_else(Mat::new, |it| it.matrix);
        let a = map.by_state.matrix;
        let (shown, fed) = (&c * &a, &c * &b + &d);
        Ok(StateSpace { states, inputs, outputs, a, b, c: shown, d: fed })
    }
}

/// Names of quantities.
pub(crate) fn names(list: &[Quantity]) -> Vec<String> {
    list.iter().map(|it| it.name.clone()).collect()
}

/// Units of measure of quantities; an empty text where there is none.
pub(crate) fn measures(list: &[Quantity]) -> Vec<String> {
    list.iter().map(|it| it.unit.clone().unwrap_or_default()).collect()
}
