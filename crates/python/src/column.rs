//! The values of one signal, which NumPy takes by Python's buffer protocol without a copy.

use std::ffi::{c_int, c_void};
use std::mem::size_of;
use std::ptr;

use arrow_buffer::ScalarBuffer;
use pyo3::exceptions::PyBufferError;
use pyo3::ffi;
use pyo3::prelude::*;

/// Numbers that Python can read and not change. `numpy.asarray(column)` shares the memory.
#[pyclass(frozen, module = "maglev_cosim._native")]
pub struct Column {
    values: ScalarBuffer<f64>,
    /// shape and stride of a buffer must live as long as it
    shape: ffi::Py_ssize_t,
    stride: ffi::Py_ssize_t,
}

impl Column {
    pub fn new(values: ScalarBuffer<f64>) -> Self {
        let length = |count: usize| ffi::Py_ssize_t::try_from(count).unwrap_or_default();
        Self { shape: length(values.len()), stride: length(size_of::<f64>()), values }
    }
}

#[pymethods]
impl Column {
    fn __len__(&self) -> usize {
        self.values.len()
    }

    /// # Safety
    /// Python passes a valid pointer.
    unsafe fn __getbuffer__(
        slf: Bound<'_, Self>,
        view: *mut ffi::Py_buffer,
        flags: c_int,
    ) -> PyResult<()> {
        if view.is_null() {
            return Err(PyBufferError::new_err("no place for the buffer"));
        }
        if flags & ffi::PyBUF_WRITABLE == ffi::PyBUF_WRITABLE {
            return Err(PyBufferError::new_err("results cannot be changed"));
        }
        let wants = |flag: c_int| flags & flag == flag;
        let column = slf.get();
        let (values, shape, stride) =
            (column.values.as_ptr(), ptr::from_ref(&column.shape), ptr::from_ref(&column.stride));
        let bytes = column.shape * column.stride;
        // SAFETY: Python passes a view to fill. It points to memory of this object, which never changes and which the
        // reference in `obj` keeps alive until the buffer is released.
        unsafe {
            (*view).buf = values.cast_mut().cast::<c_void>();
            (*view).len = bytes;
            (*view).readonly = 1;
            (*view).itemsize = column.stride;
            (*view).format =
                if wants(ffi::PyBUF_FORMAT) { c"d".as_ptr().cast_mut() } else { ptr::null_mut() };
            (*view).ndim = 1;
            (*view).shape = if wants(ffi::PyBUF_ND) { shape.cast_mut() } else { ptr::null_mut() };
            (*view).strides =
                if wants(ffi::PyBUF_STRIDES) { stride.cast_mut() } else { ptr::null_mut() };
            (*view).suboffsets = ptr::null_mut();
            (*view).internal = ptr::null_mut();
            (*view).obj = slf.into_any().into_ptr();
        }
        Ok(())
    }
}
