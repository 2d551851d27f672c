//! A whole run: from a checked scenario to results, summary and pictures.

use std::cell::Cell;
use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

use indexmap::IndexMap;

use crate::coupling::{Algorithm, Exchange, GaussSeidel, Jacobi, Links, RealLink};
use crate::description::Type;
use crate::error::Error;
use crate::graph::{self, SignalGraph};
use crate::initialize::{SolvedLoop, initialize};
use crate::instance::{Instance, UnitError};
use crate::library::Functions;
use crate::logger::Message;
use crate::participant::{Participant, Slot, Traffic};
use crate::plot;
use crate::record::{Curve, Gatherer, Table};
use crate::scenario::{AlgorithmName, Scenario};
use crate::summary::{
    AlgorithmSummary, Failure, SignalSummary, Status, Summary, UnitMessage, UnitSummary, WallTime,
};
use crate::system::{Override, Port, System, SystemError};

/// Time between two reports of progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(50);
/// Messages of units kept for the summary.
const MAX_MESSAGES: usize = 200;

/// Watches a run.
pub trait Observer {
    /// Stepping begins, with so many steps to come.
    fn begin(&mut self, steps: u64) {
        let _ = steps;
    }

    /// So many steps are done; `factor` is simulated time over wall time.
    fn progress(&mut self, done: u64, time: f64, factor: f64) {
        let _ = (done, time, factor);
    }

    /// Something worth telling that is no error.
    fn notice(&mut self, text: &str) {
        let _ = text;
    }

    /// Whether the run shall end now.
    fn interrupted(&self) -> bool {
        false
    }
}

/// An observer that looks away.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unobserved;

impl Observer for Unobserved {}

/// What to run and where to put the results.
#[derive(Debug, Clone)]
pub struct Job<'a> {
    /// The scenario, with paths of units relative to the working directory.
    pub scenario: &'a Scenario,
    /// Name of the scenario, for the summary.
    pub name: &'a str,
    /// Values that replace those of the scenario.
    pub overrides: &'a [Override],
    /// Folder for the results; made if needed.
    pub folder: &'a Path,
}

impl Job<'_> {
    /// Runs it. Whatever happens after the start, what was recorded is kept: results.csv,
    /// summary.json and the pictures are written also for a run that fails or is interrupted.
    ///
    /// # Errors
    /// Whatever stops the run, see [`Error`].
    pub fn run(&self, observer: &mut dyn Observer) -> Result<Summary, Error> {
        let begin = Instant::now();
        self.scenario.check()?;
        let system = System::new(self.scenario, self.overrides)?;
        let selection = Selection::new(self.scenario, &system)?;
        let order = sequence(self.scenario, &system)?;
        tell_findings(&system, observer);
        let mut output = Output::create(self.folder, self.scenario, &system, &selection)?;
        let mut progress = Progress::default();
        let mut participants = Vec::new();
        let result = self.start_and_step(
            &system,
            &selection,
            &order,
            observer,
            &mut participants,
            &mut output,
            &mut progress,
            begin,
        );
        let messages = gather_messages(&mut participants, progress.messages.split_off(0));
        progress.messages = messages;
        let summary = self.finish(
            &system,
            &selection,
            &order,
            &participants,
            output,
            progress,
            &result,
            begin,
        );
        match (result, summary) {
            (Err(error), _) | (Ok(_), Err(error)) => Err(error),
            (Ok(_), Ok(summary)) => Ok(summary),
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one run, borrowed apart")]
    fn start_and_step(
        &self,
        system: &System,
        selection: &Selection,
        order: &[usize],
        observer: &mut dyn Observer,
        participants: &mut Vec<Participant>,
        output: &mut Output,
        progress: &mut Progress,
        begin: Instant,
    ) -> Result<Status, Error> {
        let mut instances = instantiate(system)?;
        let scenario = self.scenario;
        progress.loops =
            initialize(system, &mut instances, scenario.experiment, scenario.initialization)?;
        let mut algorithm: Box<dyn Algorithm<Participant>> = match scenario.algorithm.name {
            AlgorithmName::Jacobi => Box::new(Jacobi),
            AlgorithmName::GaussSeidel => Box::new(GaussSeidel::new(order.to_vec())),
        };
        let start = scenario.experiment.start;
        let failed = |source| Error::Step { time: start, source };
        let (mut joined, mut exchange) =
            plan(scenario, system, selection, instances, &*algorithm).map_err(failed)?;
        participants.append(&mut joined);
        exchange.start(start, participants).map_err(failed)?;
        for (k, participant) in participants.iter_mut().enumerate() {
            let highest = participant.probe_inputs().map_err(failed)?;
            exchange.limit(k, highest);
            // a unit may have complained about what was only probed
            participant.instance_mut().take_messages();
        }
        progress.start = begin.elapsed();
        let run_begin = Instant::now();
        let status = self.step_all(
            &mut *algorithm,
            &mut exchange,
            participants,
            selection,
            observer,
            output,
            progress,
        );
        progress.run = run_begin.elapsed();
        let status = status?;
        for participant in participants.iter_mut() {
            participant
                .instance_mut()
                .terminate()
                .map_err(|source| Error::Step { time: progress.time, source })?;
        }
        Ok(status)
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one run, borrowed apart")]
    fn step_all(
        &self,
        algorithm: &mut dyn Algorithm<Participant>,
        exchange: &mut Exchange,
        participants: &mut [Participant],
        selection: &Selection,
        observer: &mut dyn Observer,
        output: &mut Output,
        progress: &mut Progress,
    ) -> Result<Status, Error> {
        let experiment = self.scenario.experiment;
        let steps = experiment.steps()?;
        let slots = selection.slots(participants);
        observer.begin(steps);
        let begin = Instant::now();
        let mut told = begin;
        progress.time = experiment.start;
        output.take(progress.time, participants, &slots)?;
        for n in 0..steps {
            #[expect(clippy::cast_precision_loss, reason = "steps() allows at most 2^53")]
            let time_of = |n: u64| experiment.start + n as f64 * experiment.step;
            let time = time_of(n);
            algorithm
                .step(exchange, participants, time, experiment.step)
                .map_err(|source| Error::Step { time, source })?;
            progress.steps = n + 1;
            progress.time = time_of(n + 1);
            output.take(progress.time, participants, &slots)?;
            if observer.interrupted() {
                return Ok(Status::Interrupted);
            }
            let now = Instant::now();
            if now - told > PROGRESS_INTERVAL {
                told = now;
                let wall = (now - begin).as_secs_f64();
                let factor = (progress.time - experiment.start) / wall;
                observer.progress(n + 1, progress.time, factor);
                progress.listen(participants, observer);
            }
        }
        progress.listen(participants, observer);
        Ok(Status::Finished)
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one run")]
    fn finish(
        &self,
        system: &System,
        selection: &Selection,
        order: &[usize],
        participants: &[Participant],
        output: Output,
        progress: Progress,
        result: &Result<Status, Error>,
        begin: Instant,
    ) -> Result<Summary, Error> {
        let Output { folder, table, gatherers, curves, .. } = output;
        let written =
            |source| Error::Output { path: self.folder.to_owned(), running: true, source };
        let rows = table.rows();
        table.finish().map_err(written)?;
        let mut pictures = Vec::new();
        if progress.steps > 0 {
            pictures = draw(self.scenario, system, selection, &folder, curves)?;
        }
        let signals = selection.ports[..selection.recorded]
            .iter()
            .zip(&gatherers)
            .map(|(&port, gatherer)| {
                let unit = base_unit(system, port);
                let statistics = gatherer.statistics();
                (system.port_name(port), SignalSummary { unit, statistics })
            })
            .collect();
        let experiment = self.scenario.experiment;
        let units = units(self.scenario, system, participants);
        let units_seconds: f64 = units
            .values()
            .map(|unit: &UnitSummary| unit.step_seconds + unit.exchange_seconds)
            .sum();
        let run_seconds = progress.run.as_secs_f64();
        let simulated = progress.time - experiment.start;
        let summary = Summary {
            scenario: self.name.to_owned(),
            title: self.scenario.title.clone(),
            status: *result.as_ref().unwrap_or(&Status::Failed),
            error: result.as_ref().err().map(Failure::from),
            start: experiment.start,
            stop: experiment.stop,
            step: experiment.step,
            steps: progress.steps,
            reached: progress.time,
            rows,
            real_time_factor: if run_seconds > 0.0 { simulated / run_seconds } else { 0.0 },
            algorithm: algorithm_summary(self.scenario, system, order),
            initial_loops: progress.loops,
            wall_time: WallTime {
                total_seconds: begin.elapsed().as_secs_f64(),
                start_seconds: progress.start.as_secs_f64(),
                run_seconds,
                units_seconds,
                master_seconds: (run_seconds - units_seconds).max(0.0),
            },
            master_version: env!("CARGO_PKG_VERSION").to_owned(),
            overrides: self
                .overrides
                .iter()
                .map(|entry| format!("{}={}", entry.target, entry.value))
                .collect(),
            units,
            signals,
            messages: progress.messages,
            pictures,
        };
        let path = folder.join("summary.json");
        let mut text = serde_json::to_string_pretty(&summary)
            .map_err(std::io::Error::from)
            .map_err(|source| Error::Output { path: path.clone(), running: true, source })?;
        text.push('\n');
        fs::write(&path, text).map_err(|source| Error::Output { path, running: true, source })?;
        Ok(summary)
    }
}

/// What happens in a run, gathered for the summary.
#[derive(Default)]
struct Progress {
    steps: u64,
    time: f64,
    start: Duration,
    run: Duration,
    loops: Vec<SolvedLoop>,
    messages: Vec<UnitMessage>,
    warned: Vec<bool>,
}

impl Progress {
    /// Takes the units' messages and tells the first grave one of each unit.
    fn listen(&mut self, participants: &mut [Participant], observer: &mut dyn Observer) {
        self.warned.resize(participants.len(), false);
        for (participant, warned) in participants.iter_mut().zip(&mut self.warned) {
            let instance = participant.instance_mut();
            let messages = instance.take_messages();
            let warns = instance.warned() || messages.iter().any(|message| message.grave);
            if warns && !std::mem::replace(warned, true) {
                let text = messages
                    .iter()
                    .find(|message| message.grave)
                    .map_or("a call returned fmi2Warning", |message| message.text.as_str());
                observer.notice(&format!("unit {} warns: {text}", instance.name()));
            }
            keep(&mut self.messages, instance.name(), messages);
        }
    }
}

fn keep(kept: &mut Vec<UnitMessage>, instance: &str, messages: Vec<Message>) {
    let room = MAX_MESSAGES.saturating_sub(kept.len());
    kept.extend(messages.into_iter().take(room).map(|message| UnitMessage {
        instance: instance.to_owned(),
        status: message.status,
        text: message.text,
    }));
}

fn gather_messages(
    participants: &mut [Participant],
    mut kept: Vec<UnitMessage>,
) -> Vec<UnitMessage> {
    for participant in participants {
        let instance = participant.instance_mut();
        let messages = instance.take_messages();
        keep(&mut kept, instance.name(), messages);
    }
    kept
}

fn tell_findings(system: &System, observer: &mut dyn Observer) {
    let mut told = Vec::new();
    for plan in &system.instances {
        let path = plan.package.path();
        if told.contains(&path) {
            continue;
        }
        told.push(path);
        for finding in plan.package.findings() {
            observer.notice(&format!("{}: {}", path.display(), finding.message));
        }
    }
    let stepping = SignalGraph::stepping(system);
    for component in stepping.loops() {
        observer.notice(&format!(
            "algebraic loop, cut by extrapolation: {}",
            stepping.names(system, &component)
        ));
    }
}

/// Signals of interest: those recorded first, then those only drawn.
struct Selection {
    ports: Vec<Port>,
    recorded: usize,
    /// per plot, per panel: positions in `ports`
    plots: Vec<Vec<Vec<usize>>>,
}

impl Selection {
    fn new(scenario: &Scenario, system: &System) -> Result<Self, Error> {
        let mut ports: Vec<Port> = Vec::new();
        for (k, pattern) in scenario.record.signals.iter().enumerate() {
            for port in Self::select(system, &format!("record.signals[{k}]"), pattern)? {
                if !ports.contains(&port) {
                    ports.push(port);
                }
            }
        }
        let recorded = ports.len();
        let mut plots = Vec::new();
        for (k, plot) in scenario.plots.iter().enumerate() {
            let mut panels = Vec::new();
            for (j, panel) in plot.panels.iter().enumerate() {
                let mut curves = Vec::new();
                for pattern in &panel.signals {
                    let place = format!("plots[{k}].panels[{j}].signals");
                    for port in Self::select(system, &place, pattern)? {
                        let known = ports.iter().position(|it| *it == port);
                        curves.push(known.unwrap_or_else(|| {
                            ports.push(port);
                            ports.len() - 1
                        }));
                    }
                }
                panels.push(curves);
            }
            plots.push(panels);
        }
        Ok(Self { ports, recorded, plots })
    }

    /// Signals that have numbers; a star passes over texts, naming one is an error.
    fn select(system: &System, place: &str, pattern: &str) -> Result<Vec<Port>, SystemError> {
        let mut ports = system.select(place, pattern)?;
        if pattern.contains('*') {
            ports.retain(|port| system.variable(*port).kind != Type::String);
        }
        if let Some(text) = ports.iter().find(|port| system.variable(**port).kind == Type::String) {
            return Err(SystemError::NotNumeric {
                place: place.to_owned(),
                port: system.port_name(*text),
            });
        }
        Ok(ports)
    }

    fn slots(&self, participants: &[Participant]) -> Vec<(usize, Slot)> {
        self.ports
            .iter()
            .filter_map(|port| {
                Some((port.instance, participants[port.instance].slot(port.variable)?))
            })
            .collect()
    }
}

/// Factor and offset to SI base units.
fn to_base(system: &System, port: Port) -> (f64, f64) {
    let description = system.instances[port.instance].description();
    description
        .unit_of(port.variable)
        .and_then(|unit| unit.base.as_ref())
        .map_or((1.0, 0.0), |base| (base.factor, base.offset))
}

fn base_unit(system: &System, port: Port) -> Option<String> {
    let description = system.instances[port.instance].description();
    match description.unit_of(port.variable).and_then(|unit| Some((unit, unit.base.as_ref()?))) {
        Some((unit, base)) if base.factor == 1.0 && base.offset == 0.0 => Some(unit.name.clone()),
        Some((_, base)) => Some(base.expression()),
        None => system.variable(port).unit.clone(),
    }
}

/// Where the run's signals go.
struct Output {
    folder: PathBuf,
    table: Table,
    gatherers: Vec<Gatherer>,
    /// of the signals that are drawn
    curves: Vec<Option<Curve>>,
    conversions: Vec<(f64, f64)>,
    values: Vec<f64>,
    stride: u64,
    points: u64,
}

impl Output {
    fn create(
        folder: &Path,
        scenario: &Scenario,
        system: &System,
        selection: &Selection,
    ) -> Result<Self, Error> {
        let failed = |source| Error::Output { path: folder.to_owned(), running: false, source };
        fs::create_dir_all(folder).map_err(failed)?;
        let names: Vec<String> = selection.ports[..selection.recorded]
            .iter()
            .map(|&port| system.port_name(port))
            .collect();
        let table = Table::create(folder, names.iter().map(String::as_str)).map_err(failed)?;
        let mut curves = vec![None; selection.ports.len()];
        let points = scenario.experiment.steps()? + 1;
        for panels in &selection.plots {
            let count = panels.iter().map(Vec::len).sum();
            for &k in panels.iter().flatten() {
                // a signal in two pictures is reduced for the finer one
                let slices = plot::slices(count);
                let curve = Curve::new(points, slices);
                if curves[k].as_ref().is_none_or(|other: &Curve| other.is_coarser_than(&curve)) {
                    curves[k] = Some(curve);
                }
            }
        }
        Ok(Self {
            folder: folder.to_owned(),
            table,
            gatherers: vec![Gatherer::default(); selection.recorded],
            curves,
            conversions: selection.ports.iter().map(|&port| to_base(system, port)).collect(),
            values: vec![0.0; selection.ports.len()],
            stride: scenario.stride()?,
            points: 0,
        })
    }

    fn take(
        &mut self,
        time: f64,
        participants: &[Participant],
        slots: &[(usize, Slot)],
    ) -> Result<(), Error> {
        for ((value, &(unit, slot)), &(factor, offset)) in
            self.values.iter_mut().zip(slots).zip(&self.conversions)
        {
            *value = factor * participants[unit].value(slot) + offset;
        }
        for (gatherer, &value) in self.gatherers.iter_mut().zip(&self.values) {
            gatherer.take(time, value);
        }
        for (curve, &value) in self.curves.iter_mut().zip(&self.values) {
            if let Some(curve) = curve {
                curve.take(time, value);
            }
        }
        if self.points.is_multiple_of(self.stride) {
            let recorded = self.gatherers.len();
            self.table.row(time, self.values[..recorded].iter().copied()).map_err(|source| {
                Error::Output { path: self.folder.clone(), running: true, source }
            })?;
        }
        self.points += 1;
        Ok(())
    }
}

fn instantiate(system: &System) -> Result<Vec<Instance>, Error> {
    let mut loaded: HashMap<PathBuf, (Functions, Rc<Cell<bool>>)> = HashMap::new();
    let mut instances = Vec::with_capacity(system.instances.len());
    for plan in &system.instances {
        let package = &plan.package;
        // keyed by the unpacked binary: one file under two names is unpacked, and loaded, twice
        let binary = package.binary();
        let once = package.description().co_simulation.can_be_instantiated_only_once_per_process;
        let (functions, dead) = match loaded.get(&binary) {
            Some(known) if !once => known.clone(),
            Some(_) => (Functions::load_copy(package)?, Rc::default()),
            None => {
                let fresh: (Functions, Rc<Cell<bool>>) = (Functions::load(package)?, Rc::default());
                loaded.insert(binary, fresh.clone());
                fresh
            }
        };
        let instance =
            Instance::new(package, functions, &dead, &plan.name).map_err(Error::Instantiate)?;
        instances.push(instance);
    }
    Ok(instances)
}

fn sequence(scenario: &Scenario, system: &System) -> Result<Vec<usize>, Error> {
    let mut first = Vec::new();
    for (k, pattern) in scenario.algorithm.order.iter().enumerate() {
        first.extend(system.select_instances(&format!("algorithm.order[{k}]"), pattern)?);
    }
    Ok(graph::sequence(system, &first))
}

/// Lays out what every instance exchanges and joins the instances to it.
fn plan(
    scenario: &Scenario,
    system: &System,
    selection: &Selection,
    instances: Vec<Instance>,
    algorithm: &dyn Algorithm<Participant>,
) -> Result<(Vec<Participant>, Exchange), UnitError> {
    let degree = usize::from(scenario.algorithm.extrapolation);
    let n = instances.len();
    let mut traffic = vec![Traffic::default(); n];
    let mut links = vec![Links::default(); n];
    for port in &selection.ports {
        traffic[port.instance].watched.push(port.variable);
    }
    for link in &system.links {
        connect(scenario, system, algorithm, degree, link, &mut traffic, &mut links);
    }
    let mut participants = Vec::with_capacity(n);
    for (k, (instance, traffic)) in instances.into_iter().zip(traffic).enumerate() {
        let mut participant = Participant::new(instance, traffic);
        links[k].offered = participant.probe_outputs()?;
        participants.push(participant);
    }
    Ok((participants, Exchange::new(links, degree)))
}

fn connect(
    scenario: &Scenario,
    system: &System,
    algorithm: &dyn Algorithm<Participant>,
    degree: usize,
    link: &crate::system::Link,
    traffic: &mut [Traffic],
    links: &mut [Links],
) {
    let (from, to) = (link.from, link.to);
    /// position of a variable in a list, appended if new
    fn place(list: &mut Vec<usize>, variable: usize) -> usize {
        list.iter().position(|&it| it == variable).unwrap_or_else(|| {
            list.push(variable);
            list.len() - 1
        })
    }
    let target = &system.instances[to.instance].description().co_simulation;
    match system.variable(from).kind {
        Type::Real => {
            let source = &system.instances[from.instance].description().co_simulation;
            let interpolates = algorithm.interpolates(from.instance, to.instance);
            let useful = if interpolates { degree.max(1) } else { degree };
            let wanted = if scenario.algorithm.derivatives {
                useful.min(source.max_output_derivative_order as usize)
            } else {
                0
            };
            let outputs = &mut traffic[from.instance].real_outputs;
            let output = match outputs.iter().position(|(it, _)| *it == from.variable) {
                Some(k) => {
                    outputs[k].1 = outputs[k].1.max(wanted);
                    k
                }
                None => {
                    outputs.push((from.variable, wanted));
                    outputs.len() - 1
                }
            };
            // interpolation may be cubic (Hermite) whatever the extrapolation's degree
            let limit = match (target.can_interpolate_inputs, interpolates) {
                (false, _) => 0,
                (true, true) => 3,
                (true, false) => degree,
            };
            traffic[to.instance].real_inputs.push((to.variable, limit));
            links[to.instance].reals.push(RealLink {
                unit: from.instance,
                output,
                factor: link.conversion.factor,
                offset: link.conversion.offset,
                limit,
            });
        }
        Type::Integer | Type::Enumeration => {
            let output = place(&mut traffic[from.instance].integer_outputs, from.variable);
            traffic[to.instance].integer_inputs.push(to.variable);
            links[to.instance].integers.push((from.instance, output));
            links[from.instance].integer_outputs = traffic[from.instance].integer_outputs.len();
        }
        Type::Boolean => {
            let output = place(&mut traffic[from.instance].boolean_outputs, from.variable);
            traffic[to.instance].boolean_inputs.push(to.variable);
            links[to.instance].booleans.push((from.instance, output));
            links[from.instance].boolean_outputs = traffic[from.instance].boolean_outputs.len();
        }
        Type::String => {
            let output = place(&mut traffic[from.instance].string_outputs, from.variable);
            traffic[to.instance].string_inputs.push(to.variable);
            links[to.instance].strings.push((from.instance, output));
            links[from.instance].string_outputs = traffic[from.instance].string_outputs.len();
        }
    }
}

fn draw(
    scenario: &Scenario,
    system: &System,
    selection: &Selection,
    folder: &Path,
    curves: Vec<Option<Curve>>,
) -> Result<Vec<String>, Error> {
    let points: Vec<Vec<(f64, f64)>> =
        curves.into_iter().map(|curve| curve.map(Curve::finish).unwrap_or_default()).collect();
    let mut pictures = Vec::new();
    for (plot, panels) in scenario.plots.iter().zip(&selection.plots) {
        let panels: Vec<plot::Panel> = plot
            .panels
            .iter()
            .zip(panels)
            .map(|(panel, indices)| plot::Panel {
                ylabel: panel.ylabel.clone(),
                lines: indices
                    .iter()
                    .enumerate()
                    .map(|(k, &index)| plot::Line {
                        label: panel
                            .labels
                            .get(k)
                            .cloned()
                            .unwrap_or_else(|| system.port_name(selection.ports[index])),
                        points: points[index].iter().map(|&(t, y)| (t, panel.scale * y)).collect(),
                    })
                    .collect(),
            })
            .collect();
        let title = if plot.title.is_empty() { &scenario.title } else { &plot.title };
        let svg = plot::draw(title, &panels)
            .map_err(|source| Error::Plot { file: plot.file.clone(), source })?;
        let path = folder.join(&plot.file);
        fs::write(&path, svg).map_err(|source| Error::Output { path, running: true, source })?;
        pictures.push(plot.file.clone());
    }
    Ok(pictures)
}

fn units(
    scenario: &Scenario,
    system: &System,
    participants: &[Participant],
) -> IndexMap<String, UnitSummary> {
    let mut units = IndexMap::new();
    for (name, path) in &scenario.units {
        // without an instance there is nothing to tell
        let Some(first) = system.instances.iter().find(|plan| plan.package.path() == path) else {
            continue;
        };
        let description = first.description();
        let mine = || participants.iter().filter(|it| it.instance().package().path() == path);
        units.insert(
            name.clone(),
            UnitSummary {
                path: path.display().to_string(),
                model: description.model_name.clone(),
                version: description.version.clone(),
                guid: description.guid.clone(),
                generation_tool: description.generation_tool.clone(),
                instances: system
                    .instances
                    .iter()
                    .filter(|plan| plan.package.path() == path)
                    .count(),
                steps: mine().map(|it| it.instance().steps()).sum(),
                step_seconds: mine().map(|it| it.timing().step_seconds()).sum(),
                exchange_seconds: mine().map(|it| it.timing().exchange_seconds()).sum(),
            },
        );
    }
    units
}

fn algorithm_summary(scenario: &Scenario, system: &System, order: &[usize]) -> AlgorithmSummary {
    let stepping = SignalGraph::stepping(system);
    let sequential = scenario.algorithm.name == AlgorithmName::GaussSeidel;
    AlgorithmSummary {
        name: scenario.algorithm.name.as_str().to_owned(),
        extrapolation: scenario.algorithm.extrapolation,
        derivatives: scenario.algorithm.derivatives,
        order: order
            .iter()
            .filter(|_| sequential)
            .map(|&k| system.instances[k].name.clone())
            .collect(),
        algebraic_loops: stepping
            .loops()
            .iter()
            .map(|component| stepping.names(system, component))
            .collect(),
    }
}
