//! Bindings of machine resources: buffers, allocator, signals, vector units.

use pyo3::prelude::*;

use super::errors::to_python;
use crate::machine;
use crate::machine::process;
use crate::machine::processor::{self, Width};

/// Frees cached plans and buffers (`spectrum::release`, `machine::release`); returns the size of the buffers in bytes.
#[pyfunction]
pub(super) fn release() -> usize {
    crate::spectrum::release();
    machine::release()
}

/// Declares that this process belongs to a program of the package; see `machine::process::own_process`.
#[pyfunction]
pub(super) fn own_process() {
    process::own_process();
}

/// Returns cached memory to the system; true if it did. See `machine::process::trim`.
#[pyfunction]
pub(super) fn trim(py: Python<'_>) -> bool {
    py.detach(process::trim)
}

/// `machine::process::end_with`: the final message of a program whose mapped file is truncated.
#[pyfunction]
pub(super) fn end_with_line(line: &str, code: i32) {
    process::end_with(line, code);
}

/// Name of the vector unit in use. `most` restricts this process to the named unit and narrower ones.
#[pyfunction]
#[pyo3(signature = (most = None))]
pub(super) fn vector_unit(most: Option<&str>) -> PyResult<&'static str> {
    most.map_or(Ok(()), processor::limit_unit_to).map_err(to_python)?;
    Ok(Width::best().name())
}
