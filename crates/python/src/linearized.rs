//! Modes and matrices of a scenario about its start.

use arrow_buffer::ScalarBuffer;
use linear::{LinearSystem, LinearUnit, Linearised, Open, Port, Quantity, Rows};
use master::Setup;
use patterns::matches;
use scenario::Scenario;

use crate::column::Column;
use crate::error::Failure;

/// A matrix: rows, columns, and its numbers row after row.
type Matrix = (usize, usize, Column);
/// Names of variables with their units of measure.
type Quantities = Vec<(String, Option<String>)>;
/// A, B, C, D; states, inputs, outputs.
pub type Model = (Vec<Matrix>, Vec<String>, Quantities, Quantities);

/// The modes of the coupled system, as JSON.
pub fn modes(scenario: &Scenario) -> Result<String, Failure> {
    let setup = Setup::new(scenario)?;
    let modes = linear::modes::find(&setup).map_err(maglev::Error::from)?;
    serde_json::to_string(&modes).map_err(|error| Failure::input(error.to_string(), None))
}

/// One instance as a linear system.
pub fn unit(scenario: &Scenario, name: &str) -> Result<Model, Failure> {
    let setup = Setup::new(scenario)?;
    let found = Linearised::at_start(&setup).map_err(maglev::Error::from)?;
    let unit = found.system.units.into_iter().find(|unit| unit.name == name);
    let Some(unit) = unit else {
        let error = setup.system().unknown_instance(&format!("linearize {name}"), name);
        return Err(master::Error::from(error).into());
    };
    let LinearUnit { states, inputs, outputs, a, b, c, d, .. } = unit;
    let (n, m, p) = (states.len(), inputs.len(), outputs.len());
    let full = [(a, n, n), (b, n, m), (c, p, n), (d, p, m)];
    let matrices = full.map(|(rows, height, width)| dense(&rows, height, width));
    Ok((matrices.into(), states, named(inputs), named(outputs)))
}

/// The coupled system between free inputs and outputs, which names with stars select. Without names: the recorded signals
/// that are outputs, and all inputs without a connection.
pub fn coupled(
    scenario: &Scenario,
    inputs: Option<&[String]>,
    outputs: Option<&[String]>,
) -> Result<Model, Failure> {
    let setup = Setup::new(scenario)?;
    let system = Linearised::at_start(&setup).map_err(maglev::Error::from)?.system;
    let all_inputs = ports(&system, |unit| &unit.inputs);
    let all_outputs = ports(&system, |unit| &unit.outputs);
    let inputs = match inputs {
        Some(names) => chosen(names, &all_inputs, "input")?,
        None => all_inputs
            .iter()
            .map(|(_, port)| *port)
            .filter(|port| port.index >= system.units[port.unit].connected_inputs)
            .collect(),
    };
    let outputs = match outputs {
        Some(names) => chosen(names, &all_outputs, "output")?,
        None => {
            let find = |name: String| all_outputs.iter().find(|(it, _)| *it == name);
            setup.signals().filter_map(find).map(|(_, port)| *port).collect()
        }
    };
    let open = system.open(&Open { inputs, outputs, ..Open::default() });
    let open = open.map_err(maglev::Error::from)?;
    let matrices = [&open.a, &open.b, &open.c, &open.d].map(|matrix| {
        let (height, width) = (matrix.nrows(), matrix.ncols());
        let values = (0..height).flat_map(|i| (0..width).map(move |j| matrix[(i, j)]));
        (height, width, Column::new(values.collect::<ScalarBuffer<f64>>()))
    });
    Ok((matrices.into(), open.states, named(open.inputs), named(open.outputs)))
}

fn ports(system: &LinearSystem, list: impl Fn(&LinearUnit) -> &[Quantity]) -> Vec<(String, Port)> {
    let units = system.units.iter().enumerate();
    let of = |(k, unit)| {
        let unit: &LinearUnit = unit;
        let named = list(unit).iter().enumerate();
        let port = |(index, it): (usize, &Quantity)| {
            (format!("{}.{}", unit.name, it.name), Port { unit: k, index })
        };
        named.map(port).collect::<Vec<_>>()
    };
    units.flat_map(of).collect()
}

/// The ports that names with stars and ranges select, in the order of the names.
fn chosen(names: &[String], all: &[(String, Port)], kind: &str) -> Result<Vec<Port>, Failure> {
    let mut ports = Vec::new();
    for name in names {
        let mut found = false;
        for single in patterns::expand(name).unwrap_or_else(|_| vec![name.clone()]) {
            for (known, port) in all {
                if *known == single || matches(&single, known) {
                    found = true;
                    if !ports.contains(port) {
                        ports.push(*port);
                    }
                }
            }
        }
        if !found {
            let near = patterns::suggest_pattern(name, all.iter().map(|(it, _)| it.as_str()));
            let near = near.map(|it| format!("; did you mean \"{it}\"?")).unwrap_or_default();
            let text = format!("no unit reports an {kind} \"{name}\" in its linearisation{near}");
            return Err(Failure::input(text, None));
        }
    }
    Ok(ports)
}

fn named(quantities: Vec<Quantity>) -> Quantities {
    quantities.into_iter().map(|it| (it.name, it.unit)).collect()
}

fn dense(rows: &Rows, height: usize, width: usize) -> Matrix {
    let mut values = vec![0.0; height * width];
    for (i, j, value) in rows.iter() {
        values[i * width + j] += value;
    }
    (height, width, Column::new(ScalarBuffer::from(values)))
}
