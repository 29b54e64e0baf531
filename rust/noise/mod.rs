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

pub mod bank;
pub mod boxcar;
pub mod finite;
mod generator;
mod least_squares;
pub mod power_law;
mod quad;
pub mod section;
pub mod sections;
pub mod simple;

pub use bank::power_law_bank;
pub use generator::Generator;

use crate::rng::{START, Stream, StreamKey};
use crate::{Error, Result};

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

/// The process with this name and these values, designed for records of `n` samples. Its initial state is drawn from
/// `key`.
pub fn process(name: &str, values: &[f64], n: usize, key: StreamKey) -> Result<Box<dyn Process>> {
    let start = &mut Stream::new(key, START);
    if let Some(bad) = values.iter().find(|value| !value.is_finite()) {
        return Err(Error::Input(format!("noise process {name}: value {bad} is not finite")));
    }
    Ok(match (name, values) {
        ("white", &[sd]) => Box::new(simple::White::new(sd)),
        ("blue", &[sd]) => Box::new(simple::Blue::new(sd, start)),
        ("random_walk", &[step]) => Box::new(section::Lag::random_walk(step)),
        ("flicker", &[level]) => power_law::new(-1.0, level, n, start)?,
        ("power_law", &[exponent, level]) => power_law::new(exponent, level, n, start)?,
        ("gauss_markov", &[sigma, phi]) => Box::new(section::Lag::gauss_markov(sigma, phi, start)?),
        ("filtered", [sd, sections @ ..]) if !sections.is_empty() && sections.len() % 5 == 0 => {
            Box::new(section::Filtered::new(*sd, sections, start)?)
        }
        ("finite", coefficients) if !coefficients.is_empty() => {
            Box::new(finite::Finite::new(coefficients, start))
        }
        ("moving_average", &[sd, length]) => Box::new(boxcar::MovingAverage::new(sd, length, start)?),
        ("telegraph", &[amplitude, p]) => Box::new(simple::Telegraph::new(amplitude, p, start)?),
        _ => return Err(unknown(name, values.len())),
    })
}

/// Error for an unknown name or a wrong number of values.
fn unknown(name: &str, found: usize) -> Error {
    const COUNTS: [(&str, &str); 10] = [
        ("white", "1"),
        ("blue", "1"),
        ("random_walk", "1"),
        ("flicker", "1"),
        ("power_law", "2"),
        ("gauss_markov", "2"),
        ("filtered", "1, and 5 a section"),
        ("finite", "at least 1"),
        ("moving_average", "2"),
        ("telegraph", "2"),
    ];
    Error::Input(if let Some((_, count)) = COUNTS.iter().find(|(known, _)| *known == name) {
        format!("noise process {name}: found {found} values, needs {count}")
    } else {
        let known: Vec<_> = COUNTS.iter().map(|(known, _)| *known).collect();
        format!("noise process {name:?} is unknown; known are {}", known.join(", "))
    })
}
