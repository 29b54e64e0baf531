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
//! The package has no Rust interface. [`testing`] has what the tests in `tests/`, the timings in `benches/` and the fuzz
//! targets use.
//!
//! Only the module `python` uses the Python interpreter. Every other module builds and is tested without Python.

#![cfg_attr(
    not(feature = "python"),
    allow(dead_code, unused_imports, reason = "only the bindings use some items")
)]

mod accumulator;
mod averaging;
mod covariance;
mod deviation;
mod envelope;
mod error;
mod kalman;
mod likelihood;
mod lstsq;
mod machine;
mod noise;
mod parallel;
mod phase;
mod play;
#[cfg(feature = "python")]
mod python;
mod ranks;
mod rng;
mod spectrum;
pub mod testing;
mod text;

pub(crate) use error::{Error, Result};
