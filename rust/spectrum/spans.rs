//! Search for the best pair of steps: an effect that starts at one time of a record and ends at another.
//!
//! The scalar product of two steps consists of sums over sines of the sum and of the difference of their places. Two
//! transforms give these sums at all places, and [`best_pair`] receives them. So each pair costs one division.

use std::sync::atomic::AtomicBool;

use crate::parallel::check;
use crate::{Error, Result};

/// The pair of steps that explains most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pair {
    /// Places of the steps, first < last.
    pub first: usize,
    pub last: usize,
    /// ½z² less the logarithm of the distance.
    pub gain: f64,
}

/// The pair i < l with the largest ½(s_l − s_i)²/(o_i + o_l − 2 h_il) − ln(l − i).
///
/// `score` and `own` belong to m steps. h_il = ½(w_{l−i} − w_{l+i+2}) − b_i·b_l, with at least 2m values w in
/// `waves`. The rows b of `explained` (m, k) are the parts of each step that other effects can explain. Pairs closer
/// than `min_distance` places are excluded, and so are pairs whose denominator is at most `floor`.
pub(crate) fn best_pair(
    score: &[f64],
    own: &[f64],
    waves: &[f64],
    explained: &[f64],
    min_distance: usize,
    floor: f64,
    stop: &AtomicBool,
) -> Result<Pair> {
    let m = score.len();
    if m < 2 || own.len() != m || waves.len() < 2 * m || !explained.len().is_multiple_of(m) {
        return Err(Error::Input(format!(
            "spans: {m} scores, {} sizes, {} waves and {} explained parts: the sizes do not match",
            own.len(),
            waves.len(),
            explained.len()
        )));
    }
    let k = explained.len() / m;
    let logarithm: Vec<f64> = (0..m).map(|d| (d.max(1) as f64).ln()).collect();
    let mut best = Pair { first: 0, last: 1, gain: f64::NEG_INFINITY };
    let mut gain = vec![0.0; m];
    let min_distance = min_distance.max(1);
    for i in 0..m.saturating_sub(min_distance) {
        check(stop)?;
        let from = i + min_distance;
        let row = &explained[i * k..(i + 1) * k];
        for l in from..m {
            let common: f64 = row.iter().zip(&explained[l * k..(l + 1) * k]).map(|(a, b)| a * b).sum();
            let shared = 0.5 * (waves[l - i] - waves[l + i + 2]) - common;
            let apart = own[i] + own[l] - 2.0 * shared;
            let rise = score[l] - score[i];
            let square = if apart > floor { rise * rise / apart } else { 0.0 };
            gain[l] = 0.5 * square - logarithm[l - i];
        }
        for (l, &value) in gain.iter().enumerate().skip(from) {
            if value > best.gain {
                best = Pair { first: i, last: l, gain: value };
            }
        }
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use proptest::prelude::*;

    use super::{Pair, best_pair};

    /// The same result from the formula, pair by pair.
    fn naive(
        score: &[f64],
        own: &[f64],
        waves: &[f64],
        explained: &[f64],
        min_distance: usize,
        floor: f64,
    ) -> Pair {
        let (m, k) = (score.len(), explained.len() / score.len());
        let mut best = Pair { first: 0, last: 1, gain: f64::NEG_INFINITY };
        for i in 0..m {
            for l in i + 1..m {
                let common: f64 = (0..k).map(|p| explained[i * k + p] * explained[l * k + p]).sum();
                let apart = own[i] + own[l] - (waves[l - i] - waves[l + i + 2]) + 2.0 * common;
                let square = if apart > floor { (score[l] - score[i]).powi(2) / apart } else { 0.0 };
                let gain = 0.5 * square - ((l - i) as f64).ln();
                if l - i >= min_distance && gain > best.gain {
                    best = Pair { first: i, last: l, gain };
                }
            }
        }
        best
    }

    proptest! {
        #[test]
        fn the_best_of_all_pairs(
            score in prop::collection::vec(-3.0f64..3.0, 2..40),
            k in 0usize..3,
            min_distance in 1usize..4,
            seed in 0u64..1000,
        ) {
            let m = score.len();
            let mut x = seed as f64;
            let mut next = || { x = (x * 12.9898 + 78.233).sin() * 43758.5453; x.fract().abs() };
            let own: Vec<f64> = (0..m).map(|_| 1.0 + next()).collect();
            let waves: Vec<f64> = (0..2 * m).map(|_| next()).collect();
            let explained: Vec<f64> = (0..m * k).map(|_| 0.2 * next()).collect();
            let found = best_pair(&score, &own, &waves, &explained, min_distance, 0.1, &AtomicBool::new(false)).unwrap();
            let wanted = naive(&score, &own, &waves, &explained, min_distance, 0.1);
            if wanted.gain.is_finite() {
                // Rounding may decide between ties, so only the gains are compared.
                prop_assert!((found.gain - wanted.gain).abs() <= 1e-9 * (1.0 + wanted.gain.abs()));
            } else {
                prop_assert!(!found.gain.is_finite());
            }
        }
    }

    #[test]
    fn wrong_sizes_are_refused() {
        assert!(best_pair(&[0.0; 3], &[1.0; 3], &[0.0; 5], &[], 1, 0.0, &AtomicBool::new(false)).is_err());
    }
}
