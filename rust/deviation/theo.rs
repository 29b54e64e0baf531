//! Theo1: differences of every stride up to m within m + 1 points. NIST SP 1065 eq. 30; m is even, and the effective
//! τ is 0.75 m τ₀.

use std::sync::atomic::Ordering;

use super::statistic::{Block, Part, Statistic};
use crate::machine::processor::compiled_for_each_width;

/// Number of terms of a block: its arrays of 16 KiB stay in the first-level cache while all m/2 strides are summed.
const TERMS: usize = 2048;

/// Theo1.
pub(super) struct Theo1;

impl Statistic for Theo1 {
    fn name(&self) -> &'static str {
        "theo1"
    }

    fn reach(&self, m: usize) -> usize {
        m
    }

    fn is_defined(&self, m: usize) -> bool {
        m > 0 && m.is_multiple_of(2)
    }

    fn block(&self, _: usize) -> usize {
        TERMS
    }

    fn operations(&self, m: usize) -> usize {
        m / 2
    }

    fn scale(&self, m: f64) -> f64 {
        0.75 * m.powi(2)
    }

    fn sum(&self, part: &Part<'_>, work: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(self.last_point(part.m), |block| theo1(block, work))
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        let half = m / 2;
        let term = |i: usize, delta: usize| {
            let d = theta[i] - theta[i + half - delta] + theta[i + m] - theta[i + half + delta];
            d * d / (half - delta) as f64
        };
        let sum = |i: usize| (0..half).map(|delta| term(i, delta)).sum::<f64>();
        (0..theta.len() - m).map(|i| sum(i) / (0.75 * (m * m) as f64)).collect()
    }
}

/// Sum of `Σ_{δ<m/2} (x[i] − x[i−δ+m/2] + x[i+m] − x[i+δ+m/2])² / (m/2 − δ)` over i, and the number of i.
fn theo1(block: &Block<'_>, work: &mut Vec<f64>) -> (f64, u64) {
    let (n, m, theta) = (block.n, block.m, block.theta);
    work.clear();
    work.extend(theta[..n].iter().zip(&theta[m..m + n]).map(|(a, b)| a + b));
    let half = m / 2;
    let sum = (0..half)
        .take_while(|_| !block.stop.load(Ordering::Relaxed))
        .map(|delta| {
            let (near, far) = (&theta[half - delta..][..n], &theta[half + delta..][..n]);
            squares(block.width, work, near, far) / (half - delta) as f64
        })
        .sum();
    (sum, n as u64)
}

compiled_for_each_width! {
    /// Σ (ends − near − far)².
    fn squares(ends: &[f64], near: &[f64], far: &[f64]) -> f64 = squares_inline
}

/// Body of [`squares`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn squares_inline(ends: &[f64], near: &[f64], far: &[f64]) -> f64 {
    let n = ends.len();
    let (near, far) = (&near[..n], &far[..n]);
    let mut sums = [0.0; 16];
    let whole = n - n % 16;
    for at in (0..whole).step_by(16) {
        let [e, a, b] = [ends, near, far].map(|v| &v[at..at + 16]);
        for i in 0..16 {
            let value = e[i] - (a[i] + b[i]);
            sums[i] += value * value;
        }
    }
    let rest = (whole..n).map(|i| (ends[i] - (near[i] + far[i])).powi(2)).sum::<f64>();
    sums.iter().sum::<f64>() + rest
}
