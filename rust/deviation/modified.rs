//! Modified Allan variance and its parabolic sister: O(1) per term by running sums begun anew in every block.

use std::ops::Range;
use std::sync::atomic::Ordering;

use super::Piece;

/// Points between two looks at the flag: less than a millisecond.
const LOOK: usize = 1 << 16;

/// `0..n` in parts, as long as the sum is wanted.
fn parts<'p>(piece: &'p Piece<'_>, n: usize) -> impl Iterator<Item = Range<usize>> + 'p {
    (0..n)
        .step_by(LOOK)
        .take_while(|_| !piece.stop.load(Ordering::Relaxed))
        .map(move |from| from..n.min(from + LOOK))
}

/// Modified Allan variance, NIST SP 1065 eq. 14: `Σ_k (Σ_{i=k}^{k+m−1} (θ[i+2m] − 2θ[i+m] + θ[i]))²`.
pub fn averages(piece: &Piece<'_>) -> (f64, u64) {
    let (n, m, theta) = (piece.n, piece.m, piece.theta);
    let mut window = 0.0;
    for part in parts(piece, m) {
        for i in part {
            window += (theta[i + 2 * m] - theta[i + m]) - (theta[i + m] - theta[i]);
        }
    }
    let mut sum = window * window;
    for part in parts(piece, n - 1) {
        for k in part {
            window += (theta[k + 3 * m] - theta[k]) - 3.0 * (theta[k + 2 * m] - theta[k + m]);
            sum += window * window;
        }
    }
    (sum, n as u64)
}

/// Parabolic variance, Vernotte et al. 2016 eq. 9: `Σ_k (Σ_{i<m} ((m−1)/2 − i)(θ[k+i] − θ[k+i+m]))²`.
pub fn slopes(piece: &Piece<'_>) -> (f64, u64) {
    let (n, m, theta) = (piece.n, piece.m, piece.theta);
    let gain = |j: usize| theta[j] - theta[j + m];
    let (mut plain, mut weighted) = (0.0, 0.0);
    for part in parts(piece, m) {
        for i in part {
            plain += gain(i);
            weighted += i as f64 * gain(i);
        }
    }
    let (middle, last) = ((m - 1) as f64 / 2.0, (m - 1) as f64);
    let mut sum = (middle * plain - weighted).powi(2);
    for part in parts(piece, n - 1) {
        for k in part {
            let (old, new) = (gain(k), gain(k + m));
            weighted += last * new - (plain - old);
            plain += new - old;
            sum += (middle * plain - weighted).powi(2);
        }
    }
    (sum, n as u64)
}
