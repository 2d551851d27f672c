//! A linear or logarithmic axis.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;

use crate::{axis_label, decimals};

/// A logarithmic axis spans at most this many decades if it has no limits.
const DECADES: f64 = 8.0;
/// Up to this many decades a logarithmic axis has labels at 1, 2 and 5 times the powers of ten.
const FINE: f64 = 2.0;
/// Most labels of a logarithmic axis.
const LABELS: usize = 8;

/// An axis: values have a place on it, which is their logarithm on a logarithmic one.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    /// Limits, as places.
    range: Range<f64>,
    log: bool,
    digits: usize,
}

impl Axis {
    /// With limits of its own, or those of the values. `smallest` is the smallest positive value.
    pub(crate) fn new(
        given: Option<Range<f64>>,
        everything: Range<f64>,
        log: bool,
        smallest: impl Fn() -> f64,
    ) -> Self {
        if !log {
            let range = given.unwrap_or(everything);
            return Self { digits: decimals(&range), range, log };
        }
        let least = smallest();
        let end = if everything.end > 0.0 { everything.end } else { 1.0 };
        let first =
            if least.is_finite() { least.max(end * 10_f64.powf(-DECADES)) } else { end / 10.0 };
        let given = given.filter(|it| it.start > 0.0 && it.end > it.start);
        let it = given.unwrap_or(if first < end { first..end } else { end / 10.0..end });
        Self { range: it.start.log10()..it.end.log10(), log, digits: 0 }
    }

    /// Place of a value; NaN where a logarithm has none.
    pub(crate) fn place(&self, value: f64) -> f64 {
        match self.log {
            false => value,
            true if value > 0.0 => value.log10(),
            true => f64::NAN,
        }
    }

    /// Whether a value is within the limits.
    pub(crate) fn shows(&self, value: f64) -> bool {
        let place = self.place(value);
        self.range.start <= place && place <= self.range.end
    }

    /// The limits, as places.
    pub(crate) fn range(&self) -> Range<f64> {
        self.range.clone()
    }

    /// The places with their ticks.
    pub(crate) fn scale(&self) -> Scale {
        Scale {
            places: self.range().into(),
            ticks: if self.log { Some(self.log_ticks()) } else { None },
        }
    }

    /// Places with labels, and of all lines of a logarithmic axis.
    fn log_ticks(&self) -> [Vec<f64>; 2] {
        let Range { start, end } = self.range;
        let decades = end - start;
        #[expect(clippy::cast_possible_truncation, reason = "exponents of floats")]
        let powers = start.floor() as i32..=end.ceil() as i32;
        let at = |digits: &[f64]| {
            let of = |power| digits.iter().map(move |it| it.log10() + f64::from(power));
            let places = powers.clone().flat_map(of);
            places.filter(|it| (start - 1e-9..=end + 1e-9).contains(it)).collect::<Vec<f64>>()
        };
        let labelled = at(if decades <= FINE { &[1.0, 2.0, 5.0] } else { &[1.0] });
        let every = labelled.len().div_ceil(LABELS).max(1);
        let all: &[f64] = &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        let lines = at(if decades <= DECADES { all } else { &[1.0] });
        [labelled.into_iter().step_by(every).collect(), lines]
    }

    /// Label of a place.
    pub(crate) fn label(&self, place: f64) -> String {
        if !self.log {
            return axis_label(place, self.digits);
        }
        let value = 10_f64.powf(place);
        let power = (place + 1e-9).floor();
        if (-3.0..=4.0).contains(&power) {
            let digits = decimals(&(0.0..10_f64.powf(power + 1.0)));
            return axis_label(value, digits);
        }
        let digit = (value / 10_f64.powf(power)).round();
        let raised: String = format!("{power}").chars().map(raised).collect();
        if digit > 1.0 { format!("{digit}·10{raised}") } else { format!("10{raised}") }
    }
}

/// The coordinates that plotters draws with: linear, with ticks of their own if the axis is logarithmic.
pub(crate) struct Scale {
    places: RangedCoordf64,
    ticks: Option<[Vec<f64>; 2]>,
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.places.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match &self.ticks {
            None => self.places.key_points(hint),
            Some([labelled, lines]) if hint.weight().allow_light_points() => {
                lines.iter().chain(labelled).copied().collect()
            }
            Some([labelled, _]) => labelled.clone(),
        }
    }

    fn range(&self) -> Range<f64> {
        self.places.range()
    }
}

fn raised(letter: char) -> char {
    match letter {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        _ => letter.to_digit(10).and_then(|it| char::from_u32(0x2070 + it)).unwrap_or(letter),
    }
}
