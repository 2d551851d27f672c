//! A model behind an interface without type parameters, so that the C functions are compiled only
//! once.

use std::any::Any;

use crate::model::{Model, Seed, Sensitivity, Step};
use crate::panics::dropped;
use crate::table::VariableTable;
use crate::values::{RealVar, Values};
use crate::{Error, Resources};

/// A model's state apart from the model, as saved by `fmi2GetFMUstate`; `None` before
/// initialization.
pub(crate) type SavedModelState = Option<Box<dyn Any + Send>>;

/// A [`Model`] with its state.
pub(crate) trait ErasedModel: Send {
    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<(), Error>;
    /// Called at the end of initialization mode.
    fn begins(&mut self) -> Result<(), Error>;
    fn outputs(&mut self, values: &mut Values, time: f64) -> Result<(), Error>;
    fn step(&mut self, values: &mut Values, step: Step) -> Result<(), Error>;
    fn parameters_changed(&mut self, values: &mut Values) -> Result<(), Error>;
    fn prepare_derivatives(&mut self, values: &Values) -> Result<(), Error>;
    fn output_derivative(
        &mut self,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error>;
    fn directional_derivative(
        &mut self,
        values: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error>;
    fn report(&mut self, values: &Values, request: &str) -> Result<Option<String>, Error>;
    /// Forgets the state, as before initialization.
    fn forget(&mut self);
    fn experiment(&mut self, start: f64, stop: Option<f64>, tolerance: Option<f64>);
    fn messages(&mut self) -> Vec<String>;
    fn save(&mut self, saved: &mut SavedModelState) -> Result<(), Error>;
    fn restore(&mut self, saved: &SavedModelState) -> Result<(), Error>;
    /// Called after a state and its values were restored.
    fn restored(&mut self, values: &mut Values) -> Result<(), Error>;
    fn serialize(&self, saved: &SavedModelState) -> Result<Vec<u8>, Error>;
    fn deserialize(&self, bytes: &[u8]) -> Result<SavedModelState, Error>;
    /// Rebuilds the model from the resources after a panic.
    fn rebuild(&mut self, resources: &Resources) -> Result<VariableTable, Error>;
}

pub(crate) struct ModelWithState<M: Model> {
    pub(crate) model: M,
    pub(crate) state: Option<M::State>,
}

fn no_state() -> Error {
    Error::invalid("the model has no state yet: initialise it first")
}

fn foreign_state() -> Error {
    Error::invalid("the saved state belongs to another unit")
}

impl<M: Model> ErasedModel for ModelWithState<M> {
    fn initialise(&mut self, values: &mut Values, time: f64) -> Result<(), Error> {
        self.state = Some(self.model.initialise(values, time)?);
        Ok(())
    }

    fn begins(&mut self) -> Result<(), Error> {
        self.model.begins(self.state.as_mut().ok_or_else(no_state)?)
    }

    fn outputs(&mut self, values: &mut Values, time: f64) -> Result<(), Error> {
        let state = self.state.as_ref().ok_or_else(no_state)?;
        self.model.outputs(state, values, time)
    }

    fn step(&mut self, values: &mut Values, step: Step) -> Result<(), Error> {
        let state = self.state.as_mut().ok_or_else(no_state)?;
        self.model.step(state, values, step)
    }

    fn parameters_changed(&mut self, values: &mut Values) -> Result<(), Error> {
        let state = self.state.as_mut().ok_or_else(no_state)?;
        self.model.parameters_changed(state, values)
    }

    fn prepare_derivatives(&mut self, values: &Values) -> Result<(), Error> {
        let state = self.state.as_ref().ok_or_else(no_state)?;
        self.model.prepare_derivatives(state, values)
    }

    fn output_derivative(
        &mut self,
        values: &Values,
        output: RealVar,
        order: u32,
    ) -> Result<Option<f64>, Error> {
        let state = self.state.as_ref().ok_or_else(no_state)?;
        self.model.output_derivative(state, values, output, order)
    }

    fn directional_derivative(
        &mut self,
        values: &Values,
        seed: &Seed,
        result: &mut Sensitivity,
    ) -> Result<bool, Error> {
        let state = self.state.as_ref().ok_or_else(no_state)?;
        self.model.directional_derivative(state, values, seed, result)
    }

    fn report(&mut self, values: &Values, request: &str) -> Result<Option<String>, Error> {
        let state = self.state.as_ref().ok_or_else(no_state)?;
        self.model.report(state, values, request)
    }

    fn forget(&mut self) {
        self.state = None;
    }

    fn experiment(&mut self, start: f64, stop: Option<f64>, tolerance: Option<f64>) {
        self.model.experiment(start, stop, tolerance);
    }

    fn messages(&mut self) -> Vec<String> {
        self.model.messages()
    }

    fn restored(&mut self, values: &mut Values) -> Result<(), Error> {
        match &mut self.state {
            Some(state) => self.model.restored(state, values),
            None => Ok(()),
        }
    }

    fn save(&mut self, saved: &mut SavedModelState) -> Result<(), Error> {
        let Some(state) = &mut self.state else {
            *saved = None;
            return Ok(());
        };
        self.model.saving(state)?;
        match saved.as_mut().and_then(|saved| saved.downcast_mut::<M::State>()) {
            Some(memory) => memory.clone_from(state),
            None => *saved = Some(Box::new(state.clone())),
        }
        Ok(())
    }

    fn restore(&mut self, saved: &SavedModelState) -> Result<(), Error> {
        let Some(saved) = saved else {
            self.state = None;
            return Ok(());
        };
        let saved = saved.downcast_ref::<M::State>().ok_or_else(foreign_state)?;
        match &mut self.state {
            Some(memory) => memory.clone_from(saved),
            none => *none = Some(saved.clone()),
        }
        Ok(())
    }

    fn serialize(&self, saved: &SavedModelState) -> Result<Vec<u8>, Error> {
        let state = match saved {
            None => None,
            Some(saved) => Some(saved.downcast_ref::<M::State>().ok_or_else(foreign_state)?),
        };
        postcard::to_stdvec(&state).map_err(|error| Error::caused(&error).context("serialising"))
    }

    fn deserialize(&self, bytes: &[u8]) -> Result<SavedModelState, Error> {
        let state: Option<M::State> = postcard::from_bytes(bytes)
            .map_err(|error| Error::caused(&error).context("the serialised state is damaged"))?;
        Ok(state.map(|state| Box::new(state) as Box<dyn Any + Send>))
    }

    fn rebuild(&mut self, resources: &Resources) -> Result<VariableTable, Error> {
        let (model, table) = VariableTable::declare::<M>(resources)?;
        let old = std::mem::replace(self, Self { model, state: None });
        dropped(old);
        Ok(table)
    }
}
