//! Bindings of the envelope.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::gil::run_short;
use crate::envelope;

/// `envelope::envelope`: minimum and maximum of each segment.
#[pyfunction(name = "envelope")]
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
pub(super) fn sample_envelope<'py>(
    py: Python<'py>,
    samples: PyReadonlyArray1<'py, f64>,
    buckets: usize,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
    let view = samples.as_slice()?;
    let (low, high) = run_short(py, || envelope::envelope(view, buckets))?;
    Ok((low.into_pyarray(py), high.into_pyarray(py)))
}
