//! Bindings of the noise generator.

use std::sync::Mutex;

use numpy::PyArray1;
use pyo3::prelude::*;

use super::arrays::from_buffer;
use super::gil::run;
use crate::machine::buffer_pool::Buffer;
use crate::noise::Generator;
use crate::{Error, Result};

type Processes = Vec<(String, Vec<f64>)>;

/// Buffer for `n` samples, or an error if memory is insufficient.
fn buffer_for(n: usize) -> Result<Buffer> {
    Vec::<f64>::new()
        .try_reserve_exact(n)
        .map_err(|_| Error::Input(format!("{n} samples do not fit into memory: simulate in chunks")))?;
    Ok(Buffer::new(n))
}

/// Samples of a sum of processes.
#[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
#[pyfunction]
#[pyo3(signature = (processes, n, seed, replicate = 0, axis = 0, threads = 0))]
pub fn simulate(
    py: Python<'_>,
    processes: Processes,
    n: usize,
    seed: u64,
    replicate: u64,
    axis: u64,
    threads: usize,
) -> PyResult<Bound<'_, PyArray1<f64>>> {
    let samples = run(py, |stop| {
        let mut generator = Generator::new(&processes, n, seed, replicate, axis, threads)?;
        let mut samples = buffer_for(n)?;
        generator.fill(&mut samples, stop)?;
        Ok(samples)
    })?;
    from_buffer(py, samples)
}

/// Generator of the samples of a sum of processes, in chunks.
#[pyclass(frozen, module = "allanite._core")]
pub struct Simulator {
    generator: Mutex<Generator>,
}

#[pymethods]
impl Simulator {
    #[new]
    #[expect(clippy::needless_pass_by_value, reason = "extracted from Python objects")]
    #[pyo3(signature = (processes, seed, replicate, axis, total))]
    fn new(processes: Processes, seed: u64, replicate: u64, axis: u64, total: usize) -> PyResult<Self> {
        let generator =
            Generator::new(&processes, total, seed, replicate, axis, 0).map_err(super::errors::to_python)?;
        Ok(Self { generator: Mutex::new(generator) })
    }

    /// The next `n` samples.
    fn next<'py>(&self, py: Python<'py>, n: usize) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let samples = run(py, |stop| {
            let mut samples = buffer_for(n)?;
            let mut generator = self.generator.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            generator.fill(&mut samples, stop)?;
            Ok(samples)
        })?;
        from_buffer(py, samples)
    }
}

/// `noise::power_law_bank`: (φ, variance) of each first-order section.
#[pyfunction]
pub fn power_law_bank(exponent: f64, n: usize) -> PyResult<Vec<(f64, f64)>> {
    crate::noise::power_law_bank(exponent, n).map_err(super::errors::to_python)
}
