//! The definitions, word for word, for tests.

use super::family::Kind;
use crate::phase::Quantity;

/// Phase of rates: the running sum with the leading zero.
pub fn phase(samples: &[f64], quantity: Quantity) -> Vec<f64> {
    match quantity {
        Quantity::Angle => samples.to_vec(),
        Quantity::Rate => {
            let mut sum = 0.0;
            let sums = samples.iter().map(|x| {
                sum += x;
                sum
            });
            std::iter::once(0.0).chain(sums).collect()
        }
    }
}

/// Mean of the squared second differences, and their number; terms that touch a NaN are left out.
pub fn second_differences(samples: &[f64], quantity: Quantity, m: usize) -> (f64, u64) {
    let clean: Vec<f64> = samples.iter().map(|x| if x.is_nan() { 0.0 } else { *x }).collect();
    let theta = phase(if quantity == Quantity::Rate { &clean } else { samples }, quantity);
    let (mut sum, mut count) = (0.0, 0);
    for k in 0..theta.len().saturating_sub(2 * m) {
        let d = theta[k + 2 * m] - 2.0 * theta[k + m] + theta[k];
        let gap = quantity == Quantity::Rate && samples[k..k + 2 * m].iter().any(|x| x.is_nan());
        if !gap && !d.is_nan() {
            sum += d * d;
            count += 1;
        }
    }
    (sum, count)
}

/// Variance (of TIE: the square) and number of terms of a gapless phase, by the definition.
pub fn variance(kind: Kind, theta: &[f64], m: usize) -> (f64, u64) {
    let n = theta.len();
    let tau = m as f64;
    let mean = |values: &[f64], scale: f64| {
        (values.iter().sum::<f64>() / values.len() as f64 / scale, values.len() as u64)
    };
    let third = |k: usize| theta[k + 3 * m] - 3.0 * theta[k + 2 * m] + 3.0 * theta[k + m] - theta[k];
    match kind {
        Kind::Hadamard | Kind::AdjacentHadamard => {
            let step = if kind == Kind::Hadamard { 1 } else { m };
            let d: Vec<f64> = (0..n - 3 * m).step_by(step).map(|k| third(k).powi(2)).collect();
            mean(&d, 6.0 * tau * tau)
        }
        Kind::Modified => {
            let second = |i: usize| theta[i + 2 * m] - 2.0 * theta[i + m] + theta[i];
            let d: Vec<f64> =
                (0..=n - 3 * m).map(|k| ((k..k + m).map(second).sum::<f64>() / tau).powi(2)).collect();
            mean(&d, 2.0 * tau * tau)
        }
        Kind::Parabolic => {
            let weight = |i: usize| (tau - 1.0) / 2.0 - i as f64;
            let term =
                |k: usize| (0..m).map(|i| weight(i) * (theta[k + i] - theta[k + i + m])).sum::<f64>().powi(2);
            mean(&(0..n - 2 * m).map(term).collect::<Vec<_>>(), tau.powi(6) / 72.0)
        }
        Kind::Total => {
            let last = n as isize - 1;
            let reflected = |i: isize| match i {
                i if i < 0 => 2.0 * theta[0] - theta[(-i) as usize],
                i if i > last => 2.0 * theta[last as usize] - theta[(2 * last - i) as usize],
                i => theta[i as usize],
            };
            let m = m as isize;
            let d: Vec<f64> = (1..last)
                .map(|i| (reflected(i - m) - 2.0 * reflected(i) + reflected(i + m)).powi(2))
                .collect();
            mean(&d, 2.0 * tau * tau)
        }
        Kind::ModifiedTotal => {
            let d: Vec<f64> = theta.windows(3 * m).map(|stretch| mean_around(stretch, m)).collect();
            mean(&d, 2.0 * tau * tau)
        }
        Kind::HadamardTotal => {
            let rates: Vec<f64> = theta.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let d: Vec<f64> = rates.windows(3 * m).map(|stretch| mean_around(stretch, m)).collect();
            mean(&d, 6.0)
        }
        Kind::Theo1 => {
            let half = m / 2;
            let term = |i: usize, delta: usize| {
                let d = theta[i] - theta[i + half - delta] + theta[i + m] - theta[i + half + delta];
                d * d / (half - delta) as f64
            };
            let d: Vec<f64> = (0..n - m).map(|i| (0..half).map(|delta| term(i, delta)).sum()).collect();
            mean(&d, 0.75 * tau * tau)
        }
        Kind::TieRms => mean(&(0..n - m).map(|k| (theta[k + m] - theta[k]).powi(2)).collect::<Vec<_>>(), 1.0),
        Kind::Mtie => {
            let extreme =
                |w: &[f64], pick: fn(f64, f64) -> f64| w.iter().copied().reduce(pick).unwrap_or(0.0);
            let range = |w: &[f64]| extreme(w, f64::max) - extreme(w, f64::min);
            (theta.windows(m + 1).map(range).fold(0.0, f64::max).powi(2), (n - m) as u64)
        }
    }
}

/// Mean of the 6m squared second differences of m-point means of a stretch of 3m points, detrended and reflected.
fn mean_around(stretch: &[f64], m: usize) -> f64 {
    let length = stretch.len();
    let (half, other) = (length / 2, length.div_ceil(2));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let slope = (mean(&stretch[other..]) - mean(&stretch[..half])) / other as f64;
    let flat: Vec<f64> = stretch.iter().enumerate().map(|(i, x)| x - slope * i as f64).collect();
    let all: Vec<f64> = flat.iter().rev().chain(&flat).chain(flat.iter().rev()).copied().collect();
    let d = |i: usize| {
        mean(&all[i..i + m]) - 2.0 * mean(&all[i + m..i + 2 * m]) + mean(&all[i + 2 * m..i + 3 * m])
    };
    (0..6 * m).map(|i| d(i).powi(2)).sum::<f64>() / (6 * m) as f64
}
