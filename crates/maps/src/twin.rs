//! A unit once more, alone, with other values of its parameters: its linearisation without the system.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use fmi2_import::description::{Type, Value};
use fmi2_import::instance::Instance;
use fmi2_import::library::Functions;
use linear::{LinearUnit, Report};
use master::Setup;
use master::system::{InstanceSetup, VariableIndex};

use crate::error::Error;

/// One unit of a scenario as it starts there: the values of all its connected inputs are known.
pub struct Twin<'a> {
    setup: &'a InstanceSetup,
    times: (f64, f64),
    functions: Functions,
    dead: Arc<AtomicBool>,
    /// References and values of connected inputs.
    inputs: (Vec<u32>, Vec<f64>),
    variables: (Vec<VariableIndex>, Vec<VariableIndex>),
}

/// A parameter with a value.
pub type Given = (VariableIndex, f64);

/// Starts the scenario and makes twins of some of its instances.
///
/// # Errors
/// The scenario does not start, or a unit cannot be loaded.
pub fn twins<'a>(setup: &'a Setup, of: &[usize]) -> Result<Vec<Twin<'a>>, Error> {
    let mut simulation = setup.start()?;
    let experiment = setup.scenario().experiment;
    let mut all = Vec::new();
    for &k in of {
        let plan = &setup.system().instances[k];
        let participant = &mut simulation.participants_mut()[k];
        let list = |list: &[(VariableIndex, usize)]| -> Vec<VariableIndex> {
            list.iter().map(|(variable, _)| *variable).collect()
        };
        let variables = participant.variables();
        let variables = (list(&variables.inputs.reals), list(&variables.outputs.reals));
        let reference = |k: &VariableIndex| plan.description().variables[k.0].value_reference;
        let references: Vec<u32> = variables.0.iter().map(reference).collect();
        let mut values = vec![0.0; references.len()];
        participant.instance_mut().get_real(&references, &mut values).map_err(|source| {
            linear::LinearError::Inputs { instance: plan.name.clone(), source }
        })?;
        all.push(Twin {
            setup: plan,
            times: (experiment.start, experiment.stop),
            functions: Functions::load(&plan.package)?,
            dead: Arc::default(),
            inputs: (references, values),
            variables,
        });
    }
    Ok(all)
}

impl Twin<'_> {
    /// The connected inputs and their values at the start of the scenario.
    pub fn inputs(&self) -> impl Iterator<Item = (VariableIndex, f64)> + '_ {
        self.variables.0.iter().copied().zip(self.inputs.1.iter().copied())
    }

    /// The linearisation with these parameters.
    ///
    /// # Errors
    /// The unit refuses a value, or does not report its linearisation.
    pub fn linear(&self, given: &[Given]) -> Result<LinearUnit, Error> {
        let (name, package) = (&self.setup.name, &self.setup.package);
        let refused = |source: fmi2_import::instance::FmuError| {
            let (variable, value) = given.first().copied().unwrap_or((VariableIndex(0), 0.0));
            Error::Value {
                instance: name.clone(),
                target: self.setup.description().variables[variable.0].name.clone(),
                value,
                source: Box::new(source),
            }
        };
        let made = Instance::new(package, self.functions.clone(), &self.dead, name);
        let mut instance = made.map_err(refused)?;
        instance
            .setup_experiment(self.setup.tolerance, self.times.0, self.times.1)
            .map_err(refused)?;
        for (variable, value) in &self.setup.parameters {
            instance.set(variable.0, value).map_err(refused)?;
        }
        for (variable, value) in given {
            instance.set(variable.0, &Value::Real(*value)).map_err(refused)?;
        }
        instance.enter_initialization_mode().map_err(refused)?;
        for (variable, value) in &self.setup.inputs {
            instance.set(variable.0, value).map_err(refused)?;
        }
        if !self.inputs.0.is_empty() {
            instance.set_real(&self.inputs.0, &self.inputs.1).map_err(refused)?;
        }
        instance.exit_initialization_mode().map_err(refused)?;
        let text = instance
            .report("linear")
            .map_err(|source| linear::LinearError::Silent { instance: name.clone(), source })?;
        let report = Report::read(name, &text)?;
        Ok(report.into_unit(name, package.description(), &self.variables.0, &self.variables.1)?)
    }
}

/// What an axis changes: the parameters of instances that differ from those without it. None if it changes inputs too.
///
/// # Errors
/// A parameter is not Real.
pub fn changed(
    base: &Setup,
    other: &Setup,
    target: &str,
) -> Result<Option<Vec<(usize, VariableIndex)>>, Error> {
    let mut all = Vec::new();
    let both = base.system().instances.iter().zip(&other.system().instances);
    for (k, (before, after)) in both.enumerate() {
        if before.inputs != after.inputs {
            return Ok(None);
        }
        for (variable, value) in &after.parameters {
            if before.parameters.get(variable) == Some(value) {
                continue;
            }
            if after.description().variables[variable.0].kind != Type::Real {
                return Err(Error::NotReal { target: target.to_owned() });
            }
            all.push((k, *variable));
        }
    }
    Ok(Some(all))
}
