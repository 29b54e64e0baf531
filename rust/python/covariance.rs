//! Bindings of the covariance across averaging factors.

use std::sync::atomic::AtomicBool;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedStr;

use super::arrays::averaging_factors;
use super::errors::to_python;
use super::gil::{run, run_at_once};
use crate::covariance::{Kind, Term, covariance, ordinates, quantiles, variances};

/// A pair (name, values) becomes a term here, once.
impl<'py> FromPyObject<'_, 'py> for Term {
    type Error = PyErr;

    fn extract(pair: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let (name, values): (PyBackedStr, Vec<f64>) = pair.extract()?;
        Self::new(&name, values).map_err(to_python)
    }
}

/// Typical number of operations of the covariance of two estimates: 0.3 ms for a model of five terms.
const OPERATIONS: usize = 300_000;

type Curve<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// Expected variance (k,) and covariance of the estimates (k, k).
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (terms, n, factors, kind = "oadev"))]
pub(super) fn allan_covariance<'py>(
    py: Python<'py>,
    terms: Vec<Term>,
    n: usize,
    factors: PyReadonlyArray1<'py, i64>,
    kind: &str,
) -> PyResult<Curve<'py>> {
    let factors = averaging_factors(&factors)?;
    let k = factors.len();
    let work = |stop: &AtomicBool| covariance(&terms, n, &factors, Kind::from_name(kind)?, stop);
    let (expected, matrix) = run(py, k * (k + 1) / 2 * OPERATIONS, work)?;
    Ok((expected.into_pyarray(py), matrix.into_pyarray(py).reshape([k, k])?))
}

/// Expected variance (k,) and variance of the estimates (k,).
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (terms, n, factors, kind = "oadev"))]
pub(super) fn allan_variances<'py>(
    py: Python<'py>,
    terms: Vec<Term>,
    n: usize,
    factors: PyReadonlyArray1<'py, i64>,
    kind: &str,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let factors = averaging_factors(&factors)?;
    let work = |stop: &AtomicBool| variances(&terms, n, &factors, Kind::from_name(kind)?, stop);
    let (expected, own) = run(py, factors.len() * OPERATIONS, work)?;
    Ok((expected.into_pyarray(py), own.into_pyarray(py)))
}

/// Quantiles of σ̂²/σ² at one factor.
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (terms, n, factor, probabilities, kind = "oadev"))]
pub(super) fn allan_law<'py>(
    py: Python<'py>,
    terms: Vec<Term>,
    n: usize,
    factor: usize,
    probabilities: Vec<f64>,
    kind: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let work = |stop: &AtomicBool| quantiles(&terms, n, factor, &probabilities, Kind::from_name(kind)?, stop);
    let found = run(py, OPERATIONS, work)?;
    Ok(found.into_pyarray(py))
}

/// Ordinates j (k,) of n samples at which expectations are computed.
#[pyclass(frozen, module = "allanite._core")]
pub struct Ordinates(ordinates::Ordinates);

#[pymethods]
impl Ordinates {
    /// Ordinates j in 1 … n−1 of `n` samples.
    #[new]
    fn new(j: PyReadonlyArray1<'_, i64>, n: usize) -> Self {
        Self(ordinates::Ordinates::new(j.as_array().iter().copied(), n))
    }

    /// E c_j² (k,) of a sum of terms.
    fn variance<'py>(&self, py: Python<'py>, terms: Vec<Term>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(run_at_once(|| self.0.variance(&terms))?.into_pyarray(py))
    }

    /// Means (bins,) of E c_j² over bins. `owner` (k,) names the bin of each ordinate.
    fn means<'py>(
        &self,
        py: Python<'py>,
        terms: Vec<Term>,
        owner: PyReadonlyArray1<'py, i64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let owner = owner.as_slice()?;
        Ok(run_at_once(|| self.0.means(&terms, owner))?.into_pyarray(py))
    }
}
