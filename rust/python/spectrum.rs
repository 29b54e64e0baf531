//! Bindings of the spectrum.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::gil::run;
use crate::spectrum;

/// `spectrum::cosine_transform`.
#[pyfunction]
pub fn cosine_transform<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = samples.as_slice()?;
    Ok(run(py, |stop| spectrum::cosine_transform(view, stop))?.into_pyarray(py))
}

/// `spectrum::inverse_cosine_transform`.
#[pyfunction]
pub fn inverse_cosine_transform<'py>(
    py: Python<'py>,
    ordinates: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = ordinates.as_slice()?;
    Ok(run(py, |stop| spectrum::inverse_cosine_transform(view, stop))?.into_pyarray(py))
}

/// `spectrum::padded_periodogram`.
#[pyfunction]
pub fn padded_periodogram<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = samples.as_slice()?;
    Ok(run(py, |stop| spectrum::padded_periodogram(view, stop))?.into_pyarray(py))
}
