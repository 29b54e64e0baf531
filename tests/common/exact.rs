//! Difficult records and their Allan sums in exact arithmetic.

use std::sync::atomic::AtomicBool;

use allanite::testing::deviation::allan::{Execution, overlapping};
use allanite::testing::machine::processor::Width;
use allanite::testing::phase::{Quantity, Record, Sample, Series, add_to};

/// Generator of approximately normal numbers.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / 9007199254740992.0
    }

    /// The next approximately normal number.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Σ d² from a running sum of 128-bit integers.
pub(crate) fn exact(samples: &[f64], m: usize) -> f64 {
    let largest = samples.iter().fold(f64::MIN_POSITIVE, |a, x| a.max(x.abs()));
    let scale = 2_f64.powi(90 - largest.log2().ceil() as i32);
    let mut theta = Vec::with_capacity(samples.len() + 1);
    let mut sum = 0_i128;
    theta.push(sum);
    for x in samples {
        sum += (x * scale) as i128; // the product is exact: a power of two
        theta.push(sum);
    }
    let mut squares = [0.0; 2];
    for k in 0..theta.len() - 2 * m {
        let d = (theta[k + 2 * m] - 2 * theta[k + m] + theta[k]) as f64 / scale;
        add_to(&mut squares, d * d);
    }
    squares[0] + squares[1]
}

/// Σ d² of the library at each factor.
pub(crate) fn ours<T: Sample>(samples: &[T], factors: &[usize], threads: usize) -> Vec<f64> {
    let stop = AtomicBool::new(false);
    let record = Record::new(Series::new(samples), Quantity::Rate, threads, &stop).unwrap();
    let execution = Execution { threads, width: Width::best(), stop: &stop };
    overlapping(&record, factors, execution).unwrap().0.sum
}
