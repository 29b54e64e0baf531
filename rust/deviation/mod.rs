//! Allan variance and its relatives: one estimator a file.

pub mod allan;
pub mod identify;
mod lanes;
pub mod naive;
pub mod pages;
pub mod parallel;
pub mod sums;
