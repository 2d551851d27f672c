//! Instances and the values that the scenario and the command line give them.

use std::cell::OnceCell;
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use indexmap::IndexMap;

use super::error::{Named, causality_name};
use super::signals::SignalGraph;
use super::{InstanceIndex, InstanceSetup, Overridden, Port, Result, System, SystemError};
use fmi2_import::description::{Causality, Initial, Type, Value, Variability};
use fmi2_import::package::Package;
use scenario::{DebugLog, InstanceSettings, LogLevel, Override, Setting};

impl System {
    pub(super) fn add(
        &mut self,
        pattern: &str,
        instance: &InstanceSettings,
        packages: &IndexMap<&str, Arc<Package>>,
        level: LogLevel,
    ) -> Result<()> {
        let place = format!("instances.{pattern}");
        let package = packages.get(instance.unit.as_str()).ok_or_else(|| SystemError::Unknown {
            place: format!("{place}.unit"),
            what: Named::Fmu,
            name: instance.unit.clone(),
            within: Some("units".to_owned()),
            suggestion: patterns::suggest(&instance.unit, packages.keys().copied())
                .map(str::to_owned),
        })?;
        let names = patterns::expand(pattern)
            .map_err(|source| SystemError::Pattern { place: "instances".to_owned(), source })?;
        let bad = |name: &str, why| SystemError::InstanceName { name: name.to_owned(), why };
        for name in names {
            if name.is_empty() || name.contains(['.', '*']) || name.chars().any(char::is_control) {
                return Err(bad(
                    &name,
                    "is empty or contains a dot, a star or a control character",
                ));
            }
            let index = InstanceIndex(self.instances.len());
            if self.by_name.insert(name.clone(), index).is_some() {
                return Err(bad(&name, "occurs twice"));
            }
            let package = Arc::clone(package);
            let debug_log = debug_log(&place, instance, &package, level)?;
            self.instances.push(InstanceSetup {
                name,
                unit: instance.unit.clone(),
                package,
                isolate: instance.isolate,
                steps: instance.steps,
                every: instance.every,
                tolerance: instance.tolerance,
                debug_log,
                input_derivatives: instance.input_derivatives,
                parameters: IndexMap::new(),
                inputs: IndexMap::new(),
            });
            self.set_all(&place, index, instance)?;
        }
        Ok(())
    }

    /// Instances without a tolerance of their own get the general one, or the one that their units
    /// suggest.
    pub(super) fn set_tolerances(&mut self, of_all: Option<f64>) {
        let usable = |it: &f64| *it > 0.0 && it.is_finite();
        for instance in &mut self.instances {
            let suggested = instance.description().default_experiment.tolerance.filter(usable);
            instance.tolerance = instance.tolerance.or(of_all).or(suggested);
        }
    }

    /// Sets the values that the scenario gives an instance.
    fn set_all(
        &mut self,
        place: &str,
        index: InstanceIndex,
        instance: &InstanceSettings,
    ) -> Result<()> {
        for (list, settings) in [("parameters", &instance.parameters), ("start", &instance.start)] {
            let place = format!("{place}.{list}");
            for (names, setting) in settings {
                for variable in self.find_variables(&place, index, names)? {
                    let port = Port { instance: index, variable };
                    self.check_list(&place, port, list)?;
                    let name = &self.variable(port).name;
                    self.set(&format!("{place}.{name}"), port, setting)?;
                }
            }
        }
        Ok(())
    }

    /// Parameters belong under "parameters", everything else under "start".
    fn check_list(&self, place: &str, port: Port, list: &str) -> Result<()> {
        let causality = self.variable(port).causality;
        let right = if causality == Causality::Parameter { "parameters" } else { "start" };
        if right == list {
            return Ok(());
        }
        Err(SystemError::NotSettable {
            place: place.to_owned(),
            port: self.port_name(port),
            why: format!("it is {}; it belongs under \"{right}\"", causality_name(causality)),
        })
    }

    /// Sets the values that replace those of the file. Later ones replace earlier ones.
    pub(super) fn override_values(&mut self, overrides: &[Override]) -> Result<()> {
        for entry in overrides {
            let place = format!("--set {entry}");
            for port in self.select(&place, &entry.target)? {
                let setting = entry.setting(self.variable(port));
                self.set(&place, port, &setting)?;
                self.overridden.push(Overridden { port, setting, place: place.clone() });
            }
        }
        Ok(())
    }

    /// Sets the value of a variable, replacing an earlier one.
    fn set(&mut self, place: &str, port: Port, setting: &Setting) -> Result<()> {
        let variable = self.variable(port);
        let value = self.value(place, port, setting)?;
        let refuse = |why: &str| {
            Err(SystemError::NotSettable {
                place: place.to_owned(),
                port: self.port_name(port),
                why: why.to_owned(),
            })
        };
        if variable.variability == Variability::Constant {
            return refuse("it is constant");
        }
        let is_input = variable.causality == Causality::Input;
        if !is_input && !matches!(variable.initial, Some(Initial::Exact | Initial::Approx)) {
            return refuse(&format!(
                "it is {} that the unit computes itself",
                causality_name(variable.causality)
            ));
        }
        let instance = &mut self.instances[port.instance];
        let list = if is_input { &mut instance.inputs } else { &mut instance.parameters };
        list.insert(port.variable, value);
        Ok(())
    }

    /// Values for inputs that a connection feeds have no effect: those of the command line are errors,
    /// those of the scenario are noted. In loops while initializing, such values are first guesses.
    pub(super) fn check_unused_values(&mut self) -> Result<()> {
        if self.instances.iter().all(|instance| instance.inputs.is_empty()) {
            return Ok(());
        }
        let sources: HashMap<Port, Port> =
            self.links.iter().map(|link| (link.to, link.from)).collect();
        let guesses = OnceCell::new();
        let unused = |place: &dyn Fn() -> String, port: Port| {
            let from = *sources.get(&port)?;
            let guessed = guesses.get_or_init(|| self.looped_inputs()).contains(&port);
            (!guessed).then(|| SystemError::Unused {
                place: place(),
                port: self.port_name(port),
                from: self.port_name(from),
            })
        };
        let mut given = self.overridden.iter();
        if let Some(error) = given.find_map(|it| unused(&|| it.place.clone(), it.port)) {
            return Err(error);
        }
        let mut remarks = self.indexed().flat_map(|(instance, setup)| {
            let ports = setup.inputs.keys().map(move |&variable| Port { instance, variable });
            ports.filter_map(|port| unused(&|| format!("instances.{}.start", setup.name), port))
        });
        if let Some(first) = remarks.next() {
            let more = match remarks.count() {
                0 => String::new(),
                more => format!(" (and {more} more like it)"),
            };
            self.notes.push(format!("{first}{more}"));
        }
        Ok(())
    }

    /// The inputs that depend on themselves while initializing.
    fn looped_inputs(&self) -> HashSet<Port> {
        let signals = SignalGraph::initial(self);
        let nodes = signals.loops().into_iter().flatten();
        nodes.filter(|&node| signals.is_input[node]).map(|node| signals.ports[node]).collect()
    }

    /// The variables of that name with their new values, for a change while stepping.
    pub(crate) fn changes(
        &self,
        place: &str,
        name: &str,
        setting: &Setting,
    ) -> Result<Vec<(Port, Value)>> {
        let ports = self.select(place, name)?;
        let fed: HashSet<Port> = self.links.iter().map(|link| link.to).collect();
        let change = |port: Port| {
            let variable = self.variable(port);
            let free = variable.causality == Causality::Input && !fed.contains(&port);
            let refuse = |why: &str| SystemError::NotSettable {
                place: place.to_owned(),
                port: self.port_name(port),
                why: why.to_owned(),
            };
            if self.driven.contains(&port) {
                return Err(refuse("it follows a signal under \"inputs\""));
            }
            if !free && variable.variability != Variability::Tunable {
                return Err(refuse("it is neither tunable nor an unconnected input"));
            }
            Ok((port, self.value(place, port, setting)?))
        };
        ports.into_iter().map(change).collect()
    }

    fn value(&self, place: &str, port: Port, setting: &Setting) -> Result<Value> {
        let variable = self.variable(port);
        let value = match (variable.kind, setting) {
            (Type::Enumeration, _) => return self.item(place, port, setting),
            (Type::Real, Setting::Number(x)) => Value::Real(*x),
            (Type::Integer, Setting::Number(x)) => {
                Value::Integer(whole(*x).ok_or_else(|| self.invalid(place, port, setting))?)
            }
            (Type::Boolean, Setting::Boolean(x)) => Value::Boolean(*x),
            (Type::String, Setting::Text(x)) => Value::String(x.clone()),
            (Type::String, Setting::File(file)) => self.file(place, port, &file.path)?,
            _ => return Err(self.invalid(place, port, setting)),
        };
        if let Setting::Number(x) = *setting {
            let min = variable.min.unwrap_or(f64::NEG_INFINITY);
            let max = variable.max.unwrap_or(f64::INFINITY);
            if x < min || x > max {
                return Err(SystemError::OutOfRange {
                    place: place.to_owned(),
                    port: self.port_name(port),
                    value: x,
                    min,
                    max,
                });
            }
        }
        Ok(value)
    }

    /// The path of a file, which must exist. The unit may have another working folder, so the path is
    /// absolute.
    fn file(&self, place: &str, port: Port, path: &Path) -> Result<Value> {
        let missing = |source| SystemError::File {
            place: place.to_owned(),
            port: self.port_name(port),
            path: path.to_owned(),
            source,
        };
        path.metadata().map_err(missing)?;
        let absolute = std::path::absolute(path).map_err(missing)?;
        let text = absolute.into_os_string().into_string().map_err(|_| {
            missing(std::io::Error::new(std::io::ErrorKind::InvalidData, "its path is not UTF-8"))
        })?;
        Ok(Value::String(text))
    }

    fn invalid(&self, place: &str, port: Port, setting: &Setting) -> SystemError {
        SystemError::Value {
            place: place.to_owned(),
            port: self.port_name(port),
            value: setting.to_string(),
            kind: self.variable(port).kind,
        }
    }

    /// An item of an Enumeration, given by its name or its value.
    fn item(&self, place: &str, port: Port, setting: &Setting) -> Result<Value> {
        let number = match setting {
            Setting::Number(x) => {
                Some(whole(*x).ok_or_else(|| self.invalid(place, port, setting))?)
            }
            _ => None,
        };
        let setup = &self.instances[port.instance];
        let Some(enumeration) = setup.description().enumeration_of(port.variable.0) else {
            // the unit defines no items: only numbers are possible
            return number.map(Value::Integer).ok_or_else(|| self.invalid(place, port, setting));
        };
        let found = enumeration.items.iter().find(|(name, value)| match setting {
            Setting::Text(text) => text == name,
            _ => number == Some(*value),
        });
        found.map(|(_, value)| Value::Integer(*value)).ok_or_else(|| SystemError::NoItem {
            place: place.to_owned(),
            port: self.port_name(port),
            value: setting.to_string(),
            items: enumeration
                .items
                .iter()
                .map(|(name, value)| format!("\"{name}\" ({value})"))
                .collect(),
        })
    }
}

/// The categories of an instance's debug messages. Its unit must declare them.
fn debug_log(
    place: &str,
    instance: &InstanceSettings,
    package: &Package,
    level: LogLevel,
) -> Result<Option<Vec<String>>> {
    let of_all = DebugLog::All(level == LogLevel::Debug);
    let Some(categories) = instance.debug_log.as_ref().unwrap_or(&of_all).categories() else {
        return Ok(None);
    };
    let description = package.description();
    let declared = &description.log_categories;
    match categories.iter().find(|it| !declared.contains(it)) {
        None => Ok(Some(categories.to_vec())),
        Some(unknown) => Err(SystemError::Unknown {
            place: format!("{place}.debug_log"),
            what: Named::LogCategory,
            name: unknown.clone(),
            within: Some(match declared.as_slice() {
                [] => format!("unit {}, which declares none", description.model_name),
                _ => format!("unit {} ({})", description.model_name, declared.join(", ")),
            }),
            suggestion: patterns::suggest(unknown, declared.iter().map(String::as_str))
                .map(str::to_owned),
        }),
    }
}

/// The number as an integer of 32 bits, if it is one.
fn whole(x: f64) -> Option<i32> {
    let fits = x.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&x);
    #[expect(clippy::cast_possible_truncation, reason = "checked: a whole i32")]
    fits.then_some(x as i32)
}
