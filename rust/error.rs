//! What can be wrong with the input, with the numbers.
//!
//! `Input` variants become `allanite.InputError` (exit code 2), `TooShort` becomes
//! `allanite.TooShortError` (exit code 3), `Interrupted` becomes `KeyboardInterrupt`,
//! `Internal` (a bug) `InternalError` (70).

/// Every way a call into the core can fail.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// An argument or a sample that cannot be used; the message names it, what was found, the remedy.
    #[error("{0}")]
    Input(String),
    /// The record is usable but too short for what was asked; the message says what would suffice.
    #[error("{0}")]
    TooShort(String),
    /// The caller asked to stop (Ctrl-C).
    #[error("interrupted")]
    Interrupted,
    /// A panic: what it said, and where.
    #[error("{0}")]
    Internal(String),
}
