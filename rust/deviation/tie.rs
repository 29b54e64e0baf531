//! Time interval error: the change of the phase over m samples. ITU-T G.810.

use std::sync::atomic::{AtomicBool, Ordering};

use super::statistic::{Block, Part, Phase, Statistic};

/// Mean square of the phase gained in m samples.
pub(super) struct TieRms;

/// Square of the largest range of the phase within m samples.
pub(super) struct Mtie;

impl Statistic for TieRms {
    fn name(&self) -> &'static str {
        "tierms"
    }

    fn reach(&self, m: usize) -> usize {
        m
    }

    fn scale(&self, _: f64) -> f64 {
        1.0
    }

    fn phase(&self) -> Phase {
        Phase::Detrended
    }

    fn skips_missing_points(&self) -> bool {
        true
    }

    fn sum(&self, part: &Part<'_>, _: &mut Vec<f64>) -> (f64, u64) {
        part.between_gaps(part.m, mean_square)
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        theta.iter().zip(&theta[m..]).map(|(a, b)| (b - a).powi(2)).collect()
    }
}

impl Statistic for Mtie {
    fn name(&self) -> &'static str {
        "mtie"
    }

    fn reach(&self, m: usize) -> usize {
        m
    }

    /// All windows are one block, because they share extremes.
    fn block(&self, _: usize) -> usize {
        usize::MAX / 2
    }

    fn scale(&self, _: f64) -> f64 {
        1.0
    }

    fn phase(&self) -> Phase {
        Phase::Detrended
    }

    fn is_maximum(&self) -> bool {
        true
    }

    fn sum(&self, part: &Part<'_>, work: &mut Vec<f64>) -> (f64, u64) {
        largest_range(part.theta, part.runs, part.m, work, part.stop)
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        let extreme = |w: &[f64], pick: fn(f64, f64) -> f64| w.iter().copied().reduce(pick).unwrap_or(0.0);
        let range = |w: &[f64]| {
            let whole = !w.iter().any(|v| v.is_nan());
            if whole { (extreme(w, f64::max) - extreme(w, f64::min)).powi(2) } else { f64::NAN }
        };
        theta.windows(m + 1).map(range).collect()
    }
}

/// Number of points between two checks of the stop flag: about a millisecond.
const CHECK_INTERVAL: usize = 1 << 18;

/// Sum and number of (θ[k+m] − θ[k])². Terms that are NaN are skipped.
fn mean_square(block: &Block<'_>) -> (f64, u64) {
    let (n, m, theta) = (block.n, block.m, block.theta);
    let (mut sum, mut count) = (0.0, 0);
    for (a, b) in theta[..n].iter().zip(&theta[m..m + n]) {
        let d = b - a;
        sum += if d.is_nan() { 0.0 } else { d * d };
        count += u64::from(!d.is_nan());
    }
    (sum, count)
}

/// Square of the largest range (maximum minus minimum) within windows of m + 1 points, and the number of windows.
///
/// Van Herk's algorithm: a window is the tail of one block of m + 1 points and the head of the next. Two passes serve
/// all windows of any length. The first pass stores the extremes of all tails, the second those of the growing head.
fn largest_range(
    theta: &[f64],
    runs: &[(usize, usize)],
    m: usize,
    tails: &mut Vec<f64>,
    stop: &AtomicBool,
) -> (f64, u64) {
    let (mut largest, mut count) = (0.0_f64, 0);
    let mut since = 0;
    for &(start, end) in runs {
        let run = &theta[start..=end];
        let windows = run.len().saturating_sub(m);
        count += windows as u64;
        for first in (0..windows).step_by(m + 1) {
            let windows = (m + 1).min(windows - first);
            let (block, next) = run[first..].split_at(m + 1);
            since += m + 1;
            if since >= CHECK_INTERVAL {
                since = 0;
                if stop.load(Ordering::Relaxed) {
                    return (0.0, 0);
                }
            }
            let Some(range) = largest_in_block(block, &next[..windows - 1], tails, stop) else {
                return (0.0, 0);
            };
            largest = largest.max(range);
        }
    }
    (largest * largest, count)
}

/// Largest range of the windows that start in a block; `None` if the caller wants to stop.
fn largest_in_block(block: &[f64], next: &[f64], tails: &mut Vec<f64>, stop: &AtomicBool) -> Option<f64> {
    tails.clear();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for part in block.rchunks(CHECK_INTERVAL) {
        if part.len() == CHECK_INTERVAL && stop.load(Ordering::Relaxed) {
            return None;
        }
        tails.extend(part.iter().rev().flat_map(|&x| {
            (low, high) = (smaller(x, low), larger(x, high));
            [low, high]
        }));
    }
    // The first tail is the whole block.
    let (tails, _) = tails.as_chunks::<2>();
    let mut tails = tails.iter().rev();
    let mut largest = tails.next().map_or(0.0, |[low, high]| high - low);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for part in next.chunks(CHECK_INTERVAL) {
        if part.len() == CHECK_INTERVAL && stop.load(Ordering::Relaxed) {
            return None;
        }
        for (&x, tail) in part.iter().zip(&mut tails) {
            (low, high) = (smaller(x, low), larger(x, high));
            largest = larger(larger(tail[1], high) - smaller(tail[0], low), largest);
        }
    }
    Some(largest)
}

/// The smaller number, in one instruction. The arguments are never NaN.
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger number, in one instruction. The arguments are never NaN.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
