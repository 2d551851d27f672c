//! Parquet files of a few columns.

use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

/// The values of a column; `None` is null.
pub(crate) enum Values {
    Integers(Vec<Option<i64>>),
    Numbers(Vec<Option<f64>>),
    Texts(Vec<Option<String>>),
}

/// Writes a whole file or nothing.
pub(crate) fn write(path: &Path, columns: &[(String, Values)]) -> io::Result<()> {
    results::replace(path, |file: &File| write_to(file, columns).map_err(io::Error::other))
}

fn write_to(file: &File, columns: &[(String, Values)]) -> Result<(), ParquetError> {
    let field = |(name, values): &(String, Values)| {
        let builder = match values {
            Values::Integers(_) => Type::primitive_type_builder(name, Physical::INT64),
            Values::Numbers(_) => Type::primitive_type_builder(name, Physical::DOUBLE),
            Values::Texts(_) => Type::primitive_type_builder(name, Physical::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String)),
        };
        builder.with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("study").with_fields(fields).build()?;
    let properties = WriterProperties::builder().set_dictionary_enabled(false).build();
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (_, values) in columns {
        let Some(mut column) = group.next_column()? else { break };
        match values {
            Values::Integers(values) => {
                let (present, values) = split(values, |value| *value);
                column.typed::<Int64Type>().write_batch(&values, Some(&present), None)?
            }
            Values::Numbers(values) => {
                let (present, values) = split(values, |value| *value);
                column.typed::<DoubleType>().write_batch(&values, Some(&present), None)?
            }
            Values::Texts(values) => {
                let bytes = |text: &String| ByteArray::from(text.as_str());
                let (present, values) = split(values, bytes);
                column.typed::<ByteArrayType>().write_batch(&values, Some(&present), None)?
            }
        };
        column.close()?;
    }
    group.close()?;
    writer.close()?;
    Ok(())
}

/// Definition levels, and the values that are present.
fn split<T, U>(values: &[Option<T>], map: impl Fn(&T) -> U) -> (Vec<i16>, Vec<U>) {
    let present = values.iter().map(|it| i16::from(it.is_some())).collect();
    (present, values.iter().flatten().map(map).collect())
}
