//! What several tests and benches use.

pub mod exact;
