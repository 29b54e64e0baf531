//! Loops that the estimators share: sums of squares in registers, cache tiles, and prefix sums for long windows.

mod lanes;
pub mod segments;
pub mod sums;
pub mod tiles;
