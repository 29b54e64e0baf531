//! Bindings of the deviations.

// The macros of pyo3 pass arguments by value.
#![allow(clippy::needless_pass_by_value)]

use std::sync::atomic::AtomicBool;

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::with_series;
use super::gil::{run, run_short};
use crate::accumulator::{self, Accumulator, State};
use crate::averaging::{Grid, factors as grid_factors};
use crate::deviation::allan::{Execution, adjacent, overlapping};
use crate::deviation::family::{Kind, variances};
use crate::deviation::identify::laws;
use crate::machine::processor::Width;
use crate::parallel::default_threads;
use crate::phase::{Quantity, Record};

/// Calls with at least this many terms release the GIL and check for Ctrl-C.
const MIN_INTERRUPTIBLE_TERMS: usize = 1 << 25;

type Vector<T> = Py<PyArray1<T>>;

fn quantity(angle: bool) -> Quantity {
    if angle { Quantity::Angle } else { Quantity::Rate }
}

/// Averaging factors of a named grid up to `most`. With `each` > 0, that many per decade.
#[pyfunction]
pub fn averaging_factors(py: Python<'_>, grid: &str, each: u32, most: usize) -> PyResult<Vector<i64>> {
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
pub fn overlapping_allan(
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
pub fn adjacent_allan(
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
pub fn family_variance(
    py: Python<'_>,
    kind: &str,
    samples: &Bound<'_, PyAny>,
    factors: PyReadonlyArray1<'_, i64>,
    angle: bool,
    threads: usize,
) -> PyResult<Found> {
    let threads = if threads == 0 { default_threads() } else { threads };
    let kind = Kind::named(kind).ok_or_else(|| PyValueError::new_err(format!("no estimator {kind}")))?;
    let factors: Vec<usize> = factors.as_array().iter().map(|m| *m as usize).collect();
    with_series!(samples, series => {
        let work = |stop: &AtomicBool| {
            let record = Record::new(series, quantity(angle), threads, stop)?;
            let execution = Execution { threads, width: Width::best(), stop };
            let (variance, count, theta) = variances(&record, kind, &factors, execution)?;
            Ok((variance, count, laws(&record, &theta, &factors), record.gaps()))
        };
        let (variance, count, noise, gaps) =
            // A short record is computed on the calling thread, because starting a thread takes longer.
            if series.len() > 4096 { run(py, work)? } else { run_short(py, || work(&AtomicBool::new(false)))? };
        let count = count.into_iter().map(|n| n as i64).collect::<Vec<_>>();
        Ok((
            variance.into_pyarray(py).unbind(),
            count.into_pyarray(py).unbind(),
            noise.into_pyarray(py).unbind(),
            gaps,
        ))
    })
}

fn allan(
    py: Python<'_>,
    samples: &Bound<'_, PyAny>,
    factors: &PyReadonlyArray1<'_, i64>,
    angle: bool,
    threads: usize,
    every: bool,
) -> PyResult<Found> {
    let threads = if threads == 0 { default_threads() } else { threads };
    let kind = quantity(angle);
    let factors: Vec<usize> = factors.as_array().iter().map(|m| *m as usize).collect();
    with_series!(samples, series => {
        let work = |stop: &AtomicBool| {
            let record = Record::new(series, kind, threads, stop)?;
            let execution = Execution { threads, width: Width::best(), stop };
            let (terms, theta) =
                if every { adjacent(&record, &factors, execution)? } else { overlapping(&record, &factors, execution)? };
            let noise = laws(&record, &theta, &factors);
            Ok((terms.variance(&factors, kind), terms.count, noise, record.gaps()))
        };
        let (variance, count, noise, gaps) = if series.len().saturating_mul(factors.len()) > MIN_INTERRUPTIBLE_TERMS {
            run(py, work)?
        } else {
            run_short(py, || work(&AtomicBool::new(false)))?
        };
        let count = count.into_iter().map(|n| n as i64).collect::<Vec<_>>();
        Ok((
            variance.into_pyarray(py).unbind(),
            count.into_pyarray(py).unbind(),
            noise.into_pyarray(py).unbind(),
            gaps,
        ))
    })
}

/// `accumulator::Accumulator`, and its number of averaging times per octave.
#[pyclass(name = "Accumulator", module = "allanite._core", skip_from_py_object)]
#[derive(Clone)]
pub struct PyAccumulator(Accumulator, usize);

#[pymethods]
impl PyAccumulator {
    #[new]
    fn new(per_octave: usize, start: u64) -> PyResult<Self> {
        let grid = accumulator::Grid::per_octave(per_octave).map_err(super::errors::to_python)?;
        Ok(Self(Accumulator::new(grid, start), per_octave))
    }

    fn update(&mut self, py: Python<'_>, samples: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let samples = samples.as_slice()?;
        let inner = &mut self.0;
        run_short(py, || inner.update(samples))
    }

    fn merge(&mut self, py: Python<'_>, other: PyRef<'_, Self>, higher: f64) -> PyResult<()> {
        let (inner, other) = (&mut self.0, &other.0);
        run_short(py, || inner.merge(other, higher))
    }

    fn copy(&self) -> Self {
        self.clone()
    }

    fn __getnewargs__(&self) -> (usize, u64) {
        (self.1, 0)
    }

    fn __getstate__(&self) -> State {
        self.0.state()
    }

    fn __setstate__(&mut self, state: State) -> PyResult<()> {
        let grid = accumulator::Grid::per_octave(self.1).map_err(super::errors::to_python)?;
        self.0 = Accumulator::restored(grid, state).map_err(super::errors::to_python)?;
        Ok(())
    }

    fn samples(&self) -> u64 {
        self.0.len()
    }

    fn gaps(&self) -> u64 {
        self.0.gaps()
    }

    /// For each averaging factor: factor, stride, sum, number of terms, number of lost terms.
    fn reading(&self) -> accumulator::Reading {
        self.0.reading()
    }
}
