//! Doubling runs of long factors, for which each phase point is fetched from memory only once.
//!
//! With the phase in rows of m points, the terms of m, 2m, 4m, … in a column are those of 1, 2, 4, … rows. A tile of
//! W columns is copied row by row into the cache. It is a short phase record on which the factors are W, 2W, 4W, ….
//!
//! ```text
//!          ◄──────────── m points ────────────►
//!          ┌───────┬───────┬───────┬──────────┐
//! row 0    │ 0 … W │       │       │          │      a tile in the cache:
//! row 1    │ m …   │       │       │          │      0 … W │ m … m+W │ 2m … │ 3m … │ …
//! row 2    │ 2m …  │       │       │          │      θ[k], θ[k+m], θ[k+2m] are W apart: `sums::add` with factors
//! …        │       │       │       │          │      W, 2W, 4W, … gives the sums of m, 2m, 4m, …
//! last     │       │       │    ┌──┴──────────┘
//!          └───────┴───────┴────┘                    columns after the end of the record have one row less
//!            ▲ eight tiles are one work item
//! ```
//!
//! If not all rows fit, a tile has 512 rows. Terms then start only on rows from which the largest factor still ends
//! inside the tile.

use super::sums::{self, Group, Placed};
use crate::machine::processor::Width;

/// Number of points of a tile: 640 KiB, which fits into the second-level cache.
const TILE_POINTS: usize = 5 << 14;
/// Minimum number of columns of a tile that holds all rows: four cache lines of each row.
const MIN_COLUMNS: usize = 32;
/// Number of rows of a tile that does not hold all rows.
const ROWS: usize = 512;
/// Maximum number of factors of a run on such tiles: the largest spans 2^`DOUBLINGS` rows.
const DOUBLINGS: usize = 6;
/// Number of tiles of a work item.
const STRIPE: usize = 8;
/// Number of rows between the row that is copied and the row that is prefetched.
const AHEAD: usize = 32;

/// A doubling run over a phase without gaps.
pub(crate) struct Run<'a> {
    theta: &'a [f64],
    factors: &'a [(usize, usize)],
    columns: usize,
    /// Number of rows of a tile, and number of its rows on which terms start.
    rows: usize,
    begin: usize,
    groups: Vec<Group>,
    width: Width,
}

/// The runs, split so that the largest factor of each part fits into a tile.
pub(crate) fn parts<'a>(width: Width, theta: &'a [f64], runs: &'a [Placed]) -> Vec<Run<'a>> {
    let mut parts = Vec::new();
    for run in runs {
        let mut rest = run.as_slice();
        while let Some((_, m)) = rest.first() {
            let all = theta.len().div_ceil(*m);
            let columns = (TILE_POINTS / all).min(ROWS) / 16 * 16;
            let whole = columns >= MIN_COLUMNS;
            let (part, more) = rest.split_at(if whole { rest.len() } else { rest.len().min(DOUBLINGS) });
            rest = more;
            let (columns, rows) = if whole { (columns, all) } else { (TILE_POINTS / ROWS / 16 * 16, ROWS) };
            let begin = if whole { all } else { ROWS - (1 << part.len()) };
            let groups = groups(width, part, columns);
            parts.push(Run { theta, factors: part, columns, rows, begin, groups, width });
        }
    }
    parts
}

impl Run<'_> {
    /// Pairs (place in the result, m).
    pub(crate) fn factors(&self) -> &[(usize, usize)] {
        self.factors
    }

    /// Number of work items that cover all columns.
    fn stripes(&self) -> usize {
        self.factors[0].1.div_ceil(STRIPE * self.columns)
    }

    /// Number of work items.
    pub(crate) fn items(&self) -> usize {
        self.stripes() * self.theta.len().div_ceil(self.factors[0].1).div_ceil(self.begin)
    }

    /// Adds the sums of one work item to `sums`, which has one entry per factor of the run.
    pub(crate) fn add(&self, item: usize, tile: &mut Vec<f64>, sums: &mut [f64]) {
        let m = self.factors[0].1;
        let first = item / self.stripes() * self.begin;
        let from = item % self.stripes() * STRIPE * self.columns;
        let to = (from + STRIPE * self.columns).min(m);
        // The last row is shorter, so columns before its end have one more row.
        let (rows, end) = (self.theta.len() / m, (self.theta.len() % m).clamp(from, to));
        for (from, to, rows) in [(from, end, rows + 1), (end, to, rows)] {
            let rows = rows.saturating_sub(first).min(self.rows);
            for column in (from..to).step_by(self.columns) {
                let columns = self.columns.min(to - column);
                tile.resize(rows * columns, 0.0);
                for (row, to) in tile.chunks_exact_mut(columns).enumerate() {
                    let at = (first + row) * m + column;
                    if row + AHEAD < rows {
                        prefetch(&self.theta[at + AHEAD * m..][..columns]);
                    }
                    copy(&self.theta[at..][..columns], to);
                }
                self.add_tile(tile, columns, sums);
            }
        }
    }

    /// Adds the sums of a tile that has been copied into the cache.
    fn add_tile(&self, tile: &[f64], columns: usize, sums: &mut [f64]) {
        if tile.len() <= 2 * columns {
            return;
        }
        let begin = (self.begin * columns).min(tile.len());
        let narrow;
        let groups = if columns == self.columns {
            &self.groups
        } else {
            narrow = groups(self.width, self.factors, columns);
            &narrow
        };
        sums::add(self.width, (tile, 0), (0, begin), &[(0, tile.len() - 1)], groups, sums);
    }
}

/// Groups of the factors of a run, expressed as factors of a tile with `columns` columns.
fn groups(width: Width, factors: &[(usize, usize)], columns: usize) -> Vec<Group> {
    let placed: Placed = (0..factors.len()).map(|t| (t, columns << t)).collect();
    sums::groups(width, &placed)
}

/// Copies a row in blocks of 16 points. A row is too short for a call of `memcpy` to pay off.
fn copy(from: &[f64], to: &mut [f64]) {
    let ((from, from_rest), (to, to_rest)) = (from.as_chunks::<16>(), to.as_chunks_mut::<16>());
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
    to_rest.copy_from_slice(from_rest);
}

/// Prefetches the cache lines of `points`.
#[cfg(all(target_arch = "x86_64", not(miri)))]
fn prefetch(points: &[f64]) {
    use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
    for line in points.chunks(8) {
        // SAFETY: a hint, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T1>(line.as_ptr().cast()) };
    }
}

/// Does nothing: prefetching is implemented on x86-64 only.
#[cfg(not(all(target_arch = "x86_64", not(miri))))]
fn prefetch(_: &[f64]) {}
