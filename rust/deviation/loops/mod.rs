//! The loops that the estimators share: sums of squares in registers, their tiles, prefix sums of long windows.

mod lanes;
pub mod stretches;
pub mod sums;
pub mod tiles;
