//! Moving average of white noise.

use super::Process;
use crate::rng::Stream;
use crate::{Error, Result};

/// Mean of the last `length` normals. A running difference would accumulate rounding errors, so the window is split:
/// the end of the previous segment of `length` normals (stored as suffix sums) and the beginning of the current
/// segment.
pub(super) struct MovingAverage {
    scale: f64,
    /// From `place` on: suffix sums of the previous segment. Before `place`: normals of the current segment.
    segment: Vec<f64>,
    place: usize,
    prefix: f64,
}

impl MovingAverage {
    /// Process from the standard deviation of the white noise and the number of averaged samples.
    pub(super) fn new(sd: f64, length: f64, start: &mut Stream) -> Result<Self> {
        if !(1.0..=1e9).contains(&length) || length.fract() != 0.0 {
            return Err(Error::Input(format!(
                "noise process moving_average: length {length} must be a whole number from 1 to 1e9"
            )));
        }
        let mut segment = vec![0.0; length as usize];
        start.normals(&mut segment);
        let mut this = Self { scale: sd / length, segment, place: 0, prefix: 0.0 };
        this.finish_segment();
        Ok(this)
    }

    /// Replaces the normals of a complete segment by suffix sums.
    fn finish_segment(&mut self) {
        let mut sum = 0.0;
        for value in self.segment.iter_mut().rev() {
            sum += *value;
            *value = sum;
        }
        self.place = 0;
        self.prefix = 0.0;
    }
}

impl Process for MovingAverage {
    fn run(&mut self, samples: &mut [f64]) {
        for x in samples {
            self.segment[self.place] = *x;
            self.place += 1;
            self.prefix += *x;
            let suffix = if self.place < self.segment.len() { self.segment[self.place] } else { 0.0 };
            *x = self.scale * (self.prefix + suffix);
            if self.place == self.segment.len() {
                self.finish_segment();
            }
        }
    }
}
