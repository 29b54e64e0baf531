//! Total variance: second differences about every inner point of the record reflected at its ends.
//!
//! NIST SP 1065 eq. 25. The reflection is odd about the first and the last point, θ*(−j) = 2θ(0) − θ(j), so that all
//! N − 2 centers serve every m up to N − 1. Terms whose center is at least m from both ends are those of the Allan
//! variance.

use super::loops::sums;
use super::statistic::{Part, Phase, Statistic};
use crate::machine::processor::Width;

/// Total variance.
pub(super) struct Total;

impl Statistic for Total {
    fn name(&self) -> &'static str {
        "totdev"
    }

    /// A term is named by its center, which may be any point.
    fn reach(&self, _: usize) -> usize {
        0
    }

    fn scale(&self, m: f64) -> f64 {
        2.0 * m.powi(2)
    }

    fn phase(&self) -> Phase {
        Phase::Global
    }

    fn skips_missing_points(&self) -> bool {
        true
    }

    fn extends_allan(&self) -> bool {
        true
    }

    fn sum(&self, part: &Part<'_>, _: &mut Vec<f64>) -> (f64, u64) {
        reflected(part.width, part.theta, part.runs, (part.from, part.to), part.m)
    }

    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64> {
        let last = theta.len() as isize - 1;
        let reflected = |i: isize| match i {
            i if i < 0 => 2.0 * theta[0] - theta[(-i) as usize],
            i if i > last => 2.0 * theta[last as usize] - theta[(2 * last - i) as usize],
            i => theta[i as usize],
        };
        let by = m as isize;
        let term = |i: isize| (reflected(i - by) - 2.0 * reflected(i) + reflected(i + by)).powi(2);
        (1..last).map(|i| term(i) / (2.0 * (m * m) as f64)).collect()
    }

    fn points_of_term(&self, i: usize, m: usize, last: usize) -> (usize, usize) {
        let (center, m, end) = (i as isize + 1, m as isize, last as isize);
        let mirrored = |j: isize| if j < 0 { -j } else { j.min(2 * end - j) };
        let mut used = vec![center, mirrored(center - m), mirrored(center + m)];
        used.extend((center < m).then_some(0));
        used.extend((center + m > end).then_some(end));
        let ends = (used.iter().min().copied(), used.iter().max().copied());
        (ends.0.unwrap_or(center) as usize, ends.1.unwrap_or(center) as usize)
    }
}

/// Sum and number of (θ*[i−m] − 2θ[i] + θ*[i+m])² over the centers i in `span`. Terms whose samples contain a gap and
/// terms that are NaN are skipped. `runs` are ranges (first, last) of points without a gap.
fn reflected(
    width: Width,
    theta: &[f64],
    runs: &[(usize, usize)],
    (from, to): (usize, usize),
    m: usize,
) -> (f64, u64) {
    let last = theta.len() - 1;
    let (from, to) = (from.max(1), to.min(last));
    if runs != [(0, last)] {
        return one_by_one(theta, runs, (from, to), m);
    }
    // Without gaps, the inner centers use the fast loop, unless its sum is NaN.
    let first = from.max(m);
    let end = to.min((last + 1).saturating_sub(m));
    if first >= end {
        return one_by_one(theta, runs, (from, to), m);
    }
    let inner = sums::sum_of_factor_in_rows(width, &theta[first - m..], m, end - first);
    if inner.is_nan() {
        return one_by_one(theta, runs, (from, to), m);
    }
    let (left, left_count) = one_by_one(theta, runs, (from, first), m);
    let (right, right_count) = one_by_one(theta, runs, (end, to), m);
    (left + inner + right, left_count + (end - first) as u64 + right_count)
}

/// Like [`reflected`], one term at a time.
fn one_by_one(theta: &[f64], runs: &[(usize, usize)], (from, to): (usize, usize), m: usize) -> (f64, u64) {
    let last = theta.len() - 1;
    let (mut sum, mut count) = (0.0, 0);
    let mut run = 0;
    for i in from..to {
        let (lowest, left) =
            if i >= m { (i - m, theta[i.saturating_sub(m)]) } else { (0, 2.0 * theta[0] - theta[m - i]) };
        let over = (i + m).saturating_sub(last);
        let (highest, right) =
            if over == 0 { (i + m, theta[i + m]) } else { (last, 2.0 * theta[last] - theta[last - over]) };
        let lowest = if over == 0 { lowest } else { lowest.min(last - over) };
        let highest = if i >= m { highest } else { highest.max(m - i) };
        if runs.len() != 1 || runs[0] != (0, last) {
            while run < runs.len() && runs[run].1 < i {
                run += 1;
            }
            if run == runs.len() || runs[run].0 > lowest || runs[run].1 < highest {
                continue;
            }
        }
        let d = (right - theta[i]) - (theta[i] - left);
        if !d.is_nan() {
            sum += d * d;
            count += 1;
        }
    }
    (sum, count)
}
