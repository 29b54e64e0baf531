//! The sum of several processes, one block after another.

use std::sync::atomic::{AtomicBool, Ordering};

use super::{Process, process};
use crate::rng::{Stream, StreamKey};
use crate::{Error, Result};

/// Samples of a block, each drawn from its own stream.
const BLOCK: usize = 4096;

struct Voice {
    process: Box<dyn Process>,
    key: StreamKey,
}

/// A stream of samples of a sum of processes.
pub struct Generator {
    voices: Vec<Voice>,
    block: u64,
    /// The block that is being handed out, from `used` on.
    ready: Vec<f64>,
    used: usize,
    scratch: Vec<f64>,
}

impl Generator {
    /// `processes` are (name, values) as the module's table lists them; `total` is the length of the record
    /// that the slow end of the spectra is designed for (more samples may be drawn).
    pub fn new<S: AsRef<str>, V: AsRef<[f64]>>(
        processes: &[(S, V)],
        total: usize,
        seed: u64,
        replicate: u64,
        axis: u64,
    ) -> Result<Self> {
        let voices = processes
            .iter()
            .enumerate()
            .map(|(effect, (name, values))| {
                let key = StreamKey { seed, replicate, effect: effect as u64, axis };
                Ok(Voice { process: process(name.as_ref(), values.as_ref(), total, key)?, key })
            })
            .collect::<Result<_>>()?;
        Ok(Self { voices, block: 0, ready: vec![0.0; BLOCK], used: BLOCK, scratch: vec![0.0; BLOCK] })
    }

    /// The next `out.len()` samples.
    pub fn fill(&mut self, out: &mut [f64], stop: &AtomicBool) -> Result<()> {
        let mut rest = out;
        while !rest.is_empty() {
            if self.used == BLOCK {
                if stop.load(Ordering::Relaxed) {
                    return Err(Error::Interrupted);
                }
                self.next_block();
            }
            let count = rest.len().min(BLOCK - self.used);
            let (head, tail) = rest.split_at_mut(count);
            head.copy_from_slice(&self.ready[self.used..self.used + count]);
            self.used += count;
            rest = tail;
        }
        Ok(())
    }

    fn next_block(&mut self) {
        self.ready.fill(0.0);
        for voice in &mut self.voices {
            voice.process.draw(&mut Stream::new(voice.key, self.block), &mut self.scratch);
            voice.process.run(&mut self.scratch);
            for (sum, x) in self.ready.iter_mut().zip(&self.scratch) {
                *sum += x;
            }
        }
        self.block += 1;
        self.used = 0;
    }
}
