//! The variables of a bundle, declared as its table lists them.

use bundle_table::{Exposed, Kind, Limits, Role, Table, Value};
use fmi2_export::{
    BooleanVar, Error, Info, IntegerVar, Interface, RealVar, StringVar, UnitOfMeasure, Values,
    VariableRow,
};

use crate::measures::{lasting, measure};

/// Handle on a variable of any type.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Handle {
    Real(RealVar),
    Integer(IntegerVar),
    Boolean(BooleanVar),
    String(StringVar),
}

impl Handle {
    fn row(self) -> VariableRow {
        match self {
            Self::Real(it) => it.row(),
            Self::Integer(it) => it.row(),
            Self::Boolean(it) => it.row(),
            Self::String(it) => it.row(),
        }
    }

    /// The value that the variable has.
    pub(crate) fn value(self, values: &Values) -> Value {
        match self {
            Self::Real(it) => Value::Real(values.real(it)),
            Self::Integer(it) => Value::Integer(values.integer(it)),
            Self::Boolean(it) => Value::Boolean(values.boolean(it)),
            Self::String(it) => Value::String(values.string(it).to_owned()),
        }
    }
}

/// Declares everything and returns the handles in the order of the table.
pub(crate) fn declare(table: &Table, interface: &mut Interface) -> Result<Vec<Handle>, Error> {
    let info = Info::new(&table.identifier, &table.model_name)
        .description(&table.description)
        .version(env!("CARGO_PKG_VERSION"))
        .license(&table.license)
        .copyright(&table.copyright)
        .experiment(table.start, table.stop, table.step);
    interface.describe(match table.tolerance {
        Some(tolerance) => info.tolerance(tolerance),
        None => info,
    });
    let Limits { variable_step, states, instances, alone } = table.limits.clone();
    interface.limit(fmi2_export::Limits {
        variable_step,
        states,
        instances,
        alone,
        directional: Some("a bundle offers none".to_owned()),
    });
    let measures: Vec<UnitOfMeasure> = table.measures.iter().map(measure).collect();
    let mut handles = Vec::with_capacity(table.variables.len());
    for it in &table.variables {
        handles.push(variable(it, &measures, interface)?);
    }
    for (it, handle) in table.variables.iter().zip(&handles) {
        if it.role == Role::Output {
            let rows = |list: &[usize]| list.iter().map(|&k| handles[k].row()).collect::<Vec<_>>();
            interface.depends(handle.row(), &rows(&it.depends));
            interface.initially_depends(handle.row(), &rows(&it.initially));
        }
    }
    Ok(handles)
}

/// Gives a declaration its role.
macro_rules! with_role {
    ($draft:expr, $it:expr, $start:expr) => {
        match $it.role {
            Role::Input => $draft.input($start),
            Role::Parameter => $draft.parameter($start),
            Role::Tunable => $draft.tunable($start),
            Role::Output => $draft.output(),
        }
        .description($it.description.as_str())
    };
}

fn variable(
    it: &Exposed,
    measures: &[UnitOfMeasure],
    interface: &mut Interface,
) -> Result<Handle, Error> {
    let name = it.name.as_str();
    let handle = match (it.kind, &it.start) {
        (Kind::Real, start @ (None | Some(Value::Real(_)))) => {
            let start = if let Some(Value::Real(x)) = start { *x } else { 0.0 };
            let mut draft = with_role!(interface.real(name), it, start);
            if let Some(place) = it.measure {
                draft = draft.unit(measures[place]);
            }
            if let Some(display) = &it.display {
                draft = draft.display(lasting(display));
            }
            if let Some(nominal) = it.nominal {
                draft = draft.nominal(nominal);
            }
            if let Some(min) = it.min {
                draft = draft.min(min);
            }
            if let Some(max) = it.max {
                draft = draft.max(max);
            }
            if it.discrete && matches!(it.role, Role::Input | Role::Output) {
                draft = draft.discrete();
            } else if it.role == Role::Input {
                draft = draft.takes(it.takes);
            } else {
                draft = draft.derivatives(it.derivatives).interpolated(it.interpolated);
            }
            Handle::Real(draft.done())
        }
        (Kind::Integer, start @ (None | Some(Value::Integer(_)))) => {
            let start = if let Some(Value::Integer(x)) = start { *x } else { 0 };
            let mut draft = with_role!(interface.integer(name), it, start);
            if let Some(min) = it.min {
                draft = draft.min(whole(min));
            }
            if let Some(max) = it.max {
                draft = draft.max(whole(max));
            }
            Handle::Integer(draft.done())
        }
        (Kind::Boolean, start @ (None | Some(Value::Boolean(_)))) => {
            let start = matches!(start, Some(Value::Boolean(true)));
            Handle::Boolean(with_role!(interface.boolean(name), it, start).done())
        }
        (Kind::String, start @ (None | Some(Value::String(_)))) => {
            let start = if let Some(Value::String(text)) = start { text.as_str() } else { "" };
            Handle::String(with_role!(interface.string(name), it, start).done())
        }
        _ => return Err(Error::invalid(format!("the start value of {name} is of another type"))),
    };
    Ok(handle)
}

/// A bound of an Integer.
#[expect(clippy::cast_possible_truncation, reason = "the cast saturates")]
fn whole(bound: f64) -> i32 {
    bound as i32
}
