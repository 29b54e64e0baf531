//! Helpers shared by tests and benches.

pub mod exact;
