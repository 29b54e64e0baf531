//! Shapes and norms of the gamma distributions at each node of w.

use super::Block;

/// Number of nodes of the quadrature over w.
pub(super) const NODES: usize = 14;
/// Number of cells of a block.
pub(super) const WIDTH: usize = 8;
/// Limits of the quadrature in ln w. P(w < x) = e^(−1/x), so that 99.999 % of the probability lies inside.
const ENDS: (f64, f64) = (-2.0, 11.5);
/// Used instead of ln 0 = −∞, whose product with 0 would be NaN.
const LOG_ZERO: f64 = -1e300;
/// From this k on Stirling's series is exact to 1e-14.
const MIN_STIRLING_K: f64 = 8.0;

/// Value of the discrepancy's random factor w, and its probability, at each node of the quadrature.
pub(super) fn nodes() -> [(f64, f64); NODES] {
    let edge = |i: usize| (ENDS.0 + (ENDS.1 - ENDS.0) * i as f64 / NODES as f64).exp();
    let below = |i: usize| match i {
        0 => 0.0,
        NODES => 1.0,
        _ => (-1.0 / edge(i)).exp(),
    };
    std::array::from_fn(|i| ((edge(i) * edge(i + 1)).sqrt(), below(i + 1) - below(i)))
}

/// Constants of one scale for cells with `count` degrees of freedom. Padding cells of the last block contribute
/// nothing.
pub(super) fn table(count: &[f64], scale: f64) -> Vec<Block> {
    let nodes = nodes();
    let weights = nodes.map(|(_, weight)| weight.ln());
    let block = |count: &[f64]| {
        let mut block = Block { shape: [[0.0; WIDTH]; NODES], norm: [[LOG_ZERO; WIDTH]; NODES] };
        block.norm[0] = [0.0; WIDTH];
        for (lane, n) in count.iter().enumerate() {
            let half = n / 2.0;
            let plain = norm(half);
            for (node, (w, _)) in nodes.iter().enumerate() {
                let shape = half / (1.0 + half * scale.powi(2) * w);
                block.shape[node][lane] = shape;
                block.norm[node][lane] = weights[node] + norm(shape) - plain;
            }
        }
        block
    };
    count.chunks(WIDTH).map(block).collect()
}

/// k ln k − ln Γ(k), without cancellation.
pub(super) fn norm(k: f64) -> f64 {
    const HALF_LN_TAU: f64 = 0.918938533204672741780329736406;
    // Bernoulli numbers over 2j(2j − 1) (DLMF 5.11.1).
    const SERIES: [f64; 7] =
        [1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0, 1.0 / 1188.0, -691.0 / 360360.0, 1.0 / 156.0];
    let rest = |z: f64| SERIES.iter().rev().fold(0.0, |sum, c| sum / (z * z) + c) / z;
    if k >= MIN_STIRLING_K {
        return k + 0.5 * k.ln() - HALF_LN_TAU - rest(k);
    }
    let z = k + MIN_STIRLING_K;
    let shifted: f64 = (0..MIN_STIRLING_K as usize).map(|i| k + i as f64).product();
    k * k.ln() - ((z - 0.5) * z.ln() - z + HALF_LN_TAU + rest(z)) + shifted.ln()
}
