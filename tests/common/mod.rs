//! Helpers shared by tests and benches.

pub(crate) mod exact;
