//! The sum of several processes, on any number of threads.
//!
//! Work goes in rounds of some blocks. While the recursions of one round run, one task a process, the deviates of
//! the next are drawn, one task a block: the recursions are the shorter half of the work, so two threads are
//! both busy to the end.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::{Deviates, Process, process};
use crate::rng::{Stream, StreamKey};
use crate::{Error, Result};

/// Samples of a block, each drawn from its own stream.
pub const BLOCK: usize = 4096;
/// Blocks of a round.
const ROUND: usize = 16;
/// Fewer blocks are not worth a second thread.
const FEW: u64 = 2 * ROUND as u64;

struct Voice {
    process: Box<dyn Process>,
    deviates: Deviates,
    key: StreamKey,
    /// Deviates of this round, which become its samples.
    now: Vec<f64>,
    /// Deviates of the next round.
    ahead: Vec<f64>,
}

impl Voice {
    fn draw(&mut self, block: u64) {
        self.now.resize(BLOCK, 0.0);
        self.deviates.draw(&mut Stream::new(self.key, block), &mut self.now);
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
        for part in out.chunks_exact_mut(BLOCK) {
            check(stop)?;
            for voice in &mut self.voices {
                voice.draw(self.block);
                voice.process.run(&mut voice.now);
            }
            self.samples().sum(0, part);
            self.block += 1;
        }
        Ok(())
    }

    /// Whole blocks on the threads of the pool this runs in.
    fn rounds(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        let first = self.block;
        let last = first + (out.len() / BLOCK) as u64;
        for voice in &mut self.voices {
            voice.now.resize(ROUND * BLOCK, 0.0);
            voice.ahead.resize(ROUND * BLOCK, 0.0);
        }
        self.draw_ahead(first, last, false);
        for part in out.chunks_mut(ROUND * BLOCK) {
            check(stop)?;
            for voice in &mut self.voices {
                std::mem::swap(&mut voice.now, &mut voice.ahead);
                voice.now.truncate(part.len());
                voice.ahead.resize(ROUND * BLOCK, 0.0);
            }
            self.block += (part.len() / BLOCK) as u64;
            self.draw_ahead(self.block, last, true);
            let samples = self.samples();
            part.par_chunks_mut(BLOCK).enumerate().for_each(|(i, block)| samples.sum(i * BLOCK, block));
        }
        Ok(())
    }

    fn samples(&self) -> Samples<'_> {
        Samples(self.voices.iter().map(|voice| voice.now.as_slice()).collect())
    }

    /// Draws the deviates of the round that begins with block `from`; if asked, the recursions of this round
    /// run at the same time.
    fn draw_ahead(&mut self, from: u64, last: u64, run: bool) {
        rayon::scope(|scope| {
            for voice in &mut self.voices {
                let Voice { process, deviates, key, now, ahead } = voice;
                let (deviates, key) = (*deviates, *key);
                for (block, part) in (from..last).zip(ahead.chunks_mut(BLOCK)) {
                    scope.spawn(move |_| deviates.draw(&mut Stream::new(key, block), part));
                }
                if run {
                    scope.spawn(move |_| process.run(now));
                }
            }
        });
    }
}

fn check(stop: &AtomicBool) -> Result<()> {
    if stop.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
}

/// The samples of every process, in the order in which they are added.
struct Samples<'a>(Vec<&'a [f64]>);

impl Samples<'_> {
    fn sum(&self, at: usize, out: &mut [f64]) {
        match self.0.as_slice() {
            [] => out.fill(0.0),
            [first, others @ ..] => {
                out.copy_from_slice(&first[at..][..out.len()]);
                for samples in others {
                    for (total, x) in out.iter_mut().zip(&samples[at..]) {
                        *total += x;
                    }
                }
            }
        }
    }
}
