//! What the machine offers, below everything else: vector units, large buffers, what a program says of files cut under it.

pub mod maps;
pub mod pages;
pub mod processor;
