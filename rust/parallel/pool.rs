//! Threads that wait for work, of this process.
//!
//! A forked process has the memory of its parent but none of its threads: work given to the parent's would wait for
//! ever. So a pool belongs to the process that made it, and a fork makes its own when it first needs one.

use std::ptr::null_mut;
use std::sync::atomic::{AtomicPtr, Ordering};

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::default_threads;

struct Owned {
    process: u32,
    pool: ThreadPool,
}

/// No lock, which a fork could inherit closed.
static POOL: AtomicPtr<Owned> = AtomicPtr::new(null_mut());

/// Does `work` where its parallel iterators find the threads of this process.
pub fn pooled<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    pool().install(work)
}

/// Does `work` here and on `others` threads of the pool, as far as it has them.
pub fn beside(others: usize, work: &(impl Fn() + Sync)) {
    pool().in_place_scope(|scope| {
        for _ in 0..others {
            scope.spawn(|_| work());
        }
        work();
    });
}

fn pool() -> &'static ThreadPool {
    let process = std::process::id();
    let known = POOL.load(Ordering::Acquire);
    // SAFETY: null, or made below from a box that is never freed.
    if let Some(owned) = unsafe { known.as_ref() }
        && owned.process == process
    {
        return &owned.pool;
    }
    let pool =
        ThreadPoolBuilder::new().num_threads(default_threads()).build().expect("the system gives threads");
    let made = Box::into_raw(Box::new(Owned { process, pool }));
    match POOL.compare_exchange(known, made, Ordering::AcqRel, Ordering::Acquire) {
        // SAFETY: made above and never freed. What was there belongs to the parent: its threads are not here to be
        // joined, so it is left alone.
        Ok(_) => unsafe { &(*made).pool },
        Err(other) => {
            // SAFETY: another thread of this process was quicker; no other thread has seen this pool.
            drop(unsafe { Box::from_raw(made) });
            // SAFETY: as above: not null, for it has just been put there, and never freed.
            unsafe { &(*other).pool }
        }
    }
}
