//! A scenario under one condition, ready to be computed for many sets of values.

use std::sync::Mutex;

use crate::closed::Laws;
use crate::core::{Core, EXACT, SEARCH};
use crate::counting::{ALL, Mode, Rule};
use crate::error::TuneError;
use crate::figures::{Figures, Scene};
use crate::file::{Bounds, SensorNoise, Tuning};
use crate::noise::Track;
use crate::split::Split;
use crate::verify::{named, whole_system};
use faer::prelude::c64;
use fmi2_import::description::{Type, Value};
use linear::{LinearSystem, LinearUnit, Linearised, Port};
use maps::{Given, Twin, changed, twins};
use master::Setup;
use master::system::VariableIndex;
use scenario::{Override, Scenario, Setting};

/// Change of a parameter by which its influence is found out, as a fraction of its range.
const NUDGE: f64 = 0.2;

/// A parameter that is varied.
#[derive(Debug, Clone)]
pub(crate) struct Parameter {
    pub target: String,
    pub bounds: Bounds,
    pub changes: Vec<(usize, VariableIndex)>,
    /// Unit of measure.
    pub unit: Option<String>,
    /// In the scenario, if it is the same for all instances.
    pub own: Option<f64>,
}

impl Parameter {
    /// The value at a place between 0 and 1.
    pub fn value(&self, place: f64) -> f64 {
        let Bounds { from, to, log } = self.bounds;
        let place = place.clamp(0.0, 1.0);
        let value = if log { from * (to / from).powf(place) } else { from + (to - from) * place };
        value.clamp(from, to)
    }

    /// The place of a value.
    pub fn place(&self, value: f64) -> f64 {
        let Bounds { from, to, log } = self.bounds;
        let value = value.clamp(from, to);
        if log { (value / from).ln() / (to / from).ln() } else { (value - from) / (to - from) }
    }
}

/// The scenario with further values, ready to start. Nothing runs, so the step need not divide its time.
pub(crate) fn setup(scenario: &Scenario, set: &[(String, String)]) -> Result<Setup, TuneError> {
    let mut scenario = scenario.clone();
    scenario.experiment.stop = scenario.experiment.start + scenario.experiment.step;
    scenario.record.interval = None;
    scenario.checkpoint = None;
    for (target, value) in set {
        scenario.overrides.push(Override { target: target.clone(), value: value.clone() });
    }
    Ok(Setup::new(&scenario)?)
}

/// A setting as the text of an override.
pub(crate) fn text(setting: &Setting) -> String {
    match setting {
        Setting::Boolean(value) => value.to_string(),
        Setting::Number(value) => value.to_string(),
        Setting::Text(value) => value.clone(),
        Setting::File(file) => file.path.to_string_lossy().into_owned(),
    }
}

/// What each parameter changes.
pub(crate) fn parameters(
    scenario: &Scenario,
    tuning: &Tuning,
) -> Result<Vec<Parameter>, TuneError> {
    let base = setup(scenario, &[])?;
    let mut all: Vec<Parameter> = Vec::new();
    for (target, bounds) in &tuning.vary {
        let mut changes = Vec::new();
        for value in [bounds.from, bounds.to] {
            let other = setup(scenario, &[(target.clone(), value.to_string())])?;
            let Some(found) = changed(&base, &other, target)? else {
                let problem = "it is an input: only parameters can be tuned";
                return Err(TuneError::value(format!("vary.{target}"), problem));
            };
            changes.extend(found);
        }
        changes.sort_unstable_by_key(|it| (it.0, it.1.0));
        changes.dedup();
        let taken = |it: &Parameter| it.changes.iter().any(|change| changes.contains(change));
        if let Some(other) = all.iter().find(|it| taken(it)) {
            let problem = format!("{} changes the same parameter", other.target);
            return Err(TuneError::value(format!("vary.{target}"), problem));
        }
        let Some(&(first, variable)) = changes.first() else {
            return Err(TuneError::value(format!("vary.{target}"), "it changes nothing"));
        };
        let own = |&(k, variable): &(usize, VariableIndex)| {
            let it = &base.system().instances[k];
            let value = it.parameters.get(&variable).cloned();
            match value.or_else(|| it.description().variables[variable.0].start.clone()) {
                Some(Value::Real(x)) => Some(x),
                _ => None,
            }
        };
        let value = own(&changes[0]);
        let same = changes.iter().all(|it| own(it) == value);
        let variable = &base.system().instances[first].description().variables[variable.0];
        debug_assert_eq!(variable.kind, Type::Real);
        all.push(Parameter {
            target: target.clone(),
            bounds: *bounds,
            unit: variable.unit.clone().filter(|it| it != "1"),
            own: value.filter(|_| same),
            changes,
        });
    }
    Ok(all)
}

/// One condition.
pub(crate) struct Prepared<'a> {
    pub name: String,
    system: LinearSystem,
    split: Split,
    twins: Mutex<Vec<Twin<'a>>>,
    /// For margins and voltages of the search, in parts.
    core: Core,
    /// For the figures that are shown, and for all modes.
    exact: Core,
    noise: Vec<Option<SensorNoise>>,
    track: Option<Track>,
    /// Which modes count.
    pub rule: Rule,
    /// Modes of the whole system at the start that the varied units do not reach.
    pub unreached: Vec<c64>,
}

impl<'a> Prepared<'a> {
    /// Starts the scenario with its own values of the parameters, and splits it. The search starts at other ones if those
    /// are out of bounds.
    pub fn new(
        name: &str,
        setup: &'a Setup,
        parameters: &[Parameter],
        tuning: &Tuning,
        own: &[f64],
        start: &[f64],
    ) -> Result<Self, TuneError> {
        let system = Linearised::at_start(setup)?.system;
        let mut units: Vec<usize> =
            parameters.iter().flat_map(|it| it.changes.iter().map(|it| it.0)).collect();
        units.sort_unstable();
        units.dedup();
        let mut split = Split::new(&system, units)?;
        // a parameter of some of the units makes them differ
        split.equal &= parameters
            .iter()
            .all(|it| split.units.iter().all(|k| it.changes.iter().any(|c| c.0 == *k)));
        let asked = if split.equal { &split.units[..1] } else { &split.units[..] };
        let mut all = twins(setup, asked)?;
        let mut noise = vec![None; split.channels.len()];
        for (input, it) in &tuning.noise {
            let Some(k) = split.names.iter().position(|name| name == input) else {
                let known = split.names.join(", ");
                let problem =
                    format!("the varied units measure no such input; they measure {known}");
                return Err(TuneError::value(format!("noise.{input}"), problem));
            };
            noise[k] = Some(*it);
        }
        let track = match &tuning.irregularity {
            Some(given) => {
                let found = Track::find(setup, given)?;
                let guideway = twins(setup, &[found.0])?;
                Some(Track::new(&system, found, given, &guideway[0], setup)?)
            }
            None => None,
        };
        let further: Vec<Port> = track.iter().flat_map(|it| it.ports.iter().copied()).collect();
        let rest = split.rest(&system, &further)?;
        let [core, exact] = Core::with(&rest, split.units.len(), split.equal, [SEARCH, EXACT])?;
        let wants_margins = tuning.constraints.modulus.is_some()
            || tuning.constraints.delay.is_some()
            || tuning.has_noise();
        if split.broken.is_none() && wants_margins {
            return Err(TuneError::Units {
                instance: system.units[split.units[0]].name.clone(),
                problem: "it acts by several outputs, and its linearisation has none to which something can be \
                          added, as the voltage of a magnet: there are no margins and no voltage. Set \
                          constraints.modulus and constraints.delay to null"
                    .to_owned(),
            });
        }
        let low: Vec<f64> = parameters.iter().map(|it| it.bounds.from).collect();
        let high: Vec<f64> = parameters.iter().map(|it| it.bounds.to).collect();
        let ends =
            [low, high].map(|values| all[0].linear(&given(parameters, split.units[0], &values)));
        let [before, after] = ends;
        split.check_feedthrough(&before?, &after?)?;
        all.shrink_to_fit();
        let band = tuning.band.map_or(ALL, |[low, high]| (low, high));
        let mut prepared = Self {
            name: name.to_owned(),
            system,
            split,
            twins: Mutex::new(all),
            core,
            exact,
            noise,
            track,
            rule: Rule::all(band),
            unreached: Vec::new(),
        };
        // before anything is left out, as it is started
        let known = prepared.modes(parameters, own)?;
        let whole = named(&whole_system(&prepared.system)?, &known);
        prepared.unreached = whole.unreached;
        let laws = prepared.laws(parameters, start)?;
        let mut changed = Vec::new();
        for (k, parameter) in parameters.iter().enumerate() {
            for sign in [-1.0, 1.0] {
                let mut values = start.to_vec();
                values[k] = parameter.value(parameter.place(start[k]) + sign * NUDGE);
                if values[k] != start[k] {
                    changed.push(prepared.laws(parameters, &values)?);
                }
            }
        }
        prepared.rule = Rule::new(&prepared.exact, &laws, &changed, tuning.influence, band)?;
        Ok(prepared)
    }

    /// The laws with values of the parameters.
    pub fn laws(&self, parameters: &[Parameter], values: &[f64]) -> Result<Laws, TuneError> {
        let twins = match self.twins.lock() {
            Ok(twins) => twins,
            Err(poisoned) => poisoned.into_inner(),
        };
        let asked = self.split.units.iter().zip(twins.iter());
        let units: Vec<LinearUnit> = asked
            .map(|(&k, twin)| twin.linear(&given(parameters, k, values)))
            .collect::<Result<_, _>>()?;
        let mut laws: Vec<_> =
            units.iter().enumerate().map(|(k, it)| self.split.law(k, it)).collect();
        Ok(if self.split.equal { Laws::Equal(laws.swap_remove(0)) } else { Laws::Each(laws) })
    }

    /// All figures with values of the parameters, for the search or without what that leaves out.
    pub fn figures(
        &self,
        parameters: &[Parameter],
        values: &[f64],
        exact: bool,
    ) -> Result<Figures, TuneError> {
        let scene = Scene {
            core: if exact { &self.exact } else { &self.core },
            whole: &self.exact,
            rule: &self.rule,
            noise: &self.noise,
            track: self.track.as_ref(),
            margins: self.split.broken.is_some(),
        };
        scene.figures(&self.laws(parameters, values)?)
    }

    /// All modes that the varied units reach, least damped first.
    pub fn modes(&self, parameters: &[Parameter], values: &[f64]) -> Result<Vec<Mode>, TuneError> {
        self.rule.modes(&self.exact, &self.laws(parameters, values)?)
    }

    /// Names of the signals at which loops are broken.
    pub fn broken(&self) -> Vec<String> {
        let Some(output) = self.split.broken_output() else { return Vec::new() };
        let name = |k: &usize| {
            let unit = &self.system.units[*k];
            format!("{}.{}", unit.name, unit.outputs[output].name)
        };
        self.split.units.iter().map(name).collect()
    }

    /// How it is computed, in words.
    pub fn method(&self) -> String {
        let loops = self.core.loops;
        if self.split.equal {
            let (blocks, widest) = (self.core.blocks.len(), self.core.widest());
            format!(
                "{loops} equal controllers: margins and voltages of the search by {blocks} parts of at most {widest} patterns of \
                 forces, with {} states and couplings below {SEARCH} left out; all modes and the figures shown by {} of at \
                 most {}, {} states without the controllers",
                self.core.states(),
                self.exact.blocks.len(),
                self.exact.widest(),
                self.exact.states()
            )
        } else {
            format!("{loops} different controllers: the full computation, each with its own law")
        }
    }
}

/// The values of one unit's parameters.
fn given(parameters: &[Parameter], unit: usize, values: &[f64]) -> Vec<Given> {
    let of = |(it, value): (&Parameter, &f64)| -> Vec<Given> {
        let mine = it.changes.iter().filter(|(k, _)| *k == unit);
        mine.map(|(_, variable)| (*variable, *value)).collect()
    };
    parameters.iter().zip(values).flat_map(of).collect()
}
