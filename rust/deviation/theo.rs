//! Theo1: differences of every stride up to m within m + 1 points. NIST SP 1065 eq. 30; m is even, and the effective
//! τ is 0.75 m τ₀.

use std::sync::atomic::Ordering;

use super::Block;
use crate::machine::processor::Width;

/// Sum of `Σ_{δ<m/2} (x[i] − x[i−δ+m/2] + x[i+m] − x[i+δ+m/2])² / (m/2 − δ)` over i, and the number of i.
pub fn theo1(block: &Block<'_>, work: &mut Vec<f64>) -> (f64, u64) {
    let (n, m, theta) = (block.n, block.m, block.theta);
    work.clear();
    work.extend(theta[..n].iter().zip(&theta[m..m + n]).map(|(a, b)| a + b));
    let half = m / 2;
    let sum = (0..half)
        .take_while(|_| !block.stop.load(Ordering::Relaxed))
        .map(|delta| {
            let (near, far) = (&theta[half - delta..][..n], &theta[half + delta..][..n]);
            squares(block.width, work, near, far) / (half - delta) as f64
        })
        .sum();
    (sum, n as u64)
}

/// Σ (ends − near − far)² with the instructions of the unit.
fn squares(width: Width, ends: &[f64], near: &[f64], far: &[f64]) -> f64 {
    #[cfg(target_arch = "x86_64")]
    if width.is_wide() {
        // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
        return unsafe { squares_avx2(ends, near, far) };
    }
    let _ = width;
    squares_plain(ends, near, far)
}

/// # Safety
/// The processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn squares_avx2(ends: &[f64], near: &[f64], far: &[f64]) -> f64 {
    squares_plain(ends, near, far)
}

/// Σ (ends − near − far)².
#[allow(clippy::inline_always)] // to be compiled with the instructions of its caller
#[inline(always)]
fn squares_plain(ends: &[f64], near: &[f64], far: &[f64]) -> f64 {
    let n = ends.len();
    let (near, far) = (&near[..n], &far[..n]);
    let mut sums = [0.0; 16];
    let whole = n - n % 16;
    for at in (0..whole).step_by(16) {
        let [e, a, b] = [ends, near, far].map(|v| &v[at..at + 16]);
        for i in 0..16 {
            let value = e[i] - (a[i] + b[i]);
            sums[i] += value * value;
        }
    }
    let rest = (whole..n).map(|i| (ends[i] - (near[i] + far[i])).powi(2)).sum::<f64>();
    sums.iter().sum::<f64>() + rest
}
