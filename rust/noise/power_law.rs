//! Noise whose spectrum is a power of frequency: white noise through a bank of first-order sections.

use super::bank::PoleBank;
use super::section::Lag;
use super::sections::Sections;
use super::simple::White;
use super::{Process, WINDOW};
use crate::rng::Stream;
use crate::{Error, Result};

/// Process with the spectrum level² (2 sin(w/2))^exponent, for an exponent in (−3, 1] and records of `n` samples.
pub(super) fn new(exponent: f64, level: f64, n: usize, start: &mut Stream) -> Result<Box<dyn Process>> {
    if !(exponent > -3.0 && exponent <= 1.0) {
        return Err(Error::Input(format!("noise process power_law: exponent {exponent} is outside (-3, 1]")));
    }
    let d = -0.5 * exponent;
    #[expect(clippy::float_cmp, reason = "only the exact whole orders have no bank")]
    if d == 1.0 {
        return Ok(Box::new(Lag::random_walk(level)));
    }
    if d == 0.0 {
        return Ok(Box::new(White::new(level)));
    }
    let fraction = d - d.floor();
    // Integrated noise has much more power below the band, so its bank must reach lower frequencies.
    let design = if d > 1.0 { n.saturating_mul(1000) } else { n };
    let sections = Sections::new(&PoleBank::new(fraction, design), level, start);
    Ok(match d.floor() {
        0.0 => Box::new(sections),
        1.0 => Box::new(Summed { inner: sections, sum: 0.0 }),
        _ => Box::new(Differenced::new(sections, start)),
    })
}

/// Running sum of a process, starting at zero.
struct Summed {
    inner: Sections,
    sum: f64,
}

impl Process for Summed {
    fn run(&mut self, samples: &mut [f64]) {
        self.inner.run(samples);
        for x in samples {
            let here = self.sum;
            self.sum += *x;
            *x = here;
        }
    }
}

/// First difference of a process.
struct Differenced {
    inner: Sections,
    last: f64,
}

impl Differenced {
    /// First difference of the process `inner`, whose previous sample is drawn from `start`.
    fn new(mut inner: Sections, start: &mut Stream) -> Self {
        let mut before = [0.0; WINDOW];
        start.normals(&mut before);
        inner.run(&mut before);
        Self { inner, last: before[WINDOW - 1] }
    }
}

impl Process for Differenced {
    fn run(&mut self, samples: &mut [f64]) {
        self.inner.run(samples);
        for x in samples {
            let new = *x;
            *x = new - self.last;
            self.last = new;
        }
    }
}
