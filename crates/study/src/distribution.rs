//! Distributions of factors, as inverse distribution functions.

use schemars::JsonSchema;
use serde::de::{self, Deserializer};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF as _, Normal, Triangular};

/// The distribution of a factor. A sample takes the value at a probability, so it keeps its even spread.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Equal density between two values.
    Uniform(Bounds),
    /// Equal density of the logarithm between two positive values.
    LogUniform(Bounds),
    /// Normal distribution.
    Normal(NormalLaw),
    /// Distribution of a positive value whose logarithm is normal.
    Lognormal(LognormalLaw),
    /// Linear density from `min` up to `mode` and down to `max`.
    Triangular(TriangularLaw),
}

/// The same as an object, whose errors have their place.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    uniform: Option<Bounds>,
    log_uniform: Option<Bounds>,
    normal: Option<NormalLaw>,
    lognormal: Option<LognormalLaw>,
    triangular: Option<TriangularLaw>,
}

impl<'de> Deserialize<'de> for Distribution {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Given { uniform, log_uniform, normal, lognormal, triangular } =
            Given::deserialize(deserializer)?;
        let laws = [
            uniform.map(Self::Uniform),
            log_uniform.map(Self::LogUniform),
            normal.map(Self::Normal),
            lognormal.map(Self::Lognormal),
            triangular.map(Self::Triangular),
        ];
        let mut laws = laws.into_iter().flatten();
        match (laws.next(), laws.next()) {
            (Some(law), None) => Ok(law),
            _ => Err(de::Error::custom(
                "give one of \"uniform\", \"log_uniform\", \"normal\", \"lognormal\" and \"triangular\"",
            )),
        }
    }
}

/// Smallest and largest value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// A normal distribution, cut off where bounds are given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NormalLaw {
    /// Mean value.
    pub mean: f64,
    /// Standard deviation.
    pub standard_deviation: f64,
    /// Smallest value; the density below is distributed over the rest. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value; the density above is distributed over the rest. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
}

/// A lognormal distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LognormalLaw {
    /// Median, which is exp(µ) of the normal distribution of the logarithm.
    pub median: f64,
    /// Standard deviation σ of the natural logarithm: 0.1 is about 10 per cent.
    pub sigma: f64,
}

/// A triangular distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TriangularLaw {
    /// Smallest value.
    pub min: f64,
    /// Most frequent value.
    pub mode: f64,
    /// Largest value.
    pub max: f64,
}

impl Distribution {
    /// What is wrong with its numbers.
    pub(crate) fn fault(&self) -> Option<String> {
        let ordered = |min: f64, max: f64| {
            (!(min < max && min.is_finite() && max.is_finite()))
                .then(|| format!("min {min} and max {max} must be finite, and min the smaller"))
        };
        let positive = |name: &str, value: f64| {
            (!(value > 0.0 && value.is_finite()))
                .then(|| format!("{name} is {value}; it must be positive"))
        };
        match *self {
            Self::Uniform(it) => ordered(it.min, it.max),
            Self::LogUniform(it) => ordered(it.min, it.max).or_else(|| positive("min", it.min)),
            Self::Normal(it) => {
                let odd = (!it.mean.is_finite()).then(|| format!("mean is {}", it.mean));
                let (min, max) = (it.min.unwrap_or(f64::MIN), it.max.unwrap_or(f64::MAX));
                let bounds = ordered(min, max);
                odd.or_else(|| positive("standard_deviation", it.standard_deviation))
                    .or(bounds)
                    .or_else(|| {
                        let far = (min - it.mean) > 8.0 * it.standard_deviation
                            || (it.mean - max) > 8.0 * it.standard_deviation;
                        far.then(|| {
                            "the bounds leave nothing of the distribution: they are more than 8 standard \
                             deviations from the mean"
                                .to_owned()
                        })
                    })
            }
            Self::Lognormal(it) => {
                positive("median", it.median).or_else(|| positive("sigma", it.sigma))
            }
            Self::Triangular(it) => ordered(it.min, it.max).or_else(|| {
                let outside = !(it.min..=it.max).contains(&it.mode);
                outside.then(|| format!("mode {} is not between min and max", it.mode))
            }),
        }
    }

    /// The value below which a fraction `u` of all values lies, 0 < u < 1.
    #[must_use]
    pub fn quantile(&self, u: f64) -> f64 {
        match *self {
            Self::Uniform(Bounds { min, max }) => min + u * (max - min),
            Self::LogUniform(Bounds { min, max }) => {
                (min.ln() + u * (max.ln() - min.ln())).exp().clamp(min, max)
            }
            Self::Normal(law) => match Normal::new(law.mean, law.standard_deviation) {
                Ok(normal) => {
                    let below = law.min.map_or(0.0, |it| normal.cdf(it));
                    let above = law.max.map_or(1.0, |it| normal.cdf(it));
                    let value = normal.inverse_cdf(below + u * (above - below));
                    let (min, max) = (law.min.unwrap_or(f64::MIN), law.max.unwrap_or(f64::MAX));
                    value.clamp(min, max)
                }
                Err(_) => f64::NAN,
            },
            Self::Lognormal(LognormalLaw { median, sigma }) => {
                median * (sigma * Normal::standard().inverse_cdf(u)).exp()
            }
            Self::Triangular(TriangularLaw { min, mode, max }) => {
                Triangular::new(min, max, mode).map_or(f64::NAN, |it| it.inverse_cdf(u))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Distribution {
        serde_json::from_str(text).unwrap()
    }

    /// Quantiles of the standard normal distribution: 0.8413447460685429 is that of 1.
    #[test]
    fn analytic_quantiles_are_those_of_tables() {
        let one_sigma = 0.841_344_746_068_542_9;
        for (text, u, expected) in [
            (r#"{"uniform": {"min": 2, "max": 6}}"#, 0.25, 3.0),
            (r#"{"log_uniform": {"min": 1, "max": 100}}"#, 0.5, 10.0),
            (r#"{"normal": {"mean": 3, "standard_deviation": 2}}"#, one_sigma, 5.0),
            (r#"{"normal": {"mean": 3, "standard_deviation": 2}}"#, 0.5, 3.0),
            // cut at the mean: the median of the half that is left is at 0.75 of the whole
            (
                r#"{"normal": {"mean": 0, "standard_deviation": 1, "min": 0}}"#,
                0.5,
                0.674_489_750_196_081_7,
            ),
            (r#"{"lognormal": {"median": 2, "sigma": 0.5}}"#, one_sigma, 2.0 * 0.5_f64.exp()),
            (r#"{"triangular": {"min": 0, "mode": 1, "max": 2}}"#, 0.125, 0.5),
        ] {
            let found = read(text).quantile(u);
            assert!((found - expected).abs() < 1e-9 * expected, "{text}: {found}");
        }
    }

    #[test]
    fn refusal_numbers_that_are_no_distribution() {
        for (text, part) in [
            (r#"{"uniform": {"min": 2, "max": 2}}"#, "min the smaller"),
            (r#"{"log_uniform": {"min": 0, "max": 2}}"#, "min is 0"),
            (r#"{"normal": {"mean": 0, "standard_deviation": 0}}"#, "standard_deviation is 0"),
            (r#"{"normal": {"mean": 0, "standard_deviation": 1, "min": 9}}"#, "leave nothing"),
            (r#"{"lognormal": {"median": -1, "sigma": 1}}"#, "median is -1"),
            (r#"{"triangular": {"min": 0, "mode": 3, "max": 2}}"#, "mode 3 is not between"),
        ] {
            let fault = read(text).fault().unwrap_or_default();
            assert!(fault.contains(part), "{text}: {fault}");
        }
    }
}
