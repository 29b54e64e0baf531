//! Hadamard variance: third differences of the phase, blind to a drift of the rate. NIST SP 1065 eqs. 18 and 20.

use super::family::Piece;

/// Σ (θ[k+3m] − 3θ[k+2m] + 3θ[k+m] − θ[k])² at every k; terms that are NaN are left out.
pub fn overlapping(piece: &Piece<'_>) -> (f64, u64) {
    let (n, m) = (piece.n, piece.m);
    let [a, b, c, d] = [0, m, 2 * m, 3 * m].map(|at| &piece.theta[at..at + n]);
    let (mut sums, mut gaps) = ([0.0; 8], [0_u64; 8]);
    let (mut rest, mut missing) = (0.0, 0);
    let whole = n - n % 8;
    for at in (0..whole).step_by(8) {
        for i in 0..8 {
            let value = third(a[at + i], b[at + i], c[at + i], d[at + i]);
            sums[i] += if value.is_nan() { 0.0 } else { value * value };
            gaps[i] += u64::from(value.is_nan());
        }
    }
    for at in whole..n {
        let value = third(a[at], b[at], c[at], d[at]);
        rest += if value.is_nan() { 0.0 } else { value * value };
        missing += u64::from(value.is_nan());
    }
    (sums.iter().sum::<f64>() + rest, n as u64 - missing - gaps.iter().sum::<u64>())
}

/// The same at every m-th point of the record.
pub fn adjacent(piece: &Piece<'_>) -> (f64, u64) {
    let m = piece.m;
    let theta = piece.theta;
    let (mut sum, mut count) = (0.0, 0);
    for k in (piece.first.next_multiple_of(m) - piece.first..piece.n).step_by(m) {
        let value = third(theta[k], theta[k + m], theta[k + 2 * m], theta[k + 3 * m]);
        if !value.is_nan() {
            sum += value * value;
            count += 1;
        }
    }
    (sum, count)
}

#[inline]
fn third(a: f64, b: f64, c: f64, d: f64) -> f64 {
    (d - a) - 3.0 * (c - b)
}
