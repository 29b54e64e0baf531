//! Access to the machine: vector units, the buffer pool, panics, and settings of the whole process.

pub(crate) mod buffer_pool;
pub(crate) mod panics;
#[cfg(feature = "python")]
pub(crate) mod process;
pub mod processor;

pub(crate) use buffer_pool::release;
