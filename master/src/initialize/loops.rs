//! Loops between units while initializing: x = G(x), where x are the outputs that feed back and G is
//! one sweep over the loop's levels.
//!
//! Plain sweeps, as long as each leaves less than a fifth of the change, or fewer are left than there are
//! unknowns; they cost least when the loop is weak. Else Newton: x ← x + (1 − G')⁻¹ (G(x) − x) with G'
//! by the chain rule through the sweep, from `fmi2GetDirectionalDerivative` where a unit provides it in
//! initialization mode, else by differences of its outputs. G' is kept as long as it converges fast.
//! Where Newton does not converge, Anderson acceleration of the sweeps.

use std::collections::{HashMap, HashSet};

use nalgebra::{DMatrix, DVector};

use results::summary::SolvedLoop;

use super::error::InitializeError;
use super::levels::Level;
use super::solver::{Sets, Solver, Transported};
use crate::system::{InstanceIndex, Link, Port, SignalGraph, Transfer, VariableIndex};
use coupling::acceleration::Accelerator;
use fmi2_import::description::Type;
use fmi2_import::instance::{FmuError, Offer};
use scenario::{Acceleration, Initialization};

/// A sweep that leaves more than this fraction of the change is slow.
const SLOW: f64 = 0.2;
/// Changes of up to this many tolerances that become no smaller are rounding.
const ROUNDING: f64 = 10.0;
/// Relative change of an input for differences.
const NUDGE: f64 = 1e-6;
/// Residuals named in an error.
const NAMED: usize = 5;

/// A loop with its unknowns.
pub(super) struct Loop<'a> {
    names: String,
    levels: &'a [Level],
    /// all its inputs
    inputs: HashSet<Port>,
    /// outputs that outputs of the same or an earlier level depend on
    feedback: Vec<Port>,
}

impl<'a> Loop<'a> {
    pub(super) fn new(
        names: String,
        signals: &SignalGraph,
        nodes: &[usize],
        levels: &'a [Level],
    ) -> Self {
        let inside: HashSet<usize> = nodes.iter().copied().collect();
        let level_of: HashMap<Port, usize> = levels
            .iter()
            .enumerate()
            .flat_map(|(k, level)| {
                level.reads.iter().flat_map(move |(&instance, variables)| {
                    variables.iter().map(move |&variable| (Port { instance, variable }, k))
                })
            })
            .collect();
        let next = |node: usize| signals.graph.next[node].iter().filter(|it| inside.contains(it));
        let feeds_back = |&output: &usize| {
            let level = level_of.get(&signals.ports[output]);
            next(output).flat_map(|&input| next(input)).any(|&it| {
                level_of.get(&signals.ports[it]).is_some_and(|other| Some(other) <= level)
            })
        };
        let (inputs, outputs): (Vec<usize>, Vec<usize>) =
            nodes.iter().partition(|&&node| signals.is_input[node]);
        Self {
            names,
            levels,
            inputs: inputs.iter().map(|&node| signals.ports[node]).collect(),
            feedback: outputs
                .into_iter()
                .filter(feeds_back)
                .map(|node| signals.ports[node])
                .collect(),
        }
    }
}

/// How the next iterate is computed.
enum Method {
    Sweeps,
    Newton(DMatrix<f64>),
    Anderson(Box<Accelerator>),
}

fn anderson(unknowns: usize) -> Box<Accelerator> {
    Box::new(Accelerator::new(Acceleration::Anderson, 1.0, unknowns))
}

impl Solver<'_> {
    pub(super) fn solve_loop(
        &mut self,
        it: &Loop<'_>,
        settings: Initialization,
    ) -> Result<SolvedLoop, InitializeError> {
        let real = it.feedback.iter().all(|port| self.system.variable(*port).kind == Type::Real);
        let mut method = Method::Sweeps;
        let [mut earlier, mut last, mut least] = [f64::INFINITY; 3];
        let mut newton = 0;
        for sweep in 1..=settings.iterations {
            let x = self.unknowns(it);
            let mut largest = 0.0;
            for level in it.levels {
                largest = f64::max(largest, self.transport(level, settings.tolerance)?);
            }
            if largest <= 1.0 || (least <= largest && largest <= ROUNDING) {
                return Ok(SolvedLoop { signals: it.names.clone(), sweeps: sweep, newton });
            }
            // a Jacobian costs as many derivatives as there are unknowns, often more than the sweeps left
            let left = largest.ln() / (0.5 * (earlier / largest).ln());
            let most = f64::min(it.feedback.len() as f64, f64::from(settings.iterations - sweep));
            let few = earlier < f64::INFINITY && (0.0..most).contains(&left);
            let slow = largest > SLOW * last && !few;
            (earlier, last, least) = (last, largest, least.min(largest));
            // x is unknown before the first sweep
            let Some(x) = x.filter(|_| real) else { continue };
            let image = self.unknowns(it).unwrap_or_default();
            method = match method {
                Method::Sweeps if slow && sweep > 2 => Method::Newton(self.jacobian(it)?),
                Method::Newton(_) if slow && newton % 3 != 0 => Method::Newton(self.jacobian(it)?),
                Method::Newton(_) if slow => Method::Anderson(anderson(x.len())),
                other => other,
            };
            let next = match &mut method {
                Method::Sweeps => continue,
                Method::Newton(matrix) => {
                    newton += 1;
                    let residual = image.iter().zip(&x).map(|(image, x)| image - x);
                    let residual = DVector::from_iterator(x.len(), residual);
                    let step = matrix.clone().lu().solve(&residual);
                    step.filter(|step| step.iter().all(|it| it.is_finite()))
                        .map(|step| x.iter().zip(&step).map(|(x, dx)| x + dx).collect())
                }
                Method::Anderson(accelerator) => {
                    let mut next = x.clone();
                    accelerator.next(&mut next, &image, &self.scales(it));
                    Some(next)
                }
            };
            match next {
                Some(next) => self.assume(it, &next)?,
                None => {
                    method = Method::Anderson(anderson(x.len()));
                }
            }
        }
        Err(self.not_converged(it, settings))
    }

    /// Values of the outputs that feed back, once they are known.
    fn unknowns(&self, it: &Loop<'_>) -> Option<Vec<f64>> {
        it.feedback.iter().map(|port| self.real(*port)).collect()
    }

    fn real(&self, port: Port) -> Option<f64> {
        match self.values.get(&port) {
            Some(Transported::Real(value)) => Some(*value),
            _ => None,
        }
    }

    fn scales(&self, it: &Loop<'_>) -> Vec<f64> {
        let scale = |port: &Port| {
            self.real(*port).unwrap_or(0.0).abs().max(1e-3 * self.system.nominal(*port))
        };
        it.feedback.iter().map(scale).collect()
    }

    /// Sets the loop's inputs as if the outputs that feed back had these values.
    fn assume(&mut self, it: &Loop<'_>, values: &[f64]) -> Result<(), FmuError> {
        let mut sets = Sets::new();
        for (port, &value) in it.feedback.iter().zip(values) {
            self.values.insert(*port, Transported::Real(value));
        }
        for port in &it.feedback {
            self.pass_on(*port, &mut sets)?;
        }
        for (instance, values) in sets {
            self.write(instance, &values)?;
        }
        Ok(())
    }

    /// 1 − G', a column per unknown.
    fn jacobian(&mut self, it: &Loop<'_>) -> Result<DMatrix<f64>, FmuError> {
        let n = it.feedback.len();
        let mut matrix = DMatrix::identity(n, n);
        for j in 0..n {
            let mut seeds: HashMap<Port, f64> = HashMap::new();
            let mut changed: HashMap<Port, f64> = HashMap::new();
            let mut handed = HashMap::from([(it.feedback[j], 1.0)]);
            self.propagate(it, it.feedback[j], &handed, &mut seeds);
            for level in it.levels {
                for (&instance, outputs) in &level.reads {
                    for (output, change) in self.derivative(instance, outputs, &seeds)? {
                        changed.insert(output, change);
                    }
                }
                for (&instance, outputs) in &level.reads {
                    for &variable in outputs {
                        let output = Port { instance, variable };
                        handed.insert(output, changed.get(&output).copied().unwrap_or(0.0));
                        self.propagate(it, output, &handed, &mut seeds);
                    }
                }
            }
            for (i, port) in it.feedback.iter().enumerate() {
                matrix[(i, j)] -= changed.get(port).copied().unwrap_or(0.0);
            }
        }
        Ok(matrix)
    }

    /// Changes of the inputs that an output feeds, from the changes of all outputs so far.
    fn propagate(
        &self,
        it: &Loop<'_>,
        output: Port,
        changes: &HashMap<Port, f64>,
        seeds: &mut HashMap<Port, f64>,
    ) {
        let change = |link: &&Link| match &link.transfer {
            Transfer::Linear(linear) => {
                linear.factor * changes.get(&link.from).copied().unwrap_or(0.0)
            }
            _ => 0.0,
        };
        let links = self.targets.get(&output).into_iter().flatten();
        for link in links.filter(|link| it.inputs.contains(&link.to)) {
            let sum = self.sources.get(&link.to).into_iter().flatten().map(change).sum();
            seeds.insert(link.to, sum);
        }
    }

    /// Change of a unit's outputs along a direction of its inputs.
    fn derivative(
        &mut self,
        instance: InstanceIndex,
        outputs: &[VariableIndex],
        seeds: &HashMap<Port, f64>,
    ) -> Result<Vec<(Port, f64)>, FmuError> {
        let mut knowns: Vec<(VariableIndex, f64)> = seeds
            .iter()
            .filter(|(port, seed)| port.instance == instance && **seed != 0.0)
            .map(|(port, seed)| (port.variable, *seed))
            .collect();
        if knowns.is_empty() {
            return Ok(Vec::new());
        }
        // hash maps have no order, but results must be the same in every run
        knowns.sort_unstable_by_key(|(variable, _)| *variable);
        let description = self.system.instances[instance].description();
        let reference = |variable: VariableIndex| description.variables[variable].value_reference;
        let real = |&&variable: &&VariableIndex| description.variables[variable].kind == Type::Real;
        // outputs that do not depend on these inputs are left out
        let follows = |&&variable: &&VariableIndex| {
            let inputs = description.initial_dependencies(variable.0);
            knowns.iter().any(|(known, _)| inputs.contains(&known.0))
        };
        let outputs: Vec<VariableIndex> =
            outputs.iter().filter(real).filter(follows).copied().collect();
        if outputs.is_empty() {
            return Ok(Vec::new());
        }
        let unknowns: Vec<u32> = outputs.iter().map(|&variable| reference(variable)).collect();
        let mut gains = vec![0.0; unknowns.len()];
        let unit = &mut self.instances[instance];
        if unit.offers(Offer::Directional) {
            let references: Vec<u32> = knowns.iter().map(|&(v, _)| reference(v)).collect();
            let seed: Vec<f64> = knowns.iter().map(|(_, seed)| *seed).collect();
            let given = unit.get_directional_derivative(&unknowns, &references, &seed, &mut gains);
            if !unit.unless_refused(given)? {
                gains = self.difference(instance, &unknowns, &knowns)?;
            }
        } else {
            gains = self.difference(instance, &unknowns, &knowns)?;
        }
        let port = |variable| Port { instance, variable };
        Ok(outputs.into_iter().map(port).zip(gains).collect())
    }

    fn difference(
        &mut self,
        instance: InstanceIndex,
        unknowns: &[u32],
        knowns: &[(VariableIndex, f64)],
    ) -> Result<Vec<f64>, FmuError> {
        let description = self.system.instances[instance].description();
        let references: Vec<u32> =
            knowns.iter().map(|(v, _)| description.variables[*v].value_reference).collect();
        let largest = knowns.iter().map(|(_, seed)| seed.abs()).fold(0.0, f64::max);
        let unit = &mut self.instances[instance];
        let mut values = vec![0.0; knowns.len()];
        unit.get_real(&references, &mut values)?;
        let size = values.iter().map(|x| x.abs()).fold(0.0, f64::max);
        let nudge = NUDGE * if size > 0.0 { size } else { 1.0 } / largest;
        let (mut before, mut after) = (vec![0.0; unknowns.len()], vec![0.0; unknowns.len()]);
        unit.get_real(unknowns, &mut before)?;
        let moved: Vec<f64> =
            values.iter().zip(knowns).map(|(x, (_, seed))| x + nudge * seed).collect();
        unit.set_real(&references, &moved)?;
        unit.get_real(unknowns, &mut after)?;
        unit.set_real(&references, &values)?;
        Ok(after.iter().zip(&before).map(|(after, before)| (after - before) / nudge).collect())
    }

    /// The error, with the largest residuals of one more sweep.
    fn not_converged(&mut self, it: &Loop<'_>, settings: Initialization) -> InitializeError {
        let before = self.values.clone();
        for level in it.levels {
            if let Err(error) = self.transport(level, settings.tolerance) {
                return error.into();
            }
        }
        let after = std::mem::replace(&mut self.values, before);
        let mut residuals: Vec<(f64, String)> = after
            .iter()
            .map(|(port, value)| {
                let (relative, change) = self.change(*port, value, settings.tolerance);
                (relative, format!("{} by {change:e}", self.system.port_name(*port)))
            })
            .filter(|(relative, _)| *relative > 1.0)
            .collect();
        residuals.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
        residuals.truncate(NAMED);
        let residuals: Vec<String> = residuals.into_iter().map(|(_, text)| text).collect();
        InitializeError::Loop {
            signals: it.names.clone(),
            iterations: settings.iterations,
            residuals: residuals.join(", "),
        }
    }
}
