//! Every second sample of a low-passed series, and what single samples tell.

use crate::machine::processor::{Unit, Width};

/// Samples to each side that a halved sample is made of.
pub const REACH: usize = 16;
/// Samples at half the rate that are made at a time; even and odd samples of these stay in the first cache.
const BLOCK: usize = 512;
/// Samples at half the rate whose sums are in registers.
const LANES: usize = 8;

/// Samples at half the rate: each stands at the middle of two, the first at that of `x[REACH]` and the next.
///
/// Sums of products in one order, no fused ones: a sample comes out the same whatever was computed with it, and whatever
/// computed it.
pub fn halve(width: Width, taps: &[f64; REACH], x: &[f64], out: &mut [f64]) {
    // SAFETY: a `Width` is only made of units that the processor has.
    unsafe {
        match width.unit() {
            Unit::Portable => halve_inline(taps, x, out),
            #[cfg(target_arch = "x86_64")]
            Unit::Avx2 => halve_avx2(taps, x, out),
            #[cfg(target_arch = "x86_64")]
            Unit::Avx512 => halve_avx512(taps, x, out),
        }
    }
}

/// [`halve`] for a caller that has been compiled for its vectors.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
pub fn halve_inline(taps: &[f64; REACH], x: &[f64], out: &mut [f64]) {
    for (block, out) in out.chunks_mut(BLOCK).enumerate() {
        block_of(taps, &x[2 * BLOCK * block..], out);
    }
}

#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn block_of(taps: &[f64; REACH], x: &[f64], out: &mut [f64]) {
    let mut even = [0.0; BLOCK + REACH + LANES];
    let mut odd = [0.0; BLOCK + REACH + LANES];
    let (pairs, _) = x[..2 * (out.len() + REACH)].as_chunks::<2>();
    for (i, [a, b]) in pairs.iter().enumerate() {
        (even[i], odd[i]) = (*a, *b);
    }
    for (at, out) in out.chunks_mut(LANES).enumerate() {
        let at = LANES * at;
        let mut sum = [0.0; LANES];
        for (i, tap) in taps.iter().enumerate() {
            let (before, after) = if i % 2 == 0 { (&even, &odd) } else { (&odd, &even) };
            let step = i.div_ceil(2);
            let eight =
                |from: &[f64], at: usize| *from[at..].first_chunk::<LANES>().expect("room for the lanes");
            let (before, after) = (eight(before, at + REACH / 2 - step), eight(after, at + REACH / 2 + step));
            for lane in 0..LANES {
                sum[lane] += tap * (before[lane] + after[lane]);
            }
        }
        out.copy_from_slice(&sum[..out.len()]);
    }
}

/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn halve_avx2(taps: &[f64; REACH], x: &[f64], out: &mut [f64]) {
    halve_inline(taps, x, out);
}

/// # Safety
/// The processor has AVX-512F and VL.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
unsafe fn halve_avx512(taps: &[f64; REACH], x: &[f64], out: &mut [f64]) {
    halve_inline(taps, x, out);
}

/// Smallest and largest sample, how many steps from one to the next are 0, and Σd² and Σd⁴ of them.
///
/// Samples that are missing are no extreme, and make the sums NaN.
pub fn steps(width: Width, x: &[f64]) -> [f64; 5] {
    // SAFETY: a `Width` is only made of units that the processor has.
    unsafe {
        match width.unit() {
            Unit::Portable => steps_of(x),
            #[cfg(target_arch = "x86_64")]
            Unit::Avx2 => steps_avx2(x),
            #[cfg(target_arch = "x86_64")]
            Unit::Avx512 => steps_avx512(x),
        }
    }
}

#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn steps_of(x: &[f64]) -> [f64; 5] {
    let Some((last, _)) = x.split_last() else { return [f64::INFINITY, f64::NEG_INFINITY, 0.0, 0.0, 0.0] };
    let (ours, rest) = x[..x.len() - 1].as_chunks::<LANES>();
    let (next, rest_next) = x[1..].as_chunks::<LANES>();
    // Lanes without a step stand still: they are taken off again.
    let mut end = [[*last; LANES]; 2];
    end[0][..rest.len()].copy_from_slice(rest);
    end[1][..rest.len()].copy_from_slice(rest_next);
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    let (mut still, mut square, mut fourth) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for (ours, next) in ours.iter().zip(next).chain([(&end[0], &end[1])]) {
        for lane in 0..LANES {
            let (a, step) = (ours[lane], next[lane] - ours[lane]);
            let d = step * step;
            low[lane] = if a < low[lane] { a } else { low[lane] };
            high[lane] = if a > high[lane] { a } else { high[lane] };
            still[lane] += if step == 0.0 { 1.0 } else { 0.0 };
            square[lane] += d;
            fourth[lane] += d * d;
        }
    }
    let sum = |lanes: [f64; LANES]| lanes.iter().sum::<f64>();
    [
        low.into_iter().fold(f64::INFINITY, f64::min),
        high.into_iter().fold(f64::NEG_INFINITY, f64::max),
        sum(still) - if last.is_nan() { 0.0 } else { (LANES - rest.len()) as f64 },
        sum(square),
        sum(fourth),
    ]
}

/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn steps_avx2(x: &[f64]) -> [f64; 5] {
    steps_of(x)
}

/// # Safety
/// The processor has AVX-512F and VL.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx2")]
unsafe fn steps_avx512(x: &[f64]) -> [f64; 5] {
    steps_of(x)
}

#[cfg(test)]
mod tests {
    use super::*;

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
