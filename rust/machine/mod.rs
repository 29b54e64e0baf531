//! What the machine offers, below everything else: vector units, large buffers.

pub mod pages;
pub mod processor;
