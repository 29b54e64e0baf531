//! Allan variance and related statistics, one estimator per file.

pub mod allan;
pub mod family;
mod hadamard;
pub mod identify;
pub mod loops;
mod modified;
mod modified_total;
pub mod naive;
mod theo;
mod tie;
mod total;

use std::sync::atomic::AtomicBool;

use crate::machine::processor::Width;

/// Input of a block of terms. A term is one squared difference of an estimator.
pub struct Block<'a> {
    /// Phase points `k .. k + n + reach`.
    pub theta: &'a [f64],
    /// Index of the first of these points in the record.
    pub first: usize,
    /// Number of terms.
    pub n: usize,
    /// Averaging factor.
    pub m: usize,
    /// Vector unit.
    pub width: Width,
    /// Set to true when the caller wants to stop; the sum is then unspecified.
    pub stop: &'a AtomicBool,
}
