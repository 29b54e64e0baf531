//! Bindings of the noise generator.

use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedStr;

use super::arrays::from_buffer;
use super::errors::to_python;
use super::gil::{run, run_at_once};
use crate::machine::buffer_pool::Buffer;
use crate::noise::{Generator, Primitive};
use crate::parallel::locked;
use crate::{Error, Result};

/// A pair (name, values) becomes a process here, once.
impl<'py> FromPyObject<'_, 'py> for Primitive {
    type Error = PyErr;

    fn extract(pair: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let (name, values): (PyBackedStr, Vec<f64>) = pair.extract()?;
        Self::new(&name, values).map_err(to_python)
    }
}

/// The next `n` samples of a generator, or an error if memory is insufficient.
fn samples(generator: &mut Generator, n: usize, stop: &AtomicBool) -> Result<Buffer> {
    Vec::<f64>::new()
        .try_reserve_exact(n)
        .map_err(|_| Error::Input(format!("{n} samples do not fit into memory: simulate in chunks")))?;
    Ok(Buffer::written(n, |samples| generator.fill(samples, stop))?.0)
}

/// Estimated number of operations for `n` samples of a sum of processes: about four a sample of each.
fn operations(n: usize, processes: usize) -> usize {
    n.saturating_mul(4 * processes)
}

/// Samples of a sum of processes.
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (processes, n, seed, replicate = 0, axis = 0, threads = 0))]
pub(super) fn simulate(
    py: Python<'_>,
    processes: Vec<Primitive>,
    n: usize,
    seed: u64,
    replicate: u64,
    axis: u64,
    threads: usize,
) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let found = run(py, operations(n, processes.len()), |stop| {
        let mut generator = Generator::new(&processes, n, seed, replicate, axis, threads)?;
        samples(&mut generator, n, stop)
    })?;
    from_buffer(py, found)
}

/// Generator of the samples of a sum of processes, in chunks.
#[pyclass(frozen, module = "allanite._core")]
pub struct Simulator {
    generator: Mutex<Generator>,
    processes: usize,
}

#[pymethods]
impl Simulator {
    /// Generator of a sum of processes, designed for records of `total` samples.
    #[new]
    #[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
    #[pyo3(signature = (processes, seed, replicate, axis, total))]
    fn new(processes: Vec<Primitive>, seed: u64, replicate: u64, axis: u64, total: usize) -> PyResult<Self> {
        let generator = run_at_once(|| Generator::new(&processes, total, seed, replicate, axis, 0))?;
        Ok(Self { generator: Mutex::new(generator), processes: processes.len() })
    }

    /// The next `n` samples.
    fn next<'py>(&self, py: Python<'py>, n: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let found =
            run(py, operations(n, self.processes), |stop| samples(&mut locked(&self.generator), n, stop))?;
        from_buffer(py, found)
    }
}

/// `noise::power_law_bank`: (φ, variance) of each first-order section.
#[pyfunction]
pub(super) fn power_law_bank(exponent: f64, n: usize) -> PyResult<Vec<(f64, f64)>> {
    run_at_once(|| crate::noise::power_law_bank(exponent, n))
}
