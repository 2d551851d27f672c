//! A linear system as plant, controllers and attached part.

use std::collections::HashMap;

use faer::Mat;
use linear::{LinearSystem, LinearUnit, Open, Port, Quantity, Rows};
use stability_map::{Attached, Controller, Output, Plant};

use crate::error::Error;

/// Most states of the attached part.
const MOST_ATTACHED: usize = 120;
/// Equal to rounding.
const EQUAL: f64 = 1e-12;

/// Which units are what.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    /// The controllers.
    pub controllers: Vec<usize>,
    /// Their inputs that reach their states.
    pub channels: Vec<usize>,
    /// Their output with the largest response to their states.
    pub force: usize,
    /// The attached units, with their states that are in the loop.
    pub attached: Vec<(usize, Vec<usize>)>,
    pub equal: bool,
}

fn dense(rows: &Rows, height: usize, width: usize) -> Mat<f64> {
    let mut all = Mat::zeros(height, width);
    rows.iter().for_each(|(i, j, value)| all[(i, j)] += value);
    all
}

fn c_row(unit: &LinearUnit, output: usize) -> Vec<f64> {
    let mut row = vec![0.0; unit.states.len()];
    unit.c.row(output).iter().for_each(|&(j, value)| row[j] += value);
    row
}

/// The largest magnitude in a row.
#[must_use]
pub fn largest(row: &[f64]) -> f64 {
    row.iter().fold(0.0, |size: f64, x| size.max(x.abs()))
}

/// Factor of a row relative to another, if it has one.
#[must_use]
pub fn factor(row: &[f64], main: &[f64]) -> Option<f64> {
    let square: f64 = main.iter().map(|x| x * x).sum();
    let factor = row.iter().zip(main).map(|(a, b)| a * b).sum::<f64>() / square;
    let rest = row.iter().zip(main).map(|(a, b)| (a - factor * b).abs()).fold(0.0, f64::max);
    (rest <= EQUAL * largest(row).max(EQUAL * largest(main))).then_some(factor)
}

impl Parts {
    /// Finds the parts: `kinds` is the kind of each unit, `named` the units that an axis changes. None if no kind of
    /// units can be the controllers.
    pub fn find(system: &LinearSystem, kinds: &[String], named: &[usize]) -> Option<Self> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for k in 0..system.units.len() {
            match groups.iter_mut().find(|group| kinds[group[0]] == kinds[k]) {
                Some(group) => group.push(k),
                None => groups.push(vec![k]),
            }
        }
        // units with many copies first, then what an axis names
        groups.sort_by_key(|group| {
            (std::cmp::Reverse(group.len()), !group.iter().any(|k| named.contains(k)))
        });
        groups.into_iter().find_map(|group| Self::with(system, group))
    }

    fn with(system: &LinearSystem, controllers: Vec<usize>) -> Option<Self> {
        let units = &system.units;
        let first = &units[controllers[0]];
        if first.states.is_empty() || first.states.len() > 24 {
            return None;
        }
        let force = (0..first.connected_outputs)
            .max_by(|&a, &b| largest(&c_row(first, a)).total_cmp(&largest(&c_row(first, b))))?;
        let mut channels: Vec<usize> = Vec::new();
        for &k in &controllers {
            let unit = &units[k];
            let same = unit.states.len() == first.states.len()
                && unit.connected_inputs == first.connected_inputs
                && unit.connected_outputs == first.connected_outputs;
            let main = c_row(unit, force);
            let single =
                (0..unit.connected_outputs).all(|o| factor(&c_row(unit, o), &main).is_some());
            if !same || !single || largest(&main) == 0.0 {
                return None;
            }
            for (_, j, value) in unit.b.iter() {
                if value != 0.0 && j < unit.connected_inputs && !channels.contains(&j) {
                    channels.push(j);
                }
            }
        }
        channels.sort_unstable();
        // the plant is what the controllers measure most
        let mut votes: HashMap<usize, usize> = HashMap::new();
        for it in &system.connections {
            if controllers.contains(&it.to.unit) && channels.contains(&it.to.index) {
                *votes.entry(it.from.unit).or_default() += 1;
            }
        }
        let core = votes.iter().max_by_key(|(unit, votes)| (**votes, usize::MAX - **unit))?.0;
        if controllers.contains(core) {
            return None;
        }
        let mut attached = Vec::new();
        for (k, unit) in units.iter().enumerate() {
            if k == *core || controllers.contains(&k) || unit.states.is_empty() {
                continue;
            }
            let states = coupled(unit);
            if states.len() <= MOST_ATTACHED {
                attached.push((k, states));
            }
        }
        let equal = controllers.iter().all(|&k| {
            let unit = &units[k];
            let (n, m) = (unit.states.len(), unit.inputs.len());
            let near = |a: &Mat<f64>, b: &Mat<f64>| (a - b).norm_max() <= EQUAL * a.norm_max();
            near(&dense(&unit.a, n, n), &dense(&first.a, n, n))
                && near(&dense(&unit.b, n, m), &dense(&first.b, n, m))
                && c_row(unit, force) == c_row(first, force)
        });
        Some(Self { controllers, channels, force, attached, equal })
    }

    /// The controller of a unit of the controllers.
    pub fn controller(&self, unit: &LinearUnit) -> Controller {
        let n = unit.states.len();
        let b = dense(&unit.b, n, unit.inputs.len());
        Controller {
            a: dense(&unit.a, n, n),
            b: Mat::from_fn(n, self.channels.len(), |i, j| b[(i, self.channels[j])]),
            c: c_row(unit, self.force),
            d: vec![0.0; self.channels.len()],
        }
    }

    /// The attached part of a system.
    pub fn attached(&self, units: &[LinearUnit]) -> Attached {
        let size = |f: &dyn Fn(&LinearUnit, &[usize]) -> usize| -> usize {
            self.attached.iter().map(|(k, states)| f(&units[*k], states)).sum()
        };
        let (g, q, p) = (
            size(&|_, states| states.len()),
            size(&|unit, _| unit.connected_inputs),
            size(&|unit, _| unit.connected_outputs),
        );
        let mut all = Attached { a: Mat::zeros(g, g), b: Mat::zeros(g, q), c: Mat::zeros(p, g) };
        let (mut x, mut u, mut y) = (0, 0, 0);
        for (k, states) in &self.attached {
            let unit = &units[*k];
            let n = unit.states.len();
            let a = dense(&unit.a, n, n);
            let b = dense(&unit.b, n, unit.inputs.len());
            let c = dense(&unit.c, unit.outputs.len(), n);
            for (i, &row) in states.iter().enumerate() {
                for (j, &column) in states.iter().enumerate() {
                    all.a[(x + i, x + j)] = a[(row, column)];
                }
                for j in 0..unit.connected_inputs {
                    all.b[(x + i, u + j)] = b[(row, j)];
                }
                for j in 0..unit.connected_outputs {
                    all.c[(y + j, x + i)] = c[(j, row)];
                }
            }
            x += states.len();
            u += unit.connected_inputs;
            y += unit.connected_outputs;
        }
        all
    }

    /// The plant: all other units, and what controllers and attached part pass on without states.
    pub fn plant(&self, system: &LinearSystem) -> Result<Plant, Error> {
        let mut still = system.clone();
        let mut open = Open::default();
        let mut rows: Vec<Vec<Port>> = vec![Vec::new(); self.channels.len()];
        for &k in &self.controllers {
            let unit = &system.units[k];
            let main = c_row(unit, self.force);
            let by: Vec<f64> = (0..unit.connected_outputs)
                .map(|o| factor(&c_row(unit, o), &main).unwrap_or(0.0))
                .collect();
            let ports = freeze(&mut still.units[k], &[by], &self.channels);
            open.inputs.push(Port { unit: k, index: ports.0 });
            for (row, index) in rows.iter_mut().zip(ports.1..) {
                row.push(Port { unit: k, index });
            }
        }
        let mut measured = Vec::new();
        for (k, _) in &self.attached {
            let unit = &system.units[*k];
            let outputs: Vec<Vec<f64>> = (0..unit.connected_outputs)
                .map(|o| (0..unit.connected_outputs).map(|i| f64::from(u8::from(i == o))).collect())
                .collect();
            let inputs: Vec<usize> = (0..unit.connected_inputs).collect();
            let ports = freeze(&mut still.units[*k], &outputs, &inputs);
            open.inputs.extend((0..outputs.len()).map(|i| Port { unit: *k, index: ports.0 + i }));
            measured.extend((0..inputs.len()).map(|i| Port { unit: *k, index: ports.1 + i }));
        }
        open.outputs = rows.concat();
        open.outputs.extend(measured);
        let space = still.open(&open)?;
        let m = self.controllers.len();
        let (n, p) = (space.a.nrows(), space.b.ncols() - m);
        let output = |first: usize, count: usize| Output {
            by_state: space.c.subrows(first, count).to_owned(),
            by_force: space.d.submatrix(first, 0, count, m).to_owned(),
            by_attached: space.d.submatrix(first, m, count, p).to_owned(),
        };
        let channels = self.channels.len();
        Ok(Plant {
            by_force: space.b.submatrix(0, 0, n, m).to_owned(),
            by_attached: space.b.submatrix(0, m, n, p).to_owned(),
            channels: (0..channels).map(|i| output(i * m, m)).collect(),
            to_attached: output(channels * m, space.c.nrows() - channels * m),
            a: space.a,
        })
    }
}

/// Takes the states out of a unit. It gets inputs that add to its outputs by these rows, and outputs that show these
/// inputs of it. Returns the first of both.
fn freeze(unit: &mut LinearUnit, added: &[Vec<f64>], shown: &[usize]) -> (usize, usize) {
    let first = (unit.inputs.len(), unit.outputs.len());
    let mut d: Vec<(usize, usize, f64)> = unit.d.iter().collect();
    let extra = |name: String| Quantity { name, unit: None };
    for (k, by) in added.iter().enumerate() {
        unit.inputs.push(extra(format!("added {k}")));
        d.extend(by.iter().enumerate().map(|(o, &value)| (o, first.0 + k, value)));
    }
    for (k, &input) in shown.iter().enumerate() {
        unit.outputs.push(extra(format!("shown {k}")));
        d.push((first.1 + k, input, 1.0));
    }
    unit.states.clear();
    unit.a = Rows::new(0, &[]);
    unit.b = Rows::new(0, &[]);
    unit.c = Rows::new(unit.outputs.len(), &[]);
    unit.d = Rows::new(unit.outputs.len(), &d);
    first
}

/// States of a unit that its connected inputs reach and that its connected outputs show.
fn coupled(unit: &LinearUnit) -> Vec<usize> {
    let n = unit.states.len();
    let mut reached = vec![false; n];
    let mut shown = vec![false; n];
    for (i, j, value) in unit.b.iter() {
        reached[i] |= value != 0.0 && j < unit.connected_inputs;
    }
    for (o, j, value) in unit.c.iter() {
        shown[j] |= value != 0.0 && o < unit.connected_outputs;
    }
    let edges: Vec<(usize, usize)> =
        unit.a.iter().filter(|(_, _, value)| *value != 0.0).map(|(i, j, _)| (i, j)).collect();
    for _ in 0..n {
        for &(i, j) in &edges {
            reached[i] |= reached[j];
            shown[j] |= shown[i];
        }
    }
    (0..n).filter(|&k| reached[k] && shown[k]).collect()
}
