//! A map as Parquet: one row per point.

use std::path::Path;
use std::sync::Arc;

use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::error::Error;
use crate::result::{MapCell, StabilityMap};

const SCHEMA: &str = "message map {
    REQUIRED DOUBLE x;
    REQUIRED DOUBLE y;
    REQUIRED DOUBLE damping_ratio;
    REQUIRED DOUBLE frequency_hz;
    REQUIRED DOUBLE real;
    REQUIRED DOUBLE imaginary;
    REQUIRED INT64 growing;
    REQUIRED BYTE_ARRAY mode (STRING);
    REQUIRED BYTE_ARRAY evidence (STRING);
    REQUIRED DOUBLE over;
}";

/// Writes all points. `y` is 0 without a second axis, `over` NaN without a third.
///
/// # Errors
/// The file cannot be written.
pub fn write_parquet(map: &StabilityMap, path: &Path) -> Result<(), Error> {
    let failed = |source: std::io::Error| Error::Write { path: path.to_owned(), source };
    let bytes = encoded(map).map_err(|e| failed(std::io::Error::other(e)))?;
    results::write_whole(path, &bytes).map_err(failed)
}

fn encoded(map: &StabilityMap) -> Result<Vec<u8>, ParquetError> {
    let schema = Arc::new(parse_message_type(SCHEMA)?);
    let mut bytes = Vec::new();
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties)?;
    let points = || {
        map.cells.iter().enumerate().flat_map(|(row, cells)| {
            cells.iter().enumerate().map(move |(column, cell)| (column, row, cell))
        })
    };
    let y = |row: usize| map.y.as_ref().map_or(0.0, |it| it.values[row]);
    let real = |of: &dyn Fn(&MapCell) -> f64| -> Vec<f64> { points().map(|it| of(it.2)).collect() };
    let word = |of: &dyn Fn(&MapCell) -> serde_json::Value| -> Vec<ByteArray> {
        points().map(|it| ByteArray::from(of(it.2).as_str().unwrap_or_default())).collect()
    };
    let json = |it: serde_json::Result<serde_json::Value>| it.unwrap_or_default();
    let mut group = writer.next_row_group()?;
    column::<DoubleType, _>(
        &mut group,
        &points().map(|it| map.x.values[it.0]).collect::<Vec<_>>(),
    )?;
    column::<DoubleType, _>(&mut group, &points().map(|it| y(it.1)).collect::<Vec<_>>())?;
    for of in [
        &(|it: &MapCell| it.damping) as &dyn Fn(&MapCell) -> f64,
        &|it: &MapCell| it.frequency_hz,
        &|it: &MapCell| it.real,
        &|it: &MapCell| it.imaginary,
    ] {
        column::<DoubleType, _>(&mut group, &real(of))?;
    }
    let growing: Vec<i64> =
        points().map(|it| i64::try_from(it.2.growing).unwrap_or(i64::MAX)).collect();
    column::<Int64Type, _>(&mut group, &growing)?;
    column::<ByteArrayType, _>(&mut group, &word(&|it| json(serde_json::to_value(it.mode))))?;
    column::<ByteArrayType, _>(&mut group, &word(&|it| json(serde_json::to_value(it.evidence))))?;
    column::<DoubleType, _>(&mut group, &real(&|it| it.at.unwrap_or(f64::NAN)))?;
    group.close()?;
    writer.close()?;
    Ok(bytes)
}

fn column<T: DataType, W: std::io::Write + Send>(
    group: &mut parquet::file::writer::SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
) -> Result<(), ParquetError> {
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(values, None, None)?;
        column.close()?;
    }
    Ok(())
}
