//! Estimators computed directly from their definitions, as a reference for tests.

use super::family::Kind;
use crate::phase::Quantity;

/// Phase of the samples. For rates this is the running sum with a leading zero.
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

/// Sum of the squared second differences and their number. Terms that use a NaN sample are skipped.
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

/// Variance (for TIE: the square) and number of terms of a phase without gaps.
pub fn variance(kind: Kind, theta: &[f64], m: usize) -> (f64, u64) {
    mean(kind, &terms(kind, theta, m))
}

/// Like [`variance`] for samples with NaN; terms that use a NaN sample are skipped. For rates the phase across a gap
/// is unknown, so that a term uses all samples between its first and its last point.
pub fn variance_with_gaps(kind: Kind, samples: &[f64], quantity: Quantity, m: usize) -> (f64, u64) {
    if quantity == Quantity::Angle {
        return mean(kind, &terms(kind, samples, m));
    }
    let present: Vec<f64> = samples.iter().copied().filter(|x| !x.is_nan()).collect();
    let level = present.iter().sum::<f64>() / present.len() as f64;
    let centered: Vec<f64> = samples.iter().map(|x| if x.is_nan() { 0.0 } else { x - level }).collect();
    let mut terms = terms(kind, &phase(&centered, Quantity::Rate), m);
    let last = samples.len();
    for (i, term) in terms.iter_mut().enumerate() {
        let (from, to) = match kind {
            Kind::AdjacentHadamard => (i * m, i * m + 3 * m),
            Kind::Hadamard | Kind::HadamardTotal => (i, i + 3 * m),
            Kind::Modified | Kind::ModifiedTotal => (i, i + 3 * m - 1),
            Kind::Parabolic => (i, i + 2 * m - 1),
            Kind::Theo1 | Kind::TieRms | Kind::Mtie => (i, i + m),
            Kind::Total => {
                let at = i + 1;
                let mirrored = |j: isize| if j < 0 { -j } else { j.min(2 * last as isize - j) } as usize;
                let ends = [mirrored(at as isize - m as isize), mirrored((at + m) as isize)];
                let edges = [(at < m).then_some(0), (at + m > last).then_some(last)];
                let all = || ends.into_iter().chain(edges.into_iter().flatten()).chain([at]);
                (all().min().unwrap_or(at), all().max().unwrap_or(at))
            }
        };
        if samples[from..to].iter().any(|x| x.is_nan()) {
            *term = f64::NAN;
        }
    }
    mean(kind, &terms)
}

/// Mean of the terms that are not NaN (for MTIE: their maximum), and their number.
fn mean(kind: Kind, terms: &[f64]) -> (f64, u64) {
    let kept: Vec<f64> = terms.iter().copied().filter(|d| !d.is_nan()).collect();
    let count = kept.len() as u64;
    if kind == Kind::Mtie {
        return (kept.iter().copied().reduce(f64::max).unwrap_or(f64::NAN), count);
    }
    (kept.iter().sum::<f64>() / count as f64, count)
}

/// Terms in units of the result; NaN where a term uses a NaN.
fn terms(kind: Kind, theta: &[f64], m: usize) -> Vec<f64> {
    let n = theta.len();
    let tau = m as f64;
    let third = |k: usize| theta[k + 3 * m] - 3.0 * theta[k + 2 * m] + 3.0 * theta[k + m] - theta[k];
    match kind {
        Kind::Hadamard | Kind::AdjacentHadamard => {
            let step = if kind == Kind::Hadamard { 1 } else { m };
            (0..n - 3 * m).step_by(step).map(|k| third(k).powi(2) / (6.0 * tau * tau)).collect()
        }
        Kind::Modified => {
            let second = |i: usize| theta[i + 2 * m] - 2.0 * theta[i + m] + theta[i];
            let term = |k: usize| ((k..k + m).map(second).sum::<f64>() / tau).powi(2) / (2.0 * tau * tau);
            (0..=n - 3 * m).map(term).collect()
        }
        Kind::Parabolic => {
            let weight = |i: usize| (tau - 1.0) / 2.0 - i as f64;
            let term =
                |k: usize| (0..m).map(|i| weight(i) * (theta[k + i] - theta[k + i + m])).sum::<f64>().powi(2);
            (0..n - 2 * m).map(|k| term(k) / (tau.powi(6) / 72.0)).collect()
        }
        Kind::Total => {
            let last = n as isize - 1;
            let reflected = |i: isize| match i {
                i if i < 0 => 2.0 * theta[0] - theta[(-i) as usize],
                i if i > last => 2.0 * theta[last as usize] - theta[(2 * last - i) as usize],
                i => theta[i as usize],
            };
            let by = m as isize;
            let term = |i: isize| (reflected(i - by) - 2.0 * reflected(i) + reflected(i + by)).powi(2);
            (1..last).map(|i| term(i) / (2.0 * tau * tau)).collect()
        }
        Kind::ModifiedTotal => {
            theta.windows(3 * m).map(|segment| mean_around(segment, m) / (2.0 * tau * tau)).collect()
        }
        Kind::HadamardTotal => {
            let rates: Vec<f64> = theta.windows(2).map(|pair| pair[1] - pair[0]).collect();
            rates.windows(3 * m).map(|segment| mean_around(segment, m) / 6.0).collect()
        }
        Kind::Theo1 => {
            let half = m / 2;
            let term = |i: usize, delta: usize| {
                let d = theta[i] - theta[i + half - delta] + theta[i + m] - theta[i + half + delta];
                d * d / (half - delta) as f64
            };
            let sum = |i: usize| (0..half).map(|delta| term(i, delta)).sum::<f64>();
            (0..n - m).map(|i| sum(i) / (0.75 * tau * tau)).collect()
        }
        Kind::TieRms => (0..n - m).map(|k| (theta[k + m] - theta[k]).powi(2)).collect(),
        Kind::Mtie => {
            let extreme =
                |w: &[f64], pick: fn(f64, f64) -> f64| w.iter().copied().reduce(pick).unwrap_or(0.0);
            let range = |w: &[f64]| {
                let whole = !w.iter().any(|v| v.is_nan());
                if whole { (extreme(w, f64::max) - extreme(w, f64::min)).powi(2) } else { f64::NAN }
            };
            theta.windows(m + 1).map(range).collect()
        }
    }
}

/// Mean of the 6m squared second differences of m-point means of a segment of 3m points, detrended and reflected.
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
