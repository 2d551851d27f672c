//! The linearisation of a bundle: that of its units, joined by their connections.

use bundle_table::{Role, Table};
use fmi2_export::{Error, Motions, StateSpace};
use linear::{Linearised, Open};
use master::Simulation;

use crate::declare::Handle;
use crate::measures::lasting;
use crate::running::Prepared;

/// The answer to the report `linear`, between the exposed inputs and outputs. It takes the coupling as exact: the master's
/// steps inside are not part of it.
pub(crate) fn states(
    prepared: &Prepared,
    simulation: &mut Simulation<'_>,
    table: &Table,
    handles: &[Handle],
) -> Result<String, Error> {
    let failed = |error: linear::LinearError| Error::caused(&error);
    let system = Linearised::of(&prepared.setup, simulation).map_err(failed)?.system;
    let mut space = StateSpace::default();
    let mut open = Open::default();
    // columns of the inputs in the report; one of them may stand for many inside
    let mut columns = Vec::new();
    let mut rows = 0;
    for (it, handle) in table.variables.iter().zip(handles) {
        let Handle::Real(variable) = handle else { continue };
        match it.role {
            Role::Input => {
                // inputs that a unit does not report have no effect
                let found: Vec<_> =
                    it.ports.iter().filter_map(|name| system.input(name).ok()).collect();
                if !found.is_empty() {
                    let column = space.input(*variable);
                    columns.extend(found.iter().map(|_| column));
                    open.inputs.extend(found);
                }
            }
            Role::Output => {
                if let Some(port) = it.ports.first().and_then(|name| system.output(name).ok()) {
                    space.output(*variable);
                    open.outputs.push(port);
                    rows += 1;
                }
            }
            Role::Parameter | Role::Tunable => {}
        }
    }
    let found = system.open(&open).map_err(failed)?;
    let states = found.states.len();
    for name in found.states {
        space.state(name);
    }
    for j in 0..states {
        (0..states).for_each(|i| space.a(i, j, found.a[(i, j)]));
        (0..rows).for_each(|i| space.c(i, j, found.c[(i, j)]));
    }
    for (k, &column) in columns.iter().enumerate() {
        (0..states).for_each(|i| space.b(i, column, found.b[(i, k)]));
        (0..rows).for_each(|i| space.d(i, column, found.d[(i, k)]));
    }
    space.to_json()
}

/// The answer to the report `motions`: what moves in the units inside, with the names of their instances in front.
pub(crate) fn motions(
    prepared: &Prepared,
    simulation: &mut Simulation<'_>,
) -> Result<String, Error> {
    let found = Linearised::of_with_motions(&prepared.setup, simulation);
    let found = found.map_err(|error| Error::caused(&error))?;
    let mut all = Motions::default();
    let mut first = 0;
    for (unit, own) in found.system.units.iter().zip(&found.motions) {
        let mut rows = Vec::with_capacity(own.parts.len());
        for it in &own.parts {
            let part = format!("{} {}", unit.name, it.part);
            rows.push(all.motion(part, it.direction.as_str(), it.at, lasting(&it.unit)));
        }
        for (i, j, value) in own.rows.iter() {
            all.by(rows[i], first + j, value);
        }
        first += unit.states.len();
    }
    all.to_json()
}
