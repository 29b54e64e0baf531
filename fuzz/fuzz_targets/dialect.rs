//! Fuzz target: arbitrary first lines with arbitrary reader options.
#![no_main]

#[path = "../../tests/common/logs.rs"]
mod logs;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| logs::dialect(bytes));
