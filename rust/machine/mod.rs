//! Access to the machine: vector units, the buffer pool, and the exit message for truncated files.

pub mod buffer_pool;
pub mod maps;
pub mod processor;
