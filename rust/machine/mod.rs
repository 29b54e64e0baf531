//! The machine, below everything else: vector units, the buffer pool, what a program says of files cut under it.

pub mod buffer_pool;
pub mod maps;
pub mod processor;
