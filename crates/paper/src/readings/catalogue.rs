//! The readings: what the paper's text leaves open, one choice at a time and in combinations.

use std::f64::consts::PI;

use super::{
    case::{Case, Study, figure_14},
    list::readings,
};

/// How the magnet's law and table 2 are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Magnet {
    /// The linear law about this current (A).
    Linear(f64),
    /// The nonlinear law, about the current that carries the load.
    Nonlinear,
    /// 32 magnets in place of 64, about this current (A).
    Half(f64),
    /// Gains on estimates in SI units, not on the scaled outputs of eq. 5.
    GainsInUnits,
}

/// How table 3's girder is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Girder {
    /// Rigid bearings and this mass per length (kg/m).
    Mass(f64),
    /// One elastic bearing.
    OneBearing,
    /// Two elastic bearings.
    TwoBearings,
}

/// What excites the crossing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Track {
    /// Waves from 0.5 m.
    Shipped,
    /// Waves from 5 cm, mean over the pole.
    ShortWaves,
    /// Waves from 5 cm, as the magnets' centres meet them.
    AtCentres,
    /// Steps of 1 mm at the joints, and nothing else.
    Joints,
    /// As shipped, and the chirp on the first span, as far off its middle as at the standstill.
    Chirp,
    /// The same, and the train begins on the first span.
    ChirpFromMiddle,
}

/// One reading of the paper.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    /// Name.
    pub name: &'static str,
    /// What in the text speaks for or against it.
    pub argument: &'static str,
    /// Magnets.
    pub magnet: Magnet,
    /// Girders.
    pub girder: Girder,
    /// Where the chirp acts at the standstill (m); mid-span is 37.5.
    pub force: f64,
    /// Where the middle of the train stands (m).
    pub train: f64,
    /// Whether figure 12 shows the deflection at the bogies, not that at mid-span.
    pub at_bogies: bool,
    /// Whether figure 14 is that of a crossing.
    pub moving_girders: bool,
    /// Irregularity and excitation of the crossing.
    pub track: Track,
    /// Whether something in the text speaks for each of its values.
    pub in_text: bool,
}

/// Mass per length of the shipped girder (kg/m).
pub const MASS: f64 = 22_000.0 * 1.24 / 9.81;

/// Mass per length (kg/m) with which E·I of table 3, with this second moment of area (m⁴), gives 7.1 Hz.
pub fn mass_of(inertia: f64) -> f64 {
    28_825e6 * inertia * (PI / 25.0).powi(4) / (2.0 * PI * 7.1).powi(2)
}

impl Magnet {
    fn label(self) -> String {
        match self {
            Self::Linear(current) => format!("{current} A"),
            Self::Nonlinear => "nonlinear".to_owned(),
            Self::Half(current) => format!("32 magnets {current} A"),
            Self::GainsInUnits => "gains in units".to_owned(),
        }
    }

    fn apply(self, case: Case) -> Case {
        // a magnet of a pair has half the area, so half the force per current; half the resistance and gains
        // give both the current of table 2's magnet
        const HALF: [(&str, &str); 7] = [
            ("pole_area", "0.018"),
            ("resistance", "0.3"),
            ("gain_acceleration", "3.5"),
            ("gain_velocity", "20"),
            ("gain_position", "2"),
            ("gain_gap_velocity", "20"),
            ("gain_gap", "3.5"),
        ];
        match self {
            Self::Linear(current) => case.with("operating_current", current),
            Self::Nonlinear => case.with("nonlinear", true),
            Self::Half(current) => case.with_all(&HALF).with("operating_current", current),
            // eq. 5's outputs are 250 q, 2.5 q', 0.25 q''
            Self::GainsInUnits => case.with_all(&[
                ("gain_acceleration", "28"),
                ("gain_velocity", "16"),
                ("gain_position", "0.016"),
                ("gain_gap_velocity", "16"),
                ("gain_gap", "0.028"),
            ]),
        }
    }
}

impl Girder {
    fn study(self) -> Study {
        match self {
            Self::Mass(_) => Study::Rigid,
            Self::OneBearing => Study::OneBearing,
            Self::TwoBearings => Study::TwoBearings,
        }
    }

    /// Factor on stiffness and mass.
    fn factor(self) -> f64 {
        match self {
            Self::Mass(mass) => mass / MASS,
            Self::OneBearing | Self::TwoBearings => 1.0,
        }
    }

    fn label(self) -> String {
        match self {
            Self::Mass(mass) => format!("{mass:.0} kg/m"),
            Self::OneBearing => "one bearing".to_owned(),
            Self::TwoBearings => "two bearings".to_owned(),
        }
    }
}

impl Reading {
    fn finish(&self, case: Case, what: &str) -> Case {
        let name = format!("{} | {} | {what}", self.magnet.label(), self.girder.label());
        self.magnet.apply(case).named(name)
    }

    /// The standstill under the chirp.
    pub fn standstill(&self) -> Case {
        let factor = self.girder.factor();
        let case = Case::standstill(self.girder.study())
            .girder(factor, factor)
            .with("chirp_position", self.force)
            .with("initial_position", self.train);
        let what = format!("standstill | force at {} m | train at {} m", self.force, self.train);
        self.finish(case, &what)
    }

    /// The girders of figure 14: 5 to 8 Hz by stiffness, then by mass. The force is at mid-span.
    pub fn girders(&self) -> Vec<Case> {
        let factor = self.girder.factor();
        let study = self.girder.study();
        let (base, what) = if self.moving_girders {
            (Case::crossing(study).with("stop", 32), "crossing")
        } else {
            (Case::standstill(study).with("stop", 14), "standstill")
        };
        let case = |(f, means, stiffness, divisor)| {
            let case = base.clone().girder(factor * stiffness, factor / divisor);
            self.finish(case, &format!("{what} | {f} Hz by {means}"))
        };
        figure_14().map(case).collect()
    }

    /// The crossing.
    pub fn crossing(&self) -> Case {
        let factor = self.girder.factor();
        let study = if self.track == Track::Joints { Study::Joints } else { self.girder.study() };
        let case = Case::crossing(study).girder(factor, factor);
        let short = |case: Case| case.with("irregularity_shortest_wave", 0.05);
        let chirp =
            |case: Case| case.with("chirp_on", true).with("chirp_position", self.force - 25.0);
        let (case, what) = match self.track {
            Track::Shipped => (case, "waves from 0.5 m"),
            Track::ShortWaves => (short(case), "waves from 5 cm"),
            Track::AtCentres => {
                let case = short(case).with("irregularity_averaged", false);
                (case.with("irregularity_amplitude", 4e-7), "waves from 5 cm at the centres")
            }
            Track::Joints => (case, "steps at the joints"),
            Track::Chirp => (chirp(case), "chirp"),
            // over mid-span after 7 s
            Track::ChirpFromMiddle => {
                (chirp(case).with("initial_position", 2.8), "chirp from mid-span")
            }
        };
        let off = self.force - 37.5;
        let excited = matches!(self.track, Track::Chirp | Track::ChirpFromMiddle);
        let place = if excited && off != 0.0 { format!(" {off} m off") } else { String::new() };
        self.finish(case, &format!("crossing | {what}{place}"))
    }

    /// The same crossing over girders without their second mode, where the second frequency is excited.
    pub fn one_mode(&self) -> Option<Case> {
        let excited = !matches!(self.track, Track::Shipped);
        let case = self.crossing().with("modes", 1);
        excited.then(|| {
            let name = format!("{} | one mode", case.name);
            case.named(name)
        })
    }

    /// All runs.
    pub fn cases(&self) -> Vec<Case> {
        let mut all = vec![self.standstill()];
        all.extend(self.girders());
        all.push(self.crossing());
        all.extend(self.one_mode());
        all
    }
}

/// Every run of all readings, once.
pub fn cases() -> Vec<Case> {
    let mut all: Vec<Case> = Vec::new();
    for case in readings().iter().flat_map(Reading::cases) {
        if !all.contains(&case) {
            all.push(case);
        }
    }
    all
}
