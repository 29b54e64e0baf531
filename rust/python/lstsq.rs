//! Bindings of non-negative generalized least squares.

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::gil::run_short;
use crate::lstsq;

type Fitted<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, f64);

/// Coefficients (p,), their covariance (p, p), χ².
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
pub(super) fn gls_nonnegative<'py>(
    py: Python<'py>,
    design: PyReadonlyArray2<'py, f64>,
    target: PyReadonlyArray1<'py, f64>,
    covariance: PyReadonlyArray2<'py, f64>,
) -> PyResult<Fitted<'py>> {
    let rows = |array: numpy::ndarray::ArrayView2<'_, f64>| array.iter().copied().collect::<Vec<f64>>();
    let p = design.as_array().ncols();
    let (design, covariance) = (rows(design.as_array()), rows(covariance.as_array()));
    let target = target.as_array().to_vec();
    let found = run_short(py, || lstsq::gls_nonnegative(&design, &target, &covariance))?;
    let matrix = found.covariance.into_pyarray(py).reshape([p, p])?;
    Ok((found.coefficients.into_pyarray(py), matrix, found.chi2))
}
