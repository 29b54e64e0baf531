//! Bindings of the spectrum.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1};
use pyo3::prelude::*;

use super::gil::{run, run_at_once, run_short};
use crate::machine::processor::Width;
use crate::spectrum::courses::Courses;
use crate::spectrum::lapped::{Lapped, Sums, add_row};
use crate::spectrum::{self, chirps, halving, spans};

/// Estimated number of operations of a Fourier transform of n samples and of planning it, which takes up to twenty
/// times as long.
fn transform(n: usize) -> usize {
    n.saturating_mul(20 * (1 + n.max(1).ilog2() as usize))
}

/// Orthonormal cosine transform of samples with c_0 set to zero; see `spectrum::cosine_transform`.
#[pyfunction]
pub(super) fn cosine_transform<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = samples.as_slice()?;
    Ok(run(py, transform(view.len()), |stop| spectrum::cosine_transform(view, stop))?.into_pyarray(py))
}

/// Samples with mean zero that have these ordinates; see `spectrum::inverse_cosine_transform`.
#[pyfunction]
pub(super) fn inverse_cosine_transform<'py>(
    py: Python<'py>,
    ordinates: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = ordinates.as_slice()?;
    Ok(run(py, transform(view.len()), |stop| spectrum::inverse_cosine_transform(view, stop))?
        .into_pyarray(py))
}

/// Periodogram at the frequencies j/2n, j = 0…n; see `spectrum::padded_periodogram`.
#[pyfunction]
pub(super) fn padded_periodogram<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let view = samples.as_slice()?;
    Ok(run(py, transform(view.len()), |stop| spectrum::padded_periodogram(view, stop))?.into_pyarray(py))
}

/// Sum of squares of the ordinates of each bin; see `spectrum::squares`.
#[pyfunction]
pub(super) fn squares<'py>(
    py: Python<'py>,
    ordinates: PyReadonlyArray1<'py, f64>,
    edges: PyReadonlyArray1<'py, i64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (ordinates, edges) = (ordinates.as_slice()?, edges.as_slice()?);
    Ok(run_short(py, || spectrum::squares(ordinates, edges))?.into_pyarray(py))
}

/// `chirps::heights`: highest power at each drift rate.
#[pyfunction]
pub(super) fn chirp_heights<'py>(
    py: Python<'py>,
    series: PyReadonlyArray1<'py, f64>,
    first: f64,
    step: f64,
    count: usize,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let series = series.as_slice()?;
    let operations = count.saturating_mul(transform(series.len() / 2));
    Ok(run(py, operations, |stop| chirps::heights(series, first, step, count, stop))?.into_pyarray(py))
}

/// `Courses::best`: frequency and power of each course.
#[pyfunction]
pub(super) fn best_courses<'py>(
    py: Python<'py>,
    series: PyReadonlyArray1<'py, f64>,
    sections: usize,
    step: f64,
    most: usize,
) -> PyResult<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<f64>>)> {
    let courses = Courses { series: series.as_slice()?, sections, step, most };
    let operations = most.saturating_mul(transform(courses.series.len()));
    let (places, heights) = run(py, operations, |stop| courses.best(stop))?;
    Ok((places.into_pyarray(py), heights.into_pyarray(py)))
}

/// `spans::best_pair`: places of the two steps, and the gain.
#[pyfunction]
pub(super) fn best_pair(
    py: Python<'_>,
    score: PyReadonlyArray1<'_, f64>,
    own: PyReadonlyArray1<'_, f64>,
    waves: PyReadonlyArray1<'_, f64>,
    beside: PyReadonlyArray2<'_, f64>,
    least: usize,
    floor: f64,
) -> PyResult<(usize, usize, f64)> {
    let (score, own, waves) = (score.as_slice()?, own.as_slice()?, waves.as_slice()?);
    let beside = beside.as_slice()?;
    let operations = score.len().saturating_mul(beside.len().max(score.len()));
    let found = run(py, operations, |stop| spans::best_pair(score, own, waves, beside, least, floor, stop))?;
    Ok((found.first, found.last, found.gain))
}

/// `lapped::Lapped`.
#[pyclass(name = "Lapped", module = "allanite._core", frozen)]
pub struct PyLapped(Lapped);

/// Power in bands, tile by tile, and the number of tiles.
type Tiles<'py> = (Bound<'py, PyArray1<f64>>, usize);

#[pymethods]
impl PyLapped {
    /// Transform with the window `after` and `before` a border and the low-pass filter `taps` for halving the rate.
    #[new]
    fn new(
        after: PyReadonlyArray1<'_, f64>,
        before: PyReadonlyArray1<'_, f64>,
        taps: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        let (after, before, taps) = (after.as_slice()?, before.as_slice()?, taps.as_slice()?);
        run_at_once(|| Lapped::new(after, before, taps, Width::best())).map(Self)
    }

    /// Samples at half the rate.
    fn halved<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let x = x.as_slice()?;
        Ok(run_short(py, || Ok(self.0.halved(x)))?.into_pyarray(py))
    }

    /// Coefficients of consecutive segments, one after the other.
    fn segments<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let x = x.as_slice()?;
        Ok(run_short(py, || self.0.segments(x))?.into_pyarray(py))
    }

    /// Halves the rate of consecutive tiles and adds their power to `sums`, up to the first tile with a missing sample.
    fn tiles<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        mut halved: PyReadwriteArray1<'py, f64>,
        sums: (usize, PyReadwriteArray1<'py, f64>, PyReadwriteArray1<'py, f64>),
        bands: usize,
        threads: usize,
    ) -> PyResult<Tiles<'py>> {
        let (x, (first, mut high, mut low)) = (x.as_slice()?, sums);
        let sums = Sums { first, high: high.as_slice_mut()?, low: low.as_slice_mut()? };
        let halved = halved.as_slice_mut()?;
        let found = run_short(py, || self.0.tiles(x, halved, sums, bands, threads))?;
        Ok((found.bands.into_pyarray(py), found.count))
    }
}

/// Adds rows, in their order, to sums in two doubles.
#[pyfunction]
pub(super) fn add_rows(
    mut high: PyReadwriteArray1<'_, f64>,
    mut low: PyReadwriteArray1<'_, f64>,
    rows: PyReadonlyArray2<'_, f64>,
) -> PyResult<()> {
    let (high, low) = (high.as_slice_mut()?, low.as_slice_mut()?);
    for row in rows.as_slice()?.chunks(high.len().max(1)) {
        add_row(Width::best(), high, low, row);
    }
    Ok(())
}

/// `halving::steps`: minimum, maximum, number of zero steps, Σd², Σd⁴.
#[pyfunction]
pub(super) fn steps(py: Python<'_>, x: PyReadonlyArray1<'_, f64>) -> PyResult<[f64; 5]> {
    let x = x.as_slice()?;
    run_short(py, || Ok(halving::steps(Width::best(), x)))
}
