//! Modified Allan variance and parabolic variance, in O(1) per term by running sums that restart in every block.

use std::ops::Range;
use std::sync::atomic::Ordering;

use super::Block;

/// Number of points between two checks of the stop flag: less than a millisecond.
const CHECK_INTERVAL: usize = 1 << 16;

/// The range `0..n` in chunks; ends early when the stop flag is set.
fn chunks_until_stop<'p>(block: &'p Block<'_>, n: usize) -> impl Iterator<Item = Range<usize>> + 'p {
    (0..n)
        .step_by(CHECK_INTERVAL)
        .take_while(|_| !block.stop.load(Ordering::Relaxed))
        .map(move |from| from..n.min(from + CHECK_INTERVAL))
}

/// Sum and number of terms of the modified Allan variance, NIST SP 1065 eq. 14:
/// `Σ_k (Σ_{i=k}^{k+m−1} (θ[i+2m] − 2θ[i+m] + θ[i]))²`.
pub fn averages(block: &Block<'_>) -> (f64, u64) {
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

/// Sum and number of terms of the parabolic variance, Vernotte et al. 2016 eq. 9:
/// `Σ_k (Σ_{i<m} ((m−1)/2 − i)(θ[k+i] − θ[k+i+m]))²`.
pub fn slopes(block: &Block<'_>) -> (f64, u64) {
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
