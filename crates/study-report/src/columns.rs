//! The columns of a study's table.

use serde_json::Value;

/// What a column is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// A factor.
    Factor,
    /// A factor whose values are seeds: repetitions, without an effect of their own.
    Seeds,
    /// A figure of a point.
    Figure,
}

/// A factor or a figure, with its value at each point.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name in the table.
    pub name: String,
    /// Name for readers.
    pub title: String,
    /// Unit of measure; empty if there is none.
    pub unit: String,
    /// What it is.
    pub kind: ColumnKind,
    /// Bounds of a figure with a limit.
    pub limits: [Option<f64>; 2],
    /// The values.
    pub values: ColumnValues,
}

/// Values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues {
    /// Numbers, NaN where there is none.
    Numbers(Vec<f64>),
    /// Texts: those that occur, and the index of each point's.
    Texts(Vec<String>, Vec<usize>),
}

impl ColumnValues {
    /// Numbers if all texts that are not empty are numbers.
    pub(crate) fn of(texts: &[&str]) -> Self {
        let number = |text: &&str| if text.is_empty() { Some(f64::NAN) } else { text.parse().ok() };
        if let Some(numbers) = texts.iter().map(number).collect::<Option<Vec<f64>>>() {
            return Self::Numbers(numbers);
        }
        let mut known: Vec<String> = Vec::new();
        let mut index = |text: &&str| {
            known.iter().position(|it| it == text).unwrap_or_else(|| {
                known.push((*text).to_owned());
                known.len() - 1
            })
        };
        let places = texts.iter().map(&mut index).collect();
        Self::Texts(known, places)
    }

    /// The value of a point as a number: the index of a text.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 texts")]
    pub fn number(&self, point: usize) -> f64 {
        match self {
            Self::Numbers(values) => values[point],
            Self::Texts(_, places) => places[point] as f64,
        }
    }
}

/// A bound as a number: `0.004` or `"1/3800"`.
pub(crate) fn bound(value: &Value) -> Option<f64> {
    let fraction = |text: &str| match text.split_once('/') {
        Some((above, below)) => {
            Some(above.trim().parse::<f64>().ok()? / below.trim().parse::<f64>().ok()?)
        }
        None => text.trim().parse().ok(),
    };
    value.as_f64().or_else(|| fraction(value.as_str()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn analytic_bounds_are_numbers_or_fractions() {
        assert_eq!(bound(&json!(0.004)), Some(0.004));
        assert_eq!(bound(&json!("1/3800")), Some(1.0 / 3800.0));
        assert_eq!((bound(&json!("x")), bound(&json!(null))), (None, None));
    }

    #[test]
    fn issue_texts_are_values_of_factors_too() {
        let it = ColumnValues::of(&["soft", "hard", "soft"]);
        assert_eq!(it, ColumnValues::Texts(vec!["soft".into(), "hard".into()], vec![0, 1, 0]));
        let ColumnValues::Numbers(values) = ColumnValues::of(&["1", "", "-2e3"]) else { panic!() };
        assert!(values[0] == 1.0 && values[1].is_nan() && values[2] == -2000.0);
    }
}
