//! Sorted samples and ranks.
//!
//! Samples are mapped to integers with the same order. Sorting these integers needs no branches and is three times as
//! fast as sorting floating-point numbers.

use crate::{Error, Result};

/// Multipliers of the finalizer of MurmurHash3 (Appleby), which permutes all 32-bit indices.
const FACTORS: [u32; 2] = [0x85eb_ca6b, 0xc2b2_ae35];
const INVERSES: [u32; 2] = [inverse(FACTORS[0]), inverse(FACTORS[1])];

/// Multiplicative inverse of an odd number modulo 2³², by Newton's method.
const fn inverse(odd: u32) -> u32 {
    let mut found = odd; // correct in the lowest three bits; each iteration doubles their number
    let mut i = 0;
    while i < 4 {
        found = found.wrapping_mul(2_u32.wrapping_sub(odd.wrapping_mul(found)));
        i += 1;
    }
    found
}

/// Pseudo-random permutation of the 32-bit indices.
const fn shuffled(i: u32) -> u32 {
    let i = (i ^ i >> 16).wrapping_mul(FACTORS[0]);
    let i = (i ^ i >> 13).wrapping_mul(FACTORS[1]);
    i ^ i >> 16
}

/// Inverse of [`shuffled`].
const fn unshuffled(i: u32) -> u32 {
    let i = (i ^ i >> 16).wrapping_mul(INVERSES[1]);
    let i = (i ^ i >> 13 ^ i >> 26).wrapping_mul(INVERSES[0]);
    i ^ i >> 16
}

/// Values in ascending order. NaN with a negative sign bit comes first, other NaN last.
pub(crate) fn in_order(values: &[f64]) -> Vec<f64> {
    let mut keys: Vec<u64> = values.iter().map(|x| ordered_key64(x.to_bits())).collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| f64::from_bits(bits_of_key64(key))).collect()
}

/// Indices that sort the values, rounded to single precision, in ascending order. Equal values are shuffled, so that
/// ties do not keep the order of time.
pub(crate) fn order(values: &[f64]) -> Result<Vec<i64>> {
    if u32::try_from(values.len()).is_err() {
        return Err(Error::Input(format!("order: {} values: at most {}", values.len(), u32::MAX)));
    }
    let mut keys: Vec<u64> = (0_u32..)
        .zip(values)
        .map(|(i, x)| u64::from(ordered_key32((*x as f32).to_bits())) << 32 | u64::from(shuffled(i)))
        .collect();
    keys.sort_unstable();
    Ok(keys.into_iter().map(|key| i64::from(unshuffled(key as u32))).collect())
}

/// Integer with the same order as the number with these bits.
const fn ordered_key64(bits: u64) -> u64 {
    bits ^ (((bits as i64 >> 63) as u64) | 1 << 63)
}

/// Inverse of [`ordered_key64`]: bits of the number from its integer key.
const fn bits_of_key64(key: u64) -> u64 {
    key ^ (((!key as i64 >> 63) as u64) | 1 << 63)
}

/// Like [`ordered_key64`], for single precision.
const fn ordered_key32(bits: u32) -> u32 {
    bits ^ (((bits as i32 >> 31) as u32) | 1 << 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn values_are_sorted_and_ranked(values in prop::collection::vec(prop_oneof![-1e9..1e9_f64, Just(0.0), Just(-0.0), Just(2.5)], 0..300)) {
            let mut expected = values.clone();
            expected.sort_by(f64::total_cmp);
            let found = in_order(&values);
            prop_assert!(found.iter().zip(&expected).all(|(a, b)| a.to_bits() == b.to_bits()));
            let order = order(&values).unwrap();
            let mut every = order.clone();
            every.sort_unstable();
            prop_assert!(every.into_iter().eq(0..values.len() as i64));
            let single: Vec<_> = order.iter().map(|&i| values[i as usize] as f32).collect();
            prop_assert!(single.windows(2).all(|p| p[0] <= p[1]));
        }
    }

    #[test]
    fn equal_values_are_shuffled() {
        let order = order(&[1.0; 1000]).unwrap();
        let steps: Vec<_> = order.windows(2).map(|p| p[1] - p[0]).collect();
        let up = steps.iter().filter(|step| **step > 0).count();
        assert!((300..700).contains(&up), "{up}");
        assert!(steps.iter().filter(|step| step.abs() == 1).count() < 20);
    }

    #[test]
    fn nan_comes_last() {
        let found = in_order(&[f64::NAN, f64::INFINITY, -1.0]);
        assert_eq!(found[..2], [-1.0, f64::INFINITY]);
        assert!(found[2].is_nan());
        assert_eq!(order(&[f64::NAN, -1.0, 3.0]).unwrap(), [1, 2, 0]);
    }
}
