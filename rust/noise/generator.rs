//! The sum of several processes, on any number of threads.
//!
//! On one thread the samples of all processes are made and added in parts that stay in the nearest cache. On several, work
//! goes in rounds of some blocks, one task a process; a process that would keep the others waiting has the
//! deviates of its next round drawn while its recursion runs over this one. The samples of the processes are
//! added in their order, always.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::simple::add;
use super::{Deviates, Process, process};
use crate::rng::{Stream, StreamKey};
use crate::{Error, Result};

/// Samples of a block, each drawn from its own stream.
pub const BLOCK: usize = 4096;
/// Samples made at a time: with a copy for the sum they fill half of a first-level cache.
const PART: usize = 1024;
/// Blocks of a round: the samples of four processes fill the second-level caches of two cores.
const ROUND: usize = 8;
/// Fewer blocks are not worth a second thread.
const FEW: u64 = 2 * ROUND as u64;

struct Voice {
    process: Box<dyn Process>,
    deviates: Deviates,
    key: StreamKey,
    /// Samples of this round, or the deviates that become them.
    now: Vec<f64>,
    /// Deviates of the next round, where they are drawn beforehand.
    ahead: Vec<f64>,
}

impl Voice {
    /// Time of a sample, in that of drawing a deviate.
    fn cost(&self) -> f64 {
        1.0 + self.process.cost()
    }

    fn stream(&self, block: u64) -> Stream {
        Stream::new(self.key, block)
    }

    /// The next samples.
    fn make(&mut self, stream: &mut Stream, samples: &mut [f64]) {
        self.deviates.draw(stream, samples);
        self.process.run(samples);
    }

    /// Samples of whole blocks.
    fn round(&mut self, from: u64, samples: &mut [f64]) {
        for (block, samples) in (from..).zip(samples.chunks_exact_mut(BLOCK)) {
            let stream = &mut self.stream(block);
            for part in samples.chunks_exact_mut(PART) {
                self.make(stream, part);
            }
        }
    }

    /// Samples of whole blocks, into `now`.
    fn round_apart(&mut self, from: u64, blocks: usize) {
        let mut now = std::mem::take(&mut self.now);
        now.resize(blocks * BLOCK, 0.0);
        self.round(from, &mut now);
        self.now = now;
    }
}

/// A stream of samples of a sum of processes.
pub struct Generator {
    voices: Vec<Voice>,
    block: u64,
    /// The block that is being handed out, from `used` on.
    ready: Vec<f64>,
    used: usize,
    pool: Option<rayon::ThreadPool>,
    threads: usize,
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
                let key = StreamKey { seed, replicate, effect: effect as u64, axis };
                let process = process(name.as_ref(), values.as_ref(), total, key)?;
                Ok(Voice { deviates: process.deviates(), process, key, now: Vec::new(), ahead: Vec::new() })
            })
            .collect::<Result<_>>()?;
        Ok(Self { voices, block: 0, ready: vec![0.0; BLOCK], used: BLOCK, pool: None, threads })
    }

    /// The next `out.len()` samples.
    pub fn fill(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        let begun = out.len().min(BLOCK - self.used);
        let (head, rest) = out.split_at_mut(begun);
        head.copy_from_slice(&self.ready[self.used..][..begun]);
        self.used += begun;
        let (whole, tail) = rest.split_at_mut(rest.len() / BLOCK * BLOCK);
        if self.threads == 1 || ((whole.len() / BLOCK) as u64) < FEW {
            self.alone(whole, stop)?;
        } else if self.threads == 0 {
            self.rounds(whole, stop)?;
        } else {
            self.in_pool(whole, stop)?;
        }
        if !tail.is_empty() {
            let mut ready = std::mem::take(&mut self.ready);
            self.alone(&mut ready, stop)?;
            tail.copy_from_slice(&ready[..tail.len()]);
            self.used = tail.len();
            self.ready = ready;
        }
        Ok(())
    }

    fn in_pool(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        let pool = match self.pool.take() {
            Some(pool) => pool,
            None => rayon::ThreadPoolBuilder::new()
                .num_threads(self.threads)
                .build()
                .map_err(|error| Error::Input(format!("{} threads: {error}", self.threads)))?,
        };
        let result = pool.install(|| self.rounds(out, stop));
        self.pool = Some(pool);
        result
    }

    /// Whole blocks on this thread.
    fn alone(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        let mut scratch = [0.0; PART];
        for block in out.chunks_exact_mut(BLOCK) {
            check(stop)?;
            let mut streams: Vec<_> = self.voices.iter().map(|voice| voice.stream(self.block)).collect();
            for part in block.chunks_exact_mut(PART) {
                let mut voices = self.voices.iter_mut().zip(&mut streams);
                match voices.next() {
                    None => part.fill(0.0),
                    Some((voice, stream)) => voice.make(stream, part),
                }
                for (voice, stream) in voices {
                    voice.make(stream, &mut scratch);
                    add(part, &scratch);
                }
            }
            self.block += 1;
        }
        Ok(())
    }

    /// Whole blocks on the threads of the pool this runs in.
    fn rounds(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        let threads = rayon::current_num_threads();
        if threads == 1 {
            return self.alone(out, stop);
        }
        let last = self.block + (out.len() / BLOCK) as u64;
        let share = self.voices.iter().map(Voice::cost).sum::<f64>() / threads as f64;
        let mut order: Vec<usize> = (0..self.voices.len()).collect();
        // The longest task first: the short ones fill the gaps at the end.
        order.sort_by(|&i, &j| self.voices[j].cost().total_cmp(&self.voices[i].cost()));
        let heavy: Vec<bool> = self.voices.iter().map(|voice| voice.cost() > share).collect();
        for (voice, _) in self.voices.iter_mut().zip(&heavy).filter(|(_, heavy)| **heavy) {
            voice.ahead.resize(ROUND * BLOCK, 0.0);
            draw(voice.deviates, voice.key, self.block, last, &mut voice.ahead);
        }
        for part in out.chunks_mut(ROUND * BLOCK) {
            check(stop)?;
            let (from, blocks) = (self.block, part.len() / BLOCK);
            self.block += blocks as u64;
            let next = self.block;
            let mut voices: Vec<_> = self.voices.iter_mut().map(Some).collect();
            let length = part.len();
            // The first to be added needs no room of its own.
            let direct = !heavy.first().is_none_or(|heavy| *heavy);
            let mut room = direct.then_some(&mut *part);
            rayon::scope(|scope| {
                for &i in &order {
                    let Some(voice) = voices[i].take() else { continue };
                    if i == 0
                        && let Some(room) = room.take()
                    {
                        scope.spawn(move |_| voice.round(from, room));
                        continue;
                    }
                    if !heavy[i] {
                        scope.spawn(move |_| voice.round_apart(from, blocks));
                        continue;
                    }
                    std::mem::swap(&mut voice.now, &mut voice.ahead);
                    voice.now.truncate(length);
                    voice.ahead.resize(ROUND * BLOCK, 0.0);
                    let Voice { process, deviates, key, now, ahead } = voice;
                    let (deviates, key) = (*deviates, *key);
                    scope.spawn(move |_| process.run(now));
                    for (block, part) in (next..last).zip(ahead.chunks_mut(BLOCK)) {
                        scope.spawn(move |_| draw(deviates, key, block, last, part));
                    }
                }
            });
            let all: Vec<&[f64]> = self.voices.iter().map(|voice| voice.now.as_slice()).collect();
            part.par_chunks_mut(BLOCK).enumerate().for_each(|(i, block)| {
                let mut parts = all.iter().skip(usize::from(direct)).map(|now| &now[i * BLOCK..][..BLOCK]);
                if !direct {
                    match parts.next() {
                        None => block.fill(0.0),
                        Some(first) => block.copy_from_slice(first),
                    }
                }
                parts.for_each(|samples| add(block, samples));
            });
        }
        Ok(())
    }
}

/// Deviates of the blocks from `block` on, before `last`.
fn draw(deviates: Deviates, key: StreamKey, block: u64, last: u64, out: &mut [f64]) {
    for (block, part) in (block..last).zip(out.chunks_mut(BLOCK)) {
        deviates.draw(&mut Stream::new(key, block), part);
    }
}

fn check(stop: &AtomicBool) -> Result<()> {
    if stop.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
}
