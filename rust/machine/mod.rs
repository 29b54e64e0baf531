//! Access to the machine: vector units, the buffer pool, and the exit message for truncated files.

pub(crate) mod buffer_pool;
pub(crate) mod maps;
pub mod processor;
