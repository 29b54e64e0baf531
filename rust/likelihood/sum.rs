//! The innermost loop: the sum over nodes of w, eight cells at a time.

// Functions are inlined so that they are compiled with the instructions of their caller.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

use super::Block;
use super::exponents::{exp, fused};
use super::gamma::{NODES, WIDTH};

/// Number of blocks whose sums can be multiplied without overflow: 14^128 is 1e147.
const FLUSH: usize = 128;

/// Marginal logL up to a constant; writes twice the mean shape of each cell to `weight`. `y` and `weight` consist of
/// whole blocks.
#[expect(clippy::needless_range_loop, reason = "node and lane index several arrays alike")]
#[inline(always)]
pub(super) fn marginal<const FUSED: bool>(blocks: &[Block], y: &[f64], weight: &mut [f64]) -> f64 {
    let (y, weight) = (y.as_chunks::<WIDTH>().0, weight.as_chunks_mut::<WIDTH>().0);
    let (mut tops, mut product, mut logs) = ([0.0; WIDTH], [1.0; WIDTH], 0.0);
    for (i, ((block, y), weight)) in blocks.iter().zip(y).zip(weight).enumerate() {
        let mut log = [[0.0; WIDTH]; NODES];
        let mut top = [f64::NEG_INFINITY; WIDTH];
        for node in 0..NODES {
            for lane in 0..WIDTH {
                let value = fused::<FUSED>(block.shape[node][lane], y[lane], block.norm[node][lane]);
                log[node][lane] = value;
                // With the operands in this order a NaN is kept.
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
