//! The numerical core of allanite.
//!
//! | module | what it computes | source |
//! |---|---|---|
//! | [`averaging`] | averaging factors m of a τ grid | NIST SP 1065 §5 |
//! | [`phase`] | samples → phase θ, offset removed exactly | IEEE 952 annex C |
//! | [`deviation`] | Allan variance and its relatives | NIST SP 1065 §5.2 |
//! | [`accumulator`] | Allan variance of a stream in constant memory | |
//! | [`covariance`] | covariance of the estimates across τ | Greenhall & Riley 2003 |
//! | [`spectrum`] | cosine-transform ordinates, log-spaced bins | |
//! | [`envelope`] | minimum and maximum of equal segments, for plots | |
//! | [`kalman`] | innovations and smoothed mean of a state-space model | Durbin & Koopman 2012 |
//! | [`lstsq`] | generalized and non-negative least squares | Lawson & Hanson ch. 23 |
//! | [`likelihood`] | spectrum fits that allow for a discrepancy | Lange, Little & Taylor 1989 |
//! | [`play`] | values that a quantity with play drags along | Visintin 1994 |
//! | [`noise`] | samples of colored noise | Kasdin 1995 |
//! | [`ranks`] | sorting and ranks | |
//! | [`text`] | numeric columns of a text log | |
//! | [`parallel`] | work on several threads | |
//! | [`machine`] | vector units, large buffers, allocator, panics | |
//!
//! The package has no Rust interface: modules are public only for the tests in `tests/` and the timings in `benches/`.
//!
//! Only the module `python` uses the Python interpreter. Every other module builds and is tested without Python.

#![cfg_attr(
    not(feature = "python"),
    allow(dead_code, unused_imports, reason = "only the bindings use some items")
)]

pub mod accumulator;
pub mod averaging;
mod covariance;
pub mod deviation;
mod envelope;
mod error;
mod kalman;
mod likelihood;
mod lstsq;
pub mod machine;
pub mod noise;
pub mod parallel;
pub mod phase;
mod play;
#[cfg(feature = "python")]
mod python;
mod ranks;
pub mod rng;
mod spectrum;
pub mod text;

pub use error::Error;

/// Result of a call into the core.
pub type Result<T> = std::result::Result<T, Error>;
