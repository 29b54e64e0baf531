//! The thread pool of this process.
//!
//! A forked process inherits the memory of its parent but none of its threads. Work sent to the parent's pool would
//! wait forever. So a pool belongs to the process that created it, and a forked process creates its own pool on first
//! use.

use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, Ordering};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::default_threads;
use crate::{Error, Result};

struct Owned {
    process: u32,
    pool: ThreadPool,
}

/// Atomic pointer instead of a lock, because a forked process could inherit a locked lock.
static POOL: AtomicPtr<Owned> = AtomicPtr::new(null_mut());

/// Result of `work` inside the pool of this process, so that rayon's parallel iterators use it. Error if the pool
/// cannot start its threads.
pub fn pooled<R: Send>(work: impl FnOnce() -> R + Send) -> Result<R> {
    Ok(pool()?.install(work))
}

/// Runs `work` on the calling thread and on up to `others` threads of the pool.
pub(super) fn run_also_on(others: usize, work: &(impl Fn() + Sync)) -> Result<()> {
    pool()?.in_place_scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| work());
        }
        work();
    });
    Ok(())
}

/// The pool of this process, created on first use.
fn pool() -> Result<&'static ThreadPool> {
    let process = std::process::id();
    let known = POOL.load(Ordering::Acquire);
    // SAFETY: null, or made below from a box that is never freed.
    if let Some(owned) = unsafe { known.as_ref() }
        && owned.process == process
    {
        return Ok(&owned.pool);
    }
    let builder = ThreadPoolBuilder::new().num_threads(default_threads());
    let pool = builder.build().map_err(|error| Error::no_thread(&error))?;
    let made = Box::into_raw(Box::new(Owned { process, pool }));
    Ok(match POOL.compare_exchange(known, made, Ordering::AcqRel, Ordering::Acquire) {
        // SAFETY: made above and never freed. A pool found here belongs to the parent process, whose threads do not
        // exist in this process and cannot be joined, so it is not freed.
        Ok(_) => unsafe { &(*made).pool },
        Err(other) => {
            // SAFETY: another thread of this process was quicker; no other thread has seen this pool.
            drop(unsafe { Box::from_raw(made) });
            // SAFETY: not null, because the other thread has just stored it, and never freed.
            unsafe { &(*other).pool }
        }
    })
}
