//! Runs of the study of readings, as rows of its tables of points.

use std::fmt::{Display, Write as _};

use crate::runs::FREQUENCIES;

/// The study files, which differ in the girders' bearings or in the track.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Study {
    /// Girders on rigid bearings.
    Rigid,
    /// Girders on one elastic bearing.
    OneBearing,
    /// Girders on two elastic bearings.
    TwoBearings,
    /// Rigid bearings, and a track that has steps at the joints in place of the random irregularity.
    Joints,
}

impl Study {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Rigid, Self::OneBearing, Self::TwoBearings, Self::Joints];

    /// Name of its file in `examples/studies`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rigid => "readings",
            Self::OneBearing => "readings-one-bearing",
            Self::TwoBearings => "readings-two-bearings",
            Self::Joints => "readings-joints",
        }
    }
}

/// The factors of the study with the values of `scenarios/standstill.json`, and what each sets.
const FACTORS: [(&str, &str, &str); 22] = [
    ("step", "0.002", "experiment.step"),
    ("stop", "30", "experiment.stop"),
    ("travel_speed", "0", "vehicle.travel_speed"),
    ("initial_position", "37.5", "vehicle.initial_position"),
    ("nonlinear", "false", "ems_*.nonlinear"),
    ("operating_current", "24", "ems_*.operating_current"),
    ("pole_area", "0.036", "ems_*.pole_area"),
    ("resistance", "0.6", "ems_*.resistance"),
    ("gain_acceleration", "7", "ems_*.gain_acceleration"),
    ("gain_velocity", "40", "ems_*.gain_velocity"),
    ("gain_position", "4", "ems_*.gain_position"),
    ("gain_gap_velocity", "40", "ems_*.gain_gap_velocity"),
    ("gain_gap", "7", "ems_*.gain_gap"),
    ("stiffness_factor", "1", "guideway.stiffness_factor"),
    ("mass_factor", "1", "guideway.mass_factor"),
    ("modes", "2", "guideway.modes"),
    ("irregularity_on", "false", "guideway.irregularity_on"),
    ("irregularity_amplitude", "0.0000007", "guideway.irregularity_amplitude"),
    ("irregularity_shortest_wave", "0.5", "guideway.irregularity_shortest_wave"),
    ("irregularity_averaged", "true", "guideway.irregularity_averaged"),
    ("chirp_on", "true", "guideway.chirp_on"),
    ("chirp_position", "37.5", "guideway.chirp_position"),
];

/// One run: its study, its name and its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Case {
    /// The study that has it.
    pub study: Study,
    /// Name, unique within the study.
    pub name: String,
    values: Vec<String>,
}

impl Case {
    /// The standstill under the chirp at mid-span, with the shipped values.
    pub fn standstill(study: Study) -> Self {
        let values = FACTORS.iter().map(|it| it.1.to_owned()).collect();
        Self { study, name: String::new(), values }
    }

    /// The crossing at 5 km/h as shipped, with steps of 5 ms.
    pub fn crossing(study: Study) -> Self {
        Self::standstill(study)
            .with("step", 0.005)
            .with("stop", 75)
            .with("travel_speed", 5.0 / 3.6)
            .with("initial_position", -14)
            .with("irregularity_on", true)
            .with("chirp_on", false)
    }

    /// The same with another value.
    pub fn with(mut self, factor: &str, value: impl Display) -> Self {
        let value = value.to_string();
        for ((name, ..), own) in FACTORS.iter().zip(&mut self.values) {
            if *name == factor {
                own.clone_from(&value);
            }
        }
        self
    }

    /// The same with other values.
    pub fn with_all(self, values: &[(&str, &str)]) -> Self {
        values.iter().fold(self, |case, (factor, value)| case.with(factor, value))
    }

    /// The same with the girder's stiffness and mass multiplied.
    pub fn girder(self, stiffness: f64, mass: f64) -> Self {
        self.with("stiffness_factor", stiffness).with("mass_factor", mass)
    }

    /// The same by this name.
    pub fn named(mut self, name: String) -> Self {
        self.name = name;
        self
    }

    /// Values as options of `maglev`, without those of the scenario's `experiment`.
    pub fn options(&self) -> Vec<String> {
        let all = FACTORS.iter().zip(&self.values);
        let variables = all.filter(|((_, _, target), _)| !target.starts_with("experiment"));
        variables.flat_map(|(it, value)| ["--set".into(), format!("{}={value}", it.2)]).collect()
    }
}

/// The table of points of a study.
pub fn table(cases: &[&Case]) -> String {
    let mut text = String::from("case");
    for (name, ..) in FACTORS {
        let _ = write!(text, ",{name}");
    }
    for case in cases {
        let _ = write!(text, "\n{}", case.name);
        for value in &case.values {
            let _ = write!(text, ",{value}");
        }
    }
    text + "\n"
}

/// Factor on the stiffness and divisor of the mass that bring a girder of 7.1 Hz to another first frequency, by each
/// means.
pub fn figure_14() -> impl Iterator<Item = (u32, &'static str, f64, f64)> {
    let factor = |f: u32| (f64::from(f) / 7.1).powi(2);
    let by_stiffness = FREQUENCIES.map(|f| (f, "stiffness", factor(f), 1.0));
    by_stiffness.into_iter().chain(FREQUENCIES.map(|f| (f, "mass", 1.0, factor(f))))
}
