//! results.parquet: the same table in columns.

use std::fs::File;
use std::path::Path;

use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader as _, RowGroupReader, SerializedFileReader};

use crate::error::ReportError;
use crate::table::Table;

/// Reads a table of 64-bit floats whose first column is `time`; columns of texts are passed over.
pub(crate) fn read_parquet(path: &Path) -> Result<Table, ReportError> {
    let read = |source| ReportError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(read)?;
    let columns =
        columns(file).map_err(|source| ReportError::Parquet { path: path.to_owned(), source })?;
    let mut columns = columns.into_iter();
    let bad = |message: &str| ReportError::Table {
        path: path.to_owned(),
        row: 1,
        column: "1".to_owned(),
        message: message.to_owned(),
    };
    let Some((_, time)) = columns.next().filter(|(name, _)| name == "time") else {
        return Err(bad("the first column is not \"time\""));
    };
    let (names, columns): (Vec<String>, Vec<Vec<f64>>) = columns.unzip();
    if columns.iter().any(|column| column.len() != time.len()) {
        return Err(bad("columns differ in length"));
    }
    Ok(Table { names, time, columns })
}

fn columns(file: File) -> Result<Vec<(String, Vec<f64>)>, ParquetError> {
    let reader = SerializedFileReader::new(file)?;
    let schema = reader.metadata().file_metadata().schema_descr();
    let numeric = |k: &usize| schema.column(*k).physical_type() != parquet::basic::Type::BYTE_ARRAY;
    let places: Vec<usize> = (0..schema.num_columns()).filter(numeric).collect();
    let mut columns: Vec<(String, Vec<f64>)> =
        places.iter().map(|&k| (schema.column(k).name().to_owned(), Vec::new())).collect();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        for (&k, (_, values)) in places.iter().zip(&mut columns) {
            values.extend(column(group.as_ref(), k)?);
        }
    }
    Ok(columns)
}

/// One column of a group of rows, NaN for nulls.
fn column(group: &dyn RowGroupReader, index: usize) -> Result<Vec<f64>, ParquetError> {
    let description = group.metadata().schema_descr().column(index);
    if description.physical_type() != parquet::basic::Type::DOUBLE {
        let text = format!("the column {} is not of 64-bit floats", description.name());
        return Err(ParquetError::General(text));
    }
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    let mut reader = get_typed_column_reader::<DoubleType>(group.get_column_reader(index)?);
    let (mut values, mut present) = (Vec::with_capacity(rows), Vec::with_capacity(rows));
    reader.read_records(rows, Some(&mut present), None, &mut values)?;
    if description.max_def_level() == 0 {
        return Ok(values);
    }
    let mut values = values.into_iter();
    let next = |&level: &i16| if level > 0 { values.next() } else { None };
    Ok(present.iter().map(next).map(|it| it.unwrap_or(f64::NAN)).collect())
}
