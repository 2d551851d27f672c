//! The simulation inside, together with the setup that it belongs to.

use std::path::Path;
use std::sync::Arc;

use bundle_table::{Exposed, SCENARIO, Table};
use coupling::Outside;
use fmi2_export::Error;
use fmi2_import::description;
use master::simulation::Pool;
use master::system::Port;
use master::{Setup, Simulation};
use scenario::Scenario;

use crate::state::Times;

/// A setup for certain times.
pub(crate) struct Prepared {
    pub(crate) setup: Setup,
    pub(crate) times: Times,
    /// per variable of the table, the variables inside
    pub(crate) ports: Vec<Vec<Port>>,
    pub(crate) outside: Arc<Outside>,
    /// whether each variable has been set to another value than that of the scenario
    pub(crate) put: Vec<bool>,
    /// until when signals over time have their jumps, if the importer sets no stop time (s)
    pub(crate) horizon: f64,
}

self_cell::self_cell!(
    /// A running simulation.
    pub(crate) struct Running {
        owner: Prepared,
        #[not_covariant]
        dependent: Simulation,
    }
);

/// The scenario with its units open.
pub(crate) struct Opened {
    scenario: Scenario,
    pool: Pool,
}

impl Opened {
    /// Reads the scenario and opens the units.
    pub(crate) fn new(folder: &Path) -> Result<Self, Error> {
        let scenario = Scenario::load(&folder.join(SCENARIO)).map_err(|it| Error::caused(&it))?;
        let mut pool = Pool::default();
        pool.setup(&scenario).map_err(|it| refusal(&it))?;
        Ok(Self { scenario, pool })
    }

    /// A setup for these times. `inputs` are the variables of the table that the importer may change at any time.
    pub(crate) fn prepare(
        &mut self,
        times: Times,
        table: &Table,
        inputs: &[usize],
    ) -> Result<Prepared, Error> {
        let mut scenario = self.scenario.clone();
        let experiment = &mut scenario.experiment;
        let span = experiment.stop - experiment.start;
        experiment.start = times.start;
        experiment.stop = fitting(times, experiment.step, span);
        experiment.tolerance = times.tolerance.or(experiment.tolerance);
        let horizon = match times.stop {
            None if !scenario.inputs.is_empty() => experiment.stop,
            _ => f64::INFINITY,
        };
        let mut setup = self.pool.setup(&scenario).map_err(|it| refusal(&it))?;
        if times.stop.is_none() {
            setup.remove_stop();
        }
        let find = |it: &Exposed| it.ports.iter().map(|name| port(&setup, name)).collect();
        let ports: Vec<Vec<Port>> = table.variables.iter().map(find).collect::<Result<_, _>>()?;
        let open: Vec<Port> = inputs.iter().flat_map(|&k| ports[k].iter().copied()).collect();
        let outside = setup.open_inputs(&open);
        let put = vec![false; ports.len()];
        Ok(Prepared { setup, times, ports, outside, put, horizon })
    }

    /// Starts the units.
    pub(crate) fn start(&mut self, prepared: Prepared) -> Result<Running, Error> {
        let pool = &mut self.pool;
        Running::try_new(prepared, |it| it.setup.start_from(pool).map_err(|it| refusal(&it)))
    }
}

/// A stop time that is a communication point, at or after that of the importer.
fn fitting(times: Times, step: f64, span: f64) -> f64 {
    let wanted = times.stop.map_or(span, |stop| stop - times.start);
    let count = (wanted / step).round().max(1.0);
    if (count * step - wanted).abs() <= 1e-9 * wanted {
        return times.start + wanted;
    }
    times.start + (wanted / step).ceil().max(1.0) * step
}

fn port(setup: &Setup, name: &str) -> Result<Port, Error> {
    let found = setup.system().select(name, name).map_err(|it| Error::caused(&it))?;
    let [port] = found[..] else {
        return Err(Error::invalid(format!("{name} of the table is not one variable")));
    };
    Ok(port)
}

/// A value for a unit.
pub(crate) fn value(value: bundle_table::Value) -> description::Value {
    match value {
        bundle_table::Value::Real(x) => description::Value::Real(x),
        bundle_table::Value::Integer(x) => description::Value::Integer(x),
        bundle_table::Value::Boolean(x) => description::Value::Boolean(x),
        bundle_table::Value::String(x) => description::Value::String(x),
    }
}

/// What the importer sees of an error inside: its causes with the names of the instances, and how to fix it.
pub(crate) fn refusal(error: &master::Error) -> Error {
    if let master::Error::Step { source, .. } = error
        && source.asks_to_end()
    {
        return Error::terminated(Error::caused(error));
    }
    let told = Error::caused(error);
    match error.help() {
        Some(help) => Error::invalid(format!("{told} ({help})")),
        None => told,
    }
}
