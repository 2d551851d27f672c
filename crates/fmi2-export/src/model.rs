//! What a unit crate writes: one implementation of [`Model`].

use serde::{Serialize, de::DeserializeOwned};

use crate::interface::Interface;
use crate::values::{RealVar, RealVars, Values};
use crate::{Error, Resources};

/// One communication step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Where the step begins, s.
    pub time: f64,
    /// How long it is, s; greater than 0.
    pub size: f64,
}

impl Step {
    /// Where the step ends, s.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.time + self.size
    }
}

/// A model to be exported as an FMI 2.0 co-simulation unit.
///
/// `Self` is the immutable model with its variable handles (and scratch memory or caches, which
/// must never influence a result). Everything that changes in time is in [`Model::State`] and in
/// the [`Values`], which the kit keeps. So saving, restoring, serialising and resetting are the
/// kit's work alone. The kit never calls a model from two threads at a time; two instances are two
/// models, which must share nothing.
pub trait Model: Sized + Send + 'static {
    /// Everything that changes while stepping, beyond the variables' values.
    ///
    /// Where saving must not allocate, implement `Clone::clone_from` by hand so that it reuses the
    /// memory (for a struct of plain numbers and arrays the derived one is as good).
    type State: Clone + Send + Serialize + DeserializeOwned + 'static;

    /// Reads the resources, declares every variable once and keeps the returned handles.
    ///
    /// Runs at every `fmi2Instantiate` and when the description is printed; the same resources
    /// must give the same declarations.
    ///
    /// # Errors
    /// A resource is missing or wrong.
    fn declare(resources: &Resources, interface: &mut Interface) -> Result<Self, Error>;

    /// The state at `time` as a pure function of the values of parameters and inputs. Also sets
    /// the calculated parameters.
    ///
    /// Called in initialization mode when a value is asked for after something was set, and at its
    /// end; [`Model::outputs`] follows at once.
    ///
    /// # Errors
    /// The values admit no initial state.
    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<Self::State, Error>;

    /// Computes all outputs from the state and the inputs at `time`.
    ///
    /// # Errors
    /// An output has no value here.
    fn outputs(&mut self, state: &Self::State, values: &mut Values, time: f64)
    -> Result<(), Error>;

    /// Advances the state from `step.time` to exactly `step.end()`, with the inputs varying as the
    /// polynomials [`Values::taylor`].
    ///
    /// Afterwards the kit sets each input to its extrapolated end value, zeroes the derivatives
    /// and calls [`Model::outputs`].
    ///
    /// # Errors
    /// With [`Error::discard`] the state must still be that of `step.time`: the importer may try a
    /// smaller step. After any other error the instance only accepts being reset, restored or
    /// freed.
    fn step(
        &mut self,
        state: &mut Self::State,
        values: &mut Values,
        step: Step,
    ) -> Result<(), Error>;

    /// Tunable parameters were changed between steps.
    ///
    /// # Errors
    /// The values do not fit each other.
    fn parameters_changed(
        &mut self,
        state: &mut Self::State,
        values: &mut Values,
    ) -> Result<(), Error> {
        let _ = (state, values);
        Ok(())
    }

    /// Called once before each row of [`Model::output_derivative`] calls, which then all see this
    /// state and these values: the place to check or compute what the derivatives share. What it
    /// leaves is scratch and must not influence results.
    ///
    /// # Errors
    /// The derivatives have no values here.
    fn prepare_derivatives(&mut self, state: &Self::State, values: &Values) -> Result<(), Error> {
        let _ = (state, values);
        Ok(())
    }

    /// The `order`-th time derivative (1, 2, …) of `output` at the current communication point;
    /// `None` where not offered. The values are those that [`Model::outputs`] left.
    ///
    /// Where an output follows inputs at once, its derivative takes the inputs' own derivatives as
    /// they were at the end of the step just done, so far as the model keeps them in its state (the
    /// kit forgets them with the step); an input without counts as held.
    ///
    /// # Errors
    /// The derivative has no value here.
    fn output_derivative(
        &mut self,
        state: &Self::State,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        let _ = (state, values, output, order);
        Ok(None)
    }

    /// Directional derivative between steps: `result` = Σ ∂output/∂input · `seed` at the current
    /// communication point, at least for all outputs that depend on an input. Answer `false` (as
    /// by default) and the kit takes central differences of [`Model::outputs`] instead. In
    /// initialization mode it always does, of [`Model::initialise`] and [`Model::outputs`].
    ///
    /// # Errors
    /// The derivative has no value here.
    fn directional_derivative(
        &mut self,
        state: &Self::State,
        values: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error> {
        let _ = (state, values, seed, result);
        Ok(false)
    }

    /// Answers a request beyond FMI (`fmi2_export_report`), such as a table that is no variable;
    /// `None` for a request that is not offered. Must not influence any later result.
    ///
    /// # Errors
    /// The request is offered, but wrong or without an answer here.
    fn report(
        &mut self,
        state: &Self::State,
        values: &Values,
        request: &str,
    ) -> Result<Option<String>, Error> {
        let _ = (state, values, request);
        Ok(None)
    }
}

/// The direction of a directional derivative: one number per real variable, 0 where not given.
#[derive(Debug, Clone, Default)]
pub struct Seed(pub(crate) Vec<f64>);

impl Seed {
    /// Component of one input.
    #[must_use]
    pub fn real(&self, input: RealVar) -> f64 {
        self.0[input.at()]
    }

    /// Components of a row of inputs.
    #[must_use]
    pub fn reals(&self, inputs: RealVars) -> &[f64] {
        &self.0[inputs.first as usize..][..inputs.len()]
    }
}

/// The result of a directional derivative: one number per real variable, 0 where not set.
#[derive(Debug, Clone, Default)]
pub struct Sensitivity(pub(crate) Vec<f64>);

impl Sensitivity {
    /// Sets the component of one output.
    pub fn set_real(&mut self, output: RealVar, value: f64) {
        self.0[output.at()] = value;
    }

    /// The components of a row of outputs, to be written.
    pub fn reals_mut(&mut self, outputs: RealVars) -> &mut [f64] {
        &mut self.0[outputs.first as usize..][..outputs.len()]
    }
}
