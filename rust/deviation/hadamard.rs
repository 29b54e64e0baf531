//! Hadamard variance: third differences of the phase, which a linear drift of the rate does not change. NIST SP 1065
//! eqs. 18 and 20.

use super::statistic::{Block, Part, Statistic};
use crate::machine::processor::compiled_for_each_width;

/// Hadamard variance of third differences at every point.
pub(super) struct Overlapping;

/// Hadamard variance of third differences at every m-th point.
pub(super) struct Adjacent;

impl Statistic for Overlapping {
    fn name(&self) -> &'static str {
        "ohdev"
    }

    fn reach(&self, m: usize) -> usize {
        3 * m
    }

    fn scale(&self, m: f64) -> f64 {
        6.0 * m.powi(2)
    }

    fn skips_missing_points(&self) -> bool {
        true
    }

    fn sum(&self, part: &Part<'_>, _: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(self.last_point(part.m), overlapping)
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        definition(theta, m, 1)
    }
}

impl Statistic for Adjacent {
    fn name(&self) -> &'static str {
        "hdev"
    }

    fn reach(&self, m: usize) -> usize {
        Overlapping.reach(m)
    }

    fn scale(&self, m: f64) -> f64 {
        Overlapping.scale(m)
    }

    fn skips_missing_points(&self) -> bool {
        true
    }

    fn sum(&self, part: &Part<'_>, _: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(self.last_point(part.m), adjacent)
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        definition(theta, m, m)
    }

    fn points_of_term(&self, i: usize, m: usize, _: usize) -> (usize, usize) {
        (i * m, i * m + 3 * m)
    }
}

/// Squared third differences at every `stride`-th point, over 6 m².
fn definition(theta: &[f64], m: usize, stride: usize) -> Vec<f64> {
    let third = |k: usize| theta[k + 3 * m] - 3.0 * theta[k + 2 * m] + 3.0 * theta[k + m] - theta[k];
    (0..theta.len() - 3 * m).step_by(stride).map(|k| third(k).powi(2) / (6.0 * (m * m) as f64)).collect()
}

/// Sum and number of (θ[k+3m] − 3θ[k+2m] + 3θ[k+m] − θ[k])² at every k. Terms that are NaN are skipped.
///
/// If the sum of a strip is finite, the strip contains no NaN. Only other strips are examined term by term.
fn overlapping(block: &Block<'_>) -> (f64, u64) {
    // Four streams of 32 KiB stay in the second-level cache when a strip with gaps is read again.
    const STRIP: usize = 4096;
    let (mut sum, mut count) = (0.0, 0);
    for from in (0..block.n).step_by(STRIP) {
        let n = STRIP.min(block.n - from);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| &block.theta[from + i * block.m..][..n]);
        let strip = third_differences(block.width, [a, b, c, d]);
        if strip.is_nan() {
            for i in 0..n {
                let value = third(a[i], b[i], c[i], d[i]);
                sum += if value.is_nan() { 0.0 } else { value * value };
                count += u64::from(!value.is_nan());
            }
        } else {
            sum += strip;
            count += n as u64;
        }
    }
    (sum, count)
}

compiled_for_each_width! {
    /// Σ (d − 3c + 3b − a)² over four slices of equal length.
    fn third_differences(parts: [&[f64]; 4]) -> f64 = third_differences_inline
}

/// Σ (d − 3c + 3b − a)² over four slices of equal length.
#[inline(always)]
pub(super) fn third_differences_inline([a, b, c, d]: [&[f64]; 4]) -> f64 {
    const LANES: usize = 16;
    let n = a.len();
    let mut sums = [0.0; LANES];
    let whole = n - n % LANES;
    for at in (0..whole).step_by(LANES) {
        let [a, b, c, d] = [a, b, c, d].map(|v| &v[at..at + LANES]);
        for i in 0..LANES {
            let value = third(a[i], b[i], c[i], d[i]);
            sums[i] += value * value;
        }
    }
    sums.iter().sum::<f64>() + (whole..n).map(|i| third(a[i], b[i], c[i], d[i]).powi(2)).sum::<f64>()
}

/// Like [`overlapping`], at every m-th point of the record.
fn adjacent(block: &Block<'_>) -> (f64, u64) {
    let m = block.m;
    let theta = block.theta;
    let (mut sum, mut count) = (0.0, 0);
    for k in (block.first.next_multiple_of(m) - block.first..block.n).step_by(m) {
        let value = third(theta[k], theta[k + m], theta[k + 2 * m], theta[k + 3 * m]);
        if !value.is_nan() {
            sum += value * value;
            count += 1;
        }
    }
    (sum, count)
}

/// Third difference of four values.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn third(a: f64, b: f64, c: f64, d: f64) -> f64 {
    (d - a) - 3.0 * (c - b)
}
