//! Bindings of the Kalman filter.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::errors::to_python;
use super::gil::run;
use crate::kalman::{self, System};

type Matrix<'py> = PyReadonlyArray2<'py, f64>;
type Vector<'py> = PyReadonlyArray1<'py, f64>;
type Series<'py> = Bound<'py, PyArray1<f64>>;

fn system(f: &Matrix<'_>, q: &Matrix<'_>, h: &Vector<'_>, r: f64, p0: &Matrix<'_>) -> PyResult<System> {
    System::new(f.as_slice()?, q.as_slice()?, h.as_slice()?, r, p0.as_slice()?).map_err(to_python)
}

/// `kalman::filter`: innovations and their variances.
#[pyfunction]
pub fn kalman_filter<'py>(
    py: Python<'py>,
    samples: Vector<'py>,
    f: Matrix<'py>,
    q: Matrix<'py>,
    h: Vector<'py>,
    r: f64,
    p0: Matrix<'py>,
) -> PyResult<(Series<'py>, Series<'py>)> {
    let system = system(&f, &q, &h, r, &p0)?;
    let view = samples.as_slice()?;
    let (values, variances) = run(py, |stop| kalman::filter(&system, view, stop))?;
    Ok((values.into_pyarray(py), variances.into_pyarray(py)))
}

/// `kalman::smooth`: mean of H s given all samples.
#[pyfunction]
pub fn kalman_smooth<'py>(
    py: Python<'py>,
    samples: Vector<'py>,
    f: Matrix<'py>,
    q: Matrix<'py>,
    h: Vector<'py>,
    r: f64,
    p0: Matrix<'py>,
) -> PyResult<Series<'py>> {
    let system = system(&f, &q, &h, r, &p0)?;
    let view = samples.as_slice()?;
    Ok(run(py, |stop| kalman::smooth(&system, view, stop))?.into_pyarray(py))
}
