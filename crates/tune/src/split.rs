//! A linearised scenario as the units that are tuned, each with one force, and everything else.

use faer::Mat;
use linear::{LinearSystem, LinearUnit, Open, Port, Quantity, Rows, StateSpace};
use maps::{factor, largest};

use crate::error::TuneError;

/// Equal to rounding.
const EQUAL: f64 = 1e-12;
/// Relative change of what a unit passes on without states up to which it is due to its operating point, and left out:
/// the lateral stiffness of a magnet on a bent girder follows its force. A new start shows what that does.
const UNCHANGED: f64 = 0.25;

/// Which units are tuned, and how they are connected to the rest.
#[derive(Debug, Clone)]
pub(crate) struct Split {
    /// The units that are tuned.
    pub units: Vec<usize>,
    /// Their inputs that matter.
    pub channels: Vec<usize>,
    /// Names of these inputs.
    pub names: Vec<String>,
    /// Their connected output with the largest response to their states.
    force: usize,
    /// Output and input of the signal at which loops are broken: an output to which something can be added.
    pub broken: Option<(usize, usize)>,
    /// Whether all units are equal.
    pub equal: bool,
}

/// ẋ = A x + B e + b w, f = C x, v = V x + D e + d w: from the measurements e and what adds to the broken signal to
/// the force and the broken signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Law {
    pub a: Mat<f64>,
    pub b: Mat<f64>,
    pub force: Vec<f64>,
    pub signal: Vec<f64>,
    pub direct: Vec<f64>,
    pub added: Vec<f64>,
    pub added_direct: f64,
}

fn row(rows: &Rows, k: usize, width: usize) -> Vec<f64> {
    let mut all = vec![0.0; width];
    rows.row(k).iter().for_each(|&(j, value)| all[j] += value);
    all
}

impl Split {
    /// Finds out how units are connected to the rest.
    pub fn new(system: &LinearSystem, units: Vec<usize>) -> Result<Self, TuneError> {
        let all = &system.units;
        let first = &all[units[0]];
        let wrong = |unit: &LinearUnit, problem: &str| TuneError::Units {
            instance: unit.name.clone(),
            problem: problem.to_owned(),
        };
        let n = first.states.len();
        let state = |unit: &LinearUnit, output: usize| row(&unit.c, output, unit.states.len());
        let force = (0..first.connected_outputs)
            .max_by(|&a, &b| largest(&state(first, a)).total_cmp(&largest(&state(first, b))));
        let Some(force) = force.filter(|&it| largest(&state(first, it)) > 0.0) else {
            return Err(wrong(first, "it has no states that reach a connected output"));
        };
        let broken = first.outputs.iter().enumerate().find_map(|(output, it)| {
            let input = first.inputs.iter().position(|input| input.name == it.name)?;
            Some((output, input))
        });
        let mut channels: Vec<usize> = Vec::new();
        for &k in &units {
            let unit = &all[k];
            let shape = |unit: &LinearUnit| {
                (
                    unit.states.len(),
                    unit.connected_inputs,
                    unit.connected_outputs,
                    unit.inputs.len(),
                )
            };
            if shape(unit) != shape(first) {
                return Err(wrong(
                    unit,
                    &format!("it has other inputs, outputs or states than {}", first.name),
                ));
            }
            let main = state(unit, force);
            if (0..unit.connected_outputs).any(|it| factor(&state(unit, it), &main).is_none()) {
                return Err(wrong(
                    unit,
                    "its states act by several outputs on their own; only units with one force can be tuned",
                ));
            }
            let by_signal =
                broken.map(|(output, _)| unit.d.row(output).to_vec()).unwrap_or_default();
            let reached = unit.b.iter().map(|(_, j, value)| (j, value)).chain(by_signal);
            for (j, value) in reached {
                if value != 0.0 && j < unit.connected_inputs && !channels.contains(&j) {
                    channels.push(j);
                }
            }
        }
        channels.sort_unstable();
        let names = channels.iter().map(|&j| first.inputs[j].name.clone()).collect();
        let mut split = Self { units, channels, names, force, broken, equal: true };
        let law = split.law(first);
        let near = |a: &Mat<f64>, b: &Mat<f64>| (a - b).norm_max() <= EQUAL * a.norm_max().max(1.0);
        split.equal = n > 0
            && split.units.iter().all(|&k| {
                let other = split.law(&all[k]);
                near(&law.a, &other.a) && near(&law.b, &other.b) && law.force == other.force
            });
        Ok(split)
    }

    /// The law of one of the units.
    pub fn law(&self, unit: &LinearUnit) -> Law {
        let (n, c) = (unit.states.len(), self.channels.len());
        let mut b = Mat::zeros(n, unit.inputs.len());
        unit.b.iter().for_each(|(i, j, value)| b[(i, j)] += value);
        let mut law = Law {
            a: unit.matrix(),
            b: Mat::from_fn(n, c, |i, j| b[(i, self.channels[j])]),
            force: row(&unit.c, self.force, n),
            signal: vec![0.0; n],
            direct: vec![0.0; c],
            added: vec![0.0; n],
            added_direct: 0.0,
        };
        if let Some((output, input)) = self.broken {
            let direct = row(&unit.d, output, unit.inputs.len());
            law.signal = row(&unit.c, output, n);
            law.direct = self.channels.iter().map(|&j| direct[j]).collect();
            law.added = (0..n).map(|i| b[(i, input)]).collect();
            law.added_direct = direct[input];
        }
        law
    }

    /// Checks that what units pass on without states does not depend on the parameters.
    pub fn check_feedthrough(
        &self,
        before: &LinearUnit,
        after: &LinearUnit,
    ) -> Result<(), TuneError> {
        let signal = self.broken.map(|it| it.0);
        for output in (0..before.connected_outputs).filter(|it| Some(*it) != signal) {
            let width = before.inputs.len();
            let (a, b) = (row(&before.d, output, width), row(&after.d, output, width));
            let change = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            if change > UNCHANGED * largest(&a).max(largest(&b)) {
                return Err(TuneError::Units {
                    instance: before.name.clone(),
                    problem: format!(
                        "a parameter changes how {} follows an input at once, without a state between",
                        before.outputs[output].name
                    ),
                });
            }
        }
        Ok(())
    }

    /// Everything else, and what the units pass on without states: from their forces and further inputs to their
    /// measurements, channel by channel.
    pub fn rest(&self, system: &LinearSystem, further: &[Port]) -> Result<StateSpace, TuneError> {
        let mut still = system.clone();
        let mut open = Open::default();
        let mut shown: Vec<Vec<Port>> = vec![Vec::new(); self.channels.len()];
        for &k in &self.units {
            let unit = &system.units[k];
            let state = |output| row(&unit.c, output, unit.states.len());
            let main = state(self.force);
            let by: Vec<f64> = (0..unit.connected_outputs)
                .map(|output| factor(&state(output), &main).unwrap_or(0.0))
                .collect();
            let (input, output) = freeze(&mut still.units[k], &by, &self.channels);
            open.inputs.push(Port { unit: k, index: input });
            for (list, index) in shown.iter_mut().zip(output..) {
                list.push(Port { unit: k, index });
            }
        }
        open.inputs.extend_from_slice(further);
        open.outputs = shown.concat();
        Ok(still.open(&open)?)
    }
}

/// Takes the states out of a unit. It gets an input that adds to its outputs by these factors, and outputs that show
/// some of its inputs. Returns the input and the first of the outputs.
fn freeze(unit: &mut LinearUnit, by: &[f64], shown: &[usize]) -> (usize, usize) {
    let first = (unit.inputs.len(), unit.outputs.len());
    let connected = unit.connected_outputs;
    let mut d: Vec<(usize, usize, f64)> = unit.d.iter().filter(|it| it.0 < connected).collect();
    d.extend(by.iter().enumerate().map(|(output, &factor)| (output, first.0, factor)));
    d.extend(shown.iter().enumerate().map(|(k, &input)| (first.1 + k, input, 1.0)));
    let extra = |name: &str| Quantity { name: name.to_owned(), unit: None };
    unit.inputs.push(extra("force of its states"));
    unit.outputs.extend(shown.iter().map(|_| extra("measurement")));
    unit.states.clear();
    unit.a = Rows::new(0, &[]);
    unit.b = Rows::new(0, &[]);
    unit.c = Rows::new(unit.outputs.len(), &[]);
    unit.d = Rows::new(unit.outputs.len(), &d);
    first
}
