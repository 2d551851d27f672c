//! What is tuned: parameters, conditions, objective, constraints. A tuning file has all of it; options of the command
//! add to it.

use std::path::Path;
use std::str::FromStr;

use indexmap::IndexMap;
use scenario::Setting;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::TuneError;

/// A tuning: which parameters may change, under which conditions, for what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(title = "Tuning of a scenario", rename = "Tuning")]
pub struct Tuning {
    /// Path or URL of the schema, for editors.
    #[serde(rename = "$schema", skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Title, one line.
    pub title: String,
    /// Parameters that may change, `instance.variable` with patterns as for `--set`, and their bounds.
    pub vary: IndexMap<String, Bounds>,
    /// Conditions by name: what each sets in the scenario. The worst of all counts. Default: the scenario as it is.
    pub conditions: IndexMap<String, IndexMap<String, Setting>>,
    /// What is made as large, or for `voltage` as small, as possible.
    pub objective: Objective,
    /// What every condition must keep.
    pub constraints: Constraints,
    /// Noise of sensors, by the input of the varied units that reads them, such as `gap`.
    pub noise: IndexMap<String, SensorNoise>,
    /// Irregularity of the track under the moving train. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub irregularity: Option<Irregularity>,
    /// Frequencies (Hz) between which modes count. Those outside must decay. Default: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band: Option<[f64; 2]>,
    /// A mode does not count if no parameter, changed by a fifth of its range, changes its damping ratio by this fraction.
    pub influence: f64,
    /// Seed of the random points from which searches start.
    pub seed: u64,
    /// Random points among which starts are chosen.
    #[schemars(range(min = 1, max = 100_000))]
    pub samples: usize,
    /// Searches, of which the first starts from the scenario's own values.
    #[schemars(range(min = 1, max = 1000))]
    pub starts: usize,
    /// Evaluations of each search at most.
    #[schemars(range(min = 10, max = 1_000_000))]
    pub evaluations: usize,
    /// Points of the front of damping against modulus margin; 0 for none.
    #[schemars(range(max = 1000))]
    pub front: usize,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            schema: None,
            title: String::new(),
            vary: IndexMap::new(),
            conditions: IndexMap::new(),
            objective: Objective::Damping,
            constraints: Constraints::default(),
            noise: IndexMap::new(),
            irregularity: None,
            band: None,
            influence: 0.1,
            seed: 1,
            samples: 60,
            starts: 4,
            evaluations: 400,
            front: 7,
        }
    }
}

/// Bounds of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Least value.
    pub from: f64,
    /// Largest value.
    pub to: f64,
    /// Whether the search takes steps by factors. Both bounds must be positive.
    #[serde(default)]
    pub log: bool,
}

/// What is optimised, always for the worst condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Objective {
    /// The least damping ratio. A mode decays by the same factor per cycle, whatever its frequency.
    #[default]
    Damping,
    /// The slowest decay −Re λ (1/s): how soon the slowest motion is gone.
    Decay,
    /// The least modulus margin: robustness against errors of the model.
    Modulus,
    /// The r.m.s. voltage, which is made small: needs noise or irregularity, and a least damping.
    Voltage,
}

impl Objective {
    /// As in the file.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Damping => "damping",
            Self::Decay => "decay",
            Self::Modulus => "modulus",
            Self::Voltage => "voltage",
        }
    }
}

impl FromStr for Objective {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let all = [Self::Damping, Self::Decay, Self::Modulus, Self::Voltage];
        all.into_iter().find(|it| it.as_str() == text).ok_or_else(|| {
            format!("\"{text}\" is not an objective: give damping, decay, modulus or voltage")
        })
    }
}

/// Limits that every condition must keep. Null or absent: no limit, apart from the defaults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Constraints {
    /// Least damping ratio of the modes that the parameters influence. Default: none, but all of them must decay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
    /// Least modulus margin, of one loop alone and of all alike. Default: 0.5.
    pub modulus: Option<f64>,
    /// Least delay margin (s), of one loop alone and of all alike. Default: 0.001.
    pub delay: Option<f64>,
    /// Largest r.m.s. voltage (V) of a magnet from noise and irregularity. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voltage: Option<f64>,
}

impl Default for Constraints {
    fn default() -> Self {
        Self { damping: None, modulus: Some(0.5), delay: Some(0.001), voltage: None }
    }
}

/// Noise of a sensor, as the unit `ems` makes it: white up to its bandwidth, where its power has fallen to one half.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorNoise {
    /// R.m.s., in the unit of the input. Give it or `density`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms: Option<f64>,
    /// Root of the one-sided density at low frequencies, in the unit of the input per √Hz.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Bandwidth (Hz).
    pub bandwidth: f64,
}

/// The train moves over the irregularity of the guideway, S(Ω) = A/Ω².
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Irregularity {
    /// Speed (m/s).
    pub speed: f64,
    /// A (m rad). Default: `irregularity_amplitude` of the guideway in the scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude: Option<f64>,
}

impl Tuning {
    /// Reads a tuning file.
    ///
    /// # Errors
    /// It cannot be read, or has a form that is not allowed.
    pub fn load(path: &Path) -> Result<Self, TuneError> {
        let failed = |source| TuneError::Read { path: path.to_owned(), source };
        let text = std::fs::read_to_string(path).map_err(failed)?;
        let json = |source| TuneError::Json { path: path.to_owned(), source };
        strict_json::read_commented(&text).map_err(json)
    }

    /// The JSON schema of tuning files, as text with a final line feed.
    #[must_use]
    pub fn json_schema() -> String {
        let mut schema = schemars::schema_for!(Self).to_value();
        strict_json::allow_comments(&mut schema);
        // a schema is a plain JSON value, which always prints
        serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
    }

    /// Checks all values that can be checked without the scenario.
    ///
    /// # Errors
    /// The first value that is wrong.
    pub fn check(&self) -> Result<(), TuneError> {
        if self.vary.is_empty() {
            return Err(TuneError::value("vary", "no parameter is given: nothing can be tuned"));
        }
        for (target, Bounds { from, to, log }) in &self.vary {
            let wrong = |problem: String| Err(TuneError::value(format!("vary.{target}"), problem));
            if !(from.is_finite() && to.is_finite() && from < to) {
                return wrong(format!("{from} to {to} is not a range: the first must be less"));
            }
            if *log && *from <= 0.0 {
                return wrong(format!("a logarithmic range must be positive, not from {from}"));
            }
        }
        let positive = |key: &str, value: Option<f64>, most: f64| match value {
            Some(it) if !(it.is_finite() && it > 0.0 && it <= most) => {
                let range =
                    if most.is_finite() { format!(" and at most {most}") } else { String::new() };
                Err(TuneError::value(key, format!("{it} must be positive{range}")))
            }
            _ => Ok(()),
        };
        let Constraints { damping, modulus, delay, voltage } = self.constraints;
        positive("constraints.damping", damping, 1.0)?;
        positive("constraints.modulus", modulus, 1.0)?;
        positive("constraints.delay", delay, 10.0)?;
        positive("constraints.voltage", voltage, f64::INFINITY)?;
        for (input, it) in &self.noise {
            let key = |name: &str| format!("noise.{input}.{name}");
            positive(&key("bandwidth"), Some(it.bandwidth), 1e6)?;
            positive(&key("rms"), it.rms, f64::INFINITY)?;
            positive(&key("density"), it.density, f64::INFINITY)?;
            if it.rms.is_some() == it.density.is_some() {
                return Err(TuneError::value(
                    format!("noise.{input}"),
                    "give either the r.m.s. or the density",
                ));
            }
        }
        if let Some(it) = self.irregularity {
            positive("irregularity.speed", Some(it.speed), 1000.0)?;
            positive("irregularity.amplitude", it.amplitude, f64::INFINITY)?;
        }
        if let Some([low, high]) = self.band
            && !(low >= 0.0 && low < high && high.is_finite())
        {
            return Err(TuneError::value("band", format!("{low} to {high} Hz is not a range")));
        }
        if !(0.0..=10.0).contains(&self.influence) {
            return Err(TuneError::value(
                "influence",
                format!("{} is not from 0 to 10", self.influence),
            ));
        }
        if !self.has_noise() {
            let needs = "needs noise of a sensor, or irregularity";
            if voltage.is_some() {
                return Err(TuneError::value("constraints.voltage", needs));
            }
            if self.objective == Objective::Voltage {
                return Err(TuneError::value("objective", format!("voltage {needs}")));
            }
        }
        if self.objective == Objective::Voltage && damping.is_none() {
            let problem =
                "voltage needs constraints.damping: the least voltage is that of no control";
            return Err(TuneError::value("objective", problem));
        }
        let counts = [("samples", self.samples, 1, 100_000), ("starts", self.starts, 1, 1000)];
        let counts = counts.into_iter().chain([
            ("evaluations", self.evaluations, 10, 1_000_000),
            ("front", self.front, 0, 1000),
        ]);
        for (key, value, least, most) in counts {
            if !(least..=most).contains(&value) {
                return Err(TuneError::value(
                    key,
                    format!("{value} is not from {least} to {most}"),
                ));
            }
        }
        Ok(())
    }

    /// Whether there is anything that moves the voltage.
    #[must_use]
    pub fn has_noise(&self) -> bool {
        !self.noise.is_empty() || self.irregularity.is_some()
    }
}

/// A parameter with bounds, `ems_*.gain_gap=2:14` or `ems_*.filter_gap_cutoff=300:3000:log`.
#[derive(Debug, Clone, PartialEq)]
pub struct Varied {
    /// `instance.variable`.
    pub target: String,
    /// Its bounds.
    pub bounds: Bounds,
}

impl FromStr for Varied {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is not of the form instance.variable=FROM:TO or instance.variable=FROM:TO:log"
            )
        };
        let (target, range) = text.split_once('=').ok_or_else(wrong)?;
        let number = |it: &str| it.trim().parse::<f64>().map_err(|_| wrong());
        let parts: Vec<&str> = range.split(':').collect();
        let bounds = match parts.as_slice() {
            [from, to] => Bounds { from: number(from)?, to: number(to)?, log: false },
            [from, to, "log"] => Bounds { from: number(from)?, to: number(to)?, log: true },
            _ => return Err(wrong()),
        };
        Ok(Self { target: target.trim().to_owned(), bounds })
    }
}

/// A condition, `heavy:vehicle.load_mass=3000,guideway.frequency_01=5`.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// What it sets.
    pub set: IndexMap<String, Setting>,
}

impl FromStr for Condition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("\"{text}\" is not of the form NAME:instance.variable=VALUE,...");
        let (name, list) = text.split_once(':').ok_or_else(wrong)?;
        let mut set = IndexMap::new();
        for part in list.split(',').filter(|it| !it.trim().is_empty()) {
            let (target, value) = part.split_once('=').ok_or_else(wrong)?;
            let value = Setting::from_text(value.trim());
            if set.insert(target.trim().to_owned(), value).is_some() {
                return Err(format!("\"{text}\" sets {} twice", target.trim()));
            }
        }
        let name = name.trim();
        if name.is_empty() {
            return Err(wrong());
        }
        Ok(Self { name: name.to_owned(), set })
    }
}

/// Noise of a sensor, `gap=RMS:BANDWIDTH`.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseOption {
    /// The input.
    pub input: String,
    /// Its noise.
    pub noise: SensorNoise,
}

impl FromStr for NoiseOption {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("\"{text}\" is not of the form INPUT=RMS:BANDWIDTH, as gap=1e-5:500");
        let (input, numbers) = text.split_once('=').ok_or_else(wrong)?;
        let (rms, bandwidth) = numbers.split_once(':').ok_or_else(wrong)?;
        let number = |it: &str| it.trim().parse::<f64>().map_err(|_| wrong());
        let noise =
            SensorNoise { rms: Some(number(rms)?), density: None, bandwidth: number(bandwidth)? };
        Ok(Self { input: input.trim().to_owned(), noise })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sound() -> Tuning {
        strict_json::read_commented(
            r#"{"$comment": "ours", "vary": {"ems_*.gain_gap": {"from": 2, "to": 14}}}"#,
        )
        .unwrap()
    }

    #[test]
    fn analytic_options_are_read() {
        let it: Varied = "ems_*.gain_gap = 2:14".parse().unwrap();
        assert_eq!(
            (it.target.as_str(), it.bounds),
            ("ems_*.gain_gap", Bounds { from: 2.0, to: 14.0, log: false })
        );
        assert!("a.b=1:9:log".parse::<Varied>().unwrap().bounds.log);
        let it: Condition = "soft: guideway.frequency_01=5, v.on=true".parse().unwrap();
        assert_eq!((it.name.as_str(), it.set.len()), ("soft", 2));
        assert_eq!(it.set["v.on"], Setting::Boolean(true));
        assert_eq!("as-is:".parse::<Condition>().unwrap().set.len(), 0);
        assert_eq!("gap=1e-5:500".parse::<NoiseOption>().unwrap().noise.bandwidth, 500.0);
    }

    #[test]
    fn refusal_wrong_options_are_named() {
        for text in ["a.b", "a.b=1", "a.b=1:x", "a.b=1:2:lin", "a.b=1:2:3:4"] {
            assert!(text.parse::<Varied>().unwrap_err().contains(text));
        }
        for text in ["soft", ":a.b=1", "soft:a.b"] {
            assert!(text.parse::<Condition>().unwrap_err().contains(text));
        }
        assert!("s:a.b=1,a.b=2".parse::<Condition>().unwrap_err().contains("twice"));
        assert!("gap=1".parse::<NoiseOption>().unwrap_err().contains("BANDWIDTH"));
        assert!("dampen".parse::<Objective>().unwrap_err().contains("voltage"));
    }

    #[test]
    fn refusal_wrong_values_are_named_with_their_key() {
        assert!(sound().check().is_ok());
        type Change = fn(&mut Tuning);
        let noise = |rms: Option<f64>, density| SensorNoise { rms, density, bandwidth: 100.0 };
        let cases: [(&str, Change); 14] = [
            ("vary: no parameter", |it| it.vary.clear()),
            ("vary.ems_*.gain_gap: 14 to 2", |it| {
                it.vary[0] = Bounds { from: 14.0, to: 2.0, log: false }
            }),
            ("vary.ems_*.gain_gap: a logarithmic", |it| {
                it.vary[0] = Bounds { from: 0.0, to: 2.0, log: true }
            }),
            ("constraints.modulus: 2", |it| it.constraints.modulus = Some(2.0)),
            ("constraints.delay: -1", |it| it.constraints.delay = Some(-1.0)),
            ("constraints.damping: 0", |it| it.constraints.damping = Some(0.0)),
            ("constraints.voltage: needs noise", |it| it.constraints.voltage = Some(1.0)),
            ("objective: voltage needs noise", |it| it.objective = Objective::Voltage),
            ("irregularity.speed: 0", |it| {
                it.irregularity = Some(Irregularity { speed: 0.0, amplitude: None })
            }),
            ("band: 5 to 1", |it| it.band = Some([5.0, 1.0])),
            ("influence: -1", |it| it.influence = -1.0),
            ("starts: 0", |it| it.starts = 0),
            ("evaluations: 3", |it| it.evaluations = 3),
            ("front: 2000", |it| it.front = 2000),
        ];
        for (wanted, change) in cases {
            let mut tuning = sound();
            change(&mut tuning);
            let said = tuning.check().unwrap_err().to_string();
            assert!(said.contains(wanted), "{said}, not {wanted}");
        }
        for it in [noise(None, None), noise(Some(1.0), Some(1.0))] {
            let mut tuning = sound();
            tuning.noise.insert("gap".to_owned(), it);
            assert!(tuning.check().unwrap_err().to_string().contains("either"));
        }
        let mut tuning = sound();
        tuning.noise.insert("gap".to_owned(), noise(Some(1.0), None));
        tuning.objective = Objective::Voltage;
        assert!(tuning.check().unwrap_err().to_string().contains("constraints.damping"));
        for text in [
            r#"{"vary": {}, "vary": {}}"#,
            r#"{"varies": {}}"#,
            r#"{"vary": {"a.b": {"from": 1}}}"#,
        ] {
            assert!(strict_json::read_commented::<Tuning>(text).is_err(), "{text}");
        }
    }
}
