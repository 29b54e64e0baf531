//! Choice of the innermost loop: groups of averaging factors, vector width, and ranges without gaps.
//!
//! ```text
//! samples     ├────────── run ──────────┤ gap ├───────── run ─────────┤
//! strips      └ 4096 ┘└ 4096 ┘└ 4096 ┘ …       all groups over one strip, then the next: θ stays in the L1 cache
//!
//! chain       θ[k]    θ[k+m]   θ[k+2m]            θ[k+4m]                               θ[k+8m]
//!   m          a ────── b ────── c                                    d = (c − a) − 2 (b − a)
//!   2m         a ─────────────── b ───────────────── c                its b is the previous c: one load per factor
//!   4m         a ─────────────────────────────────── b ────────────────────────────────── c
//!
//! rows        θ[k]   θ[k+m]  θ[k+2m]  θ[k+3m]  …    one factor m ≥ 48, sixteen terms per column of vectors:
//!              └─ d ─────────┘                      each uses two first differences; J + 2 loads serve J
//!                     └─ d ───────────┘
//! ```

use super::lanes::{self, Lanes, Portable};
use crate::machine::processor::{Unit, Width};

/// Phase points that all groups handle before the next points are fetched.
const STRIP: usize = 4096;
/// Maximum number of factors of a chain, on the widest unit.
const GROUP: usize = 7;
/// Maximum number of factors of any other group, and of a chain on narrower units, limited by the registers.
const SEVERAL: usize = 4;
/// From this factor on the terms are summed in rows of m. Chosen by judgment; not measured.
const ROW: usize = 48;

/// Maximum length of a chain for which the vector unit has registers.
fn longest_chain(width: Width) -> usize {
    match width.unit() {
        #[cfg(target_arch = "x86_64")]
        Unit::Avx512 => GROUP,
        _ => SEVERAL,
    }
}

/// Factors that share a pass over the phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group {
    m: [usize; GROUP],
    place: [usize; GROUP],
    len: usize,
    shape: Shape,
}

/// The loop that sums a group; see `lanes.rs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Chain,
    Several,
    Rows,
}

impl Group {
    /// Group of `members`, pairs (place in the result, m), that the loop `shape` sums.
    fn new(members: &[(usize, usize)], shape: Shape) -> Self {
        let mut group = Self { m: [0; GROUP], place: [0; GROUP], len: members.len(), shape };
        for (i, (place, m)) in members.iter().enumerate() {
            (group.m[i], group.place[i]) = (*m, *place);
        }
        group
    }

    /// Pairs (place in the result, m).
    pub(crate) fn members(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.len).map(|i| (self.place[i], self.m[i]))
    }
}

/// Groups of factors. `factors` are pairs (place in the result, m) in ascending order of m. Doubling runs of three or
/// more become chains.
pub fn groups(width: Width, factors: &[(usize, usize)]) -> Vec<Group> {
    let (runs, loose) = doubling(factors);
    let mut groups = Vec::new();
    for run in runs {
        let each = run.len().div_ceil(run.len().div_ceil(longest_chain(width)));
        groups.extend(run.chunks(each).map(|part| Group::new(part, Shape::Chain)));
    }
    let (short, long) = loose.split_at(loose.partition_point(|(_, m)| *m < ROW));
    groups.extend(short.chunks(SEVERAL).map(|part| Group::new(part, Shape::Several)));
    groups.extend(long.iter().map(|part| Group::new(&[*part], Shape::Rows)));
    groups
}

/// Factors as pairs (place in the result, m).
pub(crate) type Placed = Vec<(usize, usize)>;

/// Doubling runs m, 2m, 4m, … of three or more factors, and the remaining factors, all in ascending order.
pub(crate) fn doubling(factors: &[(usize, usize)]) -> (Vec<Placed>, Placed) {
    let mut runs = Vec::new();
    let mut free = vec![true; factors.len()];
    let mut loose = Vec::new();
    for i in 0..factors.len() {
        if !free[i] {
            continue;
        }
        let mut run = vec![i];
        while let Some(&last) = run.last()
            && let Ok(next) = factors.binary_search_by_key(&(2 * factors[last].1), |f| f.1)
            && free[next]
        {
            run.push(next);
        }
        if run.len() < 3 {
            loose.push(factors[i]);
            continue;
        }
        run.iter().for_each(|&j| free[j] = false);
        runs.push(run.into_iter().map(|j| factors[j]).collect());
    }
    (runs, loose)
}

/// Adds to `sums` the squared second differences whose first point lies in `from..to` and whose 2m samples lie in one
/// of `runs`. `theta[0]` is phase point `origin`.
pub fn add(
    width: Width,
    (theta, origin): (&[f64], usize),
    (from, to): (usize, usize),
    runs: &[(usize, usize)],
    groups: &[Group],
    sums: &mut [f64],
) {
    let first = runs.partition_point(|run| run.1 <= from);
    for &(start, end) in runs[first..].iter().take_while(|run| run.0 < to) {
        let from = from.max(start);
        for group in groups.iter().filter(|group| group.shape == Shape::Rows) {
            let m = group.m[0];
            let to = to.min((end + 1).saturating_sub(2 * m));
            if to > from {
                sums[group.place[0]] += group_sums(width, &theta[from - origin..], group, to - from)[0];
            }
        }
        for strip in (from..to.min(end)).step_by(STRIP) {
            let to = to.min(strip + STRIP);
            for group in groups.iter().filter(|group| group.shape != Shape::Rows) {
                let last = |m: usize| to.min((end + 1).saturating_sub(2 * m)).max(strip);
                let common = group.members().map(|(_, m)| last(m)).min().unwrap_or(strip);
                if common > strip {
                    let found = group_sums(width, &theta[strip - origin..], group, common - strip);
                    group.members().zip(found).for_each(|((place, _), sum)| sums[place] += sum);
                }
                for (place, m) in group.members() {
                    if last(m) > common {
                        let rest = last(m) - common;
                        sums[place] += sum_of_factor(width, &theta[common - origin..], m, rest);
                    }
                }
            }
        }
    }
}

/// Like [`add`] without runs, for a phase that contains NaN. Terms that are NaN are skipped, the others are counted.
///
/// If the sum of a strip is finite, the strip contains no NaN. Only other strips are examined term by term.
pub(crate) fn add_with_gaps(
    width: Width,
    (theta, origin): (&[f64], usize),
    (from, to): (usize, usize),
    factors: &[(usize, usize)],
    sums: &mut [f64],
    counts: &mut [u64],
) {
    for strip in (from..to).step_by(STRIP) {
        let theta = &theta[strip - origin..];
        for &(place, m) in factors {
            let n = STRIP.min(to - strip).min(theta.len().saturating_sub(2 * m));
            let (mut sum, mut count) = (sum_of_factor(width, theta, m, n), n as u64);
            if sum.is_nan() {
                (sum, count) = (0.0, 0);
                for ((a, b), c) in theta[..n].iter().zip(&theta[m..]).zip(&theta[2 * m..]) {
                    let d = (c - a) - 2.0 * (b - a);
                    sum += if d.is_nan() { 0.0 } else { d * d };
                    count += u64::from(!d.is_nan());
                }
            }
            sums[place] += sum;
            counts[place] += count;
        }
    }
}

/// Adds and counts the terms at every m-th point of the record: adjacent averages.
pub(crate) fn add_adjacent(
    (theta, origin): (&[f64], usize),
    (from, to): (usize, usize),
    runs: &[(usize, usize)],
    factors: &[(usize, usize)],
    sums: &mut [f64],
    counts: &mut [u64],
) {
    let first = runs.partition_point(|run| run.1 <= from);
    for &(start, end) in runs[first..].iter().take_while(|run| run.0 < to) {
        for &(place, m) in factors {
            let last = to.min((end + 1).saturating_sub(2 * m));
            for k in (from.max(start).next_multiple_of(m)..last).step_by(m) {
                let at = k - origin;
                let d = (theta[at + 2 * m] - theta[at + m]) - (theta[at + m] - theta[at]);
                if !d.is_nan() {
                    sums[place] += d * d;
                    counts[place] += 1;
                }
            }
        }
    }
}

/// Sum over k = 0..n for one factor.
pub fn sum_of_factor(width: Width, theta: &[f64], m: usize, n: usize) -> f64 {
    group_sums(width, theta, &Group::new(&[(0, m)], Shape::Several), n)[0]
}

/// Like [`sum_of_factor`], in rows if m is long enough.
pub(crate) fn sum_of_factor_in_rows(width: Width, theta: &[f64], m: usize, n: usize) -> f64 {
    let shape = if m < ROW { Shape::Several } else { Shape::Rows };
    group_sums(width, theta, &Group::new(&[(0, m)], shape), n)[0]
}

/// Sums over k = 0..n for each factor of a group.
fn group_sums(width: Width, theta: &[f64], group: &Group, n: usize) -> [f64; GROUP] {
    if n == 0 {
        return [0.0; GROUP];
    }
    let reach = group.m[..group.len].iter().max().map_or(0, |m| 2 * m);
    assert!(n + reach <= theta.len(), "a term reaches beyond the phase");
    match width.unit() {
        // SAFETY: baseline instructions; `n + reach` doubles are readable (asserted).
        Unit::Portable => unsafe { dispatch::<Portable>(theta.as_ptr(), group, n) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: a `Width` is only made of units that the processor has; readable as above.
        Unit::Avx2 => unsafe { dispatch_avx2(theta.as_ptr(), group, n) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as for AVX2.
        Unit::Avx512 => unsafe { dispatch_avx512(theta.as_ptr(), group, n) },
    }
}

/// Like [`dispatch`], compiled for AVX2 and FMA.
///
/// # Safety
/// As [`dispatch`]; the processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn dispatch_avx2(theta: *const f64, group: &Group, n: usize) -> [f64; GROUP] {
    // SAFETY: the instructions are enabled on this function; the rest is the caller's contract.
    unsafe { dispatch::<lanes::Avx2>(theta, group, n) }
}

/// Like [`dispatch`], compiled for AVX-512.
///
/// # Safety
/// As [`dispatch`]; the processor has AVX-512F.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn dispatch_avx512(theta: *const f64, group: &Group, n: usize) -> [f64; GROUP] {
    // SAFETY: the instructions are enabled on this function; the rest is the caller's contract.
    unsafe { dispatch::<lanes::Avx512>(theta, group, n) }
}

/// Sums over k = 0..n for each factor of a group, by the loop of its shape.
///
/// # Safety
/// The processor has the instructions of `V`; `n + 2·max(m)` doubles are readable from `theta`.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
unsafe fn dispatch<V: Lanes>(theta: *const f64, group: &Group, n: usize) -> [f64; GROUP] {
    let m = group.m;
    let mut out = [0.0; GROUP];
    // SAFETY: the contract of the loops is this function's.
    unsafe {
        match (group.shape, group.len) {
            (Shape::Rows, _) => out[0] = by_rows::<V>(theta, m[0], n),
            (Shape::Chain, 7) => out = lanes::chain::<V, 7>(theta, m[0], n),
            (Shape::Chain, 6) => out[..6].copy_from_slice(&lanes::chain::<V, 6>(theta, m[0], n)),
            (Shape::Chain, 5) => out[..5].copy_from_slice(&lanes::chain::<V, 5>(theta, m[0], n)),
            (Shape::Chain, 4) => out[..4].copy_from_slice(&lanes::chain::<V, 4>(theta, m[0], n)),
            (Shape::Chain, 3) => out[..3].copy_from_slice(&lanes::chain::<V, 3>(theta, m[0], n)),
            (_, 4) => {
                out[..4].copy_from_slice(&lanes::several::<V, 4, 1>(theta, [m[0], m[1], m[2], m[3]], n));
            }
            (_, 3) => out[..3].copy_from_slice(&lanes::several::<V, 3, 1>(theta, [m[0], m[1], m[2]], n)),
            (_, 2) => out[..2].copy_from_slice(&lanes::several::<V, 2, 2>(theta, [m[0], m[1]], n)),
            (_, 1) => out[..1].copy_from_slice(&lanes::several::<V, 1, 4>(theta, [m[0]], n)),
            _ => {}
        }
    }
    out
}

/// Sum over k = 0..n for one factor, in rows of m terms.
///
/// # Safety
/// The processor has the instructions of `V`; `n + 2m` doubles are readable from `theta`.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
unsafe fn by_rows<V: Lanes>(theta: *const f64, m: usize, n: usize) -> f64 {
    let (whole, rest) = (n / m, n % m);
    let (sixteens, eights, more) = (whole / 16, whole % 16 / 8, whole % 8);
    // SAFETY: the terms of each call lie within 0..n.
    unsafe {
        let mut sum = lanes::rows::<V, 16>(theta, m, m, sixteens);
        let theta = theta.add(16 * sixteens * m);
        sum += lanes::rows::<V, 8>(theta, m, m, eights);
        let theta = theta.add(8 * eights * m);
        // The last row is shorter, so columns before its end have one more term.
        sum += some_rows::<V>(theta, m, rest, more + 1);
        sum + some_rows::<V>(theta.add(rest), m, m - rest, more)
    }
}

/// Sum over one block of at most eight rows.
///
/// # Safety
/// As [`lanes::rows`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
unsafe fn some_rows<V: Lanes>(theta: *const f64, m: usize, row: usize, rows: usize) -> f64 {
    // SAFETY: this function's contract.
    unsafe {
        match rows {
            8 => lanes::rows::<V, 8>(theta, m, row, 1),
            7 => lanes::rows::<V, 7>(theta, m, row, 1),
            6 => lanes::rows::<V, 6>(theta, m, row, 1),
            5 => lanes::rows::<V, 5>(theta, m, row, 1),
            4 => lanes::rows::<V, 4>(theta, m, row, 1),
            3 => lanes::rows::<V, 3>(theta, m, row, 1),
            2 => lanes::rows::<V, 2>(theta, m, row, 1),
            1 => lanes::rows::<V, 1>(theta, m, row, 1),
            _ => 0.0,
        }
    }
}
