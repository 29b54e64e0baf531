//! Time interval error: how far the phase gets in m samples. ITU-T G.810.

use std::sync::atomic::{AtomicBool, Ordering};

use super::Piece;

/// Points between two looks at the flag, or one window where that is longer.
const LOOK: usize = 1 << 20;

/// Σ (θ[k+m] − θ[k])²; terms that are NaN are left out.
pub fn mean_square(piece: &Piece<'_>) -> (f64, u64) {
    let (n, m, theta) = (piece.n, piece.m, piece.theta);
    let (mut sum, mut count) = (0.0, 0);
    for (a, b) in theta[..n].iter().zip(&theta[m..m + n]) {
        let d = b - a;
        sum += if d.is_nan() { 0.0 } else { d * d };
        count += u64::from(!d.is_nan());
    }
    (sum, count)
}

/// Square of the largest max − min within m + 1 points, and the number of windows.
///
/// Van Herk: the extreme of a window is that of the tail of one block of m + 1 points and the head of the next, so
/// that two passes serve every window, whatever its length.
pub fn largest_range(
    theta: &[f64],
    runs: &[(usize, usize)],
    m: usize,
    work: &mut Vec<f64>,
    stop: &AtomicBool,
) -> (f64, u64) {
    let (mut largest, mut count) = (0.0_f64, 0);
    for &(start, end) in runs {
        let run = &theta[start..=end];
        if run.len() <= m {
            continue;
        }
        let windows = run.len() - m;
        count += windows as u64;
        // A stretch that holds many windows at a time, so that memory does not depend on the record.
        for from in (0..windows).step_by(LOOK.max(m)) {
            if stop.load(Ordering::Relaxed) {
                return (0.0, 0);
            }
            let part = &run[from..(from + LOOK.max(m) + m).min(run.len())];
            let high = extremes(part, m + 1, work, f64::max);
            let low = extremes(part, m + 1, work, f64::min);
            let range = high.iter().zip(&low).map(|(a, b)| a - b).fold(0.0, f64::max);
            largest = largest.max(range);
        }
    }
    (largest * largest, count)
}

fn extremes(values: &[f64], window: usize, tails: &mut Vec<f64>, pick: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    tails.clear();
    tails.extend_from_slice(values);
    let mut heads = values.to_vec();
    for block in tails.chunks_mut(window) {
        for i in (0..block.len() - 1).rev() {
            block[i] = pick(block[i], block[i + 1]);
        }
    }
    for block in heads.chunks_mut(window) {
        for i in 1..block.len() {
            block[i] = pick(block[i], block[i - 1]);
        }
    }
    heads[window - 1..].iter().zip(&*tails).map(|(head, tail)| pick(*head, *tail)).collect()
}
