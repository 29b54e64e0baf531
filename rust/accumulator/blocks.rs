//! Elementwise operations on the blocks of a level.

use crate::machine::processor::compiled_for_each_width;

/// Replaces NaN blocks by zero, and returns the half-open index ranges of all other blocks.
pub(super) fn runs_between_gaps(blocks: &mut [f64]) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut open = 0;
    for (i, block) in blocks.iter_mut().enumerate() {
        if block.is_nan() {
            *block = 0.0;
            runs.extend((i > open).then_some((open, i)));
            open = i + 1;
        }
    }
    runs.extend((blocks.len() > open).then_some((open, blocks.len())));
    runs
}

compiled_for_each_width! {
    /// Writes `samples` − `origin` to `out`.
    pub(super) fn minus_origin(samples: &[f64], origin: f64, out: &mut [f64]) = minus_origin_inline
}

/// Body of [`minus_origin`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn minus_origin_inline(samples: &[f64], origin: f64, out: &mut [f64]) {
    for (out, x) in out.iter_mut().zip(samples) {
        *out = x - origin;
    }
}

compiled_for_each_width! {
    /// Writes the sums of adjacent pairs of `blocks` to `out`; a last block without a partner is ignored.
    pub(super) fn pair_sums(blocks: &[f64], out: &mut [f64]) = pair_sums_inline
}

/// Body of [`pair_sums`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn pair_sums_inline(blocks: &[f64], out: &mut [f64]) {
    for (out, pair) in out.iter_mut().zip(blocks.as_chunks::<2>().0) {
        *out = pair[0] + pair[1];
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::machine::processor::Width;

    proptest! {
        #[test]
        fn every_width_gives_the_bits_of_the_definition(
            samples in prop::collection::vec(-1e6_f64..1e6, 0..100),
            origin in -1e6_f64..1e6,
        ) {
            for width in Width::available() {
                let mut counted = vec![0.0; samples.len()];
                minus_origin(width, &samples, origin, &mut counted);
                prop_assert!(counted.iter().zip(&samples).all(|(found, x)| *found == x - origin));
                let mut pairs = vec![0.0; samples.len() / 2];
                pair_sums(width, &samples, &mut pairs);
                prop_assert!(pairs.iter().zip(samples.chunks(2)).all(|(found, pair)| *found == pair[0] + pair[1]));
            }
        }
    }
}
