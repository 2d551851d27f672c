//! A checked study, and its points.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use criteria::Metric;
use indexmap::IndexMap;
use scenario::{Override, Scenario, Setting};

use crate::chosen::{self, ChosenStep};
use crate::folder::{Kind, STUDY};
use crate::sample::{LatinHypercube, MOST_DIMENSIONS, MOST_SOBOL, sobol};
use crate::{Design, Factor, FactorValue, StudyError, StudyFile, content, plan, table};

/// Columns of the results that are no factor and no figure.
const RESERVED: [&str; 6] = ["point", "run", "status", "limits", "reached", "chunk"];

/// A study whose file is checked and whose base scenario is read.
pub struct Study {
    pub(crate) path: PathBuf,
    pub(crate) file: StudyFile,
    name: String,
    /// the base scenario with the changes that all points share; none of a study in a results folder
    base: Option<Scenario>,
    columns: Vec<Column>,
    /// hash of what all points depend on
    identity: String,
    rows: Rows,
    seeds: Option<SeedFactor>,
    /// the step for the accuracy that the scenario asks for, once it is chosen
    chosen: OnceLock<Option<ChosenStep>>,
}

/// A combination of values.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Its number, from 1.
    pub number: u64,
    /// Its values in the order of the factors.
    pub values: Vec<FactorValue>,
    /// Name that follows from its content: the scenario, the units, and the values. It does not change if points are
    /// added.
    pub name: String,
}

/// A figure of the results.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its definition.
    pub metric: Metric,
    /// Whether it is a limit.
    pub is_limit: bool,
}

/// The combinations without seeds.
enum Rows {
    Grid { levels: Vec<u64> },
    Table(Vec<Vec<FactorValue>>),
    LatinHypercube(LatinHypercube),
    Sobol,
    Random,
    Saltelli,
}

/// The factor with seeds.
struct SeedFactor {
    place: usize,
    count: u64,
    common: bool,
}

impl Study {
    /// Reads and checks a study file and its scenario. The units are not opened yet.
    ///
    /// # Errors
    /// A file cannot be read, or something is not allowed.
    pub fn load(path: &Path) -> Result<Self, StudyError> {
        Self::new(StudyFile::load(path)?, path)
    }

    /// The study of a results folder, with its points and figures. Neither its scenario nor its units are needed, so it
    /// can be read on another machine; its points cannot be computed.
    ///
    /// # Errors
    /// The folder has no study.json, or it is invalid.
    pub fn of_results(folder: &Path) -> Result<Self, StudyError> {
        let path = folder.join(STUDY);
        let file = StudyFile::load(&path)?;
        check(&file, &path)?;
        let identity = file.as_run.as_ref().and_then(|it| it["identity"].as_str());
        let Some(identity) = identity.map(str::to_owned) else {
            let problem = "missing; this file was not written by `maglev study run`".to_owned();
            return Err(StudyError::Key { path, at: "as_run.identity".to_owned(), problem });
        };
        let columns = columns(&file.objectives, &file.limits);
        let chosen = ChosenStep::of_results(file.as_run.as_ref());
        let study = Self::with(file, &path, None, columns, identity)?;
        study.adopt(chosen);
        Ok(study)
    }

    /// Chooses the step of all points, if the scenario asks for an accuracy and it is not chosen yet. [`Runner`] and
    /// [`coordinate`](crate::coordinate) do this too; here, `tell` gets each trial and `interrupted` can end it.
    ///
    /// [`Runner`]: crate::Runner
    ///
    /// # Errors
    /// No step gives the accuracy, or a point does not fit its units.
    pub fn choose(
        &self,
        tell: &mut dyn FnMut(&str),
        interrupted: &mut dyn FnMut() -> bool,
    ) -> Result<Option<&ChosenStep>, StudyError> {
        if self.chosen.get().is_none() {
            let chosen = chosen::choose(self, tell, interrupted)?;
            self.adopt(chosen);
        }
        Ok(self.chosen())
    }

    /// The step that was chosen for an accuracy, and how.
    #[must_use]
    pub fn chosen(&self) -> Option<&ChosenStep> {
        self.chosen.get()?.as_ref()
    }

    /// Takes a step that another copy of this study has chosen. The first choice counts.
    pub fn adopt(&self, chosen: Option<ChosenStep>) {
        self.chosen.get_or_init(|| chosen);
    }

    /// Checks a study. `path` names it, and is for messages; paths in the study are relative to the working directory.
    ///
    /// # Errors
    /// A file cannot be read, or something is not allowed.
    pub fn new(file: StudyFile, path: &Path) -> Result<Self, StudyError> {
        check(&file, path)?;
        let mut base = Scenario::load(&file.scenario).map_err(StudyError::Scenario)?;
        base.overrides = file.set.iter().map(|(target, it)| set(target, it)).collect();
        for (own, given) in
            [(&mut base.objectives, &file.objectives), (&mut base.limits, &file.limits)]
        {
            own.extend(given.iter().map(|(name, metric)| (name.clone(), metric.clone())));
        }
        // a name moves from one list to the other if the study says so
        base.objectives.retain(|name, _| !file.limits.contains_key(name));
        base.limits.retain(|name, _| !file.objectives.contains_key(name));
        quiet(&mut base);
        let problem =
            |at: String, problem: String| StudyError::Key { path: path.to_owned(), at, problem };
        if let Some(name) = base.metrics().keys().find(|name| file.factors.contains_key(*name)) {
            let text = "a figure has the same name; choose another one".to_owned();
            return Err(problem(format!("factors.{name}"), text));
        }
        if let Some(name) = base.metrics().keys().find(|it| RESERVED.contains(&it.as_str())) {
            let text = "this name is that of a column of the results; choose another one";
            return Err(problem(format!("objectives.{name}"), text.to_owned()));
        }
        let identity = content::name(&plan::identity(&file, &base)?);
        let columns = columns(&base.objectives, &base.limits);
        let study = Self::with(file, path, Some(base), columns, identity)?;
        chosen::check(&study)?;
        // the first point shows whether the targets exist in the scenario
        plan::apply(&study, &study.point(1)?)?;
        Ok(study)
    }

    fn with(
        file: StudyFile,
        path: &Path,
        base: Option<Scenario>,
        columns: Vec<Column>,
        identity: String,
    ) -> Result<Self, StudyError> {
        let seeds = file.factors.values().enumerate().find_map(|(place, factor)| {
            let count = factor.seeds?;
            Some(SeedFactor { place, count, common: factor.common })
        });
        let (name, path, rows) = (name(&file, path), path.to_owned(), Rows::Random);
        let chosen = OnceLock::new();
        let mut study = Self { name, path, base, columns, identity, rows, seeds, file, chosen };
        study.rows = study.rows(&study.path)?;
        Ok(study)
    }

    fn rows(&self, path: &Path) -> Result<Rows, StudyError> {
        let names = self.names_without_seeds();
        let problem = |at: &str, problem: String| StudyError::Key {
            path: path.to_owned(),
            at: at.to_owned(),
            problem,
        };
        if let Some(points) = self.file.design.sampled() {
            let sequence =
                matches!(self.file.design, Design::Sobol { .. } | Design::Saltelli { .. });
            if points == 0 {
                return Err(problem("design.points", "0; give 1 or more".to_owned()));
            }
            if sequence && points > MOST_SOBOL {
                let text = format!("{points}; at most {MOST_SOBOL}, or take \"random\"");
                return Err(problem("design.points", text));
            }
            if u32::try_from(points).is_err() {
                return Err(problem("design.points", format!("{points}; at most {}", u32::MAX)));
            }
            let doubled = matches!(self.file.design, Design::Saltelli { .. });
            let dimensions = names.len() * if doubled { 2 } else { 1 };
            if sequence && dimensions > MOST_DIMENSIONS {
                let text =
                    format!("a sample of {dimensions} dimensions; at most {MOST_DIMENSIONS}");
                return Err(problem("design.kind", text));
            }
            if names.is_empty() {
                let text = "there is nothing to sample: all factors are seeds; take \"grid\"";
                return Err(problem("design.kind", text.to_owned()));
            }
        }
        Ok(match &self.file.design {
            Design::Grid => {
                let mut levels = Vec::new();
                for (name, factor) in self.without_seeds() {
                    let Some(count) = factor.levels() else {
                        let text = "a grid needs \"values\" or a \"range\"; for a distribution take the design \
                                    \"sobol\" or \"latin-hypercube\"";
                        return Err(problem(
                            &format!("factors.{name}.distribution"),
                            text.to_owned(),
                        ));
                    };
                    levels.push(count);
                }
                let all = levels.iter().try_fold(1_u64, |all, count| all.checked_mul(*count));
                let all = all.and_then(|all| all.checked_mul(self.replicates()));
                if all.is_none_or(|all| all > u64::from(u32::MAX)) {
                    return Err(problem("factors", format!("more than {} points", u32::MAX)));
                }
                Rows::Grid { levels }
            }
            Design::Table { file } => Rows::Table(table::read(file, &names)?),
            Design::LatinHypercube { points } => {
                // checked above
                let rows = u32::try_from(*points).unwrap_or(u32::MAX);
                Rows::LatinHypercube(LatinHypercube::new(self.file.seed, rows, &names))
            }
            Design::Sobol { .. } => Rows::Sobol,
            Design::Random { .. } => Rows::Random,
            Design::Saltelli { .. } => Rows::Saltelli,
        })
    }

    /// Name of the study: that of its file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Path of its file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Units of measure of the figures, as a results folder has them.
    pub(crate) fn units(&self) -> Vec<Option<String>> {
        let columns = self.file.as_run.as_ref().and_then(|it| it["columns"].as_array());
        let unit = |name: &str| {
            let column = columns?.iter().find(|it| it["name"] == name)?;
            column["unit"].as_str().filter(|unit| !unit.is_empty()).map(str::to_owned)
        };
        self.columns.iter().map(|column| unit(&column.name)).collect()
    }

    /// The content of its file.
    #[must_use]
    pub fn file(&self) -> &StudyFile {
        &self.file
    }

    /// The base scenario with the changes that all points share.
    ///
    /// # Errors
    /// The study was read from a results folder.
    pub fn base(&self) -> Result<&Scenario, StudyError> {
        self.base.as_ref().ok_or_else(|| StudyError::ResultsOnly { path: self.path.clone() })
    }

    /// The figures of its results: objectives, then limits.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// A text that all points have in common and that changes with the scenario, the units and the figures.
    pub(crate) fn identity(&self) -> &str {
        &self.identity
    }

    /// Names of the factors, and the kind of their values.
    pub(crate) fn kinds(&self) -> Vec<(&String, Kind)> {
        let (names, rows) = self.table();
        let of = |(name, factor): (&String, &Factor)| -> Kind {
            let kind = |values: &mut dyn Iterator<Item = &FactorValue>| {
                values.fold(Kind::Integer, |kind, value| match (kind, value) {
                    (Kind::Text, _) | (_, FactorValue::Text(_) | FactorValue::Boolean(_)) => {
                        Kind::Text
                    }
                    (_, FactorValue::Number(_)) => Kind::Number,
                    (kind, FactorValue::Integer(_)) => kind,
                })
            };
            match (&factor.values, factor.seeds) {
                (_, Some(_)) => Kind::Integer,
                (Some(values), _) => kind(&mut values.iter()),
                (None, _) => match names.iter().position(|it| it == name) {
                    Some(k) if !rows.is_empty() => kind(&mut rows.iter().map(|row| &row[k])),
                    _ => Kind::Number,
                },
            }
        };
        self.file.factors.iter().map(|it| (it.0, of(it))).collect()
    }

    /// The rows of a table of points, with the names of its columns.
    pub(crate) fn table(&self) -> (Vec<&str>, &[Vec<FactorValue>]) {
        let rows = if let Rows::Table(rows) = &self.rows { rows.as_slice() } else { &[] };
        (self.names_without_seeds(), rows)
    }

    fn without_seeds(&self) -> impl Iterator<Item = (&String, &Factor)> {
        self.file.factors.iter().filter(|(_, factor)| factor.seeds.is_none())
    }

    fn names_without_seeds(&self) -> Vec<&str> {
        self.without_seeds().map(|(name, _)| name.as_str()).collect()
    }

    fn replicates(&self) -> u64 {
        self.seeds.as_ref().map_or(1, |seeds| seeds.count)
    }

    /// Number of points.
    #[must_use]
    pub fn count(&self) -> u64 {
        let rows = match &self.rows {
            Rows::Grid { levels } => levels.iter().product(),
            Rows::Table(rows) => rows.len() as u64,
            Rows::Saltelli => {
                let factors = self.names_without_seeds().len() as u64;
                self.file.design.sampled().unwrap_or(0) * (factors + 2)
            }
            _ => self.file.design.sampled().unwrap_or(0),
        };
        rows * self.replicates()
    }

    /// A point by its number, from 1.
    ///
    /// # Errors
    /// There is no such point.
    pub fn point(&self, number: u64) -> Result<Point, StudyError> {
        let count = self.count();
        if !(1..=count).contains(&number) {
            return Err(StudyError::NoPoint { number, count });
        }
        let (row, replicate) = ((number - 1) / self.replicates(), (number - 1) % self.replicates());
        let mut values = self.row(row);
        if let Some(SeedFactor { place, common, .. }) = self.seeds {
            let name = self.file.factors.get_index(place).map_or("", |(name, _)| name.as_str());
            let others = if common { String::new() } else { self.shown(&values, place) };
            let text = format!("seed {replicate} of {name} at {others}");
            values.insert(place, FactorValue::Integer(content::seed(self.file.seed, &text)));
        }
        let name = content::name(&self.content(&values));
        Ok(Point { number, values, name })
    }

    /// All points in order.
    pub fn points(&self) -> impl Iterator<Item = Point> + '_ {
        (1..=self.count()).filter_map(|number| self.point(number).ok())
    }

    /// The values of a combination without seeds.
    fn row(&self, k: u64) -> Vec<FactorValue> {
        let seed = self.file.seed;
        let factors = self.without_seeds().enumerate();
        // each factor has a value in each design, which was checked
        let nothing = || FactorValue::Text(String::new());
        match &self.rows {
            Rows::Grid { levels } => {
                let mut rest = k;
                let mut places: Vec<u64> = levels
                    .iter()
                    .rev()
                    .map(|count| {
                        let place = rest % count;
                        rest /= count;
                        place
                    })
                    .collect();
                places.reverse();
                factors.map(|(j, (_, it))| it.level(places[j]).unwrap_or_else(nothing)).collect()
            }
            Rows::Table(rows) => usize::try_from(k).map(|k| rows[k].clone()).unwrap_or_default(),
            Rows::LatinHypercube(sample) => factors
                .map(|(j, (name, factor))| {
                    factor.quantile(sample.at(seed, k, j, name)).unwrap_or_else(nothing)
                })
                .collect(),
            Rows::Sobol => factors
                .map(|(j, (_, it))| it.quantile(sobol(seed, k, j)).unwrap_or_else(nothing))
                .collect(),
            Rows::Random => self
                .without_seeds()
                .map(|(name, factor)| {
                    let u = content::uniform(seed, &format!("value {k} of {name}"));
                    factor.quantile(u).unwrap_or_else(nothing)
                })
                .collect(),
            Rows::Saltelli => {
                let count = self.names_without_seeds().len();
                let block = count as u64 + 2;
                let (row, member) = (k / block, k % block);
                factors
                    .map(|(j, (_, factor))| {
                        // A, B, then A with column j of B
                        let of_b = member == 1 || member == j as u64 + 2;
                        let dimension = if of_b { count + j } else { j };
                        factor.quantile(sobol(seed, row, dimension)).unwrap_or_else(nothing)
                    })
                    .collect()
            }
        }
    }

    /// The values without that of the seeds, by the names of their factors.
    fn shown(&self, values: &[FactorValue], seeds: usize) -> String {
        let names = self.file.factors.keys().enumerate().filter(|(k, _)| *k != seeds);
        let mut shown: Vec<String> =
            names.zip(values).map(|((_, name), value)| format!("{name}={value}")).collect();
        // the order of the factors is none of the content
        shown.sort_unstable();
        shown.join(";")
    }

    /// What the results of a point depend on.
    fn content(&self, values: &[FactorValue]) -> String {
        let factors = self.file.factors.values().zip(values);
        let mut changes: Vec<String> = factors
            .map(|(factor, value)| {
                // targets and values are plain JSON, which always prints
                let change = (&factor.target, factor.scale, value);
                serde_json::to_string(&change).unwrap_or_default()
            })
            .collect();
        changes.sort_unstable();
        format!("{}\n{}", self.identity, changes.join("\n"))
    }
}

/// Objectives, then limits.
fn columns(
    objectives: &IndexMap<String, Metric>,
    limits: &IndexMap<String, Metric>,
) -> Vec<Column> {
    let of = |is_limit| {
        move |(name, metric): (&String, &Metric)| Column {
            name: name.clone(),
            metric: metric.clone(),
            is_limit,
        }
    };
    objectives.iter().map(of(false)).chain(limits.iter().map(of(true))).collect()
}

/// A value that all points share, as an option `--set`.
fn set(target: &str, value: &Setting) -> Override {
    let value = match value {
        Setting::Text(text) => text.clone(),
        Setting::File(file) => {
            let path = std::path::absolute(&file.path).unwrap_or_else(|_| file.path.clone());
            path.to_string_lossy().into_owned()
        }
        other => other.to_string(),
    };
    Override { target: target.to_owned(), value }
}

/// Leaves out what a point does not need.
fn quiet(base: &mut Scenario) {
    base.plots.clear();
    base.checkpoint = None;
    base.real_time = None;
    base.trace = None;
    base.notes.clear();
    base.log_level = scenario::LogLevel::default();
}

/// The name of the file, or that of the study in a results folder.
fn name(file: &StudyFile, path: &Path) -> String {
    let as_run = file.as_run.as_ref().and_then(|it| it["name"].as_str());
    let stem = || path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    as_run.map_or_else(stem, str::to_owned)
}

/// Checks what the types cannot express.
fn check(file: &StudyFile, path: &Path) -> Result<(), StudyError> {
    let wrong =
        |at: String, problem: String| Err(StudyError::Key { path: path.to_owned(), at, problem });
    if file.factors.is_empty() {
        return wrong("factors".to_owned(), "empty; give at least one factor".to_owned());
    }
    let in_table = matches!(file.design, Design::Table { .. });
    let mut seeds = HashSet::new();
    for (name, factor) in &file.factors {
        let plain = |c: char| c.is_alphanumeric() || "_-. ".contains(c);
        if name.is_empty() || !name.chars().all(plain) {
            let text = "a name must be letters, digits, _ - . and blanks".to_owned();
            return wrong(format!("factors.{name}"), text);
        }
        if RESERVED.contains(&name.as_str()) {
            let text = "this name is that of a column of the results; choose another one";
            return wrong(format!("factors.{name}"), text.to_owned());
        }
        if let Some((key, problem)) = factor.fault(in_table) {
            return wrong(format!("factors.{name}.{key}"), problem);
        }
        if factor.seeds.is_some() && !seeds.insert(name) | (seeds.len() > 1) {
            let text = "another factor has seeds already; name all targets in one factor";
            return wrong(format!("factors.{name}.seeds"), text.to_owned());
        }
    }
    if let Some(it) = file.timeout.filter(|it| !(*it > 0.0 && it.is_finite())) {
        return wrong("timeout".to_owned(), format!("{it} is not a positive number of seconds"));
    }
    if file.tries == 0 {
        return wrong("tries".to_owned(), "0; give 1 or more".to_owned());
    }
    Ok(())
}
