//! Signals over time as an Arrow table, which pyarrow, pandas, polars and others take without a copy.

use std::collections::HashMap;
use std::ffi::CStr;
use std::sync::Arc;

use arrow_array::cast::AsArray as _;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::Float64Type;
use arrow_array::{
    Array as _, ArrayRef, Float64Array, RecordBatch, RecordBatchIterator, StringArray,
};
use arrow_buffer::{NullBuffer, ScalarBuffer};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{ArrowError, DataType, Field, Schema};
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use results::NOT_DUE;

use crate::column::Column;
use crate::recording::{Recorded, Values};

/// Key of the unit of measure in the metadata of a field.
const UNIT: &str = "unit";
/// Name of the first column.
const TIME: &str = "time";
/// Names of capsules that the Arrow PyCapsule interface prescribes.
const STREAM: &CStr = c"arrow_array_stream";
const SCHEMA: &CStr = c"arrow_schema";

/// Recorded signals over time: the column `time` (s), and one for each signal, in SI base units.
#[pyclass(frozen, module = "maglev_cosim._native")]
pub struct Table(RecordBatch);

impl Table {
    /// A table of these columns. Their memory is taken over.
    pub fn new(time: Vec<f64>, columns: Vec<Recorded>) -> Result<Self, ArrowError> {
        let mut fields = vec![field(TIME, Some("s"), DataType::Float64, false)];
        let mut arrays: Vec<ArrayRef> = vec![Arc::new(Float64Array::from(time))];
        for Recorded { name, unit, values } in columns {
            let array: ArrayRef = match values {
                Values::Numbers(values) => Arc::new(numbers(values)),
                Values::Texts(values) => Arc::new(StringArray::from(values)),
            };
            let kind = array.data_type().clone();
            fields.push(field(&name, unit.as_deref(), kind, array.null_count() > 0));
            arrays.push(array);
        }
        RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map(Self)
    }

    fn array(&self, name: &str) -> PyResult<&ArrayRef> {
        self.0.column_by_name(name).ok_or_else(|| PyKeyError::new_err(name.to_owned()))
    }
}

fn field(name: &str, unit: Option<&str>, kind: DataType, nullable: bool) -> Field {
    let metadata: HashMap<String, String> =
        unit.map(|unit| (UNIT.to_owned(), unit.to_owned())).into_iter().collect();
    Field::new(name, kind, nullable).with_metadata(metadata)
}

/// Values as an array, null in rows at which the signal was not due.
fn numbers(values: Vec<f64>) -> Float64Array {
    let due = |value: &f64| value.to_bits() != NOT_DUE.to_bits();
    let nulls = (!values.iter().all(due)).then(|| values.iter().map(due).collect::<NullBuffer>());
    Float64Array::new(ScalarBuffer::from(values), nulls)
}

fn arrow_error(error: &ArrowError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

#[pymethods]
impl Table {
    /// A table of the columns of another one: names, units and values, the time first.
    #[staticmethod]
    fn of(
        py: Python<'_>,
        columns: Vec<(String, Option<String>, Bound<'_, PyAny>)>,
    ) -> PyResult<Self> {
        let mut time = Vec::new();
        let mut others = Vec::new();
        for (k, (name, unit, values)) in columns.into_iter().enumerate() {
            let values = match values.extract::<Vec<Option<String>>>() {
                Ok(texts) if !texts.is_empty() => Values::Texts(texts),
                _ => Values::Numbers(PyBuffer::<f64>::get(&values)?.to_vec(py)?),
            };
            match values {
                Values::Numbers(values) if k == 0 => time = values,
                values => others.push(Recorded { name, unit, values }),
            }
        }
        Self::new(time, others).map_err(|error| arrow_error(&error))
    }

    fn __len__(&self) -> usize {
        self.0.num_rows()
    }

    /// Names of the columns, the time first.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.schema_ref().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// Units of measure by name.
    #[getter]
    fn units(&self) -> HashMap<String, String> {
        let fields = self.0.schema_ref().fields().iter();
        fields
            .filter_map(|it| Some((it.name().clone(), it.metadata().get(UNIT)?.clone())))
            .collect()
    }

    /// The values of a column of numbers.
    fn numbers(&self, name: &str) -> PyResult<Option<Column>> {
        let array = self.array(name)?.as_primitive_opt::<Float64Type>();
        Ok(array.map(|array| Column::new(array.values().clone())))
    }

    /// The values of a column of texts; None in rows at which it was not due.
    fn texts(&self, name: &str) -> PyResult<Option<Vec<Option<String>>>> {
        let array = self.array(name)?.as_string_opt::<i32>();
        Ok(array.map(|array| array.iter().map(|text| text.map(str::to_owned)).collect()))
    }

    /// The schema, by the Arrow PyCapsule interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.0.schema_ref().as_ref());
        PyCapsule::new_with_value(py, schema.map_err(|error| arrow_error(&error))?, SCHEMA)
    }

    /// The columns, by the Arrow PyCapsule interface. The reader casts to other types if it needs them.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        let _ = requested_schema;
        let batches = RecordBatchIterator::new([Ok(self.0.clone())], self.0.schema());
        PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(batches)), STREAM)
    }
}
