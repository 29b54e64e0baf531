//! Fuzz target: arbitrary bytes as a log, read as a whole, in pieces, and with infinities refused.
#![no_main]

#[path = "../../tests/common/logs.rs"]
mod logs;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| logs::text(bytes));
