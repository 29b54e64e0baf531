//! Bindings of the covariance across averaging factors.

use faer::c64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

use super::gil::run_short;
use crate::covariance::{Kind, Term, covariance, ordinates, quantiles, variances};
use crate::{Error, Result};

type Curve<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

fn positive(factors: &[i64]) -> Result<Vec<usize>> {
    factors
        .iter()
        .map(|m| {
            usize::try_from(*m)
                .ok()
                .filter(|m| *m > 0)
                .ok_or_else(|| Error::Input(format!("averaging factor {m} is not positive")))
        })
        .collect()
}

/// Expected variance (k,) and covariance of the estimates (k, k).
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (terms, n, factors, kind = "oadev"))]
pub fn allan_covariance<'py>(
    py: Python<'py>,
    terms: Vec<Term>,
    n: usize,
    factors: PyReadonlyArray1<'py, i64>,
    kind: &str,
) -> PyResult<Curve<'py>> {
    let factors = factors.as_array().to_vec();
    let k = factors.len();
    let (expected, matrix) =
        run_short(py, || covariance(&terms, n, &positive(&factors)?, Kind::named(kind)?))?;
    Ok((expected.into_pyarray(py), matrix.into_pyarray(py).reshape([k, k])?))
}

/// Expected variance (k,) and variance of the estimates (k,).
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (terms, n, factors, kind = "oadev"))]
pub fn allan_variances<'py>(
    py: Python<'py>,
    terms: Vec<Term>,
    n: usize,
    factors: PyReadonlyArray1<'py, i64>,
    kind: &str,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let factors = factors.as_array().to_vec();
    let (expected, own) = run_short(py, || variances(&terms, n, &positive(&factors)?, Kind::named(kind)?))?;
    Ok((expected.into_pyarray(py), own.into_pyarray(py)))
}

/// Quantiles of σ̂²/σ² at one factor.
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (terms, n, factor, probabilities, kind = "oadev"))]
pub fn allan_law<'py>(
    py: Python<'py>,
    terms: Vec<Term>,
    n: usize,
    factor: usize,
    probabilities: Vec<f64>,
    kind: &str,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let found = run_short(py, || quantiles(&terms, n, factor, &probabilities, Kind::named(kind)?))?;
    Ok(found.into_pyarray(py))
}

/// E c_j² (k,) of r(h) = Re(a φ^h) at ordinates j of n samples.
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
pub fn exponential_ordinates<'py>(
    py: Python<'py>,
    a: (f64, f64),
    phi: (f64, f64),
    j: PyReadonlyArray1<'py, i64>,
    n: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let j = j.as_slice()?;
    let found = ordinates::exponential(c64::new(a.0, a.1), c64::new(phi.0, phi.1), j, n);
    Ok(found.into_pyarray(py))
}
