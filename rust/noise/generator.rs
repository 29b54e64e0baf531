//! The sum of several processes, on any number of threads.
//!
//! A worker draws the deviates of some blocks of one process, waits until those before have gone through its recursion,
//! runs it, adds the samples to the sum, and turns to the next process. Workers thus follow each other through the
//! list of processes. The samples of the processes are added in their order, always.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::Duration;

use super::simple::add;
use super::{Deviates, Process, process};
use crate::parallel::{default_threads, for_each};
use crate::rng::{Stream, StreamKey};
use crate::{Error, Result};

/// Samples of a block, each block drawn from its own stream. Another length would make another record of
/// the same seed. 32 KiB fit a first-level cache, and so many deviates outweigh the start of a stream.
pub const BLOCK: usize = 4096;
/// Samples made at a time where no other block waits: with a copy for the sum they fill half of a first-level cache.
const PART: usize = 1024;
/// Blocks of an item of work: handing a recursion from processor to processor takes time.
const ITEM: usize = 4;
/// Fewer items are not worth a second thread.
const FEW: usize = 4;
/// How often one that waits for its turn looks whether it is still wanted.
const LOOK: Duration = Duration::from_millis(20);

struct Voice {
    deviates: Deviates,
    key: StreamKey,
    recursion: Mutex<Recursion>,
    /// The turn has changed.
    passed: Condvar,
}

struct Recursion {
    /// The block whose turn it is.
    turn: u64,
    process: Box<dyn Process>,
}

impl Voice {
    fn new(process: Box<dyn Process>, key: StreamKey) -> Self {
        Self {
            deviates: process.deviates(),
            key,
            recursion: Mutex::new(Recursion { turn: 0, process }),
            passed: Condvar::new(),
        }
    }

    /// Makes the samples of whole blocks in `room`, in parts that are then handed on; false if the caller has asked to
    /// stop.
    fn make(
        &self,
        first: u64,
        room: &mut [f64],
        stop: &AtomicBool,
        mut give: impl FnMut(usize, &[f64]),
    ) -> bool {
        // The recursion is free and this block is next.
        let mine = self.recursion.try_lock().ok().filter(|recursion| recursion.turn == first);
        let ahead = mine.is_none();
        let mut recursion = if let Some(recursion) = mine {
            recursion
        } else {
            // The deviates, at least, need not wait.
            for (block, room) in (first..).zip(room.chunks_exact_mut(BLOCK)) {
                self.deviates.draw(&mut Stream::new(self.key, block), room);
            }
            let Some(recursion) = self.wait(first, stop) else { return false };
            recursion
        };
        let blocks = (room.len() / BLOCK) as u64;
        for (i, room) in room.chunks_exact_mut(BLOCK).enumerate() {
            let mut stream = Stream::new(self.key, first + i as u64);
            for (j, part) in room.chunks_exact_mut(PART).enumerate() {
                if !ahead {
                    self.deviates.draw(&mut stream, part);
                }
                recursion.process.run(part);
                give(i * BLOCK + j * PART, part);
            }
        }
        recursion.turn = first + blocks;
        drop(recursion);
        self.passed.notify_all();
        true
    }

    /// The recursion when it is the turn of `block`; nothing if the caller has asked to stop, or a process panicked.
    fn wait(&self, block: u64, stop: &AtomicBool) -> Option<MutexGuard<'_, Recursion>> {
        let mut recursion = self.recursion.lock().ok()?;
        while recursion.turn != block {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            (recursion, _) = self.passed.wait_timeout(recursion, LOOK).ok()?;
        }
        Some(recursion)
    }
}

/// Number of the streams of a process, of which so many of the same kind stand before it in the list: two records of one
/// seed, each of another effect, are independent, and the same effect is the same in whatever company.
fn number(name: &str, before: usize) -> u64 {
    // FNV-1a: a name is a few bytes.
    let hash = name
        .bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    u64::wrapping_add(hash, before as u64)
}

/// A stream of samples of a sum of processes.
pub struct Generator {
    voices: Vec<Voice>,
    block: u64,
    /// The block that is being handed out, from `used` on.
    ready: Vec<f64>,
    used: usize,
    threads: usize,
    /// Some processes may be further than others.
    interrupted: bool,
}

impl Generator {
    /// `processes` are (name, values) as the module's table lists them; `total` is the length of the record
    /// that the slow end of the spectra is designed for (more samples may be drawn); `threads` = 0 takes
    /// all there are.
    pub fn new<S: AsRef<str>, V: AsRef<[f64]>>(
        processes: &[(S, V)],
        total: usize,
        seed: u64,
        replicate: u64,
        axis: u64,
        threads: usize,
    ) -> Result<Self> {
        let voices = processes
            .iter()
            .enumerate()
            .map(|(effect, (name, values))| {
                let same = processes[..effect].iter().filter(|(other, _)| other.as_ref() == name.as_ref());
                let key = StreamKey { seed, replicate, effect: number(name.as_ref(), same.count()), axis };
                Ok(Voice::new(process(name.as_ref(), values.as_ref(), total, key)?, key))
            })
            .collect::<Result<_>>()?;
        let threads = if threads == 0 { default_threads() } else { threads };
        Ok(Self { voices, block: 0, ready: vec![0.0; BLOCK], used: BLOCK, threads, interrupted: false })
    }

    /// The next `out.len()` samples. A stream that was interrupted has no next ones.
    pub fn fill(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        if self.interrupted {
            return Err(Error::Input("the stream of samples was interrupted: begin a new one".into()));
        }
        let begun = out.len().min(BLOCK - self.used);
        let (head, rest) = out.split_at_mut(begun);
        head.copy_from_slice(&self.ready[self.used..][..begun]);
        self.used += begun;
        let (whole, tail) = rest.split_at_mut(rest.len() / BLOCK * BLOCK);
        self.blocks(whole, stop)?;
        if !tail.is_empty() {
            let mut ready = std::mem::take(&mut self.ready);
            self.blocks(&mut ready, stop)?;
            tail.copy_from_slice(&ready[..tail.len()]);
            self.used = tail.len();
            self.ready = ready;
        }
        Ok(())
    }

    /// Whole blocks.
    fn blocks(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        let blocks = (out.len() / BLOCK) as u64;
        let items = out.chunks_mut(ITEM * BLOCK).enumerate();
        let threads = if items.len() < FEW { 1 } else { self.threads };
        self.interrupted = true;
        for_each(threads, items, stop, Vec::new, |room, (item, sum)| {
            room.resize(sum.len(), 0.0);
            self.sum(self.block + (item * ITEM) as u64, sum, room, stop);
        })?;
        self.interrupted = false;
        self.block += blocks;
        Ok(())
    }

    /// The samples of the blocks from `first` on of all processes.
    fn sum(&self, first: u64, sum: &mut [f64], room: &mut [f64], stop: &AtomicBool) {
        let Some((voice, others)) = self.voices.split_first() else {
            sum.fill(0.0);
            return;
        };
        let mut going = voice.make(first, sum, stop, |_, _| ());
        for voice in others {
            going = going && voice.make(first, room, stop, |at, part| add(&mut sum[at..][..PART], part));
        }
    }
}
