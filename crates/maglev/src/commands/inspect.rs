//! `maglev inspect`

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use fmi2_import::description::{
    Causality, DefaultExperiment, ModelDescription, Value, Variability, Variable,
};
use fmi2_import::package::Package;
use maglev::Error;

use super::table::table;

/// Arguments of `maglev inspect`.
#[derive(Args)]
pub struct Arguments {
    /// The unit (.fmu), or a system (.ssp).
    unit: PathBuf,
    /// Print the whole description (or the modes) as JSON.
    #[arg(long)]
    json: bool,
    /// Refuse a unit in which `maglev validate` finds an error.
    #[arg(long)]
    strict: bool,
    /// Show the modes of small motions about the start, if the unit offers this report.
    #[arg(long)]
    modes: bool,
    /// Options for the modes, as JSON. See the unit's documentation.
    #[arg(long, value_name = "JSON", requires = "modes")]
    options: Option<String>,
}

/// Prints a page about the unit.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    if ssp::is_system(&arguments.unit) {
        return super::system::inspect(&arguments.unit, arguments.json);
    }
    let package = Package::open(&arguments.unit)?;
    if arguments.strict {
        fmi2_conformance::refuse_defects(package.path(), package.path())?;
    }
    if arguments.modes {
        return super::unit_modes::run(package, arguments.options.as_deref(), arguments.json);
    }
    let text = if arguments.json {
        serde_json::to_string_pretty(package.description()).unwrap_or_default() + "\n"
    } else {
        page(&package)
    };
    super::print(&text)
}

// writing to a String cannot fail, so the results of writeln! are dropped
fn page(package: &Package) -> String {
    let description = package.description();
    let mut text = identity(package);
    text += &capabilities(description);
    text += &counts(description);
    text += &constants(description);
    let all = &description.variables;
    let of = |causality| {
        move |variable: &&Variable| {
            variable.causality == causality && variable.variability != Variability::Constant
        }
    };
    text += &list("Parameters", all.iter().filter(of(Causality::Parameter)), |_, variable| {
        let tunable = variable.variability == Variability::Tunable;
        let kind = if tunable { " (tunable)" } else { "" };
        vec![start(variable), unit(variable), range(variable) + kind]
    });
    text += &list("Inputs", all.iter().filter(of(Causality::Input)), |_, variable| {
        vec![start(variable), unit(variable), range(variable)]
    });
    text += &list("Outputs", all.iter().filter(of(Causality::Output)), |name, variable| {
        let inputs = description
            .find(name)
            .map(|index| description.step_dependencies(index).len())
            .unwrap_or_default();
        let inputs = match inputs {
            0 => "no input".to_owned(),
            1 => "1 input".to_owned(),
            n => format!("{n} inputs"),
        };
        vec![unit(variable), format!("depends on {inputs}")]
    });
    text
}

fn identity(package: &Package) -> String {
    let description = package.description();
    let mut text = description.model_name.clone();
    if let Some(version) = &description.version {
        let _ = write!(text, " {version}");
    }
    if let Some(what) = &description.description {
        let _ = write!(text, ": {what}");
    }
    text.push('\n');
    let or_none = |value: &Option<String>| value.clone().unwrap_or_else(|| "-".to_owned());
    let platforms = match package.platforms() {
        list if list.is_empty() => "none".to_owned(),
        list => list.join(", "),
    };
    for (name, value) in [
        ("file", package.path().display().to_string()),
        ("identifier", description.co_simulation.model_identifier.clone()),
        ("guid", description.guid.clone()),
        ("author", or_none(&description.author)),
        ("licence", or_none(&description.license)),
        ("made by", or_none(&description.generation_tool)),
        ("binaries", platforms),
    ] {
        let _ = writeln!(text, "  {name:<12}{value}");
    }
    if let Some(experiment) = experiment(&description.default_experiment) {
        let _ = writeln!(text, "  {:<12}{experiment}", "experiment");
    }
    text
}

/// The run that the unit suggests, if it suggests one.
fn experiment(suggested: &DefaultExperiment) -> Option<String> {
    let DefaultExperiment { start_time, stop_time, tolerance, step_size } = *suggested;
    let parts = [
        start_time.map(|it| format!("start {it} s")),
        stop_time.map(|it| format!("stop {it} s")),
        step_size.map(|it| format!("step {it} s")),
        tolerance.map(|it| format!("tolerance {it:e}")),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

fn capabilities(description: &ModelDescription) -> String {
    let co = &description.co_simulation;
    let mut text = "\nCapabilities\n".to_owned();
    let yes = |flag: bool| if flag { "yes" } else { "no" };
    for (name, flag) in [
        ("any communication step", co.can_handle_variable_communication_step_size),
        ("interpolates inputs", co.can_interpolate_inputs),
        ("saves and restores its state", co.can_get_and_set_fmu_state),
        ("serializes its state", co.can_serialize_fmu_state),
        ("directional derivatives", co.provides_directional_derivative),
        ("several instances per process", !co.can_be_instantiated_only_once_per_process),
        ("runs on its own", !co.needs_execution_tool),
    ] {
        let _ = writeln!(text, "  {name:<32}{}", yes(flag));
    }
    let _ = writeln!(
        text,
        "  {:<32}{}",
        "output derivatives up to order", co.max_output_derivative_order
    );
    text
}

fn counts(description: &ModelDescription) -> String {
    let mut text = "\nVariables\n".to_owned();
    for (name, causality) in [
        ("parameters", Causality::Parameter),
        ("calculated parameters", Causality::CalculatedParameter),
        ("inputs", Causality::Input),
        ("outputs", Causality::Output),
        ("local", Causality::Local),
    ] {
        let count = description.with_causality(causality).count();
        let _ = writeln!(text, "  {name:<32}{count}");
    }
    text
}

fn constants(description: &ModelDescription) -> String {
    let constants =
        description.variables.iter().filter(|it| it.variability == Variability::Constant);
    list("Constants", constants, |_, variable| vec![start(variable), unit(variable)])
}

fn start(variable: &Variable) -> String {
    variable.start.as_ref().map(ToString::to_string).unwrap_or_default()
}

fn unit(variable: &Variable) -> String {
    variable.unit.clone().unwrap_or_default()
}

fn range(variable: &Variable) -> String {
    match (variable.min.map(Value::Real), variable.max.map(Value::Real)) {
        (None, None) => String::new(),
        (Some(min), None) => format!("≥ {min}"),
        (None, Some(max)) => format!("≤ {max}"),
        (Some(min), Some(max)) => format!("[{min} … {max}]"),
    }
}

/// One line per variable, or per family of variables.
fn list<'a>(
    title: &str,
    variables: impl Iterator<Item = &'a Variable>,
    columns: impl Fn(&str, &Variable) -> Vec<String>,
) -> String {
    let rows = collapsed(variables.map(|variable| {
        let mut cells = columns(&variable.name, variable);
        cells.push(variable.description.clone().unwrap_or_default());
        (variable.name.clone(), cells)
    }));
    if rows.is_empty() {
        return String::new();
    }
    let lines = rows.into_iter().map(|row| [vec![row.name()], row.cells].concat());
    format!("\n{title}\n{}", table(lines, &[]))
}

/// Merges consecutive rows that differ only in the numbers in name and description.
fn collapsed(variables: impl Iterator<Item = (String, Vec<String>)>) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for (name, mut cells) in variables {
        match rows.last_mut().filter(|row| row.continues(&name, &cells)) {
            Some(row) => row.last = Some((name, cells.pop().unwrap_or_default())),
            None => rows.push(Row { first: name, last: None, cells }),
        }
    }
    rows.iter_mut().for_each(Row::count_in_text);
    rows
}

struct Row {
    first: String,
    /// Name and description of the last of a family.
    last: Option<(String, String)>,
    cells: Vec<String>,
}

impl Row {
    fn name(&self) -> String {
        match &self.last {
            Some((last, _)) => format!("{} … {last}", self.first),
            None => self.first.clone(),
        }
    }

    /// Gives the description the range of the name: "magnet 1" becomes "magnet 1 … 64".
    fn count_in_text(&mut self) {
        let (Some((_, last)), Some(first)) = (&self.last, self.cells.last_mut()) else { return };
        let (from, to) = (runs(first), runs(last));
        if from.len() == to.len() {
            let both = from.iter().zip(&to);
            *first = both
                .map(|(a, b)| if a == b { (*a).to_owned() } else { format!("{a} … {b}") })
                .collect();
        }
    }

    fn continues(&self, name: &str, cells: &[String]) -> bool {
        let plain = |text: &str| text.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
        let numbered = |text: &str| text.ends_with(|c: char| c.is_ascii_digit());
        numbered(name)
            && numbered(&self.first)
            && plain(name) == plain(&self.first)
            && match (cells.split_last(), self.cells.split_last()) {
                // values must be equal, descriptions may differ in numbers
                (Some((text, values)), Some((first, same))) => {
                    values == same && plain(text) == plain(first)
                }
                _ => false,
            }
    }
}

/// Splits a text into its numbers and the texts between them.
fn runs(text: &str) -> Vec<&str> {
    let mut rest = text;
    let mut runs = Vec::new();
    while let Some(digit) = rest.chars().next().map(|c| c.is_ascii_digit()) {
        let end = rest.find(|c: char| c.is_ascii_digit() != digit).unwrap_or(rest.len());
        let (run, after) = rest.split_at(end);
        runs.push(run);
        rest = after;
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(rows: &[(&str, &str, &str)]) -> Vec<String> {
        let cells = |&(name, unit, text): &(&str, &str, &str)| {
            (name.to_owned(), vec![unit.to_owned(), text.to_owned()])
        };
        let rows = collapsed(rows.iter().map(cells));
        rows.iter().map(|row| format!("{} {}", row.name(), row.cells.join(" "))).collect()
    }

    #[test]
    fn issue_numbered_families_are_one_row() {
        let family = [("gap_09", "m", "Gap of magnet 9"), ("gap_10", "m", "Gap of magnet 10")];
        assert_eq!(shown(&family), ["gap_09 … gap_10 m Gap of magnet 9 … 10"]);
        let same = [("x1", "m", "place of 2"), ("x2", "m", "place of 2")];
        assert_eq!(shown(&same), ["x1 … x2 m place of 2"]);
        for other in [
            [("gap_1", "m", "a 1"), ("gap_2", "s", "a 2")],
            [("gap_1", "m", "a 1"), ("gap_2", "m", "b 2")],
            [("gap_1", "m", "a 1"), ("rate_2", "m", "a 2")],
            [("gap", "m", "a 1"), ("gap_2", "m", "a 2")],
        ] {
            assert_eq!(shown(&other).len(), 2, "{other:?}");
        }
    }
}
