//! Overlapping Allan variance: O(n) per averaging factor, at the limit of the machine.
//!
//! `σ²(m) = 1/(2 m² M) Σ_k (θ[k+2m] − 2θ[k+m] + θ[k])²`, NIST SP 1065 eq. 11, IEEE 952 annex C. The phase is computed
//! block by block. Factors up to [`phase::LOCAL`] are summed while the block is in the cache, the others afterwards
//! from the global phase. Partial sums are added in the order of the blocks, so that the number of threads does not
//! change a bit.

use std::mem::take;
use std::sync::atomic::AtomicBool;

use super::loops::sums::{self, Group};
use super::loops::tiles;
use crate::Result;
use crate::machine::buffer_pool::{Buffer, Unwritten};
use crate::machine::processor::Width;
use crate::parallel::for_each;
use crate::phase::{self, BLOCK, LOCAL, Quantity, Record, Sample};

/// Cache tiers of the factors above [`phase::LOCAL`]: (largest m, terms per work item). The first tier stays in L2,
/// the next two in L3, the last in memory.
const TIERS: [(usize, usize); 4] =
    [(1 << 14, 1 << 16), (1 << 17, 1 << 20), (1 << 19, 1 << 21), (usize::MAX, 1 << 25)];

/// Maximum number of groups or factors of a work item. This limits memory, and the stop flag is checked between
/// items.
const BATCH: usize = 64;

/// Sums of squared second differences, one per factor, in units of one sample (for phase data, of one point).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Terms {
    /// Σ d².
    pub sum: Vec<f64>,
    /// Number of terms.
    pub count: Vec<u64>,
}

/// Sum and number of terms of each factor, from one work item.
type Found = Vec<(f64, u64)>;

impl Terms {
    /// Sums of zero for this number of factors.
    fn new(factors: usize) -> Self {
        Self { sum: vec![0.0; factors], count: vec![0; factors] }
    }

    /// Adds the results of work items, in their order, to the factors at `places`.
    fn gather<'p>(&mut self, places: &[usize], parts: impl Iterator<Item = &'p Found>) {
        let mut sums: Vec<_> = places.iter().map(|place| [self.sum[*place], 0.0]).collect();
        for part in parts {
            for ((place, sum), found) in places.iter().zip(&mut sums).zip(part) {
                phase::add_to(sum, found.0);
                self.count[*place] += found.1;
            }
        }
        for (place, sum) in places.iter().zip(sums) {
            self.sum[*place] = sum[0] + sum[1];
        }
    }

    /// Allan variance in units of the samples; NaN where a factor has no term.
    pub fn variance(&self, factors: &[usize], quantity: Quantity) -> Vec<f64> {
        let scale = |m: usize| if quantity == Quantity::Rate { m as f64 * m as f64 } else { 1.0 };
        let each = self.sum.iter().zip(&self.count).zip(factors);
        each.map(|((sum, count), m)| sum / (2.0 * scale(*m) * *count as f64)).collect()
    }
}

/// How to compute. The result does not depend on `threads`.
#[derive(Clone, Copy)]
pub struct Execution<'a> {
    /// Worker threads, at least one.
    pub threads: usize,
    /// Vector unit.
    pub width: Width,
    /// Set to true when the caller wants to stop.
    pub stop: &'a AtomicBool,
}

/// Sums of the overlapping Allan variance of `record` for ascending factors, and the global phase (empty if it was
/// not needed).
pub fn overlapping<T: Sample>(
    record: &Record<'_, T>,
    factors: &[usize],
    execution: Execution<'_>,
) -> Result<(Terms, Buffer)> {
    terms(record, factors, execution, false)
}

/// Like [`overlapping`], for adjacent averages: every m-th term.
pub fn adjacent<T: Sample>(
    record: &Record<'_, T>,
    factors: &[usize],
    execution: Execution<'_>,
) -> Result<(Terms, Buffer)> {
    terms(record, factors, execution, true)
}

/// Sums for ascending factors, overlapping or `adjacent`, and the global phase (empty if it was not needed).
fn terms<T: Sample>(
    record: &Record<'_, T>,
    factors: &[usize],
    execution: Execution<'_>,
    adjacent: bool,
) -> Result<(Terms, Buffer)> {
    let placed: Vec<_> = factors.iter().copied().enumerate().collect();
    let split = factors.partition_point(|m| *m <= LOCAL);
    let (near, far) = placed.split_at(split);
    let points = record.points();
    let pass = Pass { record, factors, execution, adjacent, blocks: points.div_ceil(BLOCK) };
    let (theta, mut terms) = Buffer::written(if far.is_empty() { 0 } else { points }, |theta| {
        pass.sum_small_factors(near, theta)
    })?;
    let (runs, rest) = if pass.is_complete() { sums::doubling(far) } else { (Vec::new(), far.to_vec()) };
    for run in tiles::parts(execution.width, &theta, &runs) {
        pass.doubling(&run, &mut terms)?;
    }
    let mut rest = rest.as_slice();
    for (most, span) in TIERS {
        let (tier, beyond) = rest.split_at(rest.partition_point(|factor| factor.1 <= most));
        rest = beyond;
        if !tier.is_empty() {
            pass.add_large_factors(tier, span, &theta, &mut terms)?;
        }
    }
    pass.count(&mut terms);
    Ok((terms, theta))
}

/// One computation of the Allan variance.
struct Pass<'a, 'r, T: Sample> {
    record: &'a Record<'r, T>,
    factors: &'a [usize],
    execution: Execution<'a>,
    adjacent: bool,
    blocks: usize,
}

impl<T: Sample> Pass<'_, '_, T> {
    /// Number of partial sums, and blocks per partial sum. Both do not depend on the number of threads, and their
    /// product with the number of factors is bounded.
    fn segments(&self) -> (usize, usize) {
        let most = ((1 << 22) / self.factors.len().max(1)).max(16);
        // A thread that handles consecutive blocks finds the phase of the next block in its own cache.
        let size = self.blocks.div_ceil(most).max((self.blocks / 32).clamp(1, 8));
        (self.blocks.div_ceil(size), size)
    }

    /// True for phase data with gaps, whose terms are tested one by one.
    fn has_phase_gaps(&self) -> bool {
        self.record.quantity() == Quantity::Angle && self.record.gaps() > 0
    }

    /// True if no term is excluded.
    fn is_complete(&self) -> bool {
        !self.adjacent && self.record.gaps() == 0
    }

    /// Half-open ranges of samples without gaps. A term of factor m needs 2m samples of one range.
    fn runs(&self) -> Vec<(usize, usize)> {
        match self.record.quantity() {
            Quantity::Rate => self.record.runs().to_vec(),
            Quantity::Angle => vec![(0, self.record.points() - 1)],
        }
    }

    /// Sums over all blocks of `work(phase, block, room for the global phase of the block if `theta` is not empty, sums)`.
    fn segmented(
        &self,
        threads: usize,
        theta: Unwritten<'_>,
        work: impl Fn(&mut Vec<f64>, usize, Option<Unwritten<'_>>, &mut Terms) + Sync,
    ) -> Result<Terms> {
        let (segments, size) = self.segments();
        let mut chunks = theta.chunks(size * BLOCK);
        let items = (0..segments).map(|segment| (segment, chunks.next()));
        let parts = for_each(threads, items, self.execution.stop, Vec::new, |phase, (segment, theta)| {
            let mut part = Terms::new(self.factors.len());
            let mut chunks = theta.map(|theta| theta.chunks(BLOCK));
            for block in segment * size..((segment + 1) * size).min(self.blocks) {
                work(phase, block, chunks.as_mut().and_then(Iterator::next), &mut part);
            }
            part
        })?;
        let mut high_low = vec![[0.0; 2]; self.factors.len()];
        let mut total = Terms::new(self.factors.len());
        for part in parts {
            part.sum.iter().zip(&mut high_low).for_each(|(sum, to)| phase::add_to(to, *sum));
            part.count.iter().zip(&mut total.count).for_each(|(count, to)| *to += count);
        }
        total.sum = high_low.iter().map(|sum| sum[0] + sum[1]).collect();
        Ok(total)
    }

    /// Sums of the factors up to [`phase::LOCAL`], from the local phase of each block; fills the global phase `theta`
    /// unless it is empty.
    fn sum_small_factors(&self, factors: &[(usize, usize)], theta: Unwritten<'_>) -> Result<Terms> {
        let points = self.record.points();
        let groups = sums::groups(self.execution.width, factors);
        let halo = factors.last().map_or(0, |(_, m)| 2 * m);
        let runs = self.runs();
        let work = points * (1 + factors.len());
        self.segmented(self.threads_for(work), theta, |phase, block, global, part| {
            let from = block * BLOCK;
            let to = (from + BLOCK).min(points);
            phase.resize((to + halo).min(points) - from, 0.0);
            let slope = self.record.local(from, phase);
            if let Some(global) = global {
                self.record.global(block, phase, slope, global);
            }
            let near = (phase.as_slice(), from);
            self.add(near, (from, to), &runs, factors, &groups, part);
        })
    }

    /// Adds the sums of larger factors, from the global phase, in work items of `span` terms.
    fn add_large_factors(
        &self,
        factors: &[(usize, usize)],
        span: usize,
        theta: &[f64],
        terms: &mut Terms,
    ) -> Result<()> {
        let points = self.record.points();
        let groups: Vec<Group> = sums::groups(self.execution.width, factors);
        let batches: Vec<(&[(usize, usize)], &[Group])> = if self.adjacent || self.has_phase_gaps() {
            factors.chunks(BATCH).map(|part| (part, [].as_slice())).collect()
        } else {
            let each = if span > 1 << 16 { 1 } else { BATCH };
            groups.chunks(each).map(|part| ([].as_slice(), part)).collect()
        };
        let places: Vec<Vec<usize>> = batches
            .iter()
            .map(|(factors, groups)| {
                let members = groups.iter().flat_map(Group::members);
                factors.iter().copied().chain(members).map(|(place, _)| place).collect()
            })
            .collect();
        let runs = self.runs();
        let parts: Vec<Found> = for_each(
            self.threads_for(points * factors.len()),
            0..points.div_ceil(span) * batches.len(),
            self.execution.stop,
            || Terms::new(self.factors.len()),
            |all, item| {
                let from = item / batches.len() * span;
                let (factors, groups) = batches[item % batches.len()];
                let within = (from, (from + span).min(points));
                self.add((theta, 0), within, &runs, factors, groups, all);
                let mut found = |place: &usize| (take(&mut all.sum[*place]), take(&mut all.count[*place]));
                places[item % batches.len()].iter().map(&mut found).collect()
            },
        )?;
        for (batch, places) in places.iter().enumerate() {
            terms.gather(places, parts.iter().skip(batch).step_by(batches.len()));
        }
        Ok(())
    }

    /// Adds the sums of one doubling run of factors; see `tiles.rs`.
    fn doubling(&self, run: &tiles::Run<'_>, terms: &mut Terms) -> Result<()> {
        let threads = self.threads_for(self.record.points());
        let places: Vec<usize> = run.factors().iter().map(|(place, _)| *place).collect();
        let parts: Vec<Found> =
            for_each(threads, 0..run.items(), self.execution.stop, Vec::new, |tile, item| {
                let mut sums = vec![0.0; places.len()];
                run.add(item, tile, &mut sums);
                sums.into_iter().map(|sum| (sum, 0)).collect()
            })?;
        terms.gather(&places, parts.iter());
        Ok(())
    }

    /// Adds the terms that start in `span` to `part`, with the loop that suits the record. `theta.0[0]` is phase
    /// point `theta.1`.
    fn add(
        &self,
        theta: (&[f64], usize),
        span: (usize, usize),
        runs: &[(usize, usize)],
        factors: &[(usize, usize)],
        groups: &[Group],
        part: &mut Terms,
    ) {
        if self.adjacent {
            sums::add_adjacent(theta, span, runs, factors, &mut part.sum, &mut part.count);
        } else if self.has_phase_gaps() {
            sums::add_with_gaps(self.execution.width, theta, span, factors, &mut part.sum, &mut part.count);
        } else {
            sums::add(self.execution.width, theta, span, runs, groups, &mut part.sum);
        }
    }

    /// Number of threads for this amount of work. Threads pay off from about a quarter of a millisecond on.
    fn threads_for(&self, work: usize) -> usize {
        if work < 1 << 20 { 1 } else { self.execution.threads }
    }

    /// Sets the number of terms of each factor, unless the loops have counted them.
    fn count(&self, terms: &mut Terms) {
        if self.has_phase_gaps() || self.adjacent {
            return;
        }
        let runs = self.runs();
        for (count, &m) in terms.count.iter_mut().zip(self.factors) {
            *count = runs.iter().map(|run| (run.1 - run.0 + 1).saturating_sub(2 * m) as u64).sum();
        }
    }
}
