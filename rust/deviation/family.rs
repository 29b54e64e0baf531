//! All other estimators: one loop over averaging factors and blocks of terms. Each estimator has its own file.

use std::sync::atomic::Ordering;

use super::allan::{Execution, Terms};
use super::{Block, allan, hadamard, modified, modified_total, theo, tie, total};
use crate::Result;
use crate::machine::buffer_pool::Buffer;
use crate::parallel::for_each;
use crate::phase::{BLOCK, LOCAL, Quantity, Record, Sample, add_to};

/// Maximum number of terms of a block that has no startup cost. The stop flag is checked between blocks.
const MAX_BLOCK: usize = 1 << 20;

/// The estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Third differences at every point.
    Hadamard,
    /// Third differences at every m-th point.
    AdjacentHadamard,
    /// Second differences of phase averages.
    Modified,
    /// Second differences of phase slopes.
    Parabolic,
    /// Second differences of the record reflected at its ends.
    Total,
    /// Modified variance of every segment of 3m points, reflected.
    ModifiedTotal,
    /// Hadamard variance of every segment of 3m rates, reflected.
    HadamardTotal,
    /// All strides up to m.
    Theo1,
    /// Mean square of the phase gained in m samples.
    TieRms,
    /// Largest range of the phase within m samples.
    Mtie,
}

impl Kind {
    /// Every estimator with its name. Tests compare each estimator of this list with `naive`.
    pub const NAMED: [(&'static str, Self); 10] = [
        ("ohdev", Self::Hadamard),
        ("hdev", Self::AdjacentHadamard),
        ("mdev", Self::Modified),
        ("pdev", Self::Parabolic),
        ("totdev", Self::Total),
        ("mtotdev", Self::ModifiedTotal),
        ("htotdev", Self::HadamardTotal),
        ("theo1", Self::Theo1),
        ("tierms", Self::TieRms),
        ("mtie", Self::Mtie),
    ];

    /// The estimator with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind)
    }

    /// A record needs one point more than this after the start of a term of factor m.
    pub fn reach(self, m: usize) -> usize {
        match self {
            Self::Hadamard | Self::AdjacentHadamard | Self::HadamardTotal => 3 * m,
            Self::Modified | Self::ModifiedTotal => 3 * m - 1,
            Self::Parabolic => 2 * m,
            Self::Total => 0,
            Self::Theo1 | Self::TieRms | Self::Mtie => m,
        }
    }

    /// Offset of the last point that a term of factor m uses.
    fn touched(self, m: usize) -> usize {
        if self == Self::Parabolic { 2 * m - 1 } else { self.reach(m) }
    }

    /// Number of terms in one block. Blocks are long if starting a block costs O(m), and short if each term costs
    /// O(m).
    fn block(self, m: usize) -> usize {
        match self {
            Self::ModifiedTotal | Self::HadamardTotal => m.max(512),
            Self::Theo1 => 2048,
            Self::Mtie => usize::MAX / 2,
            Self::Modified | Self::Parabolic => BLOCK.max(m),
            _ => BLOCK.max(m.min(MAX_BLOCK)),
        }
    }

    /// True if a term depends only on a few single points, so that terms with a missing point are NaN and can be
    /// skipped one by one.
    fn skips_missing_points(self) -> bool {
        matches!(self, Self::Hadamard | Self::AdjacentHadamard | Self::TieRms)
    }

    /// True if the estimator needs the phase of the whole record.
    fn needs_global_phase(self) -> bool {
        matches!(self, Self::Total | Self::TieRms | Self::Mtie)
    }

    /// Variance (for TIE: the square) from the sum of `count` terms, in units of one sample.
    fn scaled(self, sum: f64, count: u64, m: usize) -> f64 {
        let (n, m) = (count as f64, m as f64);
        sum / match self {
            Self::Hadamard | Self::AdjacentHadamard => 6.0 * m.powi(2) * n,
            Self::Modified => 2.0 * m.powi(4) * n,
            Self::Parabolic => m.powi(6) * n / 72.0,
            Self::Total => 2.0 * m.powi(2) * n,
            Self::ModifiedTotal => 12.0 * m.powi(5) * n,
            Self::HadamardTotal => 36.0 * m.powi(3) * n,
            Self::Theo1 => 0.75 * m.powi(2) * n,
            Self::TieRms => n,
            Self::Mtie => f64::from(u8::from(count > 0)),
        }
    }
}

/// Variances and numbers of terms for ascending factors, and the global phase.
///
/// At m = 1 the parabolic variance equals the Allan variance, and the Hadamard total variance equals the overlapping
/// Hadamard variance.
pub fn variances<T: Sample>(
    record: &Record<'_, T>,
    kind: Kind,
    factors: &[usize],
    execution: Execution<'_>,
) -> Result<(Vec<f64>, Vec<u64>, Buffer)> {
    let mut theta = global_phase(record, execution)?;
    if matches!(kind, Kind::TieRms | Kind::Mtie) && record.quantity() == Quantity::Rate {
        remove_slope(&mut theta);
    }
    let runs = point_runs(record, kind.skips_missing_points());
    let points = record.points();
    let (small, factors) = if kind == Kind::Total && record.quantity() == Quantity::Rate && record.gaps() == 0
    {
        let near = factors.partition_point(|&m| m <= LOCAL && 2 * m < points);
        (small_factor_totals(record, &theta, &factors[..near], execution)?, &factors[near..])
    } else {
        (Terms::default(), factors)
    };
    let local = record.quantity() == Quantity::Rate && !kind.needs_global_phase();
    let plan = Plan::new(kind, factors, points, local);
    let threads = if plan.cost() < 1 << 20 { 1 } else { execution.threads };
    let make = || (Vec::new(), Vec::new());
    let parts = for_each(threads, plan.batches(), execution.stop, make, |(near, work), batch| {
        let Some(from) = batch.first().map(|item: &Item| item.from) else { return Vec::new() };
        let (phase, origin) = if local && batch[0].m <= LOCAL {
            let end = batch.iter().map(|i| i.to + replaced(kind, i.m).reach(i.m)).max().unwrap_or(from);
            near.resize(end.min(points) - from, 0.0);
            record.local(from, near);
            (near.as_slice(), from)
        } else {
            (&*theta, 0)
        };
        let mut found = Vec::with_capacity(batch.len());
        for item in &batch {
            let kind = replaced(kind, item.m);
            if execution.stop.load(Ordering::Relaxed) {
                break;
            }
            let (sum, count) = if kind == Kind::Total || kind == Kind::Mtie {
                over_whole_record(kind, record, (phase, execution), (item.from, item.to), item.m, work)
            } else {
                between_gaps(kind, (phase, origin), &runs, item, execution, work)
            };
            found.push((item.place, sum, count));
        }
        found
    })?;
    let mut sums = vec![[0.0_f64; 2]; factors.len()];
    let mut terms = Terms { sum: vec![0.0; factors.len()], count: vec![0; factors.len()] };
    for (place, sum, count) in parts.into_iter().flatten() {
        if kind == Kind::Mtie {
            sums[place][0] = sums[place][0].max(sum);
        } else {
            add_to(&mut sums[place], sum);
        }
        terms.count[place] += count;
    }
    let scaled = (0..factors.len())
        .map(|i| replaced(kind, factors[i]).scaled(sums[i][0] + sums[i][1], terms.count[i], factors[i]));
    Ok((small.sum.into_iter().chain(scaled).collect(), [small.count, terms.count].concat(), theta))
}

/// Total variances of small factors, in the place of sums. The inner terms are those of the Allan variance and are
/// computed from the local phase, which avoids the rounding of the large global phase. Only the few terms at the ends
/// use the global phase.
fn small_factor_totals<T: Sample>(
    record: &Record<'_, T>,
    theta: &[f64],
    factors: &[usize],
    execution: Execution<'_>,
) -> Result<Terms> {
    let mut terms = allan::overlapping(record, factors, execution)?.0;
    let (points, all_points) = (theta.len(), [(0, theta.len() - 1)]);
    for (i, &m) in factors.iter().enumerate() {
        for span in [(1, m), (points - m, points - 1)] {
            let (sum, count) = total::reflected(execution.width, theta, &all_points, span, m);
            terms.sum[i] += sum;
            terms.count[i] += count;
        }
        terms.sum[i] = Kind::Total.scaled(terms.sum[i], terms.count[i], m);
    }
    Ok(terms)
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
    kind: Kind,
    factors: &'a [usize],
    points: usize,
    local: bool,
    /// Number of blocks of the local phase. Each block serves several factors.
    near: usize,
    /// Number of items of the other factors before each factor; the last entry counts all items.
    before: Vec<usize>,
}

impl<'a> Plan<'a> {
    fn new(kind: Kind, factors: &'a [usize], points: usize, local: bool) -> Self {
        let mut plan = Self { kind, factors, points, local, near: 0, before: vec![0] };
        let mut all = 0;
        for &m in factors {
            if plan.shared(m) {
                plan.near = points.div_ceil(BLOCK);
            } else {
                all += plan.term_count(m).div_ceil(replaced(kind, m).block(m));
            }
            plan.before.push(all);
        }
        plan
    }

    /// True if a factor shares each block of the local phase with other factors.
    fn shared(&self, m: usize) -> bool {
        self.local && m <= LOCAL && replaced(self.kind, m).block(m) == BLOCK
    }

    /// Number of terms of a factor.
    fn term_count(&self, m: usize) -> usize {
        self.points.saturating_sub(replaced(self.kind, m).reach(m))
    }

    /// Estimated number of operations.
    fn cost(&self) -> usize {
        let costs = self.factors.iter().map(|m| self.term_count(*m).saturating_mul(per_term(self.kind, *m)));
        costs.fold(0, usize::saturating_add)
    }

    /// Groups of items that one worker handles together.
    fn batches(&self) -> impl ExactSizeIterator<Item = Vec<Item>> + Send {
        (0..self.near + self.before[self.factors.len()]).map(|number| {
            if let Some(number) = number.checked_sub(self.near) {
                vec![self.alone(number)]
            } else {
                self.block(number * BLOCK)
            }
        })
    }

    /// Items of all factors that share the block of local phase from point `from` on.
    fn block(&self, from: usize) -> Vec<Item> {
        let placed = self.factors.iter().copied().enumerate().filter(|(_, m)| self.shared(*m));
        let item = |(place, m)| Item { place, m, from, to: self.term_count(m).min(from + BLOCK) };
        placed.map(item).filter(|item| item.to > from).collect()
    }

    /// Item `number` of the factors that do not share blocks.
    fn alone(&self, number: usize) -> Item {
        let place = self.before.partition_point(|before| *before <= number) - 1;
        let m = self.factors[place];
        let block = replaced(self.kind, m).block(m);
        let from = (number - self.before[place]) * block;
        Item { place, m, from, to: self.term_count(m).min(from + block) }
    }
}

/// Sum and number of the terms of an item that use no missing sample. `phase[0]` is phase point `origin`.
fn between_gaps(
    kind: Kind,
    (phase, origin): (&[f64], usize),
    runs: &[(usize, usize)],
    item: &Item,
    execution: Execution<'_>,
    work: &mut Vec<f64>,
) -> (f64, u64) {
    let m = item.m;
    let touched = kind.touched(m);
    let (mut sum, mut count) = (0.0, 0);
    let first = runs.partition_point(|run| run.1 < item.from);
    for &(start, end) in runs[first..].iter().take_while(|run| run.0 < item.to) {
        let (from, to) = (item.from.max(start), item.to.min((end + 1).saturating_sub(touched)));
        if from < to {
            let theta = &phase[from - origin..to + touched - origin];
            let Execution { width, stop, .. } = execution;
            let block = Block { theta, first: from, n: to - from, m, width, stop };
            let found = one(kind, &block, work);
            sum += found.0;
            count += found.1;
        }
    }
    (sum, count)
}

/// The simpler estimator that two estimators are defined as, or known to equal, at m = 1.
fn replaced(kind: Kind, m: usize) -> Kind {
    match kind {
        Kind::HadamardTotal if m == 1 => Kind::Hadamard,
        Kind::Parabolic if m == 1 => Kind::Modified,
        other => other,
    }
}

/// Estimated number of operations per term.
fn per_term(kind: Kind, m: usize) -> usize {
    match kind {
        Kind::ModifiedTotal | Kind::HadamardTotal => 9 * m.min(64),
        Kind::Theo1 => m / 2,
        _ => 4,
    }
}

/// Sum and number of the terms of a block.
fn one(kind: Kind, block: &Block<'_>, work: &mut Vec<f64>) -> (f64, u64) {
    match kind {
        Kind::Hadamard => hadamard::overlapping(block),
        Kind::AdjacentHadamard => hadamard::adjacent(block),
        Kind::Modified => modified::averages(block),
        Kind::Parabolic => modified::slopes(block),
        Kind::ModifiedTotal => modified_total::of_phase(block, work),
        Kind::HadamardTotal => modified_total::of_rates(block, work),
        Kind::Theo1 => theo::theo1(block, work),
        Kind::TieRms => tie::mean_square(block),
        Kind::Total | Kind::Mtie => unreachable!("handled by the caller"),
    }
}

/// Sum and number of the terms of estimators that need the whole record (for MTIE: the largest squared range).
fn over_whole_record<T: Sample>(
    kind: Kind,
    record: &Record<'_, T>,
    (theta, execution): (&[f64], Execution<'_>),
    span: (usize, usize),
    m: usize,
    work: &mut Vec<f64>,
) -> (f64, u64) {
    if kind == Kind::Mtie {
        return tie::largest_range(theta, &point_runs(record, false), m, work, execution.stop);
    }
    total::reflected(execution.width, theta, &point_runs(record, true), span, m)
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
pub fn global_phase<T: Sample>(record: &Record<'_, T>, execution: Execution<'_>) -> Result<Buffer> {
    let points = record.points();
    let mut theta = Buffer::new(points);
    let threads = if points < 1 << 20 { 1 } else { execution.threads };
    let make = || vec![0.0; BLOCK];
    let chunks = theta.chunks_mut(BLOCK).enumerate();
    for_each(threads, chunks, execution.stop, make, |local, (block, out)| {
        let local = &mut local[..out.len()];
        let slope = record.local(block * BLOCK, local);
        record.global(block, local, slope, out);
    })?;
    Ok(theta)
}

/// Removes the mean rate from the phase. Only a whole number was subtracted from integer samples, but the time
/// interval error needs the exact mean removed.
fn remove_slope(theta: &mut [f64]) {
    if let [_, .., term_count] = *theta {
        let slope = term_count / (theta.len() - 1) as f64;
        for (k, value) in theta.iter_mut().enumerate() {
            *value -= slope * k as f64;
        }
    }
}
