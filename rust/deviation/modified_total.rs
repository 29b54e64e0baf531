//! Modified total and Hadamard total variances: every segment of 3m points is detrended, reflected at both ends, and
//! differenced over the whole period.
//!
//! NIST SP 1065 §5.2.13 and 5.2.14. A segment reflected evenly at both ends is one period of a sequence of period 6m
//! that is even about both ends. The 6m second differences of m-point sums are third differences D(i) of its running
//! sum E. E is odd, so that D(i) = D(−3m − i) and half of the differences suffice. Each costs O(1) from the running
//! sum. For large m, all segments are summed together (`loops/segments.rs`).

use super::hadamard::{Overlapping, third_differences_inline};
use super::statistic::{Block, Part, Statistic};
use crate::machine::processor::compiled_for_each_width;

/// From this factor on all segments are summed together. Chosen by judgment; not measured.
const MIN_JOINT_FACTOR: usize = 24;

/// Minimum number of terms of a block: they share the start of the running sum. Chosen by judgment; not measured.
const MIN_BLOCK: usize = 512;

/// Modified total variance: the modified variance of every segment of 3m points, reflected.
pub(super) struct ModifiedTotal;

/// Hadamard total variance: the Hadamard variance of every segment of 3m rates, reflected. At m = 1 it equals the
/// overlapping Hadamard variance.
pub(super) struct HadamardTotal;

impl Statistic for ModifiedTotal {
    fn name(&self) -> &'static str {
        "mtotdev"
    }

    fn reach(&self, m: usize) -> usize {
        3 * m - 1
    }

    fn block(&self, m: usize) -> usize {
        m.max(MIN_BLOCK)
    }

    fn operations(&self, m: usize) -> usize {
        operations(m)
    }

    fn scale(&self, m: f64) -> f64 {
        12.0 * m.powi(5)
    }

    fn sum(&self, part: &Part<'_>, work: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(self.last_point(part.m), |block| of_phase(block, work))
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        theta.windows(3 * m).map(|segment| mean_around(segment, m) / (2.0 * (m * m) as f64)).collect()
    }
}

impl Statistic for HadamardTotal {
    fn name(&self) -> &'static str {
        "htotdev"
    }

    fn reach(&self, m: usize) -> usize {
        3 * m
    }

    fn block(&self, m: usize) -> usize {
        m.max(MIN_BLOCK)
    }

    fn operations(&self, m: usize) -> usize {
        operations(m)
    }

    fn scale(&self, m: f64) -> f64 {
        36.0 * m.powi(3)
    }

    fn at_factor_one(&self) -> Option<&'static dyn Statistic> {
        Some(&Overlapping)
    }

    fn sum(&self, part: &Part<'_>, work: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(self.last_point(part.m), |block| of_rates(block, work))
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        let rates: Vec<f64> = theta.windows(2).map(|pair| pair[1] - pair[0]).collect();
        rates.windows(3 * m).map(|segment| mean_around(segment, m) / 6.0).collect()
    }
}

/// Estimated number of operations of a segment: 9m, unless all segments are summed together.
fn operations(m: usize) -> usize {
    9 * m.min(64)
}

/// Mean of the 6m squared second differences D of one segment of 3m points: a term from its definition.
///
/// D are differences of m-point means of the segment, which is detrended and reflected before.
fn mean_around(segment: &[f64], m: usize) -> f64 {
    let length = segment.len();
    let (half, other) = (length / 2, length.div_ceil(2));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let slope = (mean(&segment[other..]) - mean(&segment[..half])) / other as f64;
    let flat: Vec<f64> = segment.iter().enumerate().map(|(i, x)| x - slope * i as f64).collect();
    let all: Vec<f64> = flat.iter().rev().chain(&flat).chain(flat.iter().rev()).copied().collect();
    let d = |i: usize| {
        mean(&all[i..i + m]) - 2.0 * mean(&all[i + m..i + 2 * m]) + mean(&all[i + 2 * m..i + 3 * m])
    };
    (0..6 * m).map(|i| d(i).powi(2)).sum::<f64>() / (6 * m) as f64
}

/// Sum over all segments of the phase of Σ D², and the number of segments: modified total variance.
fn of_phase(block: &Block<'_>, work: &mut Vec<f64>) -> (f64, u64) {
    let points = block.n + 3 * block.m - 1;
    let mut running = Vec::with_capacity(points + 1);
    // Removing the line through the ends changes no term, because every segment is detrended.
    let (origin, last) = (block.theta[0], block.theta[points - 1]);
    let slope = (last - origin) / (points - 1).max(1) as f64;
    let mut sum = 0.0;
    running.push(0.0);
    running.extend(block.theta[..points].iter().enumerate().map(|(i, v)| {
        sum += (v - origin) - slope * f64::from(i as u32);
        sum
    }));
    (sum_over_segments(&running, block, work), block.n as u64)
}

/// Like [`of_phase`] for the rates, whose running sum is the phase: Hadamard total variance.
fn of_rates(block: &Block<'_>, work: &mut Vec<f64>) -> (f64, u64) {
    (sum_over_segments(block.theta, block, work), block.n as u64)
}

/// Sum over all segments of Σ D², from the running sum.
fn sum_over_segments(running: &[f64], block: &Block<'_>, work: &mut Vec<f64>) -> f64 {
    let m = block.m;
    if m >= MIN_JOINT_FACTOR {
        return super::loops::segments::sum(running, block.n, m, block.stop);
    }
    work.resize(6 * m + 2, 0.0);
    (0..block.n).map(|k| around(block.width, &running[k..=k + 3 * m], m, work)).sum()
}

compiled_for_each_width! {
    /// Σ D² over the period of one reflected segment: 6m squares.
    fn around(c: &[f64], m: usize, work: &mut [f64]) -> f64 = around_inline
}

/// Body of [`around`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn around_inline(c: &[f64], m: usize, work: &mut [f64]) -> f64 {
    let length = 3 * m;
    let (half, other) = (length / 2, length.div_ceil(2));
    // Trend from the means of the two halves, whose centers are `other` points apart.
    let low = (c[half] - c[0]) / half.max(1) as f64;
    let high = (c[length] - c[other]) / half.max(1) as f64;
    let slope = (high - low) / other as f64;
    // The running sum of x − slope·i − mean ends at its initial value.
    let mean = ((c[length] - c[0]) - slope * (length * (length - 1) / 2) as f64) / length as f64;
    let first = half;
    let (left, right) = work[..6 * m + 1 + (length % 2)].split_at_mut(first);
    let (middle, beyond) = right.split_at_mut(length + 1);
    let (bend, tilt) = (slope / 2.0, mean - slope / 2.0);
    for (j, (to, from)) in middle.iter_mut().zip(c).enumerate() {
        let j = f64::from(j as i32);
        *to = (from - c[0]) - j * (bend * j + tilt);
    }
    for (to, from) in left.iter_mut().rev().zip(&middle[1..]) {
        *to = -from;
    }
    for (to, from) in beyond[..half].iter_mut().zip(middle[..length].iter().rev()) {
        *to = -from;
    }
    // The index i runs from −half to half. For even 3m the two ends are their own mirror images.
    let n = 2 * half + 1;
    let all = squares(work, m, n);
    if length.is_multiple_of(2) {
        2.0 * all - squares(work, m, 1) - squares(&work[n - 1..], m, 1)
    } else {
        2.0 * all
    }
}

/// Σ (e[i+3m] − 3e[i+2m] + 3e[i+m] − e[i])² over i < n.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn squares(e: &[f64], m: usize, n: usize) -> f64 {
    third_differences_inline([0, m, 2 * m, 3 * m].map(|at| &e[at..at + n]))
}
