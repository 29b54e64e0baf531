//! Files that are mapped into memory and become shorter: the system then ends the process, with a signal and no word.

#[cfg(unix)]
use std::sync::OnceLock;

/// What is said, and the exit code.
#[cfg(unix)]
static LAST: OnceLock<(Vec<u8>, i32)> = OnceLock::new();

/// From now on the process ends with this line on standard error and this exit code where it would end with SIGBUS.
///
/// For programs only: a library leaves signals alone. The first line stays. Windows has no such signal.
#[cfg(unix)]
pub fn end_with(line: &str, code: i32) {
    LAST.get_or_init(|| (line.as_bytes().to_vec(), code));
    let handler: extern "C" fn(libc::c_int) = told;
    // SAFETY: `told` has the signature of a handler and calls only what POSIX allows in one.
    unsafe { libc::signal(libc::SIGBUS, handler as libc::sighandler_t) };
}

#[cfg(not(unix))]
pub fn end_with(_line: &str, _code: i32) {}

#[cfg(unix)]
extern "C" fn told(_: libc::c_int) {
    if let Some((line, code)) = LAST.get() {
        // SAFETY: both calls are allowed in a handler; `line` is whole and never freed.
        unsafe {
            libc::write(libc::STDERR_FILENO, line.as_ptr().cast(), line.len());
            libc::_exit(*code);
        }
    }
}
