//! Statistics computed directly from their definitions, as a reference for tests.

use super::statistic::Statistic;
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
pub fn variance(statistic: &dyn Statistic, theta: &[f64], m: usize) -> (f64, u64) {
    mean(statistic, &statistic.definition(theta, m))
}

/// Like [`variance`] for samples with NaN; terms that use a NaN sample are skipped. For rates the phase across a gap
/// is unknown, so that a term uses all samples between its first and its last point.
pub fn variance_with_gaps(
    statistic: &dyn Statistic,
    samples: &[f64],
    quantity: Quantity,
    m: usize,
) -> (f64, u64) {
    if quantity == Quantity::Angle {
        return mean(statistic, &statistic.definition(samples, m));
    }
    let present: Vec<f64> = samples.iter().copied().filter(|x| !x.is_nan()).collect();
    let level = present.iter().sum::<f64>() / present.len() as f64;
    let centered: Vec<f64> = samples.iter().map(|x| if x.is_nan() { 0.0 } else { x - level }).collect();
    let mut terms = statistic.definition(&phase(&centered, Quantity::Rate), m);
    for (i, term) in terms.iter_mut().enumerate() {
        let (first, last) = statistic.points_of_term(i, m, samples.len());
        if samples[first..last].iter().any(|x| x.is_nan()) {
            *term = f64::NAN;
        }
    }
    mean(statistic, &terms)
}

/// Mean (or maximum) of the terms that are not NaN, and their number.
fn mean(statistic: &dyn Statistic, terms: &[f64]) -> (f64, u64) {
    let kept: Vec<f64> = terms.iter().copied().filter(|d| !d.is_nan()).collect();
    let count = kept.len() as u64;
    if statistic.is_maximum() {
        return (kept.iter().copied().reduce(f64::max).unwrap_or(f64::NAN), count);
    }
    (kept.iter().sum::<f64>() / count as f64, count)
}
