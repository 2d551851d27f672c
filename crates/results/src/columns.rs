//! Reads results.parquet, which holds the same table in columns.

use std::fs::File;
use std::path::Path;

use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::DoubleType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader as _, RowGroupReader, SerializedFileReader};

use crate::table::NOT_DUE;
use crate::{ReadError, Table};

/// Reads the wanted signals of a table of 64-bit floats whose first column is `time`, without columns
/// of texts.
pub(crate) fn read_parquet(path: &Path, wanted: impl Fn(&str) -> bool) -> Result<Table, ReadError> {
    let failed = |source| ReadError::File { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
    let columns = columns(file, wanted)
        .map_err(|source| ReadError::Parquet { path: path.to_owned(), source })?;
    let mut columns = columns.into_iter();
    let bad = |message: &str| ReadError::Table {
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

fn columns(
    file: File,
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<(String, Vec<f64>)>, ParquetError> {
    let reader = SerializedFileReader::new(file)?;
    let schema = reader.metadata().file_metadata().schema_descr();
    let is_read = |k: &usize| {
        let column = schema.column(*k);
        let numeric = column.physical_type() != parquet::basic::Type::BYTE_ARRAY;
        numeric && (*k == 0 || wanted(column.name()))
    };
    let places: Vec<usize> = (0..schema.num_columns()).filter(is_read).collect();
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

/// One column of a group of rows. Nulls are rows at which the signal was not due.
fn column(group: &dyn RowGroupReader, index: usize) -> Result<Vec<f64>, ParquetError> {
    let description = group.metadata().schema_descr().column(index);
    if description.physical_type() != parquet::basic::Type::DOUBLE {
        let text = format!("column {} does not hold 64-bit floats", description.name());
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
    Ok(present.iter().map(next).map(|it| it.unwrap_or(NOT_DUE)).collect())
}
