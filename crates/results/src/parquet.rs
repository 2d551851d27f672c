//! results.parquet: a copy of results.csv in columns of 64-bit floats, and of UTF-8 texts for String signals.
//! It reads many times faster.
//!
//! It is made from the complete table: its values equal those of results.csv bit for bit, a resumed run
//! writes the same file as an uninterrupted one, and a killed run leaves a readable text file instead of an
//! incomplete Parquet file.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError as Source;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use thiserror::Error;

use crate::file::replace;
use crate::table_writer::RecordedColumn;
use crate::{PARQUET, TABLE};

/// Values in a row group: 32 MiB.
const GROUP_VALUES: usize = 1 << 22;

/// Why results.parquet cannot be written.
#[derive(Debug, Error)]
pub enum ParquetError {
    /// Reading the table or writing the copy failed.
    #[error("cannot write results.parquet")]
    Io(#[from] io::Error),
    /// The table is damaged.
    #[error("cannot read results.csv for its copy in Parquet")]
    Table(#[from] csv::Error),
    /// A field should be a number.
    #[error("results.csv: \"{field}\" in row {row} is not a number")]
    Number {
        /// Content of the field.
        field: String,
        /// Number of the row, from 1.
        row: u64,
    },
    /// The Parquet library reported an error.
    #[error("cannot write results.parquet")]
    Parquet(#[from] Source),
}

/// Copies a complete results.csv to results.parquet in the same folder: a column `time` and one per
/// signal, with nulls in rows at which a signal is not due. The metadata entry `units` contains the
/// signals' units of measure as a JSON object.
///
/// # Errors
/// The table cannot be read, or the copy cannot be written.
pub fn copy_to_parquet(folder: &Path, columns: &[RecordedColumn]) -> Result<PathBuf, ParquetError> {
    let table = folder.join(TABLE);
    let path = folder.join(PARQUET);
    replace(&path, |file| copy(&table, file, columns))?;
    Ok(path)
}

fn copy(table: &Path, file: &File, columns: &[RecordedColumn]) -> Result<(), ParquetError> {
    let mut reader = csv::ReaderBuilder::new().from_path(table)?;
    let optional = columns.iter().any(|column| column.stride != columns[0].stride);
    let mut writer =
        SerializedFileWriter::new(file, schema(columns, optional)?, properties(columns))?;
    let rows = (GROUP_VALUES / (columns.len() + 1)).clamp(1 << 10, 1 << 20);
    let mut batch = Batch::new(columns);
    let mut record = csv::ByteRecord::new();
    let mut row = 0;
    while reader.read_byte_record(&mut record)? {
        row += 1;
        batch.take(&record, row, !optional)?;
        if batch.rows == rows {
            batch.write(writer.next_row_group()?, optional)?;
        }
    }
    if batch.rows > 0 {
        batch.write(writer.next_row_group()?, optional)?;
    }
    writer.close()?;
    Ok(())
}

fn schema(columns: &[RecordedColumn], optional: bool) -> Result<Arc<Type>, Source> {
    let field = |name: &str, repetition, is_text: bool| {
        let builder = if is_text {
            Type::primitive_type_builder(name, Physical::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String))
        } else {
            Type::primitive_type_builder(name, Physical::DOUBLE)
        };
        builder.with_repetition(repetition).build().map(Arc::new)
    };
    let repetition = if optional { Repetition::OPTIONAL } else { Repetition::REQUIRED };
    let mut fields = vec![field("time", Repetition::REQUIRED, false)?];
    for column in columns {
        fields.push(field(&column.name, repetition, column.is_text)?);
    }
    Ok(Arc::new(Type::group_type_builder("results").with_fields(fields).build()?))
}

fn properties(columns: &[RecordedColumn]) -> Arc<WriterProperties> {
    let units: BTreeMap<&str, &str> = columns
        .iter()
        .filter_map(|column| Some((column.name.as_str(), column.unit.as_deref()?)))
        .collect();
    // a map of texts can always be printed
    let units = serde_json::to_string(&units).unwrap_or_default();
    let metadata = vec![KeyValue::new("units".to_owned(), units)];
    // values hardly repeat, so a dictionary would only cost time
    let builder = WriterProperties::builder().set_dictionary_enabled(false);
    Arc::new(builder.set_key_value_metadata(Some(metadata)).build())
}

/// Rows turned into columns.
struct Batch {
    rows: usize,
    values: Vec<ColumnValues>,
    /// per column and row: 1 for a value, 0 for a null
    present: Vec<Vec<i16>>,
}

enum ColumnValues {
    Numbers(Vec<f64>),
    Texts(Vec<ByteArray>),
}

impl ColumnValues {
    /// Adds a field; false if it should be a number and is not.
    fn take(&mut self, field: &[u8]) -> bool {
        match self {
            Self::Numbers(values) => {
                let text = std::str::from_utf8(field).unwrap_or_default();
                let number = text.parse::<f64>().ok();
                values.extend(number);
                number.is_some()
            }
            Self::Texts(values) => {
                values.push(ByteArray::from(field.to_vec()));
                true
            }
        }
    }
}

impl Batch {
    fn new(columns: &[RecordedColumn]) -> Self {
        let texts = std::iter::once(false).chain(columns.iter().map(|column| column.is_text));
        let values =
            |text| if text { ColumnValues::Texts(vec![]) } else { ColumnValues::Numbers(vec![]) };
        Self {
            rows: 0,
            values: texts.map(values).collect(),
            present: vec![Vec::new(); columns.len() + 1],
        }
    }

    fn take(
        &mut self,
        record: &csv::ByteRecord,
        row: u64,
        all_due: bool,
    ) -> Result<(), ParquetError> {
        for ((field, values), present) in record.iter().zip(&mut self.values).zip(&mut self.present)
        {
            // an empty field is an empty text or a null: a text if every signal is due in every row
            let due = !field.is_empty() || (all_due && matches!(values, ColumnValues::Texts(_)));
            present.push(i16::from(due));
            if due && !values.take(field) {
                let field = String::from_utf8_lossy(field).into_owned();
                return Err(ParquetError::Number { field, row });
            }
        }
        self.rows += 1;
        Ok(())
    }

    fn write(
        &mut self,
        mut group: SerializedRowGroupWriter<'_, &File>,
        optional: bool,
    ) -> Result<(), Source> {
        for (k, (values, present)) in self.values.iter_mut().zip(&mut self.present).enumerate() {
            if let Some(mut column) = group.next_column()? {
                let levels = (optional && k > 0).then_some(present.as_slice());
                match values {
                    ColumnValues::Numbers(values) => {
                        column.typed::<DoubleType>().write_batch(values, levels, None)?
                    }
                    ColumnValues::Texts(values) => {
                        column.typed::<ByteArrayType>().write_batch(values, levels, None)?
                    }
                };
                column.close()?;
            }
            match values {
                ColumnValues::Numbers(values) => values.clear(),
                ColumnValues::Texts(values) => values.clear(),
            }
            present.clear();
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::RowAccessor as _;

    /// Read by the same library; tests/python uses another one.
    #[test]
    fn invariant_the_copy_holds_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let column = |name: &str, stride| RecordedColumn {
            name: name.into(),
            unit: None,
            stride,
            is_text: false,
        };
        let columns = [column("a.x", 1), column("b,y", 2)];
        let mut table = crate::TableWriter::create(folder.path(), &columns).unwrap();
        let value = |n: u64| (n as f64 * 0.7).sin() / 3.0;
        for n in 0..2500 {
            table.take(n, n as f64 * 0.1, &[value(n), -value(n)], |_| None).unwrap();
        }
        table.finish().unwrap();
        let path = copy_to_parquet(folder.path(), &columns).unwrap();
        let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
        let mut rows = 0;
        for (n, row) in (0..).zip(reader.get_row_iter(None).unwrap()) {
            let row = row.unwrap();
            assert_eq!(row.get_double(0).unwrap().to_bits(), (n as f64 * 0.1).to_bits());
            assert_eq!(row.get_double(1).unwrap().to_bits(), value(n).to_bits());
            assert_eq!(row.get_double(2).ok(), (n % 2 == 0).then_some(-value(n)));
            rows += 1;
        }
        assert_eq!(rows, 2500);
        assert!(!folder.path().join("results.parquet.partial").exists());
    }

    /// With several recording intervals, an empty text cannot be distinguished from a null.
    #[test]
    fn invariant_texts_are_columns_of_utf8() {
        for (stride, empty) in [(1, true), (2, false)] {
            let folder = tempfile::tempdir().unwrap();
            let columns = [
                RecordedColumn { name: "a.s".into(), unit: None, stride: 1, is_text: true },
                RecordedColumn { name: "a.x".into(), unit: None, stride, is_text: false },
            ];
            let mut table = crate::TableWriter::create(folder.path(), &columns).unwrap();
            for (n, text) in (0..).zip([c"say \"no\"", c"", c"ja"]) {
                table.take(n, n as f64, &[f64::NAN, 1.0], |_| Some(text)).unwrap();
            }
            table.finish().unwrap();
            let path = copy_to_parquet(folder.path(), &columns).unwrap();
            let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
            let rows = reader.get_row_iter(None).unwrap().map(Result::unwrap);
            let texts: Vec<Option<String>> =
                rows.map(|row| row.get_string(1).ok().cloned()).collect();
            let of_empty = empty.then(String::new);
            assert_eq!(texts, [Some("say \"no\"".into()), of_empty, Some("ja".into())]);
        }
    }
}
