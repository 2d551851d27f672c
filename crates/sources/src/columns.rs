//! Columns of a file as they are, without what a signal adds to them.

use std::fs::File;
use std::path::Path;

use parquet::file::reader::{FileReader as _, SerializedFileReader};
use scenario::{FileSignal, Interpolation};

use crate::{SourceError, read_csv, read_parquet};

/// Whether a file is read as Parquet: by the ending of its name. Any other is CSV.
fn is_parquet(path: &Path) -> bool {
    path.extension().is_some_and(|it| it.eq_ignore_ascii_case("parquet"))
}

/// Names of the columns of a CSV or Parquet file.
///
/// # Errors
/// The file cannot be read.
pub fn column_names(path: &Path) -> Result<Vec<String>, SourceError> {
    if !is_parquet(path) {
        return read_csv::names(path);
    }
    let file =
        File::open(path).map_err(|source| SourceError::Open { path: path.to_owned(), source })?;
    let reader = SerializedFileReader::new(file)
        .map_err(|source| SourceError::Parquet { path: path.to_owned(), source })?;
    let schema = reader.metadata().file_metadata().schema();
    Ok(schema.get_fields().iter().map(|field| field.name().to_owned()).collect())
}

/// Times and values of a column, in the file's units. Rows without a value are left out; times increase.
///
/// # Errors
/// The file cannot be read, a column is missing, a field is not a finite number, or a time is not after the one before.
pub fn read_column(
    path: &Path,
    time: &str,
    column: &str,
) -> Result<(Vec<f64>, Vec<f64>), SourceError> {
    let signal = FileSignal {
        file: path.to_owned(),
        time: time.to_owned(),
        column: column.to_owned(),
        interpolation: Interpolation::Linear,
        factor: 1.0,
        delay: 0.0,
    };
    let points =
        if is_parquet(path) { read_parquet::points(&signal)? } else { read_csv::points(&signal)? };
    Ok(points.into_parts())
}
