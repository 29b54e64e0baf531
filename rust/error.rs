//! Errors of the core.
//!
//! `Input` variants become `allanite.InputError` (exit code 2: one line with a remedy), `TooShort` becomes
//! `allanite.TooShortError` (exit code 3), `Interrupted` becomes `KeyboardInterrupt`,
//! `Internal` (a bug) `InternalError` (70).

/// Every way a call into the core can fail.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An unusable argument or sample, or a refusal of the system that the user can end, such as of a thread. The
    /// message names the argument or the refusal, the value found, and the remedy.
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

/// Result of a call into the core.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// The system has refused to start a thread. The input is not wrong, but `Input` reports the cause in one line, as
    /// for a full disk; `Internal` would ask for a bug report.
    pub(crate) fn no_thread(error: &impl std::fmt::Display) -> Self {
        Self::Input(format!("no thread can be started ({error}): too little memory is free"))
    }
}
