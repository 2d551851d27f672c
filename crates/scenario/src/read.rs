//! Reading a scenario: merging a file with those that it extends, and resolving paths.

use std::path::{Path, absolute};

use serde_json::Value;
use strict_json::{FormError, PathStep, merge};

use crate::file::{ScenarioFile, chain, chain_of};
use crate::suggestions::{GivenTimes, LeftOut};
use crate::{
    InstanceSettings, Scenario, ScenarioError, Setting, SignalOverTime, exceptions, inputs, units,
};

impl Scenario {
    /// Reads a scenario file and the files that it extends. Paths of units become relative to the working directory.
    ///
    /// # Errors
    /// A file cannot be read, or the scenario is invalid.
    pub fn load(path: &Path) -> Result<Self, ScenarioError> {
        Self::load_with(path, GivenTimes::default())
    }

    /// Reads a scenario file as [`Scenario::load`] does, with other times than those in the file. Times that are missing
    /// come from the `DefaultExperiment` of the units.
    ///
    /// # Errors
    /// A file cannot be read, the scenario is invalid, or a time is missing and no unit has a default.
    pub fn load_with(path: &Path, given: GivenTimes) -> Result<Self, ScenarioError> {
        Self::compose(&chain(path)?, given)
    }

    /// Reads a text as if it were the content of the file `path`, which need not exist.
    ///
    /// # Errors
    /// A file that it extends cannot be read, or the scenario is invalid.
    pub fn read(text: &str, path: &Path) -> Result<Self, ScenarioError> {
        Self::compose(&chain_of(text.to_owned(), path)?, GivenTimes::default())
    }

    /// The scenario with a change, which is the text of a file in `folder` that extends it. Values of `--set` are kept.
    ///
    /// # Errors
    /// The change is no JSON object, or the scenario is invalid with it.
    pub fn changed(&self, change: &str, folder: &Path) -> Result<Self, ScenarioError> {
        let path = folder.join("the change");
        let change = ScenarioFile::new(change.to_owned(), &path)?;
        if change.extends.is_some() {
            return Err(ScenarioError::ExtendsInText { path });
        }
        let failed = |error: serde_json::Error| ScenarioError::NotJson {
            path: folder.join("the scenario"),
            message: error.to_string(),
        };
        let text = serde_json::to_string(self).map_err(failed)?;
        let base = ScenarioFile::new(text, &folder.join("the scenario"))?;
        let mut scenario = Self::compose(&[change, base], GivenTimes::default())?;
        scenario.notes.splice(0..0, self.notes.iter().cloned());
        scenario.overrides.clone_from(&self.overrides);
        Ok(scenario)
    }

    /// The scenario of a file and those that it extends.
    fn compose(chain: &[ScenarioFile], given: GivenTimes) -> Result<Self, ScenarioError> {
        let mut whole = whole(chain, Units::Located);
        let left_out = LeftOut::fill(&mut whole);
        let mut scenario = scenario(chain, whole)?;
        if let Some(trace) = &mut scenario.trace {
            let file = chain.iter().find(|source| source.value["trace"].is_string());
            let folder = file.and_then(|source| source.path.parent()).unwrap_or(Path::new(""));
            *trace = folder.join(&*trace);
        }
        scenario.resolve_files(|instance, list, variable| {
            // of a range, which may have been divided, the first name stands for all
            let name = patterns::expand(instance).ok().and_then(|names| names.into_iter().next());
            let covers = |key: &str| {
                key == instance
                    || patterns::expand(key)
                        .ok()
                        .zip(name.as_ref())
                        .is_some_and(|(k, it)| k.contains(it))
            };
            let given = |source: &&ScenarioFile| {
                let instances = source.value["instances"].as_object();
                instances.into_iter().flatten().any(|(key, settings)| {
                    settings[list][variable]["path"].is_string() && covers(key)
                })
            };
            chain.iter().find(given).and_then(|source| source.path.parent())
        });
        for input in &mut scenario.inputs {
            if let SignalOverTime::Csv(it) | SignalOverTime::Parquet(it) = &mut input.signal {
                it.file = absolute(&it.file).unwrap_or(std::mem::take(&mut it.file));
            }
        }
        left_out.complete(&mut scenario, given)?;
        Ok(scenario)
    }

    /// Reads the text of a scenario that extends no file. `path` is for messages only.
    ///
    /// # Errors
    /// The scenario is invalid.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ScenarioError> {
        let source = ScenarioFile::new(text.to_owned(), path)?;
        if source.extends.is_some() {
            return Err(ScenarioError::ExtendsInText { path: path.to_owned() });
        }
        let chain = [source];
        scenario(&chain, whole(&chain, Units::AsWritten))
    }
}

impl Scenario {
    /// Makes the paths in values absolute. `folder` returns the folder of the file that contains the value, by instance,
    /// list and variable.
    fn resolve_files<'a>(&mut self, folder: impl Fn(&str, &str, &str) -> Option<&'a Path>) {
        for (name, instance) in &mut self.instances {
            let InstanceSettings { parameters, start, .. } = instance;
            for (list, settings) in [("parameters", parameters), ("start", start)] {
                for (variable, setting) in settings {
                    let Setting::File(file) = setting else { continue };
                    let path =
                        folder(name, list, variable).unwrap_or(Path::new("")).join(&file.path);
                    // without a working directory the path remains relative
                    file.path = absolute(&path).unwrap_or(path);
                }
            }
        }
    }
}

/// What the paths of units are relative to.
#[derive(Clone, Copy, PartialEq)]
enum Units {
    /// The working directory: the folder of the file that contains the path is put in front.
    Located,
    AsWritten,
}

/// The files merged into one value, starting with the last one, which extends no other.
fn whole(chain: &[ScenarioFile], units: Units) -> Value {
    let mut whole = Value::Null;
    for (k, source) in chain.iter().rev().enumerate() {
        let mut value = source.value.clone();
        if units == Units::Located {
            let folder = source.path.parent().unwrap_or(Path::new(""));
            units::locate(&mut value, folder);
            inputs::locate(&mut value, folder);
        }
        if k == 0 {
            whole = value;
        } else {
            units::extend(&mut value, &mut whole);
            merge(&mut whole, &value);
        }
    }
    whole
}

/// The scenario of the merged files.
fn scenario(chain: &[ScenarioFile], mut whole: Value) -> Result<Scenario, ScenarioError> {
    exceptions::divide(&mut whole);
    strict_json::from_value(whole).map_err(|(steps, error)| blame(chain, &steps, &error))
}

/// An error in the merged value, reported for the file that it comes from: the first one in the chain that contains
/// most of the path to the place.
pub(crate) fn blame(
    chain: &[ScenarioFile],
    steps: &[PathStep],
    error: &FormError,
) -> ScenarioError {
    let depth = |file: &ScenarioFile| strict_json::depth(&file.value, steps);
    let deepest = chain.iter().map(depth).max().unwrap_or(0);
    let source = chain.iter().find(|file| depth(file) == deepest).unwrap_or(&chain[0]);
    source.error(steps, error)
}

#[cfg(test)]
mod tests {
    use std::error::Error as _;
    use std::fs;

    use tempfile::TempDir;

    use super::*;
    use crate::Setting;

    const BASE: &str = r#"{
  "$comment": ["what it is", "on two lines"],
  "units": { "a": "a.fmu", "b": "units/b.fmu" },
  "instances": {
    "$comment": "three of them",
    "z": { "unit": "a", "parameters": { "gain": 1, "on": true } },
    "y": { "unit": "b" },
    "x": { "unit": "a" }
  },
  "experiment": { "stop": 1.0, "step": 0.1 }
}"#;

    /// Files in a folder of their own: name and text.
    fn folder(files: &[(&str, &str)]) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        folder
    }

    fn refused(folder: &TempDir, file: &str) -> String {
        Scenario::load(&folder.path().join(file)).unwrap_err().to_string()
    }

    #[test]
    fn analytic_a_file_changes_the_one_that_it_extends() {
        let top = r#"{ "extends": "sub/middle.json", "title": "top",
            "instances": { "z": { "parameters": { "gain": 3 } } } }"#;
        let middle = r#"{ "extends": "../base.json", "units": { "b": "c.fmu" }, "title": "middle",
            "instances": { "z": { "parameters": { "gain": 2, "on": null } }, "y": null },
            "experiment": { "stop": 2.0 } }"#;
        let folder = folder(&[("base.json", BASE), ("sub/middle.json", middle), ("top.json", top)]);
        let scenario = Scenario::load(&folder.path().join("top.json")).unwrap();

        assert_eq!(scenario.title, "top");
        assert_eq!((scenario.experiment.stop, scenario.experiment.step), (2.0, 0.1));
        let names: Vec<_> = scenario.instances.keys().map(String::as_str).collect();
        assert_eq!(names, ["z", "x"], "what stays keeps its order");
        let parameters = &scenario.instances["z"].parameters;
        assert_eq!(parameters.len(), 1);
        assert_eq!(parameters["gain"], Setting::Number(3.0));
        // a path is relative to the file that contains it
        let unit = |name: &str| fs::canonicalize(folder.path()).unwrap().join(name);
        fs::write(folder.path().join("a.fmu"), "").unwrap();
        fs::write(folder.path().join("sub/c.fmu"), "").unwrap();
        assert_eq!(scenario.units["a"].fmu.canonicalize().unwrap(), unit("a.fmu"));
        assert_eq!(scenario.units["b"].fmu.canonicalize().unwrap(), unit("sub/c.fmu"));
    }

    /// A change in memory does what a file that extends the scenario does.
    #[test]
    fn invariant_a_change_is_a_file_that_extends_the_scenario() {
        let change = r#"{ "experiment": { "stop": 3 }, "units": { "a": "other/a.fmu" },
            "instances": { "x": null, "z": { "parameters": { "gain": 2 } } } }"#;
        let top = change.replacen('{', r#"{ "extends": "base.json","#, 1);
        let folder = folder(&[("base.json", BASE), ("top.json", &top)]);
        let mut base = Scenario::load(&folder.path().join("base.json")).unwrap();
        base.overrides.push("z.gain=1".parse().unwrap());
        let changed = base.changed(change, folder.path()).unwrap();
        assert_eq!(changed.overrides, base.overrides);
        let extended = Scenario::load(&folder.path().join("top.json")).unwrap();
        assert_eq!(Scenario { overrides: Vec::new(), ..changed }, extended);
        assert_eq!(Scenario::read(&top, &folder.path().join("none.json")).unwrap(), extended);
        for (text, part) in [("{", "not JSON"), (r#"{"stop": 3}"#, "stop"), (&top, "extend")] {
            let error = base.changed(text, folder.path()).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    /// Paths belong to the file that contains them. Patches add up, since a null in the second one must reach the
    /// layout; a path or a list replaces what the extended file has.
    #[test]
    fn analytic_changes_of_resources_add_up_along_files() {
        let unit = |text: &str| {
            let rest = r#""instances": {}, "experiment": {"stop": 1, "step": 1}"#;
            format!(r#"{{ "units": {{ "v": {text} }}, {rest} }}"#)
        };
        let top =
            |text: &str| format!(r#"{{ "extends": "sub/base.json", "units": {{ "v": {text} }} }}"#);
        let base = unit(
            r#"{"fmu": "v.fmu", "resources": {"a.json": {"b": {"car": {"m": 1}}}, "t.csv": "t.csv"}}"#,
        );
        for (text, expected) in [
            (r#""w.fmu""#, r#""w.fmu""#),
            (
                r#"{"fmu": "w.fmu", "resources": {"t.csv": null}}"#,
                r#"{"fmu":"w.fmu","resources":{"a.json":{"b":{"car":{"m":1}}}}}"#,
            ),
            (
                r#"{"resources": {"a.json": {"b": {"car": null}}}}"#,
                r#"{"fmu":"sub/v.fmu","resources":{"a.json":[{"b":{"car":{"m":1}}},{"b":{"car":null}}],"t.csv":"sub/t.csv"}}"#,
            ),
            (
                r#"{"resources": {"a.json": ["a.json", {"b": 3}], "t.csv": "u.csv"}}"#,
                r#"{"fmu":"sub/v.fmu","resources":{"a.json":["a.json",{"b":3}],"t.csv":"u.csv"}}"#,
            ),
        ] {
            let folder = folder(&[("sub/base.json", &base), ("top.json", &top(text))]);
            let scenario = Scenario::load(&folder.path().join("top.json")).unwrap();
            let mut unit = scenario.units["v"].clone();
            let near = |path: &Path| path.strip_prefix(folder.path()).map(Path::to_owned);
            unit.map_paths(near).unwrap();
            assert_eq!(serde_json::to_string(&unit).unwrap(), expected, "{text}");
        }
        let plain = folder(&[
            ("sub/base.json", &unit("\"v.fmu\"")),
            ("top.json", &top(r#"{"resources": {"a.json": {"m": null}}}"#)),
        ]);
        let scenario = Scenario::load(&plain.path().join("top.json")).unwrap();
        let text = serde_json::to_string(&scenario.units["v"].resources).unwrap();
        assert_eq!(text, r#"{"a.json":{"m":null}}"#);
        let wrong = folder(&[
            ("sub/base.json", &base),
            ("top.json", &top("{\n\"resources\": {\n\"a.json\": 3 } }")),
        ]);
        let error = refused(&wrong, "top.json");
        assert!(error.contains("top.json: at units.v.resources.a.json: invalid type"), "{error}");
        assert!(error.contains("line 3"), "{error}");
    }

    /// A file of its own, or of the one that it extends, gives one of a row another value.
    #[test]
    fn issue_16_a_patch_changes_one_of_a_range() {
        let base = BASE.replace("\"x\": { \"unit\": \"a\" }", "\"m_[1..4]\": { \"unit\": \"a\", \"parameters\": { \"gain\": 1, \"file\": { \"path\": \"t.csv\" } } }");
        let middle = r#"{ "extends": "../base.json", "instances": { "m_2": { "parameters": { "gain": 2 } } } }"#;
        let top = r#"{ "extends": "sub/middle.json", "instances": { "m_2": { "parameters": { "on": true } },
            "m_4": { "unit": "b" } } }"#;
        let folder =
            folder(&[("base.json", &base), ("sub/middle.json", middle), ("top.json", top)]);
        let scenario = Scenario::load(&folder.path().join("top.json")).unwrap();
        let names: Vec<_> = scenario.instances.keys().map(String::as_str).collect();
        assert_eq!(names, ["z", "y", "m_1", "m_2", "m_3", "m_4"]);
        let of = |name: &str, key: &str| scenario.instances[name].parameters.get(key).cloned();
        assert_eq!(
            ["m_1", "m_2", "m_3"].map(|it| of(it, "gain")),
            [1.0, 2.0, 1.0].map(|x| Some(Setting::Number(x)))
        );
        assert_eq!((of("m_2", "on"), of("m_3", "on")), (Some(Setting::Boolean(true)), None));
        assert_eq!(scenario.instances["m_4"].unit, "b");
        let Some(Setting::File(file)) = of("m_2", "file") else { panic!("not a file") };
        assert!(file.path.ends_with("sub/../t.csv"), "{}", file.path.display());
        let alone = r#"{ "extends": "base.json", "instances": { "m_5": { "parameters": { "gain": 2 } } } }"#;
        fs::write(folder.path().join("alone.json"), alone).unwrap();
        assert!(refused(&folder, "alone.json").contains("missing field `unit`"));
    }

    #[test]
    fn issue_a_byte_order_mark_is_ignored() {
        let mark = "\u{feff}";
        let top = format!("{mark}{{ \"extends\": \"base.json\", \"title\": \"top\" }}");
        let odd = format!("{mark}{{ \"extends\": \"base.json\", \"titel\": \"top\" }}");
        let base = format!("{mark}{BASE}");
        let folder = folder(&[("base.json", &base), ("top.json", &top), ("odd.json", &odd)]);
        let scenario = Scenario::load(&folder.path().join("top.json")).unwrap();
        assert_eq!((scenario.title.as_str(), scenario.experiment.stop), ("top", 1.0));
        assert!(Scenario::parse(&base, Path::new("s.json")).is_ok());
        assert!(refused(&folder, "odd.json").contains("`titel`"));
    }

    #[test]
    fn issue_errors_name_the_file_that_they_are_in() {
        let folder = folder(&[
            ("base.json", BASE),
            ("key.json", &BASE.replace("\"stop\"", "\"stopp\"")),
            ("of-key.json", r#"{ "extends": "key.json", "title": "t" }"#),
            ("type.json", "{ \"extends\": \"base.json\",\n \"experiment\": { \"step\": \"x\" } }"),
            ("removed.json", r#"{ "extends": "base.json", "experiment": null }"#),
            ("doubled.json", r#"{ "extends": "base.json", "title": "a", "title": "b" }"#),
            ("comment.json", r#"{ "extends": "base.json", "record": { "$comment": 3 } }"#),
            ("cut.json", r#"{ "extends": "base.json" "#),
        ]);
        for (file, parts) in [
            ("of-key.json", ["key.json: at experiment", "`stopp`", "line 10"]),
            ("type.json", ["type.json: at experiment.step", "\"x\"", "line 2"]),
            ("removed.json", ["removed.json: at the top level", "missing", "`experiment`"]),
            ("doubled.json", ["doubled.json: at", "\"title\" occurs twice", "line 1"]),
            ("comment.json", ["comment.json: at record.$comment", "a text", "line 1"]),
            ("cut.json", ["cut.json is not JSON", "EOF", "line 1"]),
        ] {
            let error = refused(&folder, file);
            for part in parts {
                assert!(error.contains(part), "{file}: {error}");
            }
        }
    }

    #[test]
    fn issue_cycles_and_missing_files_are_named() {
        let folder = folder(&[
            ("a.json", r#"{ "extends": "b.json" }"#),
            ("b.json", r#"{ "extends": "./a.json" }"#),
            ("self.json", r#"{ "extends": "self.json" }"#),
            ("lost.json", r#"{ "extends": "nowhere.json" }"#),
            ("number.json", r#"{ "extends": 7 }"#),
        ]);
        let error = refused(&folder, "a.json");
        let place = |name: &str| error.find(name).unwrap_or_else(|| panic!("{error}"));
        assert!(place("a.json extends") < place("b.json extends"), "{error}");
        assert!(refused(&folder, "self.json").contains("self.json extends"));
        let lost = Scenario::load(&folder.path().join("lost.json")).unwrap_err();
        assert!(lost.to_string().contains("lost.json: at extends"), "{lost}");
        assert!(lost.to_string().contains("cannot read"), "{lost}");
        assert!(lost.source().is_some());
        assert!(refused(&folder, "number.json").contains("at extends: 7 is not the path"));
        let text = Scenario::parse(r#"{ "extends": "a.json" }"#, Path::new("s.json"));
        assert!(matches!(text, Err(ScenarioError::ExtendsInText { .. })));
    }
}
