//! From fresh instances to the start of stepping.
//!
//! While instantiated, units get the experiment and their parameters; in initialization mode, their
//! inputs, in the order of their dependencies (InitialUnknowns). Signals are handled in levels, so
//! that each unit is asked once for many outputs. Signals that depend on each other in a loop are
//! solved for by sweeps over the same levels, Newton's method where they converge slowly or not at
//! all, and Anderson acceleration (`loops.rs`).

pub mod late;
mod loops;

use std::collections::{BTreeMap, HashMap};
use std::ffi::CString;

use thiserror::Error;

use loops::Loop;

use crate::graph::SignalGraph;
use crate::system::{Link, Port, System, Transfer};
use fmi2_import::description::{Causality, Type};
use fmi2_import::instance::{FmuError, Instance};
use results::summary::SolvedLoop;
use scenario::{Experiment, Initialization};

/// Why the system cannot be initialized.
#[derive(Debug, Error)]
pub enum InitializeError {
    /// A unit's.
    #[error("initialization failed")]
    Unit(#[from] FmuError),
    /// A loop that does not settle.
    #[error(
        "initialization: the loop through {signals} did not settle in {iterations} sweeps: \
         these still change: {residuals}"
    )]
    Loop {
        /// Signals of the loop.
        signals: String,
        /// Number of sweeps made.
        iterations: u32,
        /// The signals that change most in another one, and by how much.
        residuals: String,
    },
}

impl InitializeError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Unit(error) => error.fault().help(),
            Self::Loop { .. } => Some(
                "give start values nearer to the solution, or raise initialization.iterations or \
                 initialization.tolerance in the scenario",
            ),
        }
    }
}

/// What initialization leaves besides instances that are ready to step.
#[derive(Debug, Clone, Default)]
pub struct Initialized {
    /// Loops that were solved.
    pub loops: Vec<SolvedLoop>,
    /// Connected outputs as they were in initialization mode, Strings left out; true is 1.
    pub outputs: HashMap<Port, f64>,
}

/// Initializes all instances and leaves them ready to step.
///
/// # Errors
/// A unit fails, or a loop does not settle.
pub fn initialize(
    system: &System,
    instances: &mut [Instance],
    experiment: Experiment,
    settings: Initialization,
) -> Result<Initialized, InitializeError> {
    for (plan, instance) in system.instances.iter().zip(instances.iter_mut()) {
        instance.setup_experiment(plan.tolerance, experiment.start, experiment.stop)?;
        for (variable, value) in &plan.parameters {
            instance.set(*variable, value)?;
        }
        instance.enter_initialization_mode()?;
        for (variable, value) in &plan.inputs {
            instance.set(*variable, value)?;
        }
    }
    let initialized = Solver::new(system, instances, experiment.start).solve(settings)?;
    for instance in instances.iter_mut() {
        instance.exit_initialization_mode()?;
    }
    Ok(initialized)
}

/// Outputs to read and the connections to serve with them, at the same depth.
#[derive(Default)]
struct Level {
    /// per instance the outputs to read
    reads: BTreeMap<usize, Vec<usize>>,
}

#[derive(Debug, Clone, PartialEq)]
enum Transported {
    Real(f64),
    Integer(i32),
    Boolean(i32),
    String(CString),
}

impl Transported {
    /// As a number; false is 0, true is 1.
    fn number(&self) -> f64 {
        match self {
            Self::Real(x) => *x,
            Self::Integer(x) => f64::from(*x),
            Self::Boolean(x) => f64::from(u8::from(*x != 0)),
            Self::String(_) => 0.0,
        }
    }
}

struct Solver<'a> {
    system: &'a System,
    instances: &'a mut [Instance],
    start: f64,
    values: HashMap<Port, Transported>,
    /// the connections of each output, and of each input
    targets: HashMap<Port, Vec<&'a Link>>,
    sources: HashMap<Port, Vec<&'a Link>>,
}

/// Values to set, per instance.
type Sets = BTreeMap<usize, Vec<(usize, Transported)>>;

impl<'a> Solver<'a> {
    fn new(system: &'a System, instances: &'a mut [Instance], start: f64) -> Self {
        let mut targets: HashMap<Port, Vec<&Link>> = HashMap::new();
        let mut sources: HashMap<Port, Vec<&Link>> = HashMap::new();
        for link in &system.links {
            targets.entry(link.from).or_default().push(link);
            sources.entry(link.to).or_default().push(link);
        }
        Self { system, instances, start, values: HashMap::new(), targets, sources }
    }

    /// What the inputs that an output feeds get by the values known now.
    fn hand_to(&self, output: Port, sets: &mut Sets) -> Result<(), FmuError> {
        for link in self.targets.get(&output).into_iter().flatten() {
            let set = (link.to.variable, self.input(link.to)?);
            sets.entry(link.to.instance).or_default().push(set);
        }
        Ok(())
    }

    /// An input's value: the sum over those of its sources that are known yet.
    fn input(&self, to: Port) -> Result<Transported, FmuError> {
        let mut sum = 0.0;
        for link in self.sources.get(&to).into_iter().flatten() {
            let Some(value) = self.values.get(&link.from) else { continue };
            match (&link.transfer, value) {
                (Transfer::Linear(it), value) => {
                    sum += it.factor * value.number() + it.offset;
                }
                (Transfer::Whole, Transported::Boolean(value)) => {
                    return Ok(Transported::Integer(i32::from(*value != 0)));
                }
                (Transfer::Items(items), Transported::Integer(value)) => {
                    let found = items.iter().find(|(from, _)| from == value);
                    return match found {
                        Some((_, to)) => Ok(Transported::Integer(*to)),
                        None => {
                            let target = self.system.port_name(to);
                            let unit = &self.instances[link.from.instance];
                            Err(unit.no_item(link.from.variable, *value, &target, self.start))
                        }
                    };
                }
                (_, value) => return Ok(value.clone()),
            }
        }
        Ok(Transported::Real(sum))
    }

    fn solve(mut self, settings: Initialization) -> Result<Initialized, InitializeError> {
        let signals = SignalGraph::initial(self.system);
        let mut solved = Vec::new();
        for stage in stages(&signals) {
            match stage {
                Stage::Once(level) => {
                    self.transport(&level, 1.0)?;
                }
                Stage::Loop { nodes, levels } => {
                    let names = signals.names(self.system, &nodes);
                    let it = Loop::new(names, &signals, &nodes, &levels);
                    solved.push(self.solve_loop(&it, settings)?);
                }
            }
        }
        let numbers = self.values.iter().filter(|(_, it)| !matches!(it, Transported::String(_)));
        let outputs = numbers.map(|(&port, it)| (port, it.number()));
        Ok(Initialized { loops: solved, outputs: outputs.collect() })
    }

    /// Reads the level's outputs, hands them on, and returns the largest change relative to what the
    /// tolerance allows.
    fn transport(&mut self, level: &Level, tolerance: f64) -> Result<f64, FmuError> {
        let mut largest = 0.0;
        let mut sets = Sets::new();
        let mut read = Vec::new();
        for (&instance, variables) in &level.reads {
            for (variable, value) in self.read(instance, variables)? {
                let port = Port { instance, variable };
                largest = f64::max(largest, self.change(port, &value, tolerance).0);
                self.values.insert(port, value);
                read.push(port);
            }
        }
        for port in read {
            self.hand_to(port, &mut sets)?;
        }
        for (instance, values) in sets {
            self.write(instance, &values)?;
        }
        Ok(largest)
    }

    /// Change of a signal, relative to what the tolerance allows and absolute.
    fn change(&self, port: Port, new: &Transported, tolerance: f64) -> (f64, f64) {
        match (self.values.get(&port), new) {
            (Some(Transported::Real(old)), Transported::Real(new)) => {
                let nominal = self.system.variable(port).nominal.unwrap_or(1.0).abs();
                let scale = new.abs().max(1e-3 * nominal);
                let change = (new - old).abs();
                (change / (tolerance * scale), change)
            }
            (Some(old), new) if old == new => (0.0, 0.0),
            _ => (f64::INFINITY, f64::INFINITY),
        }
    }

    fn read(
        &mut self,
        instance: usize,
        variables: &[usize],
    ) -> Result<Vec<(usize, Transported)>, FmuError> {
        let description = self.system.instances[instance].description();
        let of = |kinds: &[Type]| -> (Vec<usize>, Vec<u32>) {
            variables
                .iter()
                .filter(|&&variable| kinds.contains(&description.variables[variable].kind))
                .map(|&variable| (variable, description.variables[variable].value_reference))
                .unzip()
        };
        let unit = &mut self.instances[instance];
        let mut read = Vec::with_capacity(variables.len());
        let (indices, references) = of(&[Type::Real]);
        let mut reals = vec![0.0; references.len()];
        unit.get_real(&references, &mut reals)?;
        for (&variable, &value) in indices.iter().zip(&reals) {
            if !value.is_finite() {
                return Err(unit.not_finite(variable, value, self.start).into());
            }
            read.push((variable, Transported::Real(value)));
        }
        let (indices, references) = of(&[Type::Integer, Type::Enumeration]);
        let mut integers = vec![0; references.len()];
        unit.get_integer(&references, &mut integers)?;
        read.extend(indices.into_iter().zip(integers.into_iter().map(Transported::Integer)));
        let (indices, references) = of(&[Type::Boolean]);
        let mut booleans = vec![0; references.len()];
        unit.get_boolean(&references, &mut booleans)?;
        read.extend(indices.into_iter().zip(booleans.into_iter().map(Transported::Boolean)));
        let (indices, references) = of(&[Type::String]);
        for (variable, reference) in indices.into_iter().zip(references) {
            read.push((variable, Transported::String(unit.get_string(reference)?)));
        }
        Ok(read)
    }

    fn write(&mut self, instance: usize, values: &[(usize, Transported)]) -> Result<(), FmuError> {
        let description = self.system.instances[instance].description();
        let unit = &mut self.instances[instance];
        let (mut references, mut reals) = (Vec::new(), Vec::new());
        for (variable, value) in values {
            debug_assert_eq!(description.variables[*variable].causality, Causality::Input);
            let reference = description.variables[*variable].value_reference;
            match value {
                Transported::Real(value) => {
                    references.push(reference);
                    reals.push(*value);
                }
                Transported::Integer(value) => unit.set_integer(&[reference], &[*value])?,
                Transported::Boolean(value) => unit.set_boolean(&[reference], &[*value])?,
                Transported::String(value) => unit.set_string(reference, value)?,
            }
        }
        unit.set_real(&references, &reals)
    }
}

enum Stage {
    Once(Level),
    Loop { nodes: Vec<usize>, levels: Vec<Level> },
}

/// Groups the signals: outputs of equal depth together, each loop on its own.
fn stages(signals: &SignalGraph) -> Vec<Stage> {
    let components = signals.graph.components();
    let mut home = vec![0; signals.ports.len()];
    for (k, component) in components.iter().enumerate() {
        for &node in component {
            home[node] = k;
        }
    }
    // depth counts outputs passed, and puts every loop on a depth of its own
    let mut depth = vec![0_usize; components.len()];
    for (k, component) in components.iter().enumerate() {
        let passed = component.iter().any(|&node| !signals.is_input[node]);
        for &node in component {
            for &to in &signals.graph.next[node] {
                if home[to] != k {
                    depth[home[to]] = depth[home[to]].max(depth[k] + usize::from(passed));
                }
            }
        }
    }
    let mut once: BTreeMap<usize, Level> = BTreeMap::new();
    let mut loops: BTreeMap<usize, Vec<Stage>> = BTreeMap::new();
    for (k, component) in components.iter().enumerate() {
        if signals.graph.is_loop(component) {
            let levels = loop_levels(signals, component);
            let stage = Stage::Loop { nodes: component.clone(), levels };
            loops.entry(depth[k]).or_default().push(stage);
        } else if let [node] = component[..]
            && !signals.is_input[node]
        {
            let port = signals.ports[node];
            let level = once.entry(depth[k]).or_default();
            level.reads.entry(port.instance).or_default().push(port.variable);
        }
    }
    let deepest = depth.iter().copied().max().unwrap_or(0);
    let mut stages = Vec::new();
    for d in 0..=deepest {
        stages.extend(once.remove(&d).map(Stage::Once));
        stages.extend(loops.remove(&d).into_iter().flatten());
    }
    stages
}

/// Levels of a sweep over a loop: breadth first from the loop's outputs of the first instance.
fn loop_levels(signals: &SignalGraph, component: &[usize]) -> Vec<Level> {
    let inside: std::collections::HashSet<usize> = component.iter().copied().collect();
    let outputs: Vec<usize> =
        component.iter().copied().filter(|&node| !signals.is_input[node]).collect();
    let mut level: HashMap<usize, usize> = HashMap::new();
    let first = outputs.iter().map(|&node| signals.ports[node].instance).min();
    let mut wave: Vec<usize> = outputs
        .iter()
        .copied()
        .filter(|&node| Some(signals.ports[node].instance) == first)
        .collect();
    let mut depth = 0;
    while !wave.is_empty() {
        for &node in &wave {
            level.insert(node, depth);
        }
        let mut next: Vec<usize> = wave
            .iter()
            .flat_map(|&node| &signals.graph.next[node])
            .filter(|input| inside.contains(input))
            .flat_map(|&input| &signals.graph.next[input])
            .copied()
            .filter(|output| inside.contains(output) && !level.contains_key(output))
            .collect();
        next.sort_unstable();
        next.dedup();
        wave = next;
        depth += 1;
    }
    let mut levels: Vec<Level> = Vec::new();
    levels.resize_with(depth, Level::default);
    for node in outputs {
        let port = signals.ports[node];
        // a component is strongly connected: the waves reach every output
        let at = level.get(&node).copied().unwrap_or(0);
        levels[at].reads.entry(port.instance).or_default().push(port.variable);
    }
    levels
}
