//! Names that options take. Help and completions list them, and a typo gets the nearest one suggested.

use std::str::FromStr;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use scenario::{AlgorithmName, LogLevel, ResultFormat};

/// Coupling algorithms.
pub fn algorithms() -> impl TypedValueParser<Value = AlgorithmName> {
    one_of(AlgorithmName::ALL.map(AlgorithmName::as_str))
}

/// Formats of results.
pub fn formats() -> impl TypedValueParser<Value = ResultFormat> {
    one_of(["csv", "parquet"])
}

/// Which messages of units are shown.
pub fn log_levels() -> impl TypedValueParser<Value = LogLevel> {
    one_of(["error", "warning", "info", "debug"])
}

fn one_of<T, const N: usize>(names: [&'static str; N]) -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err = String> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names.map(PossibleValue::new)).try_map(|name| name.parse::<T>())
}
