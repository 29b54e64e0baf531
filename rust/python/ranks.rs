//! Bindings of sorting and ranks.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::gil::run_short;
use crate::ranks;

/// `ranks::in_order`: sorted values.
#[pyfunction]
pub(super) fn in_order<'py>(
    py: Python<'py>,
    values: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = values.as_slice()?;
    Ok(run_short(py, || Ok(ranks::in_order(view)))?.into_pyarray(py))
}

/// `ranks::order`: indices that sort the values.
#[pyfunction]
pub(super) fn order<'py>(
    py: Python<'py>,
    values: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let view = values.as_slice()?;
    Ok(run_short(py, || ranks::order(view))?.into_pyarray(py))
}
