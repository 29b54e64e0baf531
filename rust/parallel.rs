//! Work on several threads, with results that do not depend on the number of threads.
//!
//! The workers are the calling thread and threads of rayon's pool. So a short call does not wait for a thread to wake
//! up, and two processors run two threads, not three. The operating system decides where each thread runs.
//!
//! `par_chunks_mut` is not used because it halves the slice and hands out the halves out of order. The blocks of the
//! noise generator must start in order, or workers wait for each other. Each worker also keeps its own buffers.
//!
//! Measured on 2026-11-22 on two cores, against threads created for each call and bound to a free processor. The wall
//! time was 0.99 to 1.02 of theirs for `oadev` of 1e6 and 1e7 samples (13.9 ms and 152 ms, octaves and 90 factors).
//! The ratio was 0.89 to 1.00 for colored noise.

mod pool;

use std::mem::take;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::{Error, Result};
pub use pool::pooled;

/// Results of `work(state, item)` for every item, in the order of the items. Each worker has its own state. Items are
/// handed out in order. An item is a number of a range or a chunk of a slice; a worker writes its chunk without a
/// lock. A panic in `work` sets `stop`, ends all workers and panics in the caller.
pub(crate) fn for_each<S, I, R, M, W>(
    threads: usize,
    items: I,
    stop: &AtomicBool,
    make: M,
    work: W,
) -> Result<Vec<R>>
where
    I: ExactSizeIterator + Send,
    I::Item: Send,
    R: Send,
    M: Fn() -> S + Sync,
    W: Fn(&mut S, I::Item) -> R + Sync,
{
    let count = items.len();
    let wanted = || !stop.load(Ordering::Relaxed);
    if threads <= 1 || count <= 1 {
        let mut state = make();
        let done: Vec<R> = items.take_while(|_| wanted()).map(|item| work(&mut state, item)).collect();
        return check(stop).map(|()| done);
    }
    let items = Mutex::new(items.enumerate());
    let done: Mutex<Vec<(usize, R)>> = Mutex::new(Vec::with_capacity(count));
    pool::run_also_on(threads.min(count) - 1, &|| {
        let _guard = EndOthers(stop);
        let mut state = make();
        while wanted() {
            let next = locked(&items).next();
            let Some((place, item)) = next else { return };
            let result = work(&mut state, item);
            locked(&done).push((place, result));
        }
    })?;
    check(stop)?;
    let mut done = take(&mut *locked(&done));
    done.sort_unstable_by_key(|(place, _)| *place);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

/// Sets the stop flag when its thread panics. So the other workers start no further items, and none waits for the item
/// that panicked.
struct EndOthers<'a>(&'a AtomicBool);

impl Drop for EndOthers<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

/// Error if the caller wants to stop.
pub(crate) fn check(stop: &AtomicBool) -> Result<()> {
    if stop.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
}

/// Lock of a mutex, even if a thread has panicked while it held the lock. The caller reports that panic.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Number of processors available to this process: the default number of threads.
pub fn default_threads() -> usize {
    static COUNT: std::sync::OnceLock<usize> = std::sync::OnceLock::new();
    *COUNT.get_or_init(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn results_come_in_the_order_of_the_items(count in 0_usize..300, threads in 0_usize..9) {
            let stop = AtomicBool::new(false);
            let found = for_each(threads, 0..count, &stop, || 0, |_, item| item * item).unwrap();
            prop_assert!(found.into_iter().eq((0..count).map(|item| item * item)));
        }
    }

    #[test]
    fn a_panic_in_a_worker_reaches_the_caller_and_the_pool_survives() {
        for threads in [1, 2, 7] {
            for bad in [0, 17, 99] {
                let work = |(): &mut (), item: usize| {
                    assert_ne!(item, bad, "a bug in one item");
                    item
                };
                let stop = AtomicBool::new(false);
                let caught = catch_unwind(AssertUnwindSafe(|| for_each(threads, 0..100, &stop, || (), work)));
                assert!(caught.is_err(), "{threads} threads");
            }
            let stop = AtomicBool::new(false);
            let sum: usize = for_each(threads, 0..100, &stop, || (), |(), item| item).unwrap().iter().sum();
            assert_eq!(sum, 4950);
        }
    }

    #[test]
    fn a_panic_in_a_worker_ends_the_others() {
        let (stop, later) = (AtomicBool::new(false), AtomicUsize::new(0));
        let work = |(): &mut (), item: usize| {
            assert_ne!(item, 5, "a bug in one item");
            if item == 4 {
                // As a block of noise that waits for a block of another worker.
                while !stop.load(Ordering::Relaxed) {
                    std::thread::yield_now();
                }
            }
            later.fetch_add(usize::from(item > 5), Ordering::Relaxed);
            std::thread::sleep(Duration::from_millis(1));
        };
        let caught = catch_unwind(AssertUnwindSafe(|| for_each(3, 0..10_000, &stop, || (), work)));
        assert!(caught.is_err());
        // All items take more than 3 s; unwinding takes far less than 1 s, even on a busy machine.
        assert!(later.into_inner() < 2_000);
    }

    #[test]
    fn the_stop_flag_ends_the_work() {
        for threads in [1, 3] {
            let stop = AtomicBool::new(false);
            let work = |(): &mut (), item: usize| stop.fetch_or(item == 5, Ordering::Relaxed);
            assert_eq!(for_each(threads, 0..1_000_000, &stop, || (), work), Err(Error::Interrupted));
        }
    }
}
