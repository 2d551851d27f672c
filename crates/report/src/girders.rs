//! The spans of a run's guideway: lengths between supports, and first frequencies.

use criteria::Place;
use guideway::{Guideway, GuidewayDescription};
use results::ScenarioAsRun;

use crate::error::ReportError;
use crate::layout_fmu::LayoutFmu;
use crate::names::{self, numbered};

/// A place counts as one of a support within this fraction of the girder's length.
const SAME: f64 = 1e-6;

/// The spans of a guideway.
#[derive(Debug)]
pub(crate) struct Girders {
    /// The instance, by its name in the scenario.
    pub(crate) instance: String,
    spans: Vec<Girder>,
    points: Vec<(String, usize, f64)>,
}

/// One girder: a span, or a continuous girder over several fields.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Girder {
    /// Place of its start along the track (m).
    start: f64,
    length: f64,
    /// Places of its supports from its start (m), rising.
    supports: Vec<f64>,
    /// First natural frequency (Hz), with all factors.
    pub(crate) frequency: f64,
    /// Natural frequencies of all modes (Hz), with all factors.
    frequencies: Vec<f64>,
}

impl Girder {
    /// The longest distance between two supports (m).
    pub(crate) fn longest(&self) -> f64 {
        let fields = self.supports.windows(2).map(|pair| pair[1] - pair[0]);
        fields.reduce(f64::max).unwrap_or(self.length)
    }
}

impl Girders {
    /// Reads the first unit of a scenario that is a guideway, with the parameters of the run.
    pub(crate) fn of(scenario: &ScenarioAsRun) -> Result<Self, String> {
        let unit = LayoutFmu::find(scenario, names::GUIDEWAY_FILE)
            .map_err(|error| results::causes(&error).join(": "))?
            .ok_or("no unit of the run is a guideway with girders")?;
        Self::read(&unit).map_err(|error| results::causes(&error).join(": "))
    }

    fn read(unit: &LayoutFmu<'_>) -> Result<Self, ReportError> {
        let mut layout = unit.layout(GuidewayDescription::from_json)?;
        // generating a profile takes time
        layout.irregularity.on = false;
        for (girder, file) in layout.shapes_files() {
            let text = unit.resource(&file)?;
            let set = layout.set_shapes(&girder, &text);
            set.map_err(|error| unit.unusable(&error.to_string()))?;
        }
        apply(unit, &mut layout);
        if let Some(rails) = &mut layout.rails {
            rails.irregularity.on = false;
        }
        let model =
            Guideway::new(&layout, None).map_err(|error| unit.unusable(&error.to_string()))?;
        let kinds: Vec<_> = layout.girders.values().collect();
        let spans = model.spans().iter().map(|span| {
            let length = span.end - span.start;
            let supports = kinds[span.girder].supports.iter().flatten().map(|it| it.x);
            let mut supports: Vec<f64> = supports.collect();
            if supports.is_empty() {
                supports = vec![0.0, length];
            }
            supports.sort_by(f64::total_cmp);
            let modes = model.girders()[span.girder].modes();
            let frequencies: Vec<f64> = modes.iter().map(|mode| mode.frequency()).collect();
            let frequency = frequencies.first().copied().unwrap_or(f64::NAN);
            Girder { start: span.start, length, supports, frequency, frequencies }
        });
        let points = layout.points.iter().map(|it| (it.name.clone(), it.span, it.x));
        Ok(Self {
            instance: unit.name().to_owned(),
            spans: spans.collect(),
            points: points.collect(),
        })
    }

    /// The longest field of each span (m), in the order of the track.
    pub(crate) fn lengths(&self) -> Vec<f64> {
        self.spans.iter().map(Girder::longest).collect()
    }

    /// Natural frequencies of the empty girders (Hz), without duplicates.
    pub(crate) fn frequencies(&self) -> Vec<f64> {
        let mut all: Vec<f64> =
            self.spans.iter().flat_map(|it| it.frequencies.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// The girders that differ, each with the number of its first span.
    pub(crate) fn kinds(&self) -> Vec<(usize, &Girder)> {
        let mut kinds: Vec<(usize, &Girder)> = Vec::new();
        for (number, girder) in (1..).zip(&self.spans) {
            let same = |other: &Girder| {
                (other.frequency, other.longest()) == (girder.frequency, girder.longest())
            };
            if !kinds.iter().any(|(_, other)| same(other)) {
                kinds.push((number, girder));
            }
        }
        kinds
    }

    /// The field that the signal of a point of a girder belongs to.
    pub(crate) fn place(&self, signal: &str) -> Result<Place, String> {
        let stranger = || format!("{signal} is no point of a span of {}", self.instance);
        let (instance, variable) = signal.split_once('.').ok_or_else(stranger)?;
        let point = self.points.iter().find(|(name, ..)| {
            let rest = variable.strip_prefix(name.as_str());
            rest.is_some_and(|rest| rest.starts_with('_') && names::row(variable).is_none())
        });
        let number = |text: &str| text.rsplit('_').next().and_then(|it| it.parse::<usize>().ok());
        let (number, place, what) = match (names::row(variable), point) {
            (_, Some((name, span, x))) => (Some(*span), Ok(*x), format!("point {name} of")),
            (Some(row), _) if row.starts_with("midspan_") => {
                (number(variable), Err(0.5), "middle of".to_owned())
            }
            (Some(row), _) if row.starts_with("quarter_") => {
                (number(variable), Err(0.25), "quarter of".to_owned())
            }
            _ => return Err(stranger()),
        };
        let number = number.filter(|_| instance == self.instance).ok_or_else(stranger)?;
        let girder = self.spans.get(number.wrapping_sub(1)).ok_or_else(stranger)?;
        let x = place.unwrap_or_else(|part: f64| part * girder.length);
        let near = |support: &f64| (support - x).abs() <= SAME * girder.length;
        if girder.supports.iter().any(near) {
            return Err(format!(
                "the {what} span {number} ({signal}) is over a support; name points in the fields of this girder under \
                 \"points\" of guideway.json, and judge their displacements"
            ));
        }
        let field = girder.supports.windows(2).find(|pair| pair[0] < x && x < pair[1]);
        let length = field
            .map(|pair| pair[1] - pair[0])
            .ok_or_else(|| format!("{signal} is not between two supports of span {number}"))?;
        let along = girder.start + x;
        Ok(Place { length, text: format!("{what} span {number}, x = {along} m, L = {length} m") })
    }
}

/// The unit's parameters in its layout, as far as they change frequencies.
fn apply(unit: &LayoutFmu<'_>, layout: &mut GuidewayDescription) {
    let alone = layout.girders.len() == 1;
    let most = unit.parameter(names::MODES);
    for (name, girder) in &mut layout.girders {
        let prefix = if alone { String::new() } else { format!("{name}_") };
        let value = |name: &str| unit.parameter(&format!("{prefix}{name}"));
        let factor = |name: &str| value(name).unwrap_or(1.0);
        let frequency = |k| value(&numbered(names::FREQUENCY, k, 99));
        let frequencies: Vec<f64> = (1..=99).map_while(frequency).collect();
        let count = girder.mode_count();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "few modes")]
        let wanted = most.map_or(count, |it| count.min(it as usize)).max(1);
        girder.modes = Some(wanted);
        if !frequencies.is_empty() {
            girder.frequencies = frequencies;
        }
        if !alone {
            girder.stiffness_factor =
                value(names::STIFFNESS_FACTOR).unwrap_or(girder.stiffness_factor);
            girder.mass_factor = value(names::MASS_FACTOR).unwrap_or(girder.mass_factor);
        }
        if girder.is_beam() {
            girder.scale_beam_stiffness(factor("beam_stiffness_factor"));
            let supports = ["support_stiffness_factor", "support_damping_factor"].map(factor);
            girder.scale_supports(supports[0], supports[1]);
        }
    }
    layout.stiffness_factor =
        unit.parameter(names::STIFFNESS_FACTOR).unwrap_or(layout.stiffness_factor);
    layout.mass_factor = unit.parameter(names::MASS_FACTOR).unwrap_or(layout.mass_factor);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn girders() -> Girders {
        let girder = |start: f64, length: f64, supports: &[f64]| Girder {
            start,
            length,
            supports: supports.to_vec(),
            frequency: 5.0,
            frequencies: vec![5.0, 20.0],
        };
        Girders {
            instance: "g".to_owned(),
            spans: vec![
                girder(0.0, 25.0, &[0.0, 25.0]),
                girder(25.0, 60.0, &[0.0, 35.0, 60.0]),
                girder(85.0, 60.0, &[0.0, 30.0, 60.0]),
            ],
            points: vec![("field_2".to_owned(), 3, 45.0)],
        }
    }

    #[test]
    fn analytic_a_signal_belongs_to_the_field_between_its_supports() {
        let girders = girders();
        let place = |signal: &str| girders.place(signal).map(|it| (it.length, it.text));
        let first = place("g.midspan_displacement_01").unwrap();
        assert_eq!(first, (25.0, "middle of span 1, x = 12.5 m, L = 25 m".to_owned()));
        assert_eq!(place("g.midspan_displacement_02").unwrap().0, 35.0);
        assert_eq!(place("g.quarter_displacement_3").unwrap().0, 30.0);
        let point = place("g.field_2_displacement").unwrap();
        assert_eq!(point.1, "point field_2 of span 3, x = 130 m, L = 30 m");
        assert!(place("g.midspan_displacement_03").unwrap_err().contains("over a support"));
        for other in ["h.midspan_displacement_01", "g.midspan_displacement_04", "g.gap_01", "x"] {
            assert!(place(other).unwrap_err().contains("is no point"), "{other}");
        }
        assert_eq!(girders.kinds().iter().map(|it| it.0).collect::<Vec<_>>(), [1, 2, 3]);
        assert_eq!(girders.kinds()[1].1.longest(), 35.0);
    }
}
