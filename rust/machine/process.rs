//! Settings of the whole process: the allocator, and the message on SIGBUS when a mapped file is truncated.
//!
//! A library must not change the allocator of its process or handle signals. So [`trim`] has no effect until a program
//! has called [`own_process`] at its start, and only programs call [`end_with`].

#[cfg(unix)]
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// True if this process belongs to a program of the package.
static IS_OWNED: AtomicBool = AtomicBool::new(false);

/// Declares that this process belongs to a program of the package, and limits the allocator to two arenas for all
/// threads. With many arenas, memory freed in one cannot be used by the others.
pub(crate) fn own_process() {
    IS_OWNED.store(true, Ordering::Relaxed);
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: sets a parameter of the allocator. A refusal costs only memory.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 2);
    }
}

/// Returns memory that the allocator has cached after frees to the system, if a program owns the process. Returns
/// whether it did.
pub(crate) fn trim() -> bool {
    if !IS_OWNED.load(Ordering::Relaxed) {
        return false;
    }
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: touches only free memory, and may be called at any time from any thread.
    unsafe {
        libc::malloc_trim(0);
    }
    true
}

/// Message to print and exit code.
#[cfg(unix)]
static FINAL_MESSAGE: OnceLock<(Vec<u8>, i32)> = OnceLock::new();

/// Installs a handler for SIGBUS that prints this line to standard error and exits with this code.
///
/// Without it, the process would end without a message when a mapped file is truncated. The line of the first call is
/// kept. Windows has no such signal, so the function does nothing there.
#[cfg(unix)]
pub(crate) fn end_with(line: &str, code: i32) {
    FINAL_MESSAGE.get_or_init(|| (line.as_bytes().to_vec(), code));
    let handler: extern "C" fn(libc::c_int) = print_and_exit;
    // SAFETY: `print_and_exit` has the signature of a handler and calls only functions that POSIX allows in handlers.
    unsafe { libc::signal(libc::SIGBUS, handler as libc::sighandler_t) };
}

#[cfg(not(unix))]
pub(crate) fn end_with(_line: &str, _code: i32) {}

/// Handler of SIGBUS: prints the line of [`end_with`] and ends the process with its exit code.
#[cfg(unix)]
extern "C" fn print_and_exit(_: libc::c_int) {
    if let Some((line, code)) = FINAL_MESSAGE.get() {
        // SAFETY: POSIX allows both calls in a signal handler; `line` is complete and never freed.
        unsafe {
            libc::write(libc::STDERR_FILENO, line.as_ptr().cast(), line.len());
            libc::_exit(*code);
        }
    }
}
