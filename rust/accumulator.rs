//! Overlapping Allan variance of a stream, in constant memory, mergeable.
//!
//! The averaging factors are m = q·2^l with q < 32 and, above the first level, q ≥ 16. Level l keeps blocks: sums of
//! 2^l samples on a grid that starts at sample 0 of the stream. A difference starts at every block, so that its
//! stride s = 2^l satisfies m/32 < s ≤ m/16 (every sample while m < 32). The grid fixes which blocks are added in
//! pairs. So neither the lengths of the chunks nor the order of merging changes the result; sums of integers are
//! exact.

mod blocks;

use crate::deviation::loops::sums::{self, Group};
use crate::machine::processor::Width;
use crate::phase::{add_to, running_sum, wide_sum};
use crate::{Error, Result};
use blocks::{minus_origin, pair_sums, runs_between_gaps};

/// Upper bound of q (exclusive).
const Q_END: usize = 32;
/// Number of blocks that the longest difference spans.
const SPAN: usize = 2 * (Q_END - 1);
/// Blocks handled per pass: about 32 KiB of phase, which stays in the first-level cache while all factors of a level
/// read it.
const PASS: usize = 4096;

/// Averaging factors: 16 ≤ q < 32 on every level, and also q < 16 on the first level.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Grid {
    first: Terms,
    others: Terms,
}

/// Factors of a level, grouped by the pass over the data that they share.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Terms {
    factors: Vec<usize>,
    groups: Vec<Group>,
}

impl Terms {
    /// The factors, grouped for the widest instructions of the processor.
    fn new(factors: Vec<usize>) -> Self {
        let placed: Vec<_> = factors.iter().copied().enumerate().collect();
        Self { groups: sums::groups(Width::best(), &placed), factors }
    }
}

impl Grid {
    /// Grid with `each` factors per octave, 1 ≤ `each` ≤ 16.
    pub fn per_octave(each: usize) -> Result<Self> {
        if !(1..=16).contains(&each) {
            return Err(Error::Input(format!("{each} averaging times per octave: give 1 to 16")));
        }
        let octave: Vec<usize> = {
            let mut all: Vec<_> =
                (0..each).map(|i| (16.0 * 2_f64.powf(i as f64 / each as f64)).round() as usize).collect();
            all.dedup();
            all
        };
        let mut low: Vec<usize> = (1..=4)
            .flat_map(|down| octave.iter().filter(move |q| *q % (1 << down) == 0).map(move |q| q >> down))
            .collect();
        low.sort_unstable();
        low.dedup();
        low.extend(&octave);
        Ok(Self { first: Terms::new(low), others: Terms::new(octave) })
    }

    /// Factors of a level.
    fn at(&self, level: usize) -> &Terms {
        if level == 0 { &self.first } else { &self.others }
    }
}

/// State of one level: the blocks that still start a difference, and the first blocks of the segment, for merging.
#[derive(Clone, Debug)]
struct Level {
    /// Grid index of the first block of this segment.
    start: u64,
    /// The first blocks of this segment, at most `SPAN`.
    head: Vec<f64>,
    /// The last blocks, starting at grid index `next`.
    tail: Vec<f64>,
    next: u64,
    sums: Vec<[f64; 2]>,
    counts: Vec<u64>,
}

impl Level {
    /// Empty level of a segment that begins at the block `start`.
    fn new(start: u64, factors: usize) -> Self {
        Self {
            start,
            head: vec![],
            tail: vec![],
            next: start,
            sums: vec![[0.0; 2]; factors],
            counts: vec![0; factors],
        }
    }

    /// Grid index after the last block.
    fn end(&self) -> u64 {
        self.next + self.tail.len() as u64
    }

    /// Appends blocks.
    fn push(&mut self, blocks: &[f64]) {
        let missing = SPAN.saturating_sub(self.head.len()).min(blocks.len());
        if self.start + self.head.len() as u64 == self.end() {
            self.head.extend_from_slice(&blocks[..missing]);
        }
        self.tail.extend_from_slice(blocks);
    }
}

/// Work arrays of an update. They are reused because allocating fresh memory costs as much as the computation.
#[derive(Default)]
struct Scratch {
    blocks: Vec<f64>,
    pairs: Vec<f64>,
    phase: Vec<f64>,
}

/// Allan variance sums of a segment of a stream, with the state needed to continue it and to merge it with its
/// neighbors.
#[derive(Clone, Debug)]
pub struct Accumulator {
    grid: Grid,
    start: u64,
    samples: u64,
    gaps: u64,
    origin: Option<f64>,
    levels: Vec<Level>,
    width: Width,
}

/// For each averaging factor: factor, stride, Σ d², number of differences, number of differences lost to gaps.
pub(crate) type Reading = Vec<(u64, u64, f64, u64, u64)>;

/// Serialized state: start, samples, gaps, origin, and for each level its start, first blocks, last blocks, grid
/// index of the last blocks, sums, counts.
pub(crate) type State = (u64, u64, u64, Option<f64>, Vec<LevelState>);
type LevelState = (u64, Vec<f64>, Vec<f64>, u64, Vec<[f64; 2]>, Vec<u64>);

impl Accumulator {
    /// An empty segment that starts at sample `start` of its stream.
    pub fn new(grid: Grid, start: u64) -> Self {
        let levels = vec![Level::new(start, grid.at(0).factors.len())];
        Self { grid, start, samples: 0, gaps: 0, origin: None, levels, width: Width::best() }
    }

    /// Complete state as plain numbers.
    pub(crate) fn state(&self) -> State {
        let plain =
            |l: &Level| (l.start, l.head.clone(), l.tail.clone(), l.next, l.sums.clone(), l.counts.clone());
        (self.start, self.samples, self.gaps, self.origin, self.levels.iter().map(plain).collect())
    }

    /// Accumulator restored from the state that [`Self::state`] returned.
    pub(crate) fn restored(grid: Grid, (start, samples, gaps, origin, levels): State) -> Result<Self> {
        let mut kept = Vec::with_capacity(levels.len());
        for (at, (start, head, tail, next, sums, counts)) in levels.into_iter().enumerate() {
            let factors = grid.at(at).factors.len();
            if sums.len() != factors || counts.len() != factors || next < start || head.len() > SPAN {
                return Err(Error::Input(format!("level {at} of the accumulator's state is damaged")));
            }
            kept.push(Level { start, head, tail, next, sums, counts });
        }
        if kept.is_empty() {
            return Err(Error::Input("the accumulator's state has no level".into()));
        }
        Ok(Self { grid, start, samples, gaps, origin, levels: kept, width: Width::best() })
    }

    /// Number of samples so far, missing ones included.
    pub fn len(&self) -> u64 {
        self.samples
    }

    /// True if no sample has been added.
    pub fn is_empty(&self) -> bool {
        self.samples == 0
    }

    /// Number of missing samples so far.
    pub fn gaps(&self) -> u64 {
        self.gaps
    }

    /// Adds the next samples; NaN marks a missing sample.
    pub fn update(&mut self, samples: &[f64]) -> Result<()> {
        // One pass suffices in the usual case: the sum is finite unless a sample is NaN or infinite.
        let clean = wide_sum(self.width, samples).is_finite();
        if !clean && let Some(bad) = samples.iter().position(|x| x.is_infinite()) {
            let at = self.start + self.samples + bad as u64;
            return Err(Error::Input(format!(
                "sample {at} is {} (counted from 0): only finite values and NaN (gaps) can be used",
                samples[bad]
            )));
        }
        // The origin is rounded so that integer samples stay integers.
        let first = samples.iter().find(|x| !x.is_nan()).map(|x| x.round());
        self.origin = self.origin.or(first);
        let origin = self.origin.unwrap_or(0.0);
        let mut scratch = Scratch::default();
        for chunk in samples.chunks(PASS) {
            scratch.blocks.resize(chunk.len(), 0.0);
            minus_origin(self.width, chunk, origin, &mut scratch.blocks);
            if !clean {
                self.gaps += chunk.iter().map(|x| u64::from(x.is_nan())).sum::<u64>();
            }
            self.samples += chunk.len() as u64;
            self.append(&mut scratch);
        }
        Ok(())
    }

    /// Appends blocks to the first level, and the pairs that they complete to each higher level.
    fn append(&mut self, Scratch { blocks, pairs, phase }: &mut Scratch) {
        for level in 0.. {
            if blocks.is_empty() {
                return;
            }
            let here = &mut self.levels[level];
            let end = here.end();
            // At an odd end the last block still waits for its right neighbor, unless the segment starts there.
            let waiting = (end % 2 == 1 && end > here.start).then(|| here.tail.last().copied()).flatten();
            let whole = &blocks[usize::from(end % 2 == 1)..];
            let first = usize::from(waiting.is_some());
            pairs.resize(first + whole.len() / 2, 0.0);
            pairs[..first].copy_from_slice(waiting.map(|left| left + blocks[0]).as_slice());
            pair_sums(self.width, whole, &mut pairs[first..]);
            here.push(blocks);
            self.add_completed(level, PASS, phase);
            if !pairs.is_empty() && level + 1 == self.levels.len() {
                let start = self.levels[level].start.div_ceil(2);
                self.levels.push(Level::new(start, self.grid.at(level + 1).factors.len()));
            }
            std::mem::swap(blocks, pairs);
        }
    }

    /// Adds the differences whose blocks are complete to the sums. Does nothing while fewer than `min_count` of them
    /// wait.
    fn add_completed(&mut self, level: usize, min_count: usize, phase: &mut Vec<f64>) {
        let waiting = self.levels[level].tail.len().saturating_sub(SPAN);
        if waiting == 0 || waiting < min_count.min(PASS) / if level == 0 { 1 } else { 4 } {
            return;
        }
        let here = &mut self.levels[level];
        add_terms(
            self.width,
            &here.tail,
            waiting,
            self.grid.at(level),
            phase,
            (&mut here.sums, &mut here.counts),
        );
        here.tail.drain(..waiting);
        here.next += waiting as u64;
    }

    /// Appends the segment that follows this one. The samples of `other` were counted from a base that is `higher` by
    /// this amount.
    pub fn merge(&mut self, other: &Self, higher: f64) -> Result<()> {
        if other.grid != self.grid {
            return Err(Error::Input("accumulators with different averaging times cannot be merged".into()));
        }
        let end = self.start + self.samples;
        if other.start != end {
            return Err(Error::Input(format!(
                "the other segment begins at sample {}, this one ends at {end}: give start={end}",
                other.start
            )));
        }
        let shift = match (self.origin, other.origin) {
            (Some(ours), Some(theirs)) => theirs - ours + higher,
            _ => 0.0,
        };
        self.origin = self.origin.or(other.origin.map(|theirs| theirs + higher));
        self.samples += other.samples;
        self.gaps += other.gaps;
        let mut straddling: Option<f64> = None;
        for level in 0.. {
            let theirs = other.levels.get(level);
            if theirs.is_none() && straddling.is_none() {
                break;
            }
            if level == self.levels.len() {
                let start = self.start.div_ceil(1 << level);
                self.levels.push(Level::new(start, self.grid.at(level).factors.len()));
            }
            let moved = |block: &f64| block + shift * (1_u64 << level) as f64;
            let ours = &mut self.levels[level];
            let last = ours.tail.last().copied();
            // The pair across the border, for the next level. At most one block at each level straddles the border.
            let border = ours.end();
            let head = theirs.and_then(|l| l.head.first()).map(moved);
            let (left, right) = match (straddling, border % 2) {
                (Some(middle), 1) => (last, Some(middle)),
                (Some(middle), _) => (Some(middle), head),
                (None, 1) => (last, head),
                (None, _) => (None, None),
            };
            ours.push(straddling.as_slice());
            if let Some(theirs) = theirs {
                join(self.width, ours, theirs, self.grid.at(level), moved);
            }
            straddling = left.zip(right).map(|(left, right)| left + right);
        }
        Ok(())
    }

    /// The sums so far, for every factor that fits into the segment, even if gaps have removed all its differences.
    pub fn reading(&self) -> Reading {
        let mut out = Vec::new();
        for (level, here) in self.levels.iter().enumerate() {
            let terms = self.grid.at(level);
            let (mut sums, mut counts) = (here.sums.clone(), here.counts.clone());
            let waiting = here.tail.len();
            add_terms(self.width, &here.tail, waiting, terms, &mut vec![], (&mut sums, &mut counts));
            for ((q, sum), count) in terms.factors.iter().zip(sums).zip(counts) {
                let all = (here.end() - here.start + 1).saturating_sub(2 * *q as u64);
                if all > 0 {
                    out.push(((*q as u64) << level, 1 << level, sum[0] + sum[1], count, all - count));
                }
            }
        }
        out
    }
}

/// Appends one level of the following segment to the same level of this one.
fn join(width: Width, ours: &mut Level, theirs: &Level, terms: &Terms, moved: impl Fn(&f64) -> f64) {
    if theirs.next == theirs.start {
        ours.push(&theirs.tail.iter().map(moved).collect::<Vec<_>>());
        return;
    }
    // Differences that start in this segment and end in the following one.
    let begun = ours.tail.len();
    ours.push(&theirs.head.iter().map(&moved).collect::<Vec<_>>());
    add_terms(width, &ours.tail, begun, terms, &mut vec![], (&mut ours.sums, &mut ours.counts));
    for (to, from) in ours.sums.iter_mut().zip(&theirs.sums) {
        add_to(to, from[0]);
        add_to(to, from[1]);
    }
    for (to, from) in ours.counts.iter_mut().zip(&theirs.counts) {
        *to += from;
    }
    ours.tail = theirs.tail.iter().map(moved).collect();
    ours.next = theirs.next;
}

/// Adds the squared differences that start at the first `begun` blocks and whose blocks are complete.
fn add_terms(
    width: Width,
    blocks: &[f64],
    begun: usize,
    Terms { factors, groups }: &Terms,
    phase: &mut Vec<f64>,
    (sums, counts): (&mut [[f64; 2]], &mut [u64]),
) {
    let count = blocks.len();
    phase.resize(count + 1, 0.0);
    running_sum(blocks, &mut phase[..count], width);
    phase[count] = blocks.last().map_or(0.0, |last| phase[count - 1] + last);
    let mut runs = vec![(0, count)];
    if phase[count].is_nan() {
        let mut filled = blocks.to_vec();
        runs = runs_between_gaps(&mut filled);
        running_sum(&filled, &mut phase[..count], width);
        phase[count] = phase[count - 1] + filled[count - 1];
    }
    let mut found = vec![0.0; factors.len()];
    sums::add(width, (phase, 0), (0, begun), &runs, groups, &mut found);
    for ((to, sum), (count, m)) in sums.iter_mut().zip(found).zip(counts.iter_mut().zip(factors)) {
        add_to(to, sum);
        let terms = |run: &(usize, usize)| begun.min((run.1 + 1).saturating_sub(2 * m)).saturating_sub(run.0);
        *count += runs.iter().map(|run| terms(run) as u64).sum::<u64>();
    }
}
