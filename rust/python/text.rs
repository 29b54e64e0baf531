//! Bindings of the text reader.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::gil::{UNKNOWN, run};
use crate::parallel::locked;
use crate::text::{Meta, Options, Reader};
use crate::{Error, Result};

/// Options of the reader; the error says which of them is invalid.
fn options(
    delimiter: Option<&str>,
    decimal_comma: Option<bool>,
    columns: Option<Vec<usize>>,
    finite: bool,
) -> Result<Options> {
    let delimiter = match delimiter.map(str::as_bytes) {
        None => None,
        Some(&[byte]) => Some(byte),
        Some(_) => {
            return Err(Error::Input(format!(
                "delimiter {:?}: give one character; a blank means any white space",
                delimiter.unwrap_or_default()
            )));
        }
    };
    Ok(Options { delimiter, decimal_comma, columns, finite })
}

/// Metadata as a dictionary.
fn dictionary<'py>(py: Python<'py>, meta: &Meta) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("delimiter", meta.delimiter)?;
    found.set_item("decimal_comma", meta.decimal_comma)?;
    found.set_item("comments", meta.comments)?;
    found.set_item("blank", meta.blank)?;
    found.set_item("header_line", meta.header_line)?;
    found.set_item("skipped", meta.skipped)?;
    found.set_item("missing", meta.missing)?;
    found.set_item("rows", meta.rows)?;
    Ok(found)
}

type Sampled<'py> = (Vec<Bound<'py, PyArray1<f64>>>, Vec<usize>, Vec<String>);
type Read<'py> = (Option<Vec<String>>, Vec<Bound<'py, PyArray1<f64>>>, Bound<'py, PyDict>);

/// All selected columns of a log.
#[pyfunction]
#[pyo3(signature = (path, delimiter = None, decimal_comma = None, columns = None, finite = false))]
pub(super) fn read_text<'py>(
    py: Python<'py>,
    path: PathBuf,
    delimiter: Option<&str>,
    decimal_comma: Option<bool>,
    columns: Option<Vec<usize>>,
    finite: bool,
) -> PyResult<Read<'py>> {
    let options = options(delimiter, decimal_comma, columns, finite).map_err(super::errors::to_python)?;
    let table = run(py, UNKNOWN, |stop| crate::text::read(&path, &options, stop))?;
    let meta = dictionary(py, &table.meta)?;
    let columns = table.columns.into_iter().map(|column| column.into_pyarray(py)).collect();
    Ok((table.header, columns, meta))
}

/// Reader of a log in chunks of rows.
#[pyclass(frozen, module = "allanite._core")]
pub struct TextReader {
    reader: Mutex<Reader>,
}

impl TextReader {
    /// Result of `work` with the locked reader.
    fn with<T>(&self, work: impl FnOnce(&mut Reader) -> T) -> T {
        work(&mut locked(&self.reader))
    }
}

#[pymethods]
impl TextReader {
    /// Opens a log and determines its format from the first lines.
    #[new]
    #[pyo3(signature = (path, delimiter = None, decimal_comma = None, columns = None, finite = false))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        delimiter: Option<&str>,
        decimal_comma: Option<bool>,
        columns: Option<Vec<usize>>,
        finite: bool,
    ) -> PyResult<Self> {
        let options = options(delimiter, decimal_comma, columns, finite).map_err(super::errors::to_python)?;
        let reader = run(py, UNKNOWN, |stop| Reader::open(&path, &options, stop))?;
        Ok(Self { reader: Mutex::new(reader) })
    }

    /// Names of the columns, if the log has them.
    #[getter]
    fn header(&self) -> Option<Vec<String>> {
        self.with(|reader| reader.header())
    }

    /// Number of selected columns.
    #[getter]
    fn width(&self) -> usize {
        self.with(|reader| reader.width())
    }

    /// Selects columns; must be called before the first rows are read.
    fn select(&self, columns: Vec<usize>) -> PyResult<()> {
        self.with(|reader| reader.select(columns)).map_err(super::errors::to_python)
    }

    /// Up to `rows` first rows of all columns; for each column, the number of text cells and one cell.
    fn sample<'py>(&self, py: Python<'py>, rows: usize) -> PyResult<Sampled<'py>> {
        let found = run(py, UNKNOWN, |stop: &AtomicBool| self.with(|reader| reader.sample(rows, stop)))?;
        let columns = found.columns.into_iter().map(|column| column.into_pyarray(py)).collect();
        Ok((columns, found.words, found.cells))
    }

    /// Format of the log and counts of the lines read so far.
    #[getter]
    fn meta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let meta = self.with(|reader| reader.meta().clone());
        dictionary(py, &meta)
    }

    /// Up to `rows` further rows; `None` at the end of the log.
    fn next<'py>(&self, py: Python<'py>, rows: usize) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let work = |stop: &AtomicBool| self.with(|reader| Ok((reader.next(rows, stop)?, reader.width())));
        let (table, width) = run(py, UNKNOWN, work)?;
        table
            .map(|numbers| {
                let count = numbers.len() / width;
                numbers.into_pyarray(py).reshape([count, width])
            })
            .transpose()
    }
}
