//! What a deviation must define: reach, block, scale and terms, and its definition as a reference for tests.
//!
//! A new deviation is a file in this folder that implements [`Statistic`], a line of `statistics!` in `mod.rs`, and a row
//! of `deviation/estimators.py`; `docs/make_lists.py` adds its names. The tests in `tests/kernels.rs` cover every entry of
//! [`super::STATISTICS`].

use std::sync::atomic::AtomicBool;

use crate::machine::processor::Width;
use crate::phase::BLOCK;

/// Maximum number of terms of a block that has no startup cost. The stop flag is checked between blocks.
const MAX_BLOCK: usize = 1 << 20;

/// A work item: the terms `from..to` of one averaging factor. A term is one squared difference.
pub struct Part<'a> {
    /// Phase points of the record, or of a part of it.
    pub theta: &'a [f64],
    /// Index in the record of the first of these points.
    pub origin: usize,
    /// Ranges (first, last) of points of the record without a gap.
    pub runs: &'a [(usize, usize)],
    /// First term, and the end of the last.
    pub from: usize,
    pub to: usize,
    /// Averaging factor.
    pub m: usize,
    /// Vector unit.
    pub width: Width,
    /// Set to true when the caller wants to stop; the sum is then unspecified.
    pub stop: &'a AtomicBool,
}

/// Consecutive terms without a missing point.
pub struct Block<'a> {
    /// Phase points from that of the first term to the last point of the last term.
    pub theta: &'a [f64],
    /// Index of the first of these points in the record.
    pub first: usize,
    /// Number of terms.
    pub n: usize,
    /// As in [`Part`].
    pub m: usize,
    pub width: Width,
    pub stop: &'a AtomicBool,
}

impl Part<'_> {
    /// Sum and number of the terms that use no missing sample, by `sum` of each block between two gaps. A term uses
    /// the points up to `last_point` after its first.
    pub(crate) fn between_gaps(
        &self,
        last_point: usize,
        mut sum: impl FnMut(&Block<'_>) -> (f64, u64),
    ) -> (f64, u64) {
        let &Self { theta, origin, runs, m, width, stop, .. } = self;
        let mut total = (0.0, 0);
        let first = runs.partition_point(|run| run.1 < self.from);
        for &(start, end) in runs[first..].iter().take_while(|run| run.0 < self.to) {
            let from = self.from.max(start);
            let to = self.to.min((end + 1).saturating_sub(last_point));
            if from < to {
                let theta = &theta[from - origin..to + last_point - origin];
                let found = sum(&Block { theta, first: from, n: to - from, m, width, stop });
                total.0 += found.0;
                total.1 += found.1;
            }
        }
        total
    }
}

/// The phase that a statistic needs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Any phase up to a straight line, so that each block may have its own.
    Local,
    /// One phase of the whole record, up to a straight line.
    Global,
    /// The phase of the whole record; of rates, with the exact mean rate removed.
    Detrended,
}

/// A statistic of the phase: the mean (or the maximum) of squared terms, over a scale.
pub trait Statistic: Sync {
    /// Name in the Python table of estimators.
    fn name(&self) -> &'static str;

    /// Number of points of a record minus its number of terms of factor m: the points that a term needs after its
    /// first point.
    fn reach(&self, m: usize) -> usize;

    /// Ratio of the mean square term to the variance, in units of one sample.
    fn scale(&self, m: f64) -> f64;

    /// Sum (or maximum) and number of the terms of a work item that use no missing sample.
    fn sum(&self, part: &Part<'_>, work: &mut Vec<f64>) -> (f64, u64);

    /// Terms of a phase, each divided by [`Self::scale`], computed from the definition; NaN where a term uses a NaN.
    fn definition(&self, theta: &[f64], m: usize) -> Vec<f64>;

    /// First and last point that term i of the definition uses, in a record whose last point is `last`.
    fn points_of_term(&self, i: usize, m: usize, _last: usize) -> (usize, usize) {
        (i, i + self.last_point(m))
    }

    /// Offset of the last point that a term of factor m uses.
    fn last_point(&self, m: usize) -> usize {
        self.reach(m)
    }

    /// Number of terms in one block. Blocks are long if starting a block costs O(m), and short if each term costs
    /// O(m).
    fn block(&self, m: usize) -> usize {
        BLOCK.max(m.min(MAX_BLOCK))
    }

    /// Estimated number of operations per term.
    fn operations(&self, _m: usize) -> usize {
        4
    }

    /// True if the statistic has terms of factor m.
    fn is_defined(&self, m: usize) -> bool {
        m > 0
    }

    /// True if a term depends only on a few single points, so that terms with a missing point are NaN and can be
    /// skipped one by one.
    fn skips_missing_points(&self) -> bool {
        false
    }

    /// The phase that the terms need.
    fn phase(&self) -> Phase {
        Phase::Local
    }

    /// True if the statistic is the largest term instead of the mean term.
    fn is_maximum(&self) -> bool {
        false
    }

    /// True if the terms are those of the Allan variance, and some more at the ends of the record. The former are then
    /// computed from the local phase, which avoids the rounding of the large global phase.
    fn extends_allan(&self) -> bool {
        false
    }

    /// The simpler statistic that this one is defined as, or known to equal, at m = 1.
    fn at_factor_one(&self) -> Option<&'static dyn Statistic> {
        None
    }
}
