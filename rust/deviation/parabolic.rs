//! Parabolic variance: second differences of slopes fitted to the phase, in O(1) per term by running sums that restart
//! in every block. Vernotte et al. 2016 eq. 9.

use super::modified::{Modified, chunks_until_stop};
use super::statistic::{Block, Part, Statistic};
use crate::phase::BLOCK;

/// Parabolic variance. At m = 1 it equals the Allan variance, like the modified variance.
pub(super) struct Parabolic;

impl Statistic for Parabolic {
    fn name(&self) -> &'static str {
        "pdev"
    }

    fn reach(&self, m: usize) -> usize {
        2 * m
    }

    fn last_point(&self, m: usize) -> usize {
        2 * m - 1
    }

    fn block(&self, m: usize) -> usize {
        BLOCK.max(m)
    }

    fn scale(&self, m: f64) -> f64 {
        m.powi(6) / 72.0
    }

    fn at_factor_one(&self) -> Option<&'static dyn Statistic> {
        Some(&Modified)
    }

    fn sum(&self, part: &Part<'_>, _: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(self.last_point(part.m), slopes)
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        let tau = m as f64;
        let weight = |i: usize| (tau - 1.0) / 2.0 - i as f64;
        let slope = |k: usize| (0..m).map(|i| weight(i) * (theta[k + i] - theta[k + i + m])).sum::<f64>();
        (0..theta.len() - 2 * m).map(|k| slope(k).powi(2) / (tau.powi(6) / 72.0)).collect()
    }
}

/// Sum and number of the terms:
/// `Σ_k (Σ_{i<m} ((m−1)/2 − i)(θ[k+i] − θ[k+i+m]))²`.
fn slopes(block: &Block<'_>) -> (f64, u64) {
    let (n, m, theta) = (block.n, block.m, block.theta);
    let gain = |j: usize| theta[j] - theta[j + m];
    let (mut plain, mut weighted) = (0.0, 0.0);
    for part in chunks_until_stop(block, m) {
        for i in part {
            plain += gain(i);
            weighted += i as f64 * gain(i);
        }
    }
    let (middle, last) = ((m - 1) as f64 / 2.0, (m - 1) as f64);
    let mut sum = (middle * plain - weighted).powi(2);
    for part in chunks_until_stop(block, n - 1) {
        for k in part {
            let (old, new) = (gain(k), gain(k + m));
            weighted += last * new - (plain - old);
            plain += new - old;
            sum += (middle * plain - weighted).powi(2);
        }
    }
    (sum, n as u64)
}
