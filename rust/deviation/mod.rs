//! Allan variance and its relatives: one estimator a file.

pub mod allan;
pub mod family;
mod hadamard;
pub mod identify;
mod lanes;
mod modified;
mod modified_total;
pub mod naive;
mod stretches;
pub mod sums;
mod theo;
mod tie;
mod tiles;
mod total;
