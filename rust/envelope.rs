//! Minimum and maximum of equal segments of a record, for plotting a long record.

use crate::{Error, Result};

/// Minimum and maximum of each of `buckets` equal segments. Missing samples (NaN) are ignored; a segment without
/// samples gives NaN.
///
/// A record with fewer samples than `buckets` gets one segment per sample.
pub(crate) fn envelope(samples: &[f64], buckets: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    if buckets == 0 {
        return Err(Error::Input("envelope: the number of segments is 0; give at least 1".into()));
    }
    let count = buckets.min(samples.len());
    // u128: a product of two lengths must not overflow.
    let edge = |i: usize| (i as u128 * samples.len() as u128 / count.max(1) as u128) as usize;
    Ok((0..count).map(|i| extremes(&samples[edge(i)..edge(i + 1)])).unzip())
}

/// Minimum and maximum of a segment; NaN if all samples are NaN.
fn extremes(segment: &[f64]) -> (f64, f64) {
    // f64::min and f64::max ignore NaN.
    segment.iter().fold((f64::NAN, f64::NAN), |(low, high), x| (low.min(*x), high.max(*x)))
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
        /// Both limits of every segment are samples of it, every sample lies between them, and no sample is skipped.
        #[test]
        fn the_band_is_tight(samples in prop::collection::vec(-1e9..1e9_f64, 1..200), buckets in 1_usize..50) {
            let (low, high) = envelope(&samples, buckets).unwrap();
            let count = buckets.min(samples.len());
            prop_assert_eq!(low.len(), count);
            let mut seen = 0;
            for i in 0..count {
                let segment = &samples[i * samples.len() / count..(i + 1) * samples.len() / count];
                seen += segment.len();
                let mut sorted = segment.to_vec();
                sorted.sort_by(f64::total_cmp);
                prop_assert_eq!((low[i], high[i]), (sorted[0], sorted[sorted.len() - 1]));
            }
            prop_assert_eq!(seen, samples.len());
        }
    }
}
