//! Bindings of the likelihood with a model discrepancy.

use numpy::ndarray::ArrayView2;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pyo3::prelude::*;

use super::gil::{run, run_at_once, run_short};
use crate::likelihood::{self, Evaluation, Problem};

type Array<'py> = Bound<'py, PyArray1<f64>>;

/// Copy of an array as a vector.
fn numbers(array: &PyReadonlyArray1<'_, f64>) -> Vec<f64> {
    array.as_array().to_vec()
}

/// Copy of a matrix as a vector, column by column.
fn columns(array: ArrayView2<'_, f64>) -> Vec<f64> {
    array.reversed_axes().iter().copied().collect()
}

/// Likelihood of bins with given degrees of freedom and scales of discrepancy.
#[pyclass(frozen, module = "allanite._core")]
pub struct Likelihood(likelihood::Likelihood);

#[pymethods]
impl Likelihood {
    /// Likelihood for bins with `count` degrees of freedom, for the discrepancies δ `scales`; `cells` are first bins.
    #[new]
    fn new(
        count: PyReadonlyArray1<'_, f64>,
        scales: PyReadonlyArray1<'_, f64>,
        cells: Vec<usize>,
    ) -> PyResult<Self> {
        let (count, scales) = (numbers(&count), numbers(&scales));
        run_at_once(|| likelihood::Likelihood::new(count, scales, cells)).map(Self)
    }

    /// Marginal logL and weights (bins,).
    #[pyo3(signature = (power, spectrum, scale))]
    fn judge<'py>(
        &self,
        py: Python<'py>,
        power: PyReadonlyArray1<'py, f64>,
        spectrum: PyReadonlyArray1<'py, f64>,
        scale: Option<usize>,
    ) -> PyResult<(f64, Array<'py>)> {
        let (power, spectrum) = (numbers(&power), numbers(&spectrum));
        let Evaluation { log_likelihood, weight } =
            run_short(py, || self.0.evaluate(&power, &spectrum, scale))?;
        Ok((log_likelihood, weight.into_pyarray(py)))
    }

    /// Marginal logL (scales, m) of spectra (m, bins).
    fn profile<'py>(
        &self,
        py: Python<'py>,
        power: PyReadonlyArray1<'py, f64>,
        spectra: PyReadonlyArray2<'py, f64>,
        scales: Vec<usize>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let shape = [scales.len(), spectra.as_array().nrows()];
        let (power, spectra) = (numbers(&power), spectra.as_array().iter().copied().collect::<Vec<f64>>());
        let found = run_short(py, || self.0.profile(&power, &spectra, &scales))?;
        found.into_pyarray(py).reshape(shape)
    }

    /// The scale with the highest marginal logL (the nearest maximum uphill of `start` if given), its logL and
    /// weights (bins,).
    #[pyo3(signature = (power, spectrum, start=None))]
    fn best_scale<'py>(
        &self,
        py: Python<'py>,
        power: PyReadonlyArray1<'py, f64>,
        spectrum: PyReadonlyArray1<'py, f64>,
        start: Option<usize>,
    ) -> PyResult<(usize, f64, Array<'py>)> {
        let (power, spectrum) = (numbers(&power), numbers(&spectrum));
        let (scale, found) = run_short(py, || self.0.best_scale(&power, &spectrum, start))?;
        Ok((scale, found.log_likelihood, found.weight.into_pyarray(py)))
    }

    /// Starting point (p,) from least squares relative to the power.
    fn first<'py>(
        &self,
        py: Python<'py>,
        power: PyReadonlyArray1<'py, f64>,
        matrix: PyReadonlyArray2<'py, f64>,
        offset: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Array<'py>> {
        let p = matrix.as_array().ncols();
        let (power, offset) = (numbers(&power), offset.as_ref().map(numbers));
        let columns = columns(matrix.as_array());
        let problem =
            Problem { likelihood: &self.0, power: &power, columns: &columns, offset: offset.as_deref() };
        Ok(run_short(py, || problem.first(p))?.into_pyarray(py))
    }

    /// The local maximum uphill of `theta`: θ (p,), S (bins,), marginal logL, scale and weights (bins,).
    #[expect(clippy::too_many_arguments, reason = "they define the problem")]
    fn climb<'py>(
        &self,
        py: Python<'py>,
        power: PyReadonlyArray1<'py, f64>,
        matrix: PyReadonlyArray2<'py, f64>,
        theta: PyReadonlyArray1<'py, f64>,
        scale: Option<usize>,
        offset: Option<PyReadonlyArray1<'py, f64>>,
        rounds: usize,
    ) -> PyResult<(Array<'py>, Array<'py>, f64, Option<usize>, Array<'py>)> {
        let (power, offset, theta) = (numbers(&power), offset.as_ref().map(numbers), numbers(&theta));
        let columns = columns(matrix.as_array());
        let problem =
            Problem { likelihood: &self.0, power: &power, columns: &columns, offset: offset.as_deref() };
        let found = run_short(py, || problem.climb(&theta, scale, rounds))?;
        Ok((
            found.theta.into_pyarray(py),
            found.spectrum.into_pyarray(py),
            found.evaluation.log_likelihood,
            found.scale,
            found.evaluation.weight.into_pyarray(py),
        ))
    }

    /// The local maxima uphill of each row of `thetas` (m, p), with columns (m, bins, p): θ (m, p), marginal logL
    /// (m,) and scales.
    fn climb_many<'py>(
        &self,
        py: Python<'py>,
        power: PyReadonlyArray1<'py, f64>,
        matrices: PyReadonlyArray3<'py, f64>,
        thetas: PyReadonlyArray2<'py, f64>,
        scale: Option<usize>,
        rounds: usize,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Array<'py>, Vec<Option<usize>>)> {
        let (m, p) = thetas.as_array().dim();
        let power = numbers(&power);
        let starts: Vec<f64> = thetas.as_array().iter().copied().collect();
        let columns: Vec<f64> = matrices.as_array().outer_iter().flat_map(columns).collect();
        // A round costs about four passes over the columns and the nodes of the discrepancy.
        let operations = columns.len().saturating_mul(4 * rounds);
        let found = run(py, operations, |stop| {
            likelihood::climb_many(&self.0, &power, &columns, &starts, p, scale, rounds, stop)
        })?;
        let thetas: Vec<f64> = found.iter().flat_map(|f| f.theta.iter().copied()).collect();
        let values: Vec<f64> = found.iter().map(|f| f.evaluation.log_likelihood).collect();
        let scales = found.iter().map(|f| f.scale).collect();
        Ok((thetas.into_pyarray(py).reshape([m, p])?, values.into_pyarray(py), scales))
    }
}
