//! One loop over averaging factors and blocks of terms, which serves every [`Statistic`].

use std::sync::atomic::Ordering;

use super::allan::{self, Execution, Terms};
use super::statistic::{Part, Phase, Statistic};
use crate::machine::buffer_pool::Buffer;
use crate::parallel::for_each;
use crate::phase::{BLOCK, LOCAL, Quantity, Record, Sample, add_to};
use crate::{Error, Result};

/// Variances and numbers of terms for ascending factors, and the global phase.
pub fn variances<T: Sample>(
    record: &Record<'_, T>,
    statistic: &dyn Statistic,
    factors: &[usize],
    execution: Execution<'_>,
) -> Result<(Vec<f64>, Vec<u64>, Buffer)> {
    if let Some(m) = factors.iter().find(|m| !statistic.is_defined(**m)) {
        return Err(Error::Input(format!(
            "{} is not defined for the averaging factor {m}",
            statistic.name()
        )));
    }
    let rates = record.quantity() == Quantity::Rate;
    let mut theta = global_phase(record, execution)?;
    if statistic.phase() == Phase::Detrended && rates {
        remove_slope(&mut theta);
    }
    let runs = point_runs(record, statistic.skips_missing_points());
    let points = record.points();
    let (small, factors) = if statistic.extends_allan() && rates && record.gaps() == 0 {
        let near = factors.partition_point(|&m| m <= LOCAL && 2 * m < points);
        let near = factors.split_at(near);
        (beyond_allan(record, statistic, &theta, near.0, execution)?, near.1)
    } else {
        (Terms::default(), factors)
    };
    let local = rates && statistic.phase() == Phase::Local;
    let plan = Plan::new(statistic, factors, points, local);
    let threads = if operations(statistic, factors, points) < 1 << 20 { 1 } else { execution.threads };
    let make = || (Vec::new(), Vec::new());
    let parts = for_each(threads, plan.batches(), execution.stop, make, |(near, work), batch| {
        let Some(from) = batch.first().map(|item: &Item| item.from) else { return Vec::new() };
        let (theta, origin) = if local && batch[0].m <= LOCAL {
            let end =
                batch.iter().map(|i| i.to + statistic_at(statistic, i.m).reach(i.m)).max().unwrap_or(from);
            near.resize(end.min(points) - from, 0.0);
            record.local(from, near);
            (near.as_slice(), from)
        } else {
            (&*theta, 0)
        };
        let Execution { width, stop, .. } = execution;
        let mut found = Vec::with_capacity(batch.len());
        for item in &batch {
            if stop.load(Ordering::Relaxed) {
                break;
            }
            let &Item { place, m, from, to } = item;
            let part = Part { theta, origin, runs: &runs, from, to, m, width, stop };
            let (sum, count) = statistic_at(statistic, m).sum(&part, work);
            found.push((place, sum, count));
        }
        found
    })?;
    let mut sums = vec![[0.0_f64; 2]; factors.len()];
    let mut terms = Terms { sum: vec![0.0; factors.len()], count: vec![0; factors.len()] };
    for (place, sum, count) in parts.into_iter().flatten() {
        if statistic.is_maximum() {
            sums[place][0] = sums[place][0].max(sum);
        } else {
            add_to(&mut sums[place], sum);
        }
        terms.count[place] += count;
    }
    let scaled = (0..factors.len()).map(|i| {
        scaled(statistic_at(statistic, factors[i]), sums[i][0] + sums[i][1], terms.count[i], factors[i])
    });
    Ok((small.sum.into_iter().chain(scaled).collect(), [small.count, terms.count].concat(), theta))
}

/// Estimated number of operations for these factors.
pub(crate) fn operations(statistic: &dyn Statistic, factors: &[usize], points: usize) -> usize {
    let each = |m: &usize| term_count(statistic, *m, points).saturating_mul(statistic.operations(*m));
    factors.iter().map(each).fold(0, usize::saturating_add)
}

/// Variance (for TIE: the square) from the sum (or the maximum) of `count` terms, in units of one sample.
fn scaled(statistic: &dyn Statistic, sum: f64, count: u64, m: usize) -> f64 {
    let scale = statistic.scale(m as f64);
    match (statistic.is_maximum(), count) {
        (true, 0) => f64::NAN,
        (true, _) => sum / scale,
        (false, _) => sum / (scale * count as f64),
    }
}

/// Variances, in the place of sums, of a statistic whose terms are those of the Allan variance and some more at the
/// ends of the record. The global phase is used only for the few terms at the ends.
fn beyond_allan<T: Sample>(
    record: &Record<'_, T>,
    statistic: &dyn Statistic,
    theta: &[f64],
    factors: &[usize],
    execution: Execution<'_>,
) -> Result<Terms> {
    let mut terms = allan::overlapping(record, factors, execution)?.0;
    let Execution { width, stop, .. } = execution;
    let last = theta.len() - 1;
    for (i, &m) in factors.iter().enumerate() {
        for (from, to) in [(1, m), (last + 1 - m, last)] {
            let part = Part { theta, origin: 0, runs: &[(0, last)], from, to, m, width, stop };
            let (sum, count) = statistic.sum(&part, &mut Vec::new());
            terms.sum[i] += sum;
            terms.count[i] += count;
        }
        terms.sum[i] = scaled(statistic, terms.sum[i], terms.count[i], m);
    }
    Ok(terms)
}

/// The statistic that is computed at factor m: `statistic`, or a simpler one that equals it at m = 1.
fn statistic_at(statistic: &dyn Statistic, m: usize) -> &dyn Statistic {
    if m == 1 { statistic.at_factor_one().unwrap_or(statistic) } else { statistic }
}

/// Number of terms of factor m in a record of `points` points.
fn term_count(statistic: &dyn Statistic, m: usize, points: usize) -> usize {
    points.saturating_sub(statistic_at(statistic, m).reach(m))
}

/// Work item: the terms `from..to` of one factor.
struct Item {
    place: usize,
    m: usize,
    from: usize,
    to: usize,
}

/// Iterator of work items. They are created on demand, because there may be as many as factors times blocks.
struct Plan<'a> {
    statistic: &'a dyn Statistic,
    factors: &'a [usize],
    points: usize,
    local: bool,
    /// Number of blocks of the local phase. Each block serves several factors.
    near: usize,
    /// Number of items of the other factors before each factor; the last entry counts all items.
    before: Vec<usize>,
}

impl<'a> Plan<'a> {
    /// Work items for these factors in a record of `points` points; `local` allows the local phase.
    fn new(statistic: &'a dyn Statistic, factors: &'a [usize], points: usize, local: bool) -> Self {
        let mut plan = Self { statistic, factors, points, local, near: 0, before: vec![0] };
        let mut all = 0;
        for &m in factors {
            if plan.shares_block(m) {
                plan.near = points.div_ceil(BLOCK);
            } else {
                all += plan.term_count(m).div_ceil(statistic_at(statistic, m).block(m));
            }
            plan.before.push(all);
        }
        plan
    }

    /// True if a factor shares each block of the local phase with other factors.
    fn shares_block(&self, m: usize) -> bool {
        self.local && m <= LOCAL && statistic_at(self.statistic, m).block(m) == BLOCK
    }

    /// Number of terms of a factor.
    fn term_count(&self, m: usize) -> usize {
        term_count(self.statistic, m, self.points)
    }

    /// Groups of items that one worker handles together.
    fn batches(&self) -> impl ExactSizeIterator<Item = Vec<Item>> + Send {
        (0..self.near + self.before[self.factors.len()]).map(|number| {
            if let Some(number) = number.checked_sub(self.near) {
                vec![self.item_alone(number)]
            } else {
                self.block(number * BLOCK)
            }
        })
    }

    /// Items of all factors that share the block of local phase from point `from` on.
    fn block(&self, from: usize) -> Vec<Item> {
        let placed = self.factors.iter().copied().enumerate().filter(|(_, m)| self.shares_block(*m));
        let item = |(place, m)| Item { place, m, from, to: self.term_count(m).min(from + BLOCK) };
        placed.map(item).filter(|item| item.to > from).collect()
    }

    /// Item `number` of the factors that do not share blocks.
    fn item_alone(&self, number: usize) -> Item {
        let place = self.before.partition_point(|before| *before <= number) - 1;
        let m = self.factors[place];
        let block = statistic_at(self.statistic, m).block(m);
        let from = (number - self.before[place]) * block;
        Item { place, m, from, to: self.term_count(m).min(from + block) }
    }
}

/// Ranges (first, last) of finite phase points. With `skips_missing_points`, phase data with gaps are one range.
fn point_runs<T: Sample>(record: &Record<'_, T>, skips_missing_points: bool) -> Vec<(usize, usize)> {
    match record.quantity() {
        Quantity::Rate => record.runs().to_vec(),
        Quantity::Angle if skips_missing_points => vec![(0, record.points() - 1)],
        Quantity::Angle => record.runs().iter().map(|run| (run.0, run.1 - 1)).collect(),
    }
}

/// The phase of the whole record.
pub(crate) fn global_phase<T: Sample>(record: &Record<'_, T>, execution: Execution<'_>) -> Result<Buffer> {
    let points = record.points();
    let threads = if points < 1 << 20 { 1 } else { execution.threads };
    let make = || vec![0.0; BLOCK];
    let (theta, _) = Buffer::written(points, |theta| {
        let chunks = theta.chunks(BLOCK).enumerate();
        for_each(threads, chunks, execution.stop, make, |local, (block, out)| {
            let local = &mut local[..out.len()];
            let slope = record.local(block * BLOCK, local);
            record.global(block, local, slope, out);
        })
    })?;
    Ok(theta)
}

/// Removes the mean rate from the phase. Only a whole number was subtracted from integer samples, but the time
/// interval error needs the exact mean removed.
fn remove_slope(theta: &mut [f64]) {
    if let [_, .., last] = *theta {
        let slope = last / (theta.len() - 1) as f64;
        for (k, value) in theta.iter_mut().enumerate() {
            *value -= slope * k as f64;
        }
    }
}
