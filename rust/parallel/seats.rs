//! A processor for each worker.
//!
//! A new thread may be put on the processor of the one that made it and wait there for its turn while others have
//! nothing to do: virtual machines whose scheduler gathers threads on few processors do so. Of two workers that meet on
//! a processor, the second asks for another one.

use std::sync::Mutex;

#[cfg(all(target_os = "linux", not(miri)))]
use linux::Set;
#[cfg(not(all(target_os = "linux", not(miri))))]
use none::Set;

/// Processors on which workers of one call have begun.
#[derive(Default)]
pub struct Seats(Mutex<Set>);

impl Seats {
    /// Takes the processor of this thread, or moves the thread to one that is free. Where none is, or where the system
    /// refuses, the thread stays.
    pub fn take(&self) {
        self.0.lock().expect("no worker panics while it looks for a seat").take();
    }
}

#[cfg(all(target_os = "linux", not(miri)))]
mod linux {
    use libc::{CPU_CLR, CPU_COUNT, CPU_ISSET, CPU_SET, CPU_SETSIZE, cpu_set_t};

    /// A set of processors.
    pub struct Set(cpu_set_t);

    impl Default for Set {
        fn default() -> Self {
            // SAFETY: an array of bits, of which none set is the empty set.
            Self(unsafe { std::mem::zeroed() })
        }
    }

    impl Set {
        fn has(&self, processor: usize) -> bool {
            // SAFETY: the number is below the size of the set.
            unsafe { CPU_ISSET(processor, &self.0) }
        }

        fn len(&self) -> i32 {
            // SAFETY: a count of bits.
            unsafe { CPU_COUNT(&self.0) }
        }

        /// Takes the processor of this thread, or another.
        pub fn take(&mut self) {
            let Some(mut processor) = here() else { return };
            if self.has(processor) {
                let Some(other) = self.leave() else { return };
                processor = other;
            }
            // SAFETY: the number is below the size of the set.
            unsafe { CPU_SET(processor, &mut self.0) };
        }

        /// Moves this thread to a processor that is not in the set, and lets it run on all of its own again.
        fn leave(&self) -> Option<usize> {
            let own = allowed()?;
            let mut free = Self(own.0);
            for processor in (0..CPU_SETSIZE as usize).filter(|processor| self.has(*processor)) {
                // SAFETY: the number is below the size of the set.
                unsafe { CPU_CLR(processor, &mut free.0) };
            }
            if free.len() == 0 || !allow(&free) {
                return None;
            }
            let processor = here();
            allow(&own);
            processor
        }
    }

    /// The processor that this thread runs on, if a set can hold it.
    fn here() -> Option<usize> {
        // SAFETY: takes nothing, returns a number, negative where there is none.
        let processor = usize::try_from(unsafe { libc::sched_getcpu() }).ok();
        processor.filter(|processor| *processor < CPU_SETSIZE as usize)
    }

    /// The processors that this thread may run on.
    fn allowed() -> Option<Set> {
        let mut set = Set::default();
        // SAFETY: as many bytes as the set has are written to it; 0 is this thread.
        let answer = unsafe { libc::sched_getaffinity(0, size_of::<cpu_set_t>(), &raw mut set.0) };
        (answer == 0).then_some(set)
    }

    /// Whether this thread now runs on a processor of the set.
    fn allow(set: &Set) -> bool {
        // SAFETY: as many bytes as the set has are read; 0 is this thread.
        unsafe { libc::sched_setaffinity(0, size_of::<cpu_set_t>(), &raw const set.0) == 0 }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn the_second_of_two_moves_where_it_can() {
            let own = allowed().map_or(0, |set| set.len());
            let mut seats = Set::default();
            seats.take();
            seats.take();
            assert_eq!(seats.len(), own.min(2), "of {own} processors");
            assert_eq!(allowed().map_or(0, |set| set.len()), own, "it may run where it could before");
        }
    }
}

#[cfg(not(all(target_os = "linux", not(miri))))]
mod none {
    /// Nothing: threads stay where the system puts them.
    #[derive(Default)]
    pub struct Set;

    impl Set {
        #[allow(clippy::unused_self)] // as the other one
        pub fn take(&mut self) {}
    }
}
