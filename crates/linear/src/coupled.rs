//! The coupled system as one linear differential equation, with inputs and outputs left open.

use std::collections::HashMap;

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use master::graph::Graph;

use super::error::LinearError;
use super::system::{LinearSystem, Port};
use super::unit::{LinearUnit, Quantity};

/// ẋ = A x + B u, y = C x + D u with dense matrices: a coupled system between free inputs and chosen
/// outputs.
#[derive(Debug, Clone)]
pub struct StateSpace {
    /// Names of the states, `instance.state`.
    pub states: Vec<String>,
    /// Free inputs, `instance.variable`.
    pub inputs: Vec<Quantity>,
    /// Outputs, `instance.variable`.
    pub outputs: Vec<Quantity>,
    /// A (states × states).
    pub a: Mat<f64>,
    /// B (states × inputs).
    pub b: Mat<f64>,
    /// C (outputs × states).
    pub c: Mat<f64>,
    /// D (outputs × inputs).
    pub d: Mat<f64>,
}

/// What is left open in a coupled system.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Open {
    /// Outputs whose connections are cut. What they fed becomes a free input of the same name, which
    /// feeds all of it. The loop transfer function from such an input to the same output is L; the closed
    /// system is singular where det(I − L) = 0. These are the first inputs of the system.
    pub cut: Vec<Port>,
    /// Inputs that are free. If an input is connected, the free value adds to the connected one.
    pub inputs: Vec<Port>,
    /// Outputs to show. A cut output may be among them.
    pub outputs: Vec<Port>,
}

impl LinearSystem {
    /// The matrix of the closed system: ẋ = (A + B L (I − D L)⁻¹ C) x. The states of all units come one
    /// after the other, their inputs u = L y are taken from outputs at the same instant.
    ///
    /// # Errors
    /// An algebraic loop has no solution, or the matrix is not finite.
    pub fn matrix(&self) -> Result<Mat<f64>, LinearError> {
        Ok(self.open(&Open::default())?.a)
    }

    /// The system between free inputs and chosen outputs.
    ///
    /// # Errors
    /// An algebraic loop has no solution, or a matrix is not finite.
    pub fn open(&self, open: &Open) -> Result<StateSpace, LinearError> {
        let states = self.states();
        let free = open.cut.len() + open.inputs.len();
        let signals = Signals::new(self, open)?;
        let mut a = Mat::<f64>::zeros(states, states);
        let mut b = Mat::<f64>::zeros(states, free);
        let mut first = 0;
        let mut row = vec![0.0; states + free];
        for (k, unit) in self.units.iter().enumerate() {
            for i in 0..unit.states.len() {
                row.fill(0.0);
                unit.a.row(i).iter().for_each(|&(j, value)| row[first + j] += value);
                for &(input, value) in unit.b.row(i) {
                    signals.add_input(Port { unit: k, index: input }, value, &mut row);
                }
                enter(&row, first + i, &mut a, &mut b);
            }
            first += unit.states.len();
        }
        let mut c = Mat::<f64>::zeros(open.outputs.len(), states);
        let mut d = Mat::<f64>::zeros(open.outputs.len(), free);
        for (i, port) in open.outputs.iter().enumerate() {
            enter(signals.output(*port), i, &mut c, &mut d);
        }
        let finite =
            |matrix: &Mat<f64>| matrix.col_iter().all(|it| it.iter().all(|x| x.is_finite()));
        if ![&a, &b, &c, &d].into_iter().all(finite) {
            return Err(LinearError::Infinite);
        }
        let cut = open.cut.iter().map(|port| self.output_name(*port));
        let inputs = open.inputs.iter().map(|port| self.input_name(*port));
        Ok(StateSpace {
            states: self.state_names(),
            inputs: cut.chain(inputs).collect(),
            outputs: open.outputs.iter().map(|port| self.output_name(*port)).collect(),
            a,
            b,
            c,
            d,
        })
    }
}

/// Writes a row over states and free inputs to two matrices.
fn enter(row: &[f64], i: usize, states: &mut Mat<f64>, inputs: &mut Mat<f64>) {
    let (left, right) = row.split_at(states.ncols());
    left.iter().enumerate().for_each(|(j, &value)| states[(i, j)] = value);
    right.iter().enumerate().for_each(|(j, &value)| inputs[(i, j)] = value);
}

/// Outputs as rows over states and free inputs.
struct Signals<'a> {
    system: &'a LinearSystem,
    /// Which outputs feed each input, with their factors.
    sources: HashMap<Port, Vec<(Port, f64)>>,
    /// Which free inputs add to each input: column and factor.
    free: HashMap<Port, Vec<(usize, f64)>>,
    rows: HashMap<Port, Vec<f64>>,
}

impl<'a> Signals<'a> {
    /// Solves y = C x + D u, u = L y + free inputs, for connected and chosen outputs.
    fn new(system: &'a LinearSystem, open: &Open) -> Result<Self, LinearError> {
        let states = system.states();
        let mut signals =
            Self { system, sources: HashMap::new(), free: HashMap::new(), rows: HashMap::new() };
        let mut wanted: Vec<Port> = open.outputs.clone();
        for it in &system.connections {
            if let Some(column) = open.cut.iter().position(|port| *port == it.from) {
                signals.free.entry(it.to).or_default().push((states + column, it.factor));
            } else {
                signals.sources.entry(it.to).or_default().push((it.from, it.factor));
                wanted.push(it.from);
            }
        }
        for (k, port) in open.inputs.iter().enumerate() {
            signals.free.entry(*port).or_default().push((states + open.cut.len() + k, 1.0));
        }
        wanted.sort_unstable();
        wanted.dedup();
        signals.solve(&wanted, states + open.cut.len() + open.inputs.len())?;
        Ok(signals)
    }

    fn unit(&self, port: Port) -> &'a LinearUnit {
        &self.system.units[port.unit]
    }

    /// Adds value · input to a row.
    fn add_input(&self, input: Port, value: f64, row: &mut [f64]) {
        for &(column, factor) in self.free.get(&input).into_iter().flatten() {
            row[column] += value * factor;
        }
        for (source, factor) in self.sources.get(&input).into_iter().flatten() {
            let factor = value * factor;
            if let Some(known) = self.rows.get(source) {
                row.iter_mut().zip(known).for_each(|(sum, x)| *sum += factor * x);
            }
        }
    }

    fn output(&self, port: Port) -> &[f64] {
        self.rows.get(&port).map_or(&[], Vec::as_slice)
    }

    /// Outputs in the order in which they depend on each other. Those that depend on each other in a
    /// circle are solved together.
    fn solve(&mut self, wanted: &[Port], width: usize) -> Result<(), LinearError> {
        let places: HashMap<Port, usize> =
            wanted.iter().enumerate().map(|(k, port)| (*port, k)).collect();
        // (output, factor) of every output that an output depends on without delay
        let by: Vec<Vec<(usize, f64)>> = wanted
            .iter()
            .map(|port| {
                let entries = self.unit(*port).d.row(port.index).iter();
                let found = entries.flat_map(|&(input, value)| {
                    let input = Port { unit: port.unit, index: input };
                    let sources = self.sources.get(&input).into_iter().flatten();
                    sources.map(move |(source, factor)| (*source, value * factor))
                });
                found.map(|(source, factor)| (places[&source], factor)).collect()
            })
            .collect();
        let mut graph = Graph::new(wanted.len());
        for (k, by) in by.iter().enumerate() {
            by.iter().for_each(|&(source, _)| graph.edge(source, k));
        }
        let mut starts = Vec::new();
        self.system.units.iter().fold(0, |first, unit| {
            starts.push(first);
            first + unit.states.len()
        });
        for component in graph.components() {
            // rows without what depends on members of the component: those are not known yet
            let mut rows: Vec<Vec<f64>> = Vec::new();
            for &k in &component {
                let (port, mut row) = (wanted[k], vec![0.0; width]);
                let unit = self.unit(port);
                for &(j, value) in unit.c.row(port.index) {
                    row[starts[port.unit] + j] += value;
                }
                for &(input, value) in unit.d.row(port.index) {
                    self.add_input(Port { unit: port.unit, index: input }, value, &mut row);
                }
                rows.push(row);
            }
            let inside: HashMap<usize, usize> =
                component.iter().enumerate().map(|(place, &k)| (k, place)).collect();
            let loops = component.iter().enumerate().flat_map(|(i, &k)| {
                let inside = &inside;
                by[k]
                    .iter()
                    .filter_map(move |(source, factor)| Some((i, *inside.get(source)?, *factor)))
            });
            let loops: Vec<(usize, usize, f64)> = loops.collect();
            if !loops.is_empty() {
                rows = solved(&loops, &rows)?;
            }
            for (&k, row) in component.iter().zip(rows) {
                self.rows.insert(wanted[k], row);
            }
        }
        Ok(())
    }
}

/// Solves (I − loops) y = rows.
fn solved(loops: &[(usize, usize, f64)], rows: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, LinearError> {
    let (m, width) = (rows.len(), rows.first().map_or(0, Vec::len));
    let mut matrix = Mat::<f64>::identity(m, m);
    for &(i, j, factor) in loops {
        matrix[(i, j)] -= factor;
    }
    let right = Mat::from_fn(m, width, |i, j| rows[i][j]);
    let y = PartialPivLu::new(matrix.as_ref()).solve(&right);
    let found: Vec<Vec<f64>> = (0..m).map(|i| (0..width).map(|j| y[(i, j)]).collect()).collect();
    if found.iter().flatten().all(|x| x.is_finite()) { Ok(found) } else { Err(LinearError::Loop) }
}
