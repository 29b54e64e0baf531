//! Threads over blocks of samples, with results that do not depend on their number.

mod pool;
mod seats;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::{Error, Result};
pub use pool::pooled;
use seats::Seats;

/// Does `work(state, i)` for every item `i`, each worker with a state of its own, and returns the results in the
/// order of the items. The calling thread is the first worker: short calls then do not wait for a wake-up.
pub fn for_each<S, R, M, W>(
    threads: usize,
    items: usize,
    stop: &AtomicBool,
    make: M,
    work: W,
) -> Result<Vec<R>>
where
    R: Send,
    M: Fn() -> S + Sync,
    W: Fn(&mut S, usize) -> R + Sync,
{
    let threads = threads.clamp(1, items.max(1));
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, R)>> = Mutex::new(Vec::with_capacity(items));
    let worker = || {
        let mut state = make();
        loop {
            let item = next.fetch_add(1, Ordering::Relaxed);
            if item >= items || stop.load(Ordering::Relaxed) {
                return;
            }
            let result = work(&mut state, item);
            done.lock().expect("no worker panics while it holds the lock").push((item, result));
        }
    };
    if threads == 1 {
        worker();
    } else {
        let seats = Seats::default();
        seats.take();
        std::thread::scope(|scope| {
            for _ in 1..threads {
                scope.spawn(|| {
                    seats.take();
                    worker();
                });
                // Yield so that a worker queued behind this thread can start elsewhere.
                std::thread::yield_now();
            }
            worker();
        });
    }
    if stop.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    let mut done = done.into_inner().expect("every worker has ended");
    done.sort_unstable_by_key(|(item, _)| *item);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

/// Threads to use when the caller does not say.
pub fn default_threads() -> usize {
    static COUNT: std::sync::OnceLock<usize> = std::sync::OnceLock::new();
    *COUNT.get_or_init(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}
