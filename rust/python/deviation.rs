//! Bindings of the deviations.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{averaging_factors as factors_of, with_series};
use super::gil::{run, run_at_once, run_short};
use crate::Result;
use crate::accumulator::{self, Accumulator, State};
use crate::averaging::{Grid, factors as grid_factors};
use crate::deviation::allan::{Execution, adjacent, overlapping};
use crate::deviation::family::{self, variances};
use crate::deviation::identify::laws;
use crate::deviation::statistic;
use crate::machine::buffer_pool::Buffer;
use crate::machine::processor::Width;
use crate::parallel::default_threads;
use crate::phase::{Quantity, Record, Sample, Series};

type Vector<T> = Py<PyArray1<T>>;

/// Meaning of the samples: angles or rates.
fn quantity(angle: bool) -> Quantity {
    if angle { Quantity::Angle } else { Quantity::Rate }
}

/// Averaging factors of a named grid up to `most`. With `each` > 0, that many per decade.
#[pyfunction]
pub(super) fn averaging_factors(py: Python<'_>, grid: &str, each: u32, most: usize) -> PyResult<Vector<i64>> {
    let grid = match grid {
        "octave" => Grid::Octave,
        "decade" => Grid::Decade,
        "all" => Grid::All,
        _ => Grid::PerDecade(each),
    };
    let found = run_short(py, || grid_factors(grid, most))?;
    Ok(found.into_iter().map(|m| m as i64).collect::<Vec<_>>().into_pyarray(py).unbind())
}

/// Variance, number of terms and power-law exponent α of the noise at each factor, and number of gaps.
type Found = (Vector<f64>, Vector<i64>, Vector<f64>, usize);

/// Overlapping Allan variance in units of the samples, for ascending factors.
#[pyfunction]
#[pyo3(signature = (samples, factors, angle, threads=0))]
pub(super) fn overlapping_allan(
    py: Python<'_>,
    samples: &Bound<'_, PyAny>,
    factors: PyReadonlyArray1<'_, i64>,
    angle: bool,
    threads: usize,
) -> PyResult<Found> {
    allan(py, samples, &factors, angle, threads, false)
}

/// Allan variance of adjacent averages; like [`overlapping_allan`].
#[pyfunction]
#[pyo3(signature = (samples, factors, angle, threads=0))]
pub(super) fn adjacent_allan(
    py: Python<'_>,
    samples: &Bound<'_, PyAny>,
    factors: PyReadonlyArray1<'_, i64>,
    angle: bool,
    threads: usize,
) -> PyResult<Found> {
    allan(py, samples, &factors, angle, threads, true)
}

/// Variance (for TIE: the square) by any other estimator; like [`overlapping_allan`].
#[pyfunction]
#[pyo3(signature = (kind, samples, factors, angle, threads=0))]
pub(super) fn family_variance(
    py: Python<'_>,
    kind: &str,
    samples: &Bound<'_, PyAny>,
    factors: PyReadonlyArray1<'_, i64>,
    angle: bool,
    threads: usize,
) -> PyResult<Found> {
    let statistic = statistic(kind).ok_or_else(|| PyValueError::new_err(format!("no estimator {kind}")))?;
    let factors = factors_of(&factors)?;
    with_series!(samples, series => {
        let operations = family::operations(statistic, &factors, series.len());
        found(py, series, angle, threads, (operations, &factors), |record, execution| {
            variances(record, statistic, &factors, execution)
        })
    })
}

/// Allan variance of overlapping averages, or of adjacent ones, in units of the samples.
fn allan(
    py: Python<'_>,
    samples: &Bound<'_, PyAny>,
    factors: &PyReadonlyArray1<'_, i64>,
    angle: bool,
    threads: usize,
    every: bool,
) -> PyResult<Found> {
    let factors = factors_of(factors)?;
    with_series!(samples, series => {
        let operations = series.len().saturating_mul(factors.len());
        found(py, series, angle, threads, (operations, &factors), |record, execution| {
            let sums = if every { adjacent } else { overlapping };
            let (terms, theta) = sums(record, &factors, execution)?;
            Ok((terms.variance(&factors, quantity(angle)), terms.count, theta))
        })
    })
}

/// Result of `compute`, which takes about this many operations for these factors, with the noise at each factor.
fn found<T: Sample>(
    py: Python<'_>,
    series: Series<'_, T>,
    angle: bool,
    threads: usize,
    (operations, factors): (usize, &[usize]),
    compute: impl FnOnce(&Record<'_, T>, Execution<'_>) -> Result<(Vec<f64>, Vec<u64>, Buffer)> + Send,
) -> PyResult<Found> {
    let threads = if threads == 0 { default_threads() } else { threads };
    let (variance, count, noise, gaps) = run(py, operations, |stop| {
        let record = Record::new(series, quantity(angle), threads, stop)?;
        let execution = Execution { threads, width: Width::best(), stop };
        let (variance, count, theta) = compute(&record, execution)?;
        Ok((variance, count, laws(&record, &theta, factors), record.gaps()))
    })?;
    let count = count.into_iter().map(|n| n as i64).collect::<Vec<_>>();
    Ok((
        variance.into_pyarray(py).unbind(),
        count.into_pyarray(py).unbind(),
        noise.into_pyarray(py).unbind(),
        gaps,
    ))
}

/// `accumulator::Accumulator`, and its number of averaging times per octave.
#[pyclass(name = "Accumulator", module = "allanite._core", skip_from_py_object)]
#[derive(Clone)]
pub struct PyAccumulator(Accumulator, usize);

#[pymethods]
impl PyAccumulator {
    /// Empty segment that starts at sample `start` of its stream, with `per_octave` averaging factors per octave.
    #[new]
    fn new(per_octave: usize, start: u64) -> PyResult<Self> {
        let grid = run_at_once(|| accumulator::Grid::per_octave(per_octave))?;
        Ok(Self(Accumulator::new(grid, start), per_octave))
    }

    /// Adds the next samples; NaN marks a missing sample.
    fn update(&mut self, py: Python<'_>, samples: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let samples = samples.as_slice()?;
        let inner = &mut self.0;
        run_short(py, || inner.update(samples))
    }

    /// Appends the segment that follows this one; its samples were counted from a base that is `higher` by this amount.
    fn merge(&mut self, py: Python<'_>, other: PyRef<'_, Self>, higher: f64) -> PyResult<()> {
        let (inner, other) = (&mut self.0, &other.0);
        run_short(py, || inner.merge(other, higher))
    }

    /// Independent copy.
    fn copy(&self) -> Self {
        self.clone()
    }

    /// Arguments of `new`, for pickle.
    fn __getnewargs__(&self) -> (usize, u64) {
        (self.1, 0)
    }

    /// Complete state as plain numbers, for pickle.
    fn __getstate__(&self) -> State {
        self.0.state()
    }

    /// Restores the state from `__getstate__`.
    fn __setstate__(&mut self, state: State) -> PyResult<()> {
        self.0 = run_at_once(|| Accumulator::restored(accumulator::Grid::per_octave(self.1)?, state))?;
        Ok(())
    }

    /// Number of samples so far, missing ones included.
    fn samples(&self) -> u64 {
        self.0.len()
    }

    /// Number of missing samples so far.
    fn gaps(&self) -> u64 {
        self.0.gaps()
    }

    /// For each averaging factor: factor, stride, sum, number of terms, number of lost terms.
    fn reading(&self) -> accumulator::Reading {
        self.0.reading()
    }
}
