//! Halving of the sample rate with a low-pass filter, and statistics of single steps.

use crate::machine::processor::compiled_for_each_width;

/// Number of samples on each side that contribute to a halved sample.
pub(crate) const REACH: usize = 16;
/// Number of output samples computed at a time, so that the even and odd input samples stay in the first-level cache.
const BLOCK: usize = 512;
/// Number of output samples whose sums are held in registers: two chains of additions hide each other's latency.
const LANES: usize = 16;
/// Number of independent partial sums of the step statistics.
const STEPS: usize = 8;

compiled_for_each_width! {
    /// Writes the samples at half the rate to `out`. Each lies halfway between two input samples; the first between
    /// `x[REACH]` and the next one.
    ///
    /// Products are summed in a fixed order without fused operations. So a sample has the same bits whatever else is
    /// computed with it, and on every vector unit.
    pub(crate) fn halve(taps: &[f64; REACH], x: &[f64], out: &mut [f64]) = halve_inline
}

/// Body of [`halve`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn halve_inline(taps: &[f64; REACH], x: &[f64], out: &mut [f64]) {
    let (mut even, mut odd) = ([0.0; BLOCK + REACH], [0.0; BLOCK + REACH]);
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        let pairs = out.len() + REACH;
        split(&x[2 * BLOCK * block..][..2 * pairs], &mut even, &mut odd);
        halve_split(taps, &even[..pairs], &odd[..pairs], out);
    }
}

/// Splits an even number of samples into even and odd ones.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
pub(crate) fn split(x: &[f64], even: &mut [f64], odd: &mut [f64]) {
    for ((pair, even), odd) in x.as_chunks::<2>().0.iter().zip(even).zip(odd) {
        (*even, *odd) = (pair[0], pair[1]);
    }
}

/// Like [`halve`], for separate even and odd samples. Both must have `REACH` samples more than `out`. The code is
/// inlined into a caller that is compiled for its vector unit.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
pub(crate) fn halve_split(taps: &[f64; REACH], even: &[f64], odd: &[f64], out: &mut [f64]) {
    let mut at = 0;
    let mut lanes = out.chunks_exact_mut(LANES);
    for out in &mut lanes {
        out.copy_from_slice(&halved_at::<LANES>(taps, even, odd, at));
        at += LANES;
    }
    for out in lanes.into_remainder() {
        [*out] = halved_at::<1>(taps, even, odd, at);
        at += 1;
    }
}

/// `N` samples at half the rate, from index `at` on.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn halved_at<const N: usize>(taps: &[f64; REACH], even: &[f64], odd: &[f64], at: usize) -> [f64; N] {
    let (even, odd) = (&even[at..at + N + REACH], &odd[at..at + N + REACH]);
    let mut sum = [0.0; N];
    for step in 0..REACH / 2 {
        let (before, after) = (REACH / 2 - step, REACH / 2 + step);
        for lane in 0..N {
            sum[lane] += taps[2 * step] * (even[before + lane] + odd[after + lane]);
        }
        for lane in 0..N {
            sum[lane] += taps[2 * step + 1] * (odd[before - 1 + lane] + even[after + 1 + lane]);
        }
    }
    sum
}

compiled_for_each_width! {
    /// Minimum, maximum, number of steps that are zero, Σd² and Σd⁴, where d are the steps between adjacent samples.
    ///
    /// Missing samples (NaN) are ignored in the extremes and make the sums NaN.
    pub(crate) fn steps(x: &[f64]) -> [f64; 5] = steps_of
}

/// Body of [`steps`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn steps_of(x: &[f64]) -> [f64; 5] {
    let Some((last, _)) = x.split_last() else { return [f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0, 0.0] };
    let (ours, rest) = x[..x.len() - 1].as_chunks::<STEPS>();
    let (next, rest_next) = x[1..].as_chunks::<STEPS>();
    // Padding lanes count as steps of zero; they are subtracted below.
    let mut end = [[*last; STEPS]; 2];
    end[0][..rest.len()].copy_from_slice(rest);
    end[1][..rest.len()].copy_from_slice(rest_next);
    let (mut low, mut high) = ([f64::INFINITY; STEPS], [f64::NEG_INFINITY; STEPS]);
    let (mut still, mut square, mut fourth) = ([0_u64; STEPS], [0.0; STEPS], [0.0; STEPS]);
    for (ours, next) in ours.iter().zip(next).chain([(&end[0], &end[1])]) {
        let step: [f64; STEPS] = std::array::from_fn(|lane| next[lane] - ours[lane]);
        // One loop per quantity: the compiler does not vectorize a combined loop.
        for lane in 0..STEPS {
            low[lane] = if ours[lane] < low[lane] { ours[lane] } else { low[lane] };
        }
        for lane in 0..STEPS {
            high[lane] = if ours[lane] > high[lane] { ours[lane] } else { high[lane] };
        }
        for lane in 0..STEPS {
            still[lane] += u64::from(step[lane] == 0.0);
        }
        let d = step.map(|step| step * step);
        for lane in 0..STEPS {
            square[lane] += d[lane];
        }
        for lane in 0..STEPS {
            fourth[lane] += d[lane] * d[lane];
        }
    }
    // `black_box` keeps the compiler from pairing the lanes of both sums in every step.
    let sum = |lanes: [f64; STEPS]| std::hint::black_box(lanes).iter().sum::<f64>();
    [
        low.into_iter().fold(f64::INFINITY, f64::min),
        high.into_iter().fold(f64::NEG_INFINITY, f64::max),
        (still.iter().sum::<u64>() - if last.is_nan() { 0 } else { (STEPS - rest.len()) as u64 }) as f64,
        sum(square),
        sum(fourth),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::processor::Width;

    fn values(n: usize) -> Vec<f64> {
        (0..n).map(|i| ((i * i * 31 + 7 * i) % 97) as f64).collect()
    }

    #[test]
    fn every_width_halves_to_the_same_bits() {
        let taps: [f64; REACH] = std::array::from_fn(|i| 0.3 / (1.0 + i as f64));
        for size in [0, 1, 7, 8, 9, BLOCK - 1, BLOCK, BLOCK + 5] {
            let x = values(2 * (size + REACH));
            let expected: Vec<f64> = (0..size)
                .map(|k| {
                    let middle = 2 * k + REACH + 1;
                    (0..REACH).fold(0.0, |sum, i| sum + taps[i] * (x[middle - 1 - i] + x[middle + i]))
                })
                .collect();
            for width in Width::available() {
                let mut found = vec![0.0; size];
                halve(width, &taps, &x, &mut found);
                assert_eq!(found, expected, "{size}");
            }
        }
    }

    #[test]
    fn steps_are_counted() {
        for n in [0, 1, 2, 8, 9, 17, 40] {
            let mut x = values(n);
            if n > 2 {
                x[2] = x[1];
            }
            let d: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let still = d.iter().filter(|d| **d == 0.0).count() as f64;
            for width in Width::available() {
                let [low, high, none, square, fourth] = steps(width, &x);
                assert_eq!(low, x.iter().copied().fold(f64::INFINITY, f64::min));
                assert_eq!(high, x.iter().copied().fold(f64::NEG_INFINITY, f64::max));
                // Whole numbers are summed exactly.
                assert_eq!(none, still, "{n}");
                assert_eq!(square, d.iter().map(|d| d * d).sum::<f64>());
                assert_eq!(fourth, d.iter().map(|d| d * d * d * d).sum::<f64>());
            }
        }
        for at in 0..20 {
            let mut x = values(20);
            x[at] = f64::NAN;
            let [low, high, _, square, _] = steps(Width::best(), &x);
            assert!(low >= 0.0 && high < 97.0 && square.is_nan(), "{at}");
        }
    }
}
