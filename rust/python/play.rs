//! Binding of the play operator.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::gil::run_short;

/// `play::play`: values dragged along with a play.
#[pyfunction]
pub(super) fn play<'py>(
    py: Python<'py>,
    values: PyReadonlyArray1<'py, f64>,
    width: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = values.as_slice()?;
    Ok(run_short(py, || Ok(crate::play::play(view, width)))?.into_pyarray(py))
}
