//! What varies, and between which bounds.

use std::str::FromStr;

/// The name by which the offset of the record's clock is varied.
pub const OFFSET: &str = "offset";

/// A parameter that is fitted: `INSTANCE.VARIABLE=LOW:HIGH` or `INSTANCE.VARIABLE=LOW:HIGH:START`.
#[derive(Debug, Clone, PartialEq)]
pub struct Varied {
    /// `instance.variable` of a parameter or start value; a pattern gives all that it matches the same value. Or `offset`:
    /// the seconds that are added to the times of the record.
    pub target: String,
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Where the search begins. Default: the value of the scenario, or the middle if that is out of bounds.
    pub start: Option<f64>,
}

impl Varied {
    /// Whether it is the offset of the record.
    #[must_use]
    pub fn is_offset(&self) -> bool {
        self.target == OFFSET
    }
}

impl FromStr for Varied {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is not of the form INSTANCE.VARIABLE=LOW:HIGH or INSTANCE.VARIABLE=LOW:HIGH:START, such as \
                 guideway.frequency_01=5:9"
            )
        };
        let (target, range) = text.split_once('=').ok_or_else(wrong)?;
        let target = target.trim();
        if target != OFFSET && !target.contains('.') {
            return Err(wrong());
        }
        let numbers: Vec<Option<f64>> = range
            .split(':')
            .map(|it| it.trim().parse::<f64>().ok().filter(|it| it.is_finite()))
            .collect();
        let (low, high, start) = match numbers.as_slice() {
            [Some(low), Some(high)] => (*low, *high, None),
            [Some(low), Some(high), Some(start)] => (*low, *high, Some(*start)),
            _ => return Err(wrong()),
        };
        if low >= high {
            return Err(format!(
                "\"{text}\": the lower bound {low} is not below the upper bound {high}"
            ));
        }
        if let Some(start) = start.filter(|it| !(low..=high).contains(it)) {
            return Err(format!("\"{text}\": the start {start} is not within {low} to {high}"));
        }
        Ok(Self { target: target.to_owned(), low, high, start })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusal_ranges_are_checked() {
        let it: Varied = "guideway.frequency_01=5:9:6.5".parse().unwrap();
        assert_eq!((it.low, it.high, it.start), (5.0, 9.0, Some(6.5)));
        assert!("offset=-0.1:0.1".parse::<Varied>().unwrap().is_offset());
        for (text, part) in [
            ("a.b", "INSTANCE.VARIABLE"),
            ("b=1:2", "INSTANCE.VARIABLE"),
            ("a.b=1", "INSTANCE.VARIABLE"),
            ("a.b=1:x", "INSTANCE.VARIABLE"),
            ("a.b=1:inf", "INSTANCE.VARIABLE"),
            ("a.b=1:2:1.5:3", "INSTANCE.VARIABLE"),
            ("a.b=2:2", "not below"),
            ("a.b=1:2:3", "not within 1 to 2"),
        ] {
            assert!(text.parse::<Varied>().unwrap_err().contains(part), "{text}");
        }
    }
}
