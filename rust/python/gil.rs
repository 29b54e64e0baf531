//! Releases the GIL for long calls, maps errors and answers Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use pyo3::prelude::*;

use crate::Result;

/// Version of the crate, which is the version of the package.
#[pyfunction]
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Runs `work` with the interpreter released. `work` gets a flag that turns true on Ctrl-C and is
/// expected to look at it between blocks and to return [`crate::Error::Interrupted`].
///
/// The work runs on its own thread while the calling thread looks for signals every 50 ms, because
/// Python delivers them only to the main thread. Calls known to be short should use [`run_short`].
pub fn run<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send,
    F: FnOnce(&AtomicBool) -> Result<T> + Send,
{
    let stop = AtomicBool::new(false);
    let stop = &stop;
    std::thread::scope(|scope| {
        let (sender, receiver) = std::sync::mpsc::sync_channel(1);
        scope.spawn(move || {
            // A closed channel means the caller is gone, which the scope makes impossible.
            let _ = sender.send(work(stop));
        });
        // Receiver is Send but not Sync: a mutex makes the borrow usable with the interpreter released.
        let receiver = std::sync::Mutex::new(receiver);
        let mut signal = None;
        loop {
            let got = py.detach(|| {
                receiver
                    .lock()
                    .expect("only this thread locks the receiver")
                    .recv_timeout(Duration::from_millis(50))
            });
            match got {
                Ok(result) => {
                    return match signal {
                        Some(error) => Err(error),
                        None => result.map_err(super::errors::to_python),
                    };
                }
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {
                    if signal.is_none()
                        && let Err(error) = py.check_signals()
                    {
                        stop.store(true, Ordering::Relaxed);
                        signal = Some(error);
                    }
                }
                Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => {
                    return Err(pyo3::exceptions::PyRuntimeError::new_err(
                        "the numerical core stopped unexpectedly (a bug: please report it)",
                    ));
                }
            }
        }
    })
}

/// Runs work of at most some milliseconds with the interpreter released.
pub fn run_short<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send,
    F: FnOnce() -> Result<T> + Send,
{
    py.detach(work).map_err(super::errors::to_python)
}
