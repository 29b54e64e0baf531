//! Hadamard variance: third differences of the phase, which a linear drift of the rate does not change. NIST SP 1065
//! eqs. 18 and 20.

use super::Block;
use crate::machine::processor::Width;

/// Sum and number of (θ[k+3m] − 3θ[k+2m] + 3θ[k+m] − θ[k])² at every k. Terms that are NaN are skipped.
///
/// If the sum of a strip is finite, the strip contains no NaN. Only other strips are examined term by term.
pub fn overlapping(block: &Block<'_>) -> (f64, u64) {
    // Four streams of 32 KiB stay in the second-level cache when a strip with gaps is read again.
    const STRIP: usize = 4096;
    let (mut sum, mut count) = (0.0, 0);
    for from in (0..block.n).step_by(STRIP) {
        let n = STRIP.min(block.n - from);
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| &block.theta[from + i * block.m..][..n]);
        let strip = third_differences(block.width, [a, b, c, d]);
        if strip.is_nan() {
            for i in 0..n {
                let value = third(a[i], b[i], c[i], d[i]);
                sum += if value.is_nan() { 0.0 } else { value * value };
                count += u64::from(!value.is_nan());
            }
        } else {
            sum += strip;
            count += n as u64;
        }
    }
    (sum, count)
}

/// Σ (d − 3c + 3b − a)² over four slices of equal length.
pub fn third_differences(width: Width, parts: [&[f64]; 4]) -> f64 {
    #[cfg(target_arch = "x86_64")]
    if width.is_wide() {
        // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
        return unsafe { third_differences_avx2(parts) };
    }
    let _ = width;
    third_differences_plain(parts)
}

/// # Safety
/// The processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn third_differences_avx2(parts: [&[f64]; 4]) -> f64 {
    third_differences_plain(parts)
}

#[allow(clippy::inline_always)] // to be compiled with the instructions of its caller
#[inline(always)]
fn third_differences_plain([a, b, c, d]: [&[f64]; 4]) -> f64 {
    const LANES: usize = 16;
    let n = a.len();
    let mut sums = [0.0; LANES];
    let whole = n - n % LANES;
    for at in (0..whole).step_by(LANES) {
        let [a, b, c, d] = [a, b, c, d].map(|v| &v[at..at + LANES]);
        for i in 0..LANES {
            let value = third(a[i], b[i], c[i], d[i]);
            sums[i] += value * value;
        }
    }
    sums.iter().sum::<f64>() + (whole..n).map(|i| third(a[i], b[i], c[i], d[i]).powi(2)).sum::<f64>()
}

/// Like [`overlapping`], at every m-th point of the record.
pub fn adjacent(block: &Block<'_>) -> (f64, u64) {
    let m = block.m;
    let theta = block.theta;
    let (mut sum, mut count) = (0.0, 0);
    for k in (block.first.next_multiple_of(m) - block.first..block.n).step_by(m) {
        let value = third(theta[k], theta[k + m], theta[k + 2 * m], theta[k + 3 * m]);
        if !value.is_nan() {
            sum += value * value;
            count += 1;
        }
    }
    (sum, count)
}

/// Third difference of four values.
#[allow(clippy::inline_always)] // as above
#[inline(always)]
fn third(a: f64, b: f64, c: f64, d: f64) -> f64 {
    (d - a) - 3.0 * (c - b)
}
