//! The definitions, word for word, for tests.

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
