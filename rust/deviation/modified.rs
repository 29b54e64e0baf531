//! Modified Allan variance: second differences of phase averages, in O(1) per term by a running sum that restarts in
//! every block. NIST SP 1065 eq. 14.

use std::ops::Range;
use std::sync::atomic::Ordering;

use super::statistic::{Block, Part, Statistic};
use crate::phase::BLOCK;

/// Modified Allan variance.
pub(super) struct Modified;

impl Statistic for Modified {
    fn name(&self) -> &'static str {
        "mdev"
    }

    fn reach(&self, m: usize) -> usize {
        3 * m - 1
    }

    fn block(&self, m: usize) -> usize {
        BLOCK.max(m)
    }

    fn scale(&self, m: f64) -> f64 {
        2.0 * m.powi(4)
    }

    fn sum(&self, part: &Part<'_>, _: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(self.last_point(part.m), averages)
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        let tau = m as f64;
        let second = |i: usize| theta[i + 2 * m] - 2.0 * theta[i + m] + theta[i];
        let term = |k: usize| ((k..k + m).map(second).sum::<f64>() / tau).powi(2) / (2.0 * tau * tau);
        (0..=theta.len() - 3 * m).map(term).collect()
    }
}

/// Number of points between two checks of the stop flag: less than a millisecond.
const CHECK_INTERVAL: usize = 1 << 16;

/// The range `0..n` in chunks; ends early when the stop flag is set.
pub(super) fn chunks_until_stop<'p>(
    block: &'p Block<'_>,
    n: usize,
) -> impl Iterator<Item = Range<usize>> + 'p {
    (0..n)
        .step_by(CHECK_INTERVAL)
        .take_while(|_| !block.stop.load(Ordering::Relaxed))
        .map(move |from| from..n.min(from + CHECK_INTERVAL))
}

/// Sum and number of the terms:
/// `Σ_k (Σ_{i=k}^{k+m−1} (θ[i+2m] − 2θ[i+m] + θ[i]))²`.
fn averages(block: &Block<'_>) -> (f64, u64) {
    let (n, m, theta) = (block.n, block.m, block.theta);
    let mut window = 0.0;
    for part in chunks_until_stop(block, m) {
        for i in part {
            window += (theta[i + 2 * m] - theta[i + m]) - (theta[i + m] - theta[i]);
        }
    }
    let mut sum = window * window;
    for part in chunks_until_stop(block, n - 1) {
        for k in part {
            window += (theta[k + 3 * m] - theta[k]) - 3.0 * (theta[k + 2 * m] - theta[k + m]);
            sum += window * window;
        }
    }
    (sum, n as u64)
}
