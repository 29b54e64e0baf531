//! Bindings of the Kalman filter.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::gil::{run, run_at_once};
use crate::kalman::stamped::{Lag, Noise};
use crate::kalman::{self, System, stamped};

type Matrix<'py> = PyReadonlyArray2<'py, f64>;
type Vector<'py> = PyReadonlyArray1<'py, f64>;
type Series<'py> = Bound<'py, PyArray1<f64>>;

/// System from `NumPy` arrays.
fn system(f: &Matrix<'_>, q: &Matrix<'_>, h: &Vector<'_>, r: f64, p0: &Matrix<'_>) -> PyResult<System> {
    let (f, q, h, p0) = (f.as_slice()?, q.as_slice()?, h.as_slice()?, p0.as_slice()?);
    run_at_once(|| System::new(f, q, h, r, p0))
}

/// Estimated number of operations of a filter of `states` states: a product of two matrices at every sample.
fn steps(samples: usize, states: usize) -> usize {
    samples.saturating_mul(states.saturating_pow(3).saturating_add(states))
}

/// `kalman::filter`: innovations and their variances.
#[pyfunction]
pub(super) fn kalman_filter<'py>(
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
    let operations = steps(view.len(), h.len()?);
    let (values, variances) = run(py, operations, |stop| kalman::filter(&system, view, stop))?;
    Ok((values.into_pyarray(py), variances.into_pyarray(py)))
}

/// `kalman::smooth`: expectation of H s given all samples.
#[pyfunction]
pub(super) fn kalman_smooth<'py>(
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
    let operations = steps(view.len(), h.len()?);
    Ok(run(py, operations, |stop| kalman::smooth(&system, view, stop))?.into_pyarray(py))
}

/// `kalman::stamped::filter`: innovations (k, n) of columns at arbitrary times, and their variances (n,).
///
/// Lags are (variance, rate in 1/s, whether the integral of the lag is observed).
#[pyfunction]
pub(super) fn stamped_filter<'py>(
    py: Python<'py>,
    times: Vector<'py>,
    there: PyReadonlyArray1<'py, bool>,
    columns: Matrix<'py>,
    lags: Vec<(f64, f64, bool)>,
    walk: f64,
    white: f64,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Series<'py>)> {
    let lags =
        lags.into_iter().map(|(variance, rate, integrated)| Lag { variance, rate, integrated }).collect();
    let noise = Noise { lags, walk, white };
    let shape = columns.as_array().dim();
    let (times, there, columns) = (times.as_slice()?, there.as_slice()?, columns.as_slice()?);
    let operations = steps(columns.len(), noise.lags.len() + 1);
    let (values, variances) =
        run(py, operations, |stop| stamped::filter(&noise, times, there, columns, stop))?;
    Ok((values.into_pyarray(py).reshape(shape)?, variances.into_pyarray(py)))
}
