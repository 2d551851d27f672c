//! Two columns of a Parquet file.

use std::fs::File;
use std::sync::Arc;

use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;
use parquet::schema::types::Type;
use scenario::FileSignal;

use crate::points::Points;
use crate::rows::{Rows, find};
use crate::{Row, SourceError};

/// The points of a signal. Rows without a value are left out.
pub(crate) fn points(signal: &FileSignal) -> Result<Points, SourceError> {
    let path = &signal.file;
    let failed = |source| SourceError::Parquet { path: path.clone(), source };
    let file =
        File::open(path).map_err(|source| SourceError::Open { path: path.clone(), source })?;
    let reader = SerializedFileReader::new(file).map_err(failed)?;
    let schema = reader.metadata().file_metadata().schema();
    let fields = schema.get_fields();
    let names = fields.iter().map(|field| field.name());
    let place = [find(path, names.clone(), &signal.time)?, find(path, names, &signal.column)?];
    // the file's order; one column may be both
    let mut chosen = place.to_vec();
    chosen.sort_unstable();
    chosen.dedup();
    let position = place.map(|it| usize::from(it != chosen[0]));
    let projection = Type::group_type_builder(schema.name())
        .with_fields(chosen.iter().map(|&it| Arc::clone(&fields[it])).collect())
        .build()
        .map_err(failed)?;
    let mut rows = Rows::new(signal);
    for (number, row) in (1..).zip(reader.get_row_iter(Some(projection)).map_err(failed)?) {
        let columns = row.map_err(failed)?.into_columns();
        let [time, value] = position.map(|it| &columns[it].1);
        if *value == Field::Null {
            continue;
        }
        let numbers = [time, value].map(number_in);
        rows.take(Row::Number(number), numbers, || [time, value].map(Field::to_string))?;
    }
    rows.points()
}

/// The number in a field of any numeric type; true is 1.
fn number_in(field: &Field) -> Option<f64> {
    Some(match *field {
        Field::Bool(it) => f64::from(u8::from(it)),
        Field::Byte(it) => it.into(),
        Field::Short(it) => it.into(),
        Field::Int(it) => it.into(),
        #[expect(clippy::cast_precision_loss, reason = "measured values have no 53 bits")]
        Field::Long(it) => it as f64,
        Field::UByte(it) => it.into(),
        Field::UShort(it) => it.into(),
        Field::UInt(it) => it.into(),
        #[expect(clippy::cast_precision_loss, reason = "measured values have no 53 bits")]
        Field::ULong(it) => it as f64,
        Field::Float16(it) => it.into(),
        Field::Float(it) => it.into(),
        Field::Double(it) => it,
        _ => return None,
    })
}
