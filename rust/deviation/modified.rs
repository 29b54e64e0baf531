//! Modified Allan variance and its parabolic sister: O(1) per term by running sums begun anew in every block.

use super::Piece;

/// Modified Allan variance, NIST SP 1065 eq. 14: `Σ_k (Σ_{i=k}^{k+m−1} (θ[i+2m] − 2θ[i+m] + θ[i]))²`.
pub fn averages(piece: &Piece<'_>) -> (f64, u64) {
    let (n, m, theta) = (piece.n, piece.m, piece.theta);
    let mut window: f64 = (0..m).map(|i| (theta[i + 2 * m] - theta[i + m]) - (theta[i + m] - theta[i])).sum();
    let mut sum = window * window;
    for k in 0..n - 1 {
        window += (theta[k + 3 * m] - theta[k]) - 3.0 * (theta[k + 2 * m] - theta[k + m]);
        sum += window * window;
    }
    (sum, n as u64)
}

/// Parabolic variance, Vernotte et al. 2016 eq. 9: `Σ_k (Σ_{i<m} ((m−1)/2 − i)(θ[k+i] − θ[k+i+m]))²`.
pub fn slopes(piece: &Piece<'_>) -> (f64, u64) {
    let (n, m, theta) = (piece.n, piece.m, piece.theta);
    let gain = |j: usize| theta[j] - theta[j + m];
    let mut plain: f64 = (0..m).map(gain).sum();
    let mut weighted: f64 = (0..m).map(|i| i as f64 * gain(i)).sum();
    let (middle, last) = ((m - 1) as f64 / 2.0, (m - 1) as f64);
    let mut sum = (middle * plain - weighted).powi(2);
    for k in 0..n - 1 {
        let (old, new) = (gain(k), gain(k + m));
        weighted += last * new - (plain - old);
        plain += new - old;
        sum += (middle * plain - weighted).powi(2);
    }
    (sum, n as u64)
}
