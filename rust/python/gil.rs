//! Release of the GIL for long calls, panics as errors, and handling of Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

use pyo3::prelude::*;

use crate::machine::panics::guarded;
use crate::{Error, Result};

/// Version of the crate, which is the version of the package.
#[pyfunction]
pub(super) fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// How often the calling thread checks for Ctrl-C.
const CHECK_PERIOD: Duration = Duration::from_millis(50);

/// Minimum number of operations of a call that Ctrl-C can interrupt. Fewer take less than `CHECK_PERIOD` at about a
/// nanosecond each, so that they end before the first check.
const MIN_INTERRUPTIBLE: usize = 1 << 25;

/// For [`run`]: the work may wait for another process, so that its duration is unknown.
pub(super) const UNKNOWN: usize = usize::MAX;

/// Runs `work` of about this many operations with the GIL released. `work` receives a flag that turns true on Ctrl-C.
/// It must check the flag between blocks and return [`crate::Error::Interrupted`].
///
/// Python delivers signals only to the main thread. So longer work runs on its own thread while the calling thread
/// checks for signals. Shorter work runs on the calling thread, because starting a thread takes about as long as the
/// transform of a thousand samples.
pub(super) fn run<T, F>(py: Python<'_>, operations: usize, work: F) -> PyResult<T>
where
    T: Send,
    F: FnOnce(&AtomicBool) -> Result<T> + Send,
{
    let stop = AtomicBool::new(false);
    if operations < MIN_INTERRUPTIBLE {
        return run_short(py, || work(&stop));
    }
    let stop = &stop;
    std::thread::scope(|scope| {
        let (sender, mut receiver) = sync_channel(1);
        let started = std::thread::Builder::new().spawn_scoped(scope, move || {
            // The channel is never closed before the caller has the result, because of the scope.
            let _ = sender.send(guarded(|| work(stop)));
        });
        if let Err(error) = started {
            return Err(super::errors::to_python(Error::no_thread(&error)));
        }
        let mut signal = None;
        loop {
            // The receiver can be moved, but not borrowed, while the GIL is released.
            let got;
            (receiver, got) = py.detach(move || {
                let got = receiver.recv_timeout(CHECK_PERIOD);
                (receiver, got)
            });
            let result = match got {
                Ok(result) => result,
                Err(RecvTimeoutError::Disconnected) => {
                    Err(Error::Internal("a thread has ended without a result".into()))
                }
                Err(RecvTimeoutError::Timeout) => {
                    if signal.is_none()
                        && let Err(error) = py.check_signals()
                    {
                        stop.store(true, Ordering::Relaxed);
                        signal = Some(error);
                    }
                    continue;
                }
            };
            return match signal {
                Some(error) => Err(error),
                None => result.map_err(super::errors::to_python),
            };
        }
    })
}

/// Runs `work` of a few microseconds without releasing the GIL.
pub(super) fn run_at_once<T>(work: impl FnOnce() -> Result<T>) -> PyResult<T> {
    guarded(work).map_err(super::errors::to_python)
}

/// Runs `work` of at most a few milliseconds with the GIL released.
pub(super) fn run_short<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send,
    F: FnOnce() -> Result<T> + Send,
{
    py.detach(|| guarded(work)).map_err(super::errors::to_python)
}
