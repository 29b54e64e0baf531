//! The hot loop: the sum over nodes of w, eight bins at a time.

// Compiled with the instructions of the caller.
#![allow(clippy::inline_always)]

use super::Block;
use super::gamma::{NODES, WIDTH};
#[cfg(target_arch = "x86_64")]
use crate::machine::processor::{Unit, Width};

/// Blocks whose sums multiply without an overflow: 14^(128) is 1e147.
const FLUSH: usize = 128;

/// Marginal logL but for a constant, and twice the mean shape of each bin into `weight`; `y` and `weight` are whole blocks.
pub fn marginal(blocks: &[Block], y: &[f64], weight: &mut [f64]) -> f64 {
    #[cfg(target_arch = "x86_64")]
    match Width::best().unit() {
        Unit::Portable => {}
        // SAFETY: a `Width` is only made of units that the processor has.
        Unit::Avx2 => return unsafe { marginal_wide(blocks, y, weight) },
        // SAFETY: as above.
        Unit::Avx512 => return unsafe { marginal_512(blocks, y, weight) },
    }
    marginal_body::<false>(blocks, y, weight)
}

/// # Safety
/// The processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn marginal_wide(blocks: &[Block], y: &[f64], weight: &mut [f64]) -> f64 {
    marginal_body::<true>(blocks, y, weight)
}

/// # Safety
/// The processor has AVX-512.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn marginal_512(blocks: &[Block], y: &[f64], weight: &mut [f64]) -> f64 {
    marginal_body::<true>(blocks, y, weight)
}

#[allow(clippy::needless_range_loop)] // node and lane index several arrays alike
#[inline(always)]
fn marginal_body<const FUSED: bool>(blocks: &[Block], y: &[f64], weight: &mut [f64]) -> f64 {
    let (y, weight) = (y.as_chunks::<WIDTH>().0, weight.as_chunks_mut::<WIDTH>().0);
    let (mut tops, mut product, mut logs) = ([0.0; WIDTH], [1.0; WIDTH], 0.0);
    for (i, ((block, y), weight)) in blocks.iter().zip(y).zip(weight).enumerate() {
        let mut log = [[0.0; WIDTH]; NODES];
        let mut top = [f64::NEG_INFINITY; WIDTH];
        for node in 0..NODES {
            for lane in 0..WIDTH {
                let value = fused::<FUSED>(block.shape[node][lane], y[lane], block.norm[node][lane]);
                log[node][lane] = value;
                // In this order a value that is not a number stays.
                top[lane] = if value < top[lane] { top[lane] } else { value };
            }
        }
        let (mut sum, mut moment) = ([0.0; WIDTH], [0.0; WIDTH]);
        for node in 0..NODES {
            for lane in 0..WIDTH {
                let share = exp::<FUSED>(log[node][lane] - top[lane]);
                sum[lane] += share;
                moment[lane] = fused::<FUSED>(share, block.shape[node][lane], moment[lane]);
            }
        }
        for lane in 0..WIDTH {
            weight[lane] = 2.0 * moment[lane] / sum[lane];
            tops[lane] += top[lane];
            product[lane] *= sum[lane];
        }
        if i % FLUSH == FLUSH - 1 {
            logs += product.iter().map(|p| p.ln()).sum::<f64>();
            product = [1.0; WIDTH];
        }
    }
    logs + product.iter().map(|p| p.ln()).sum::<f64>() + tops.iter().sum::<f64>()
}

/// a·b + c.
#[inline(always)]
fn fused<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// e^x of x ≤ 0 to 3e-16 of its value, and 1e-304 where that is less.
#[inline(always)]
pub fn exp<const FUSED: bool>(x: f64) -> f64 {
    // ln 2 in two parts, of which the first has zeros behind: n times it is exact (Cody & Waite 1980).
    const LN2_HIGH: f64 = 6.93147180369123816490e-01;
    const LN2_LOW: f64 = 1.90821492927058770002e-10;
    // Adding it leaves the nearest whole number in the last bits.
    const ROUND: f64 = 6755399441055744.0;
    // 1/j!; on |r| ≤ ½ ln 2 the next term is 2e-16.
    const SERIES: [f64; 13] = [
        1.0 / 479001600.0,
        1.0 / 39916800.0,
        1.0 / 3628800.0,
        1.0 / 362880.0,
        1.0 / 40320.0,
        1.0 / 5040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let x = if x > -700.0 { x } else { -700.0 };
    let shifted = fused::<FUSED>(x, std::f64::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    let r = fused::<FUSED>(n, -LN2_LOW, fused::<FUSED>(n, -LN2_HIGH, x));
    let mut sum = SERIES[0];
    for c in &SERIES[1..] {
        sum = fused::<FUSED>(sum, r, *c);
    }
    sum * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}
