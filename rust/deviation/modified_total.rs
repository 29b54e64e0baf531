//! Modified total and Hadamard total variances: every segment of 3m points is detrended, reflected at both ends, and
//! differenced over the whole period.
//!
//! NIST SP 1065 §5.2.13 and 5.2.14. A segment reflected evenly at both ends is one period of a sequence of period 6m
//! that is even about both ends. The 6m second differences of m-point sums are third differences D(i) of its running
//! sum E. E is odd, so that D(i) = D(−3m − i) and half of the differences suffice. Each costs O(1) from the running
//! sum. For large m, all segments are summed together (`loops/segments.rs`).

use super::Block;
use crate::machine::processor::Width;

/// From this factor on all segments are summed together. Chosen by judgment; not measured.
const MIN_JOINT_FACTOR: usize = 24;

/// Sum over all segments of the phase of Σ D², and the number of segments: modified total variance.
pub fn of_phase(block: &Block<'_>, work: &mut Vec<f64>) -> (f64, u64) {
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
pub fn of_rates(block: &Block<'_>, work: &mut Vec<f64>) -> (f64, u64) {
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

/// Σ D² over the period of one reflected segment.
fn around(width: Width, running: &[f64], m: usize, work: &mut [f64]) -> f64 {
    #[cfg(target_arch = "x86_64")]
    if width.is_wide() {
        // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
        return unsafe { around_avx2(running, m, work) };
    }
    let _ = width;
    around_plain(running, m, work)
}

/// # Safety
/// The processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn around_avx2(running: &[f64], m: usize, work: &mut [f64]) -> f64 {
    around_plain(running, m, work)
}

/// Σ D² of one segment: 6m squares.
#[allow(clippy::inline_always)] // to be compiled with the instructions of its caller
#[inline(always)]
fn around_plain(c: &[f64], m: usize, work: &mut [f64]) -> f64 {
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

#[allow(clippy::inline_always)] // as above
#[inline(always)]
/// Σ (e[i+3m] − 3e[i+2m] + 3e[i+m] − e[i])² over i < n.
fn squares(e: &[f64], m: usize, n: usize) -> f64 {
    let [a, b, c, d] = [0, m, 2 * m, 3 * m].map(|at| &e[at..at + n]);
    let mut sums = [0.0; 16];
    let whole = n - n % 16;
    for at in (0..whole).step_by(16) {
        let [a, b, c, d] = [a, b, c, d].map(|v| &v[at..at + 16]);
        for i in 0..16 {
            let value = (d[i] - a[i]) - 3.0 * (c[i] - b[i]);
            sums[i] += value * value;
        }
    }
    let mut sum = sums.iter().sum::<f64>();
    for i in whole..n {
        let value = (d[i] - a[i]) - 3.0 * (c[i] - b[i]);
        sum += value * value;
    }
    sum
}
