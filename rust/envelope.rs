//! Smallest and largest sample of equal stretches: a long record as the band that a screen can show of it.

use crate::{Error, Result};

/// `(low, high)` of each of `buckets` stretches, missing samples left out; NaN where a stretch has none.
///
/// A record of fewer samples than buckets has one bucket a sample.
pub fn envelope(samples: &[f64], buckets: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    if buckets == 0 {
        return Err(Error::Input("an envelope of 0 stretches: ask for at least 1".into()));
    }
    let count = buckets.min(samples.len());
    // u128: a product of two lengths must not overflow.
    let edge = |i: usize| (i as u128 * samples.len() as u128 / count.max(1) as u128) as usize;
    Ok((0..count).map(|i| extremes(&samples[edge(i)..edge(i + 1)])).unzip())
}

fn extremes(stretch: &[f64]) -> (f64, f64) {
    // f64::min and max leave NaN out.
    stretch.iter().fold((f64::NAN, f64::NAN), |(low, high), x| (low.min(*x), high.max(*x)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn missing_samples_are_left_out() {
        let (low, high) = envelope(&[1.0, f64::NAN, 3.0, f64::NAN, f64::NAN], 2).unwrap();
        assert_eq!((low[0], high[0]), (1.0, 1.0));
        assert_eq!((low[1], high[1]), (3.0, 3.0));
        let (low, _) = envelope(&[f64::NAN], 5).unwrap();
        assert!(low.len() == 1 && low[0].is_nan());
        assert!(envelope(&[1.0], 0).is_err());
    }

    proptest! {
        /// Every sample lies in the band of its stretch, both ends are samples, and nothing is left out.
        #[test]
        fn the_band_is_tight(samples in prop::collection::vec(-1e9..1e9_f64, 1..200), buckets in 1_usize..50) {
            let (low, high) = envelope(&samples, buckets).unwrap();
            let count = buckets.min(samples.len());
            prop_assert_eq!(low.len(), count);
            let mut seen = 0;
            for i in 0..count {
                let stretch = &samples[i * samples.len() / count..(i + 1) * samples.len() / count];
                seen += stretch.len();
                let mut sorted = stretch.to_vec();
                sorted.sort_by(f64::total_cmp);
                prop_assert_eq!((low[i], high[i]), (sorted[0], sorted[sorted.len() - 1]));
            }
            prop_assert_eq!(seen, samples.len());
        }
    }
}
