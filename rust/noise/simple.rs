//! White noise, differenced white noise, and the random telegraph.

use super::{Deviates, Process};
use crate::machine::processor::{Width, compiled_for_each_width};
use crate::rng::Stream;
use crate::{Error, Result};

/// Independent normals.
pub(super) struct White {
    sd: f64,
}

impl White {
    /// Process from the standard deviation of the samples.
    pub(super) fn new(sd: f64) -> Self {
        Self { sd }
    }
}

impl Process for White {
    fn run(&mut self, samples: &mut [f64]) {
        scale(Width::best(), samples, self.sd);
    }
}

compiled_for_each_width! {
    /// Multiplies samples by a factor.
    fn scale(samples: &mut [f64], factor: f64) = scale_inline
}

/// Body of [`scale`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn scale_inline(samples: &mut [f64], factor: f64) {
    for x in samples {
        *x *= factor;
    }
}

compiled_for_each_width! {
    /// Adds samples to a total.
    pub(super) fn add(total: &mut [f64], samples: &[f64]) = add_inline
}

/// Body of [`add`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn add_inline(total: &mut [f64], samples: &[f64]) {
    for (total, x) in total.iter_mut().zip(samples) {
        *total += x;
    }
}

/// First difference of independent normals: the rate noise of a quantized angle.
pub(super) struct Blue {
    sd: f64,
    last: f64,
}

impl Blue {
    /// Process from the standard deviation of the normals before differencing.
    pub(super) fn new(sd: f64, start: &mut Stream) -> Self {
        let mut first = [0.0];
        start.normals(&mut first);
        Self { sd, last: sd * first[0] }
    }
}

impl Process for Blue {
    fn run(&mut self, samples: &mut [f64]) {
        for x in samples {
            let new = self.sd * *x;
            *x = new - self.last;
            self.last = new;
        }
    }
}

/// Random telegraph with two levels. Each sample keeps the previous level with probability 1−p.
pub(super) struct Telegraph {
    level: f64,
    p: f64,
}

impl Telegraph {
    /// Process from half the distance of the levels and the switching probability.
    pub(super) fn new(amplitude: f64, p: f64, start: &mut Stream) -> Result<Self> {
        if !(0.0..=1.0).contains(&p) {
            return Err(Error::Input(format!(
                "noise process telegraph: switching probability {p} is outside 0…1"
            )));
        }
        let mut first = [0.0];
        start.uniforms(&mut first);
        Ok(Self { level: if first[0] <= 0.5 { amplitude } else { -amplitude }, p })
    }
}

impl Process for Telegraph {
    fn deviates(&self) -> Deviates {
        Deviates::Uniform
    }

    fn run(&mut self, samples: &mut [f64]) {
        for x in samples {
            // Uniforms lie in (0, 1], so p = 0 never switches and p = 1 always does.
            let switch = *x <= self.p;
            *x = self.level;
            if switch {
                self.level = -self.level;
            }
        }
    }
}
