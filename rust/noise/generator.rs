//! Sum of several processes, on any number of threads.
//!
//! A worker draws the deviates of some blocks of one process and waits until the earlier blocks have passed through
//! the recursion. Then it runs the recursion, adds the samples to the sum, and turns to the next process. So the
//! workers follow each other through the list of processes. The samples of the processes are always added in the
//! order of the list.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::Duration;

use super::simple::add;
use super::{Deviates, Primitive, Process, process};
use crate::machine::buffer_pool::Unwritten;
use crate::machine::processor::Width;
use crate::parallel::{default_threads, for_each};
use crate::rng::{Stream, StreamKey};
use crate::{Error, Result};

/// Number of samples of a block. Each block has its own random stream, so another length would change the record of a
/// seed. 32 KiB fit into a first-level cache, and starting a stream is cheap compared with drawing a block.
pub(super) const BLOCK: usize = 4096;
/// Number of samples computed at a time if no other block waits. With a copy for the sum they fill half of a
/// first-level cache.
const PART: usize = 1024;
/// Number of blocks of a work item. Handing a recursion from processor to processor takes time. Chosen by judgment;
/// not measured.
const ITEM_BLOCKS: usize = 4;
/// Minimum number of work items for a second thread. Chosen by judgment; not measured.
const MIN_THREADED_ITEMS: usize = 4;
/// How often a waiting worker checks the stop flag.
const CHECK_PERIOD: Duration = Duration::from_millis(20);

/// One process of the sum, with the streams that drive it.
struct Component {
    deviates: Deviates,
    key: StreamKey,
    recursion: Mutex<Recursion>,
    /// Signals that the recursion has moved on to another block.
    passed: Condvar,
}

/// State of a process, which passes through the blocks in order.
struct Recursion {
    /// Number of the next block.
    next_block: u64,
    process: Box<dyn Process>,
}

impl Component {
    /// Component at its first block; `key` selects its random numbers.
    fn new(process: Box<dyn Process>, key: StreamKey) -> Self {
        Self {
            deviates: process.deviates(),
            key,
            recursion: Mutex::new(Recursion { next_block: 0, process }),
            passed: Condvar::new(),
        }
    }

    /// Computes the samples of whole blocks in `scratch`, in parts that are passed to `give`; false if the caller wants
    /// to stop.
    fn generate(
        &self,
        first: u64,
        scratch: &mut [f64],
        stop: &AtomicBool,
        mut give: impl FnMut(usize, &[f64]),
    ) -> bool {
        // The usual case: the recursion is free, and this block is the next one.
        let mine = self.recursion.try_lock().ok().filter(|recursion| recursion.next_block == first);
        let ahead = mine.is_none();
        let mut recursion = if let Some(recursion) = mine {
            recursion
        } else {
            // The deviates can be drawn while the recursion is busy.
            for (block, scratch) in (first..).zip(scratch.chunks_exact_mut(BLOCK)) {
                self.deviates.draw(&mut Stream::new(self.key, block), scratch);
            }
            let Some(recursion) = self.wait(first, stop) else { return false };
            recursion
        };
        let blocks = (scratch.len() / BLOCK) as u64;
        for (i, scratch) in scratch.chunks_exact_mut(BLOCK).enumerate() {
            let mut stream = Stream::new(self.key, first + i as u64);
            for (j, part) in scratch.chunks_exact_mut(PART).enumerate() {
                if !ahead {
                    self.deviates.draw(&mut stream, part);
                }
                recursion.process.run(part);
                give(i * BLOCK + j * PART, part);
            }
        }
        recursion.next_block = first + blocks;
        drop(recursion);
        self.passed.notify_all();
        true
    }

    /// Waits until `block` is the next block of the recursion; `None` if the caller wants to stop or a process has
    /// panicked.
    fn wait(&self, block: u64, stop: &AtomicBool) -> Option<MutexGuard<'_, Recursion>> {
        let mut recursion = self.recursion.lock().ok()?;
        while recursion.next_block != block {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            (recursion, _) = self.passed.wait_timeout(recursion, CHECK_PERIOD).ok()?;
        }
        Some(recursion)
    }
}

/// Stream number of a process that is preceded by `before` processes of the same kind. It depends only on the name
/// and `before`. So different effects of one seed are independent, and an effect is the same whatever other effects
/// are simulated.
fn stream_number(name: &str, before: usize) -> u64 {
    // FNV-1a hash of the name.
    let hash = name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    u64::wrapping_add(hash, before as u64)
}

/// Generator of the samples of a sum of processes.
pub struct Generator {
    components: Vec<Component>,
    block: u64,
    /// The current block, of which the first `used` samples have been returned.
    ready: Vec<f64>,
    used: usize,
    threads: usize,
    /// True if an interrupt has left the processes at different blocks.
    interrupted: bool,
}

impl Generator {
    /// Generator of a sum of processes. The low-frequency end of the spectra is designed for records of `total`
    /// samples, but more samples may be drawn. `threads` = 0 uses all processors.
    pub fn new(
        processes: &[Primitive],
        total: usize,
        seed: u64,
        replicate: u64,
        axis: u64,
        threads: usize,
    ) -> Result<Self> {
        let components = processes
            .iter()
            .enumerate()
            .map(|(effect, primitive)| {
                let name = primitive.name();
                let same = processes[..effect].iter().filter(|other| other.name() == name).count();
                let key = StreamKey { seed, replicate, effect: stream_number(name, same), axis };
                Ok(Component::new(process(primitive, total, key)?, key))
            })
            .collect::<Result<_>>()?;
        let threads = if threads == 0 { default_threads() } else { threads };
        Ok(Self { components, block: 0, ready: vec![0.0; BLOCK], used: BLOCK, threads, interrupted: false })
    }

    /// Writes the next `out.len()` samples. Error if the generator was interrupted before.
    pub fn fill<'o>(&mut self, out: impl Into<Unwritten<'o>>, stop: &AtomicBool) -> Result<()> {
        let out = out.into();
        if self.interrupted {
            return Err(Error::Input("the stream of samples was interrupted: begin a new one".into()));
        }
        let begun = out.len().min(BLOCK - self.used);
        let (head, rest) = out.split_at(begun);
        head.copy_from(&self.ready[self.used..][..begun]);
        self.used += begun;
        let whole = rest.len() / BLOCK * BLOCK;
        let (whole, tail) = rest.split_at(whole);
        self.blocks(whole, stop)?;
        if tail.len() > 0 {
            let mut ready = std::mem::take(&mut self.ready);
            self.blocks(ready.as_mut_slice().into(), stop)?;
            self.used = tail.len();
            tail.copy_from(&ready[..self.used]);
            self.ready = ready;
        }
        Ok(())
    }

    /// Writes whole blocks.
    fn blocks(&mut self, out: Unwritten<'_>, stop: &AtomicBool) -> Result<()> {
        let blocks = (out.len() / BLOCK) as u64;
        let items = out.chunks(ITEM_BLOCKS * BLOCK).enumerate();
        let threads = if items.len() < MIN_THREADED_ITEMS { 1 } else { self.threads };
        self.interrupted = true;
        for_each(threads, items, stop, Vec::new, |scratch, (item, sum)| {
            scratch.resize(sum.len(), 0.0);
            self.sum(self.block + (item * ITEM_BLOCKS) as u64, sum, scratch, stop);
        })?;
        self.interrupted = false;
        self.block += blocks;
        Ok(())
    }

    /// Writes the sum of all processes over blocks from `first` on.
    fn sum(&self, first: u64, sum: Unwritten<'_>, scratch: &mut [f64], stop: &AtomicBool) {
        let Some((component, others)) = self.components.split_first() else {
            sum.zeroed();
            return;
        };
        // SAFETY: `generate` draws deviates into each part before a process reads it. If it stops before the last part,
        // nobody reads the sum, because the work ends with an error.
        let sum = unsafe { sum.overwritten() };
        let width = Width::best();
        let mut running = component.generate(first, sum, stop, |_, _| ());
        for component in others {
            running = running
                && component
                    .generate(first, scratch, stop, |at, part| add(width, &mut sum[at..][..PART], part));
        }
    }
}
