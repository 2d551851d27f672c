//! Static checks of a unit: what its archive, description and binary say, without running it.
//!
//! [`RULES`] is a list of small named rules. Each has the place in the FMI 2.0.5 text that it
//! enforces and returns one message per violation.

use std::collections::{HashMap, HashSet};

use crate::description::{
    Causality, Description, Finding, Initial, Severity, Type, Unknown, Value, Variability, Variable,
};
use crate::library::missing_symbols;
use crate::package::{PLATFORM, Package};

/// One check.
pub struct Rule {
    /// Its name.
    pub id: &'static str,
    /// Section of the FMI 2.0.5 specification.
    pub section: &'static str,
    /// How grave a violation is.
    pub severity: Severity,
    /// What it demands.
    pub demand: &'static str,
    /// One message per violation.
    pub check: fn(&Package) -> Vec<String>,
}

macro_rules! rules {
    ($($id:literal, $section:literal, $severity:ident, $demand:literal, $check:expr;)*) => {
        /// All rules.
        pub const RULES: &[Rule] = &[$(Rule {
            id: $id,
            section: $section,
            severity: Severity::$severity,
            demand: $demand,
            check: $check,
        }),*];
    };
}

rules! {
    "guid", "2.2.1", Error, "the GUID is not empty", guid;
    "experiment", "2.2.5", Error, "the default experiment makes sense", experiment;
    "serialize", "4.3.1", Error, "serialization needs get and set of states", serialize;
    "execution-tool", "4.3.1", Note, "the unit runs without another program", execution_tool;
    "variability-type", "2.2.7", Error, "only a Real is continuous", variability_type;
    "causality-variability", "2.2.7", Error, "causality and variability go together", variability;
    "initial", "2.2.7", Error, "initial fits causality and variability", initial;
    "start-required", "2.2.7", Error, "inputs, parameters and exact variables have a start", start;
    "start-forbidden", "2.2.7", Error, "what is calculated has no start", no_start;
    "start-range", "2.2.7", Error, "start values are finite and within min and max", start_range;
    "range", "2.2.7", Error, "min does not exceed max", range;
    "nominal", "2.2.7", Error, "nominal values are positive", nominal;
    "unit-defined", "2.2.2", Error, "every unit used is defined", unit_defined;
    "unit-base", "2.2.2", Warning, "every unit has a BaseUnit to convert by", unit_base;
    "derivative", "2.2.7", Error, "derivative refers to another Real", derivative;
    "alias", "2.2.7", Error, "variables that share a value reference have one start", alias;
    "time-once", "2.2.7", Error, "at most one variable is the independent one", independent;
    "outputs", "2.2.8", Error, "ModelStructure lists exactly the outputs", outputs;
    "initial-unknowns", "2.2.8", Warning, "InitialUnknowns are complete, sorted, not doubled",
        initial_unknowns;
    "dependencies", "2.2.8", Error, "dependencies are ascending and refer to knowns", dependencies;
    "log-categories", "2.2.4", Error, "log categories are not doubled", log_categories;
    "platform", "2.3", Warning, "there is a binary for this system", platform;
    "symbols", "2.1.2", Error, "binaries export all functions", symbols;
    "documentation", "2.3", Note, "there is documentation/index.html", documentation;
}

/// Everything found wrong with a unit, gravest first.
#[must_use]
pub fn check(package: &Package) -> Vec<Finding> {
    let mut findings = package.findings().to_vec();
    for rule in RULES {
        findings.extend((rule.check)(package).into_iter().map(|message| Finding {
            rule: rule.id,
            severity: rule.severity,
            message,
        }));
    }
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    findings
}

fn each(package: &Package, check: impl Fn(&Variable) -> Option<String>) -> Vec<String> {
    package
        .description()
        .variables
        .iter()
        .filter_map(|variable| check(variable).map(|text| format!("{}: {text}", variable.name)))
        .collect()
}

fn guid(package: &Package) -> Vec<String> {
    let empty = package.description().guid.trim().is_empty();
    if empty { vec!["the guid is empty".to_owned()] } else { Vec::new() }
}

fn experiment(package: &Package) -> Vec<String> {
    let experiment = &package.description().default_experiment;
    let mut found = Vec::new();
    if let (start, Some(stop)) = (experiment.start_time.unwrap_or(0.0), experiment.stop_time)
        && stop <= start
    {
        found.push(format!("stopTime {stop} does not come after startTime {start}"));
    }
    for (name, value) in [("stepSize", experiment.step_size), ("tolerance", experiment.tolerance)] {
        if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
            found.push(format!("{name} {value} is not positive"));
        }
    }
    found
}

fn serialize(package: &Package) -> Vec<String> {
    let co = &package.description().co_simulation;
    if co.can_serialize_fmu_state && !co.can_get_and_set_fmu_state {
        vec!["canSerializeFMUstate without canGetAndSetFMUstate".to_owned()]
    } else {
        Vec::new()
    }
}

fn execution_tool(package: &Package) -> Vec<String> {
    let needs = package.description().co_simulation.needs_execution_tool;
    if needs { vec!["needsExecutionTool is true".to_owned()] } else { Vec::new() }
}

fn variability_type(package: &Package) -> Vec<String> {
    each(package, |variable| {
        (variable.variability == Variability::Continuous && variable.kind != Type::Real)
            .then(|| format!("a {} cannot be continuous", variable.kind))
    })
}

fn variability(package: &Package) -> Vec<String> {
    use Variability::{Constant, Continuous, Discrete, Fixed, Tunable};
    each(package, |variable| {
        let allowed: &[Variability] = match variable.causality {
            Causality::Parameter | Causality::CalculatedParameter => &[Fixed, Tunable],
            Causality::Input => &[Discrete, Continuous],
            Causality::Output => &[Constant, Discrete, Continuous],
            Causality::Local => return None,
            Causality::Independent => &[Continuous],
        };
        (!allowed.contains(&variable.variability)).then(|| {
            format!(
                "causality {:?} with variability {:?}",
                variable.causality, variable.variability
            )
        })
    })
}

fn initial(package: &Package) -> Vec<String> {
    use Initial::{Approx, Calculated, Exact};
    each(package, |variable| {
        if !variable.initial_given {
            return None;
        }
        let allowed: &[Initial] = match (variable.causality, variable.variability) {
            (Causality::Input | Causality::Independent, _) => &[],
            (Causality::Parameter, _) | (_, Variability::Constant) => &[Exact],
            (Causality::CalculatedParameter, _)
            | (Causality::Local, Variability::Fixed | Variability::Tunable) => {
                &[Calculated, Approx]
            }
            (Causality::Output | Causality::Local, _) => &[Exact, Approx, Calculated],
        };
        let given = variable.initial?;
        (!allowed.contains(&given)).then(|| {
            format!("initial {given:?} is not allowed with causality {:?}", variable.causality)
        })
    })
}

fn start(package: &Package) -> Vec<String> {
    each(package, |variable| {
        let needed = variable.causality == Causality::Input
            || matches!(variable.initial, Some(Initial::Exact | Initial::Approx));
        (needed && variable.start.is_none()).then(|| "has no start value".to_owned())
    })
}

fn no_start(package: &Package) -> Vec<String> {
    each(package, |variable| {
        let calculated = variable.initial == Some(Initial::Calculated)
            || variable.causality == Causality::Independent;
        (calculated && variable.start.is_some())
            .then(|| "is calculated but has a start value".to_owned())
    })
}

fn start_range(package: &Package) -> Vec<String> {
    each(package, |variable| {
        let value = match variable.start.as_ref()? {
            Value::Real(value) => *value,
            Value::Integer(value) => f64::from(*value),
            _ => return None,
        };
        if !value.is_finite() {
            return Some(format!("start {value} is not finite"));
        }
        let low = variable.min.is_some_and(|min| value < min);
        let high = variable.max.is_some_and(|max| value > max);
        (low || high).then(|| format!("start {value} is outside of its range"))
    })
}

fn range(package: &Package) -> Vec<String> {
    each(package, |variable| {
        let (min, max) = (variable.min?, variable.max?);
        (min > max || min.is_nan() || max.is_nan()).then(|| format!("min {min} exceeds max {max}"))
    })
}

fn nominal(package: &Package) -> Vec<String> {
    each(package, |variable| {
        let nominal = variable.nominal?;
        (nominal <= 0.0 || !nominal.is_finite())
            .then(|| format!("nominal {nominal} is not positive"))
    })
}

fn unit_defined(package: &Package) -> Vec<String> {
    let description = package.description();
    each(package, |variable| {
        let name = variable.unit.as_deref()?;
        let Some(unit) = description.units.iter().find(|unit| unit.name == name) else {
            return Some(format!("the unit \"{name}\" is not defined"));
        };
        let display = variable.display_unit.as_deref()?;
        (display != name && unit.display_units.iter().all(|(it, ..)| it != display))
            .then(|| format!("the display unit \"{display}\" is not defined for \"{name}\""))
    })
}

fn unit_base(package: &Package) -> Vec<String> {
    let units = package.description().units.iter();
    units
        .filter(|unit| unit.base.is_none())
        .map(|unit| format!("the unit \"{}\" has no BaseUnit", unit.name))
        .collect()
}

fn derivative(package: &Package) -> Vec<String> {
    let variables = &package.description().variables;
    each(package, |variable| {
        let of = variable.derivative_of?;
        let sound = variables.get(of).is_some_and(|it| it.kind == Type::Real);
        (!sound).then(|| format!("derivative of variable {}, which is no Real", of + 1))
    })
}

fn alias(package: &Package) -> Vec<String> {
    let mut first: HashMap<(bool, Type, u32), &Variable> = HashMap::new();
    let mut found = Vec::new();
    for variable in &package.description().variables {
        let kind = if variable.kind == Type::Enumeration { Type::Integer } else { variable.kind };
        let constant = variable.variability == Variability::Constant;
        let key = (constant, kind, variable.value_reference);
        let other = *first.entry(key).or_insert(variable);
        let both = variable.start.is_some() && other.start.is_some();
        if both && variable.start != other.start {
            let (a, b) = (&other.name, &variable.name);
            found.push(format!("{a} and {b} share a value reference with different starts"));
        }
    }
    found
}

fn independent(package: &Package) -> Vec<String> {
    let names: Vec<&str> = package
        .description()
        .with_causality(Causality::Independent)
        .map(|index| package.description().variables[index].name.as_str())
        .collect();
    if names.len() > 1 { vec![format!("{} are all independent", names.join(", "))] } else { vec![] }
}

/// Compares a list of unknowns with what it must hold.
fn compare(
    description: &Description,
    what: &str,
    list: &[Unknown],
    wanted: &HashSet<usize>,
    must: &HashSet<usize>,
) -> Vec<String> {
    let name = |index: usize| &description.variables[index].name;
    let mut found = Vec::new();
    let mut listed = HashSet::new();
    for unknown in list {
        if !listed.insert(unknown.variable) {
            found.push(format!("{what} lists {} twice", name(unknown.variable)));
        }
        if !wanted.contains(&unknown.variable) {
            found.push(format!("{what} lists {}, which does not belong", name(unknown.variable)));
        }
    }
    let mut missing: Vec<usize> = must.difference(&listed).copied().collect();
    missing.sort_unstable();
    found.extend(missing.into_iter().map(|index| format!("{what} lacks {}", name(index))));
    found
}

fn outputs(package: &Package) -> Vec<String> {
    let description = package.description();
    let outputs = description.with_causality(Causality::Output).collect();
    compare(description, "Outputs", &description.outputs, &outputs, &outputs)
}

fn initial_unknowns(package: &Package) -> Vec<String> {
    let description = package.description();
    let unknown = |index: &usize| {
        let variable = &description.variables[*index];
        matches!(variable.initial, Some(Initial::Calculated | Initial::Approx))
            && matches!(variable.causality, Causality::Output | Causality::CalculatedParameter)
    };
    let all: HashSet<usize> = (0..description.variables.len()).collect();
    let must: HashSet<usize> = all.iter().copied().filter(unknown).collect();
    // states and their derivatives may be listed too, and those are any local or output variable
    let mut allowed = must.clone();
    allowed.extend(all.into_iter().filter(|&index| {
        description.variables[index].initial != Some(Initial::Exact)
            && matches!(
                description.variables[index].causality,
                Causality::Local | Causality::Output | Causality::CalculatedParameter
            )
    }));
    let list = &description.initial_unknowns;
    let mut found = compare(description, "InitialUnknowns", list, &allowed, &must);
    if !list.windows(2).all(|pair| pair[0].variable <= pair[1].variable) {
        found.push("InitialUnknowns are not sorted by index".to_owned());
    }
    found
}

fn dependencies(package: &Package) -> Vec<String> {
    let description = package.description();
    let states: HashSet<usize> =
        description.variables.iter().filter_map(|variable| variable.derivative_of).collect();
    let mut found = Vec::new();
    let lists =
        [("Outputs", &description.outputs), ("InitialUnknowns", &description.initial_unknowns)];
    for (what, list) in lists {
        for unknown in list {
            let Some(dependencies) = &unknown.dependencies else { continue };
            let of = &description.variables[unknown.variable].name;
            if !dependencies.windows(2).all(|pair| pair[0] < pair[1]) {
                found.push(format!("{what}: the dependencies of {of} are not ascending"));
            }
            for &index in dependencies {
                let variable = &description.variables[index];
                let known = variable.causality == Causality::Input
                    || variable.causality == Causality::Independent
                    || states.contains(&index)
                    || (what == "InitialUnknowns"
                        && (variable.initial == Some(Initial::Exact)
                            || variable.causality == Causality::Parameter));
                if !known {
                    found.push(format!(
                        "{what}: {of} depends on {}, which is no known",
                        variable.name
                    ));
                }
            }
        }
    }
    found
}

fn log_categories(package: &Package) -> Vec<String> {
    let mut seen = HashSet::new();
    let categories = package.description().log_categories.iter();
    categories
        .filter(|name| !seen.insert(name.as_str()))
        .map(|name| format!("the log category \"{name}\" is listed twice"))
        .collect()
}

fn platform(package: &Package) -> Vec<String> {
    if package.binary().is_file() {
        return Vec::new();
    }
    let has = package.platforms().join(", ");
    vec![format!("there is no binary for {PLATFORM}; there are binaries for: {has}")]
}

fn symbols(package: &Package) -> Vec<String> {
    let Ok(bytes) = std::fs::read(package.binary()) else { return Vec::new() };
    match missing_symbols(&bytes) {
        Ok(missing) => missing.into_iter().map(|name| format!("the binary lacks {name}")).collect(),
        Err(error) => vec![format!("the binary cannot be read: {error}")],
    }
}

fn documentation(package: &Package) -> Vec<String> {
    let has = package.files().iter().any(|file| file == "documentation/index.html");
    if has { Vec::new() } else { vec!["there is no documentation/index.html".to_owned()] }
}
