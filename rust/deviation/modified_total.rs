//! Modified total and Hadamard total variances: every stretch of 3m points, detrended, reflected, read all around.
//!
//! NIST SP 1065 §5.2.13 and 5.2.14. A stretch reflected evenly at both ends is one period of a sequence of period 6m
//! that is even about both ends: the 6m second differences of m-point sums are third differences of its running
//! sum E, which is odd, so that D(i) = D(−3m − i) and half of them suffice. They cost O(1) each from the running sum;
//! of long stretches all are summed together (`stretches.rs`).

use super::Piece;
use crate::machine::processor::Width;

/// From this factor on stretches are summed together.
const LONG: usize = 24;

/// Σ over stretches of Σ D², of the phase itself.
pub fn of_phase(piece: &Piece<'_>, work: &mut Vec<f64>) -> (f64, u64) {
    let points = piece.n + 3 * piece.m - 1;
    let mut running = Vec::with_capacity(points + 1);
    // The line through its ends is trend, which no stretch sees.
    let (origin, last) = (piece.theta[0], piece.theta[points - 1]);
    let slope = (last - origin) / (points - 1).max(1) as f64;
    let mut sum = 0.0;
    running.push(0.0);
    running.extend(piece.theta[..points].iter().enumerate().map(|(i, v)| {
        sum += (v - origin) - slope * f64::from(i as u32);
        sum
    }));
    (stretches(&running, piece, work), piece.n as u64)
}

/// The same of the rates, whose running sum is the phase.
pub fn of_rates(piece: &Piece<'_>, work: &mut Vec<f64>) -> (f64, u64) {
    (stretches(piece.theta, piece, work), piece.n as u64)
}

fn stretches(running: &[f64], piece: &Piece<'_>, work: &mut Vec<f64>) -> f64 {
    let m = piece.m;
    if m >= LONG {
        return super::loops::stretches::sum(running, piece.n, m, piece.stop);
    }
    work.resize(6 * m + 2, 0.0);
    (0..piece.n).map(|k| around(piece.width, &running[k..=k + 3 * m], m, work)).sum()
}

fn around(width: Width, running: &[f64], m: usize, work: &mut [f64]) -> f64 {
    #[cfg(target_arch = "x86_64")]
    if width.is_wide() {
        // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
        return unsafe { around_avx2(running, m, work) };
    }
    let _ = width;
    around_plain(running, m, work)
}

/// # Safety
/// The processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn around_avx2(running: &[f64], m: usize, work: &mut [f64]) -> f64 {
    around_plain(running, m, work)
}

/// Σ of the 6m squares of one stretch.
#[allow(clippy::inline_always)] // to be compiled with the instructions of its caller
#[inline(always)]
fn around_plain(c: &[f64], m: usize, work: &mut [f64]) -> f64 {
    let length = 3 * m;
    let (half, other) = (length / 2, length.div_ceil(2));
    // Trend from the means of the two halves, `other` points apart.
    let low = (c[half] - c[0]) / half.max(1) as f64;
    let high = (c[length] - c[other]) / half.max(1) as f64;
    let slope = (high - low) / other as f64;
    // Running sum of x − slope·i − mean, so that it ends where it began.
    let mean = ((c[length] - c[0]) - slope * (length * (length - 1) / 2) as f64) / length as f64;
    let first = half;
    let (left, right) = work[..6 * m + 1 + (length % 2)].split_at_mut(first);
    let (middle, beyond) = right.split_at_mut(length + 1);
    let (bend, tilt) = (slope / 2.0, mean - slope / 2.0);
    for (j, (to, from)) in middle.iter_mut().zip(c).enumerate() {
        let j = f64::from(j as i32);
        *to = (from - c[0]) - j * (bend * j + tilt);
    }
    for (to, from) in left.iter_mut().rev().zip(&middle[1..]) {
        *to = -from;
    }
    for (to, from) in beyond[..half].iter_mut().zip(middle[..length].iter().rev()) {
        *to = -from;
    }
    // i = −half … half: for even 3m both ends are their own mirror image.
    let n = 2 * half + 1;
    let all = squares(work, m, n);
    if length.is_multiple_of(2) {
        2.0 * all - squares(work, m, 1) - squares(&work[n - 1..], m, 1)
    } else {
        2.0 * all
    }
}

#[allow(clippy::inline_always)] // as above
#[inline(always)]
fn squares(e: &[f64], m: usize, n: usize) -> f64 {
    let [a, b, c, d] = [0, m, 2 * m, 3 * m].map(|at| &e[at..at + n]);
    let mut sums = [0.0; 16];
    let whole = n - n % 16;
    for at in (0..whole).step_by(16) {
        let [a, b, c, d] = [a, b, c, d].map(|v| &v[at..at + 16]);
        for i in 0..16 {
            let value = (d[i] - a[i]) - 3.0 * (c[i] - b[i]);
            sums[i] += value * value;
        }
    }
    let mut sum = sums.iter().sum::<f64>();
    for i in whole..n {
        let value = (d[i] - a[i]) - 3.0 * (c[i] - b[i]);
        sum += value * value;
    }
    sum
}
