//! Samples of colored noise: a sum of primitive processes, generated block by block in constant memory.
//!
//! | primitive | values | spectrum at w = 2πf τ0 | file |
//! |---|---|---|---|
//! | `white` | sd | sd² | [`simple`] |
//! | `blue` | sd | 4 sd² sin²(w/2) | [`simple`] |
//! | `random_walk` | step sd | sd²/(4 sin²(w/2)), first sample 0 | [`section`] |
//! | `flicker` | B | B²/(2 sin(w/2)) | [`power_law`] |
//! | `power_law` | exponent a in (−3, 1], level | level² (2 sin(w/2))^a | [`power_law`] |
//! | `gauss_markov` | σ, φ | `σ²(1−φ²)/(1−2φ cos w+φ²)` | [`section`] |
//! | `filtered` | sd, `b0, b1, b2, a1, a2` of each section | sd² of the sections' gain | [`section`] |
//! | `finite` | `c0, c1, …` | `\|Σ c_j e^{−ijw}\|²` | [`finite`] |
//! | `moving_average` | sd, length | sd² (sin(Lw/2)/(L sin(w/2)))² | [`boxcar`] |
//! | `telegraph` | amplitude, p | `gauss_markov` with σ = amplitude, φ = 1−2p | [`simple`] |
//!
//! The normals of block b of effect k come from the stream (seed, replicate, k, axis, b). The recursive parts run
//! over the blocks in order. So the samples depend neither on how many are requested at a time nor on the number of
//! threads.

mod bank;
mod boxcar;
mod finite;
mod generator;
mod least_squares;
mod power_law;
mod primitive;
mod quad;
mod section;
mod sections;
mod simple;

pub(crate) use bank::power_law_bank;
pub use generator::Generator;
pub use primitive::Primitive;

use crate::Result;
use crate::rng::{START, Stream, StreamKey};

/// Distribution of the independent deviates that drive a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deviates {
    /// Standard normal.
    Normal,
    /// Uniform in (0, 1].
    Uniform,
}

impl Deviates {
    /// Fills a block with deviates.
    fn draw(self, stream: &mut Stream, block: &mut [f64]) {
        match self {
            Self::Normal => stream.normals(block),
            Self::Uniform => stream.uniforms(block),
        }
    }
}

/// Number of samples of a window. Processes always receive whole windows.
pub const WINDOW: usize = 256;

/// A recursion that transforms independent deviates into samples of a process.
pub trait Process: Send {
    /// Distribution of the deviates that the process needs.
    fn deviates(&self) -> Deviates {
        Deviates::Normal
    }

    /// Transforms the deviates of the next samples into these samples, in place. The length is a whole number of
    /// windows.
    fn run(&mut self, samples: &mut [f64]);
}

/// The process designed for records of `n` samples. Its initial state is drawn from `key`.
pub fn process(primitive: &Primitive, n: usize, key: StreamKey) -> Result<Box<dyn Process>> {
    let start = &mut Stream::new(key, START);
    Ok(match *primitive {
        Primitive::White { sd } => Box::new(simple::White::new(sd)),
        Primitive::Blue { sd } => Box::new(simple::Blue::new(sd, start)),
        Primitive::RandomWalk { step } => Box::new(section::Lag::random_walk(step)),
        Primitive::Flicker { level } => power_law::new(-1.0, level, n, start)?,
        Primitive::PowerLaw { exponent, level } => power_law::new(exponent, level, n, start)?,
        Primitive::GaussMarkov { sigma, phi } => Box::new(section::Lag::gauss_markov(sigma, phi, start)?),
        Primitive::Filtered { sd, ref sections } => Box::new(section::Filtered::new(sd, sections, start)?),
        Primitive::Finite { ref coefficients } => Box::new(finite::Finite::new(coefficients, start)),
        Primitive::MovingAverage { sd, length } => Box::new(boxcar::MovingAverage::new(sd, length, start)?),
        Primitive::Telegraph { amplitude, probability } => {
            Box::new(simple::Telegraph::new(amplitude, probability, start)?)
        }
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The samples of a process computed from its definition, sample by sample.
    fn naive(primitive: &Primitive, key: StreamKey, deviates: &[f64]) -> Vec<f64> {
        let start = |count: usize| {
            let mut first = vec![0.0; count];
            Stream::new(key, START).normals(&mut first);
            first
        };
        // All normals up to sample t, of which `before` come from the initial state.
        let past = |before: usize| [start(before), deviates.to_vec()].concat();
        let each = 0..deviates.len();
        match primitive {
            Primitive::White { sd } => deviates.iter().map(|w| sd * w).collect(),
            Primitive::Blue { sd } => past(1).windows(2).map(|w| sd * w[1] - sd * w[0]).collect(),
            Primitive::RandomWalk { step } => {
                each.map(|t| step * deviates[..t].iter().sum::<f64>()).collect()
            }
            Primitive::GaussMarkov { sigma, phi } => {
                let drive = sigma * (1.0 - phi * phi).sqrt();
                let next = |state: &mut f64, w: &f64| {
                    let here = *state;
                    *state = phi * here + drive * w;
                    Some(here)
                };
                deviates.iter().scan(sigma * start(1)[0], next).collect()
            }
            Primitive::Finite { coefficients } => {
                let before = coefficients.len() - 1;
                let all = past(before);
                let one = |t: usize| (0..=before).map(|j| coefficients[j] * all[before + t - j]).sum();
                each.map(one).collect()
            }
            Primitive::MovingAverage { sd, length } => {
                let length = *length as usize;
                let all = past(length);
                each.map(|t| sd * all[t + 1..=t + length].iter().sum::<f64>() / length as f64).collect()
            }
            other => unreachable!("{other:?} has tests of its own"),
        }
    }

    proptest! {
        #[test]
        fn processes_equal_their_definition(
            size in 0.1..3.0_f64, phi in -0.99..0.99_f64, length in 1_u32..900, windows in 1_usize..5,
            coefficients in prop::collection::vec(-1.0..1.0_f64, 1..9), seed in any::<u64>()
        ) {
            let key = StreamKey { seed, replicate: 0, effect: 1, axis: 2 };
            for primitive in [
                Primitive::White { sd: size },
                Primitive::Blue { sd: size },
                Primitive::RandomWalk { step: size },
                Primitive::GaussMarkov { sigma: size, phi },
                Primitive::Finite { coefficients: coefficients.clone() },
                Primitive::MovingAverage { sd: size, length: f64::from(length) },
            ] {
                let mut process = process(&primitive, 1000, key).unwrap();
                let mut samples = vec![0.0; windows * WINDOW];
                Stream::new(key, 7).normals(&mut samples);
                let expected = naive(&primitive, key, &samples);
                samples.chunks_mut(WINDOW).for_each(|window| process.run(window));
                for (t, (found, expected)) in samples.iter().zip(expected).enumerate() {
                    // Sums of at most 1000 normals of size 3.
                    prop_assert!((found - expected).abs() < 1e-11, "{primitive:?} {t}: {found} {expected}");
                }
            }
        }
    }
}
