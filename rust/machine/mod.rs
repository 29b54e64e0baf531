//! Access to the machine: vector units, the buffer pool, and settings of the whole process.

pub(crate) mod buffer_pool;
#[cfg(feature = "python")]
pub(crate) mod process;
pub mod processor;

pub(crate) use buffer_pool::release;
