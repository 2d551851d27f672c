//! Values of variables in Python's types.

use std::path::{Path, PathBuf, absolute};

use fmi2_import::description::Type;
use fmi2_import::instance::FmuError;
use master::Simulation;
use master::system::{Port, System};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyString};
use scenario::{FileSetting, Setting};

/// The value of a variable.
#[derive(IntoPyObject)]
pub enum Value {
    Real(f64),
    Integer(i32),
    /// of a study
    Whole(i64),
    Boolean(bool),
    Text(String),
}

/// A Python value as a setting: a bool, also NumPy's, a number, a text or a path.
pub fn setting(value: &Bound<'_, PyAny>) -> PyResult<Setting> {
    if value.is_instance_of::<PyBool>() || value.get_type().name()? == "bool" {
        return Ok(Setting::Boolean(value.is_truthy()?));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Setting::Text(text.to_string()));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(Setting::Number(number));
    }
    if let Ok(path) = value.extract::<PathBuf>() {
        return Ok(Setting::File(FileSetting { path: whole(&path) }));
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!(
        "a value is a number, True, False, a text or a path, not {kind}"
    )))
}

/// A setting as the text of `--set`.
pub fn text(setting: &Setting) -> String {
    match setting {
        Setting::Boolean(value) => value.to_string(),
        // the shortest decimal that reads back to the same number
        Setting::Number(value) => value.to_string(),
        Setting::Text(text) => text.clone(),
        Setting::File(file) => file.path.to_string_lossy().into_owned(),
    }
}

/// The absolute path, so that it stays valid in other folders and processes.
pub fn whole(path: &Path) -> PathBuf {
    absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// The present value of a variable, in its own unit of measure.
pub fn read(
    simulation: &mut Simulation<'_>,
    system: &System,
    port: Port,
) -> Result<Value, FmuError> {
    let variable = system.variable(port);
    let references = [variable.value_reference];
    let instance = simulation.participants_mut()[port.instance.0].instance_mut();
    let (mut real, mut whole) = ([0.0], [0]);
    Ok(match variable.kind {
        Type::Real => {
            instance.get_real(&references, &mut real)?;
            Value::Real(real[0])
        }
        Type::Integer | Type::Enumeration => {
            instance.get_integer(&references, &mut whole)?;
            Value::Integer(whole[0])
        }
        Type::Boolean => {
            instance.get_boolean(&references, &mut whole)?;
            Value::Boolean(whole[0] != 0)
        }
        Type::String => {
            let text = instance.get_string(references[0])?;
            Value::Text(text.to_string_lossy().into_owned())
        }
    })
}
