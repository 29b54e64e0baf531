//! Allan variance and its relatives: one estimator a file.

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

/// What a block of terms is computed from.
pub struct Piece<'a> {
    /// Phase points `k .. k + n + reach`.
    pub theta: &'a [f64],
    /// Place of the first of them in the record.
    pub first: usize,
    /// Number of terms.
    pub n: usize,
    /// Averaging factor.
    pub m: usize,
    /// Vector unit.
    pub width: Width,
    /// Turns true when the sum is not wanted any more.
    pub stop: &'a AtomicBool,
}
