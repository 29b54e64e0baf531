//! White noise through a boxcar mean.

use super::Process;
use crate::rng::Stream;
use crate::{Error, Result};

/// Mean of the last `length` normals, without a running difference that would gather rounding: the window is
/// the end of the previous segment of `length` normals (its suffix sums) and the beginning of this one.
pub struct MovingAverage {
    scale: f64,
    /// Entries from `place` on: sums of the previous segment from there to its end. Before: normals of this one.
    segment: Vec<f64>,
    place: usize,
    prefix: f64,
}

impl MovingAverage {
    /// Standard deviation of the white noise and the number of samples averaged.
    pub fn new(sd: f64, length: f64, start: &mut Stream) -> Result<Self> {
        if !(1.0..=1e9).contains(&length) || length.fract() != 0.0 {
            return Err(Error::Input(format!(
                "noise process moving_average: length {length} must be a whole number from 1 to 1e9"
            )));
        }
        let mut segment = vec![0.0; length as usize];
        start.normals(&mut segment);
        let mut this = Self { scale: sd / length, segment, place: 0, prefix: 0.0 };
        this.turn();
        Ok(this)
    }

    /// The segment is full: its normals become suffix sums.
    fn turn(&mut self) {
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
                self.turn();
            }
        }
    }
}
