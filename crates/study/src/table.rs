//! Points from a CSV or Parquet file.

use std::fs::File;
use std::path::Path;

use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;

use crate::{FactorValue, StudyError};

/// The values of these columns, row by row. Other columns are left out.
pub(crate) fn read(path: &Path, columns: &[&str]) -> Result<Vec<Vec<FactorValue>>, StudyError> {
    let parquet = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("parquet"));
    let rows = if parquet { read_parquet(path, columns) } else { read_csv(path, columns) };
    let failed = |problem| StudyError::Table { path: path.to_owned(), problem };
    let rows = rows.map_err(failed)?;
    if rows.is_empty() {
        return Err(failed("it has no rows".to_owned()));
    }
    Ok(rows)
}

/// The places of columns in a header.
fn places(header: &[String], columns: &[&str]) -> Result<Vec<usize>, String> {
    let place = |name: &&str| {
        header.iter().position(|it| it == name).ok_or_else(|| {
            format!("it has no column \"{name}\"; its columns are {}", header.join(", "))
        })
    };
    columns.iter().map(place).collect()
}

fn read_csv(path: &Path, columns: &[&str]) -> Result<Vec<Vec<FactorValue>>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(|error| error.to_string())?;
    let header: Vec<String> = reader
        .headers()
        .map_err(|error| error.to_string())?
        .iter()
        .map(|name| name.trim_start_matches('\u{feff}').to_owned())
        .collect();
    let places = places(&header, columns)?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        let value = |(&place, name): (&usize, &&str)| match record.get(place) {
            None | Some("") => Err(format!("line {line}, column {name}: no value")),
            Some(text) => Ok(FactorValue::of_text(text)),
        };
        rows.push(places.iter().zip(columns).map(value).collect::<Result<_, _>>()?);
    }
    Ok(rows)
}

fn read_parquet(path: &Path, columns: &[&str]) -> Result<Vec<Vec<FactorValue>>, String> {
    let file = File::open(path).map_err(|error| error.to_string())?;
    let reader = SerializedFileReader::new(file).map_err(|error| error.to_string())?;
    let schema = reader.metadata().file_metadata().schema();
    let header: Vec<String> = schema.get_fields().iter().map(|it| it.name().to_owned()).collect();
    let places = places(&header, columns)?;
    let mut rows = Vec::new();
    let iterator = reader.get_row_iter(None).map_err(|error| error.to_string())?;
    for (number, row) in (1..).zip(iterator) {
        let row = row.map_err(|error| error.to_string())?;
        let fields: Vec<&Field> = row.get_column_iter().map(|(_, field)| field).collect();
        let value = |(&place, name): (&usize, &&str)| {
            value_of(fields[place]).ok_or_else(|| {
                format!("row {number}, column {name}: {} is not a value", fields[place])
            })
        };
        rows.push(places.iter().zip(columns).map(value).collect::<Result<_, _>>()?);
    }
    Ok(rows)
}

fn value_of(field: &Field) -> Option<FactorValue> {
    Some(match field {
        Field::Bool(value) => FactorValue::Boolean(*value),
        Field::Byte(value) => FactorValue::Integer(i64::from(*value)),
        Field::Short(value) => FactorValue::Integer(i64::from(*value)),
        Field::Int(value) => FactorValue::Integer(i64::from(*value)),
        Field::Long(value) => FactorValue::Integer(*value),
        Field::UByte(value) => FactorValue::Integer(i64::from(*value)),
        Field::UShort(value) => FactorValue::Integer(i64::from(*value)),
        Field::UInt(value) => FactorValue::Integer(i64::from(*value)),
        Field::Float(value) if value.is_finite() => FactorValue::Number(f64::from(*value)),
        Field::Double(value) if value.is_finite() => FactorValue::Number(*value),
        Field::Str(text) => FactorValue::Text(text.clone()),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_columns_are_found_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("points.csv");
        std::fs::write(&path, "\u{feff}gain, note,speed\n7,x,1e-3\n8,y,fast\n").unwrap();
        let rows = read(&path, &["speed", "gain"]).unwrap();
        let shown: Vec<String> = rows.iter().flatten().map(ToString::to_string).collect();
        assert_eq!(shown, ["0.001", "7", "fast", "8"]);
        for (text, part) in [
            ("gain\n7\n", "no column \"speed\"; its columns are gain"),
            ("gain,speed\n7,\n", "line 2, column speed: no value"),
            ("gain,speed\n", "no rows"),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = read(&path, &["speed", "gain"]).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
