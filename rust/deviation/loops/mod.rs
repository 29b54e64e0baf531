//! Loops that the estimators share: sums of squares in registers, cache tiles, and prefix sums for long windows.

mod lanes;
pub(crate) mod segments;
pub mod sums;
pub(crate) mod tiles;
