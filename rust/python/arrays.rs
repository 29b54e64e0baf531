//! Conversion between `NumPy` arrays and the core's series and buffers, without copies.

use numpy::ndarray::ArrayView1;
use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::errors::to_python;
use crate::Error;
use crate::machine::buffer_pool::Buffer;
use crate::phase::{Sample, Series};

/// Averaging factors of an array of positive numbers.
pub(super) fn averaging_factors(factors: &PyReadonlyArray1<'_, i64>) -> PyResult<Vec<usize>> {
    let positive = |m: &i64| usize::try_from(*m).ok().filter(|m| *m > 0);
    let of_one = |m| {
        positive(m).ok_or_else(|| to_python(Error::Input(format!("averaging factor {m} is not positive"))))
    };
    factors.as_array().iter().map(of_one).collect()
}

/// Owner of the memory of an array. When the array is freed, the memory goes back to the buffer pool.
#[pyclass(frozen, module = "allanite._core")]
struct Owner {
    _buffer: Buffer,
}

/// `NumPy` array that takes over a buffer.
pub(super) fn from_buffer(py: Python<'_>, mut buffer: Buffer) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let (data, len) = (buffer.as_mut_ptr(), buffer.len());
    let owner = Bound::new(py, Owner { _buffer: buffer })?;
    // SAFETY: `len` doubles lie at `data`. Nothing else refers to them, and moving the buffer did not move them.
    let view = unsafe { ArrayView1::from_shape_ptr(len, data) };
    // SAFETY: the owner keeps the doubles in place as long as the array lives, and never accesses them.
    Ok(unsafe { PyArray1::borrow_from_array(&view, owner.into_any()) })
}

/// Series over the elements of a one-dimensional array of any stride.
pub(super) fn series<'a, T>(array: &'a PyReadonlyArray1<'_, T>) -> PyResult<Series<'a, T>>
where
    T: Sample + numpy::Element,
{
    let view = array.as_array();
    let (len, step) = (array.len(), view.strides()[0]);
    if len == 0 || step == 1 {
        // SAFETY: `as_array` points to `len` consecutive elements that live as long as the borrow of the array.
        let data = unsafe { std::slice::from_raw_parts(view.as_ptr(), len) };
        return Ok(Series::new(data));
    }
    let span = (len - 1) * step.unsigned_abs() + 1;
    let first = if step < 0 { span - 1 } else { 0 };
    // SAFETY: first and last element of the view lie in one allocation, so everything between them does; it is
    // borrowed as long as the array. `view` points at its first element, which is the last in memory if step < 0.
    let data = unsafe { std::slice::from_raw_parts(view.as_ptr().sub(first), span) };
    Series::strided(data, first, step, len)
        .ok_or_else(|| pyo3::exceptions::PyValueError::new_err("the array's stride leaves its memory"))
}

/// Evaluates `$body` with `$name` bound to a `Series` of the number type of the array `$array`.
macro_rules! with_series {
    ($array:expr, $name:ident => $body:expr) => {
        with_series!($array, $name => $body, f64, f32, i16, i32, i64, i8, u8, u16, u32, u64)
    };
    ($array:expr, $name:ident => $body:expr, $($kind:ty),*) => {{
        $(
            if let Ok(array) = $array.extract::<numpy::PyReadonlyArray1<'_, $kind>>() {
                let $name = $crate::python::arrays::series(&array)?;
                return $body;
            }
        )*
        Err(pyo3::exceptions::PyTypeError::new_err("not a one-dimensional array of a native number type"))
    }};
}
pub(crate) use with_series;
