//! Errors of the core.
//!
//! `Input` variants become `allanite.InputError` (exit code 2), `TooShort` becomes
//! `allanite.TooShortError` (exit code 3), `Interrupted` becomes `KeyboardInterrupt`,
//! `Internal` (a bug) `InternalError` (70).

/// Every way a call into the core can fail.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An unusable argument or sample. The message names the argument, the value found, and the remedy.
    #[error("{0}")]
    Input(String),
    /// The record is too short for the request. The message says how many samples suffice.
    #[error("{0}")]
    TooShort(String),
    /// The caller asked to stop (Ctrl-C).
    #[error("interrupted")]
    Interrupted,
    /// A panic in the core, with its message and source location.
    #[error("{0}")]
    Internal(String),
}

impl Error {
    /// The system has refused to start a thread.
    pub(crate) fn no_thread(error: &impl std::fmt::Display) -> Self {
        Self::Input(format!("no thread can be started ({error}): too little memory is free"))
    }
}
