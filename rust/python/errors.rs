//! The core's errors as the package's exception classes.

use pyo3::PyErr;
use pyo3::exceptions::PyKeyboardInterrupt;

use crate::Error;

pyo3::import_exception!(allanite, InputError);
pyo3::import_exception!(allanite, TooShortError);
pyo3::import_exception!(allanite.common.errors, InternalError);

/// Python exception for an error: each variant raises the class that `error.rs` names for it.
pub(super) fn to_python(error: Error) -> PyErr {
    match error {
        Error::Input(message) => InputError::new_err(message),
        Error::TooShort(message) => TooShortError::new_err(message),
        Error::Interrupted => PyKeyboardInterrupt::new_err(()),
        Error::Internal(message) => InternalError::new_err(message),
    }
}
