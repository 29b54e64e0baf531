//! The numerical core of allanite.
//!
//! | module | what it computes | source |
//! |---|---|---|
//! | [`averaging`] | averaging factors m of a τ grid | NIST SP 1065 §5 |
//! | [`phase`] | samples → phase θ, offset removed exactly | IEEE 952 annex C |
//! | [`deviation`] | Allan variance and its relatives | NIST SP 1065 §5.2 |
//! | [`accumulator`] | the same of a stream, in constant memory | |
//! | [`covariance`] | covariance of the estimates across τ | Greenhall & Riley 2003 |
//! | [`spectrum`] | cosine-transform ordinates, log-spaced bins | |
//! | [`envelope`] | a long record as the band a screen can show | |
//! | [`kalman`] | innovations and smoothed mean of a state-space model | Durbin & Koopman 2012 |
//! | [`lstsq`] | generalised and non-negative least squares | Lawson & Hanson ch. 23 |
//! | [`likelihood`] | spectrum fits that allow for a discrepancy | Lange, Little & Taylor 1989 |
//! | [`noise`] | samples of coloured noise | Kasdin 1995 |
//! | [`ranks`] | samples in order | |
//! | [`text`] | numeric columns of a text log | |
//! | [`parallel`] | threads over blocks | |
//! | [`machine`] | vector units, large buffers | |
//!
//! Only `python` may name an interpreter; everything else builds and is tested without one.

pub mod accumulator;
pub mod averaging;
pub mod covariance;
pub mod deviation;
pub mod envelope;
pub mod error;
pub mod kalman;
pub mod likelihood;
pub mod lstsq;
pub mod machine;
pub mod noise;
pub mod parallel;
pub mod phase;
#[cfg(feature = "python")]
mod python;
pub mod ranks;
pub mod rng;
pub mod spectrum;
pub mod text;

pub use error::Error;

/// What the core returns.
pub type Result<T> = std::result::Result<T, Error>;
