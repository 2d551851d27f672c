//! The trait that a unit crate implements.

use serde::{Serialize, de::DeserializeOwned};

use crate::interface::Interface;
use crate::values::{RealVar, RealVars, Values};
use crate::{Error, Resources};

/// One communication step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Start of the step, s.
    pub time: f64,
    /// Length of the step, s; greater than 0.
    pub size: f64,
}

impl Step {
    /// End of the step, s.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.time + self.size
    }
}

/// A model to be exported as an FMI 2.0 co-simulation unit.
///
/// `Self` is the immutable model with its variable handles (and scratch memory or caches, which
/// must never influence a result). Everything that changes in time is in [`Model::State`] and in
/// the [`Values`], which the kit keeps. So the kit alone saves, restores, serialises and resets.
/// The kit never calls a model from two threads at the same time. Two instances are two models,
/// which must not share anything.
pub trait Model: Sized + Send + 'static {
    /// Everything that changes while stepping, beyond the variables' values.
    ///
    /// If saving must not allocate, implement `Clone::clone_from` so that it reuses the memory (for
    /// a struct of plain numbers and arrays the derived one does so already).
    type State: Clone + Send + Serialize + DeserializeOwned + 'static;

    /// Reads the resources, declares every variable once and keeps the returned handles.
    ///
    /// Runs at every `fmi2Instantiate` (but see [`Model::copied`]) and when the description is printed; the
    /// same resources must give the same declarations.
    ///
    /// # Errors
    /// A resource is missing or invalid.
    fn declare(resources: &Resources, interface: &mut Interface) -> Result<Self, Error>;

    /// A model for another instance with the same resources: what [`Model::declare`] would return for them.
    /// With it, further instances in a process start faster, since nothing is declared again. The kit asks a
    /// model that no call but `declare` has changed, or a copy of one. The default, `None`, declares again.
    fn copied(&self, _resources: &Resources) -> Option<Self> {
        None
    }

    /// The state at `time` as a pure function of the values of parameters and inputs. Also sets
    /// the calculated parameters.
    ///
    /// Called in initialization mode when a value is read after another was set, and at its end;
    /// [`Model::outputs`] follows immediately.
    ///
    /// # Errors
    /// There is no initial state for these values.
    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<Self::State, Error>;

    /// Called once at the end of initialization mode, with the state that the simulation begins with: for what
    /// only steps need, and costs too much for each call of [`Model::initialise`].
    ///
    /// # Errors
    /// The simulation cannot begin.
    fn begins(&mut self, _state: &mut Self::State) -> Result<(), Error> {
        Ok(())
    }

    /// Computes all outputs from the state and the inputs at `time`.
    ///
    /// # Errors
    /// An output has no value at this point.
    fn outputs(&mut self, state: &Self::State, values: &mut Values, time: f64)
    -> Result<(), Error>;

    /// Advances the state from `step.time` to exactly `step.end()`, with inputs that vary as the
    /// polynomials [`Values::taylor`], inputs that are declared to take more derivatives also with
    /// [`Values::further`].
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
    /// The values are inconsistent.
    fn parameters_changed(
        &mut self,
        state: &mut Self::State,
        values: &mut Values,
    ) -> Result<(), Error> {
        let _ = (state, values);
        Ok(())
    }

    /// Called once before each series of [`Model::output_derivative`] calls, which all use this
    /// state and these values: the place to compute what the derivatives share. Its results are
    /// scratch data and must not influence later results.
    ///
    /// # Errors
    /// The derivatives have no values at this point.
    fn prepare_derivatives(&mut self, state: &Self::State, values: &Values) -> Result<(), Error> {
        let _ = (state, values);
        Ok(())
    }

    /// The `order`-th time derivative (1, 2, …) of `output` at the current communication point;
    /// `None` if not offered. The values are those that [`Model::outputs`] wrote.
    ///
    /// If an output depends directly on inputs, its derivative uses the derivatives of the inputs
    /// at the end of the last step, as far as the model keeps them in its state (the kit discards
    /// them after the step). An input without derivatives counts as constant.
    ///
    /// # Errors
    /// The derivative has no value at this point.
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
    /// communication point, at least for all outputs that depend on an input. If it returns `false`
    /// (the default), the kit uses central differences of [`Model::outputs`] instead. In
    /// initialization mode it always uses central differences of [`Model::initialise`] and
    /// [`Model::outputs`].
    ///
    /// # Errors
    /// The derivative has no value at this point.
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

    /// Start and stop time (s) and relative tolerance, as the importer sets them up before initialization.
    fn experiment(&mut self, start: f64, stop: Option<f64>, tolerance: Option<f64>) {
        let _ = (start, stop, tolerance);
    }

    /// Called before the state is copied to be saved. A model that wraps something with a state of its own puts
    /// everything of it into `state` here.
    ///
    /// # Errors
    /// The state cannot be saved.
    fn saving(&mut self, state: &mut Self::State) -> Result<(), Error> {
        let _ = state;
        Ok(())
    }

    /// Called after a saved state and its values have become those of the instance. A model that wraps something
    /// returns it to `state` here. The instance may be new, and [`Model::initialise`] need not have been called.
    ///
    /// # Errors
    /// The state cannot be restored. The instance then only accepts being reset, restored or freed.
    fn restored(&mut self, state: &mut Self::State, values: &mut Values) -> Result<(), Error> {
        let _ = (state, values);
        Ok(())
    }

    /// Messages for the importer's log since the last call. They are taken after initialization and after each step,
    /// and are sent if the importer has turned events on.
    fn messages(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// Answers a request beyond FMI (`fmi2_export_report`), such as a table that cannot be a
    /// variable; `None` for an unknown request. Must not influence any later result.
    ///
    /// # Errors
    /// The request is known, but invalid or without an answer at this point.
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

/// The direction of a directional derivative: one number per real variable, 0 unless given.
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

/// The result of a directional derivative: one number per real variable, 0 unless set.
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
