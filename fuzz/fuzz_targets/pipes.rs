//! Fuzz target: a log read through a pipe in pieces of any size.
#![no_main]

#[path = "../../tests/common/logs.rs"]
mod logs;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| logs::pipes(bytes));
