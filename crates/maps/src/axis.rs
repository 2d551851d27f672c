//! A parameter and its values: `ems_*.gain_gap=2:14:100` or `guideway.frequency_01=5,6,7.1,8`.

use std::fmt;
use std::str::FromStr;

/// Most values of an axis.
const MOST: usize = 100_000;

/// A parameter that varies over a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// `instance.variable`, patterns allowed, as for `--set`.
    pub target: String,
    /// Its values, ascending.
    pub values: Vec<f64>,
}

impl FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "\"{text}\" is not of the form instance.variable=FROM:TO:COUNT or \
                 instance.variable=VALUE,VALUE,..."
            )
        };
        let (target, list) = text.split_once('=').ok_or_else(wrong)?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let parts: Vec<&str> = list.split(':').collect();
        let values: Vec<f64> = match parts.as_slice() {
            [from, to, count] => {
                let (from, to) = (number(from).ok_or_else(wrong)?, number(to).ok_or_else(wrong)?);
                let count: usize = count.trim().parse().map_err(|_| wrong())?;
                if !(2..=MOST).contains(&count) || from == to {
                    return Err(format!(
                        "\"{text}\": a range needs two different ends and 2 to {MOST} values"
                    ));
                }
                let part = |k: usize| k as f64 / (count - 1) as f64;
                (0..count).map(|k| from + (to - from) * part(k)).collect()
            }
            [list] => {
                list.split(',').map(|it| number(it).ok_or_else(wrong)).collect::<Result<_, _>>()?
            }
            _ => return Err(wrong()),
        };
        let mut values = values;
        values.sort_by(f64::total_cmp);
        if values.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(format!("\"{text}\" has a value twice"));
        }
        Ok(Self { target: target.trim().to_owned(), values })
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, last) = (self.values.first(), self.values.last());
        let shown = |x: Option<&f64>| x.map_or_else(String::new, f64::to_string);
        write!(f, "{} from {} to {}", self.target, shown(first), shown(last))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_ranges_have_both_ends_and_lists_are_sorted() {
        let axis: Axis = "ems_*.gain_gap=2:14:7".parse().unwrap();
        assert_eq!(axis.target, "ems_*.gain_gap");
        assert_eq!(axis.values, [2.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0]);
        let axis: Axis = "g.f = 8, 5,7.1".parse().unwrap();
        assert_eq!((axis.target.as_str(), axis.values.as_slice()), ("g.f", &[5.0, 7.1, 8.0][..]));
    }

    #[test]
    fn refusal_ranges_without_values_are_named() {
        for text in [
            "a.b",
            "a.b=",
            "a.b=1:2",
            "a.b=1:2:1",
            "a.b=1:1:5",
            "a.b=x",
            "a.b=1,1",
            "a.b=1:2:x",
            "a.b=nan",
        ] {
            let why = text.parse::<Axis>().unwrap_err();
            assert!(why.contains(text), "{why}");
        }
    }
}
