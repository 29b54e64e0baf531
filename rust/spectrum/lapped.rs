//! Overlapping segments that share nothing, and samples at half the rate: tiles of a pyramid (`summary/level.py`).
//!
//! The lapped transform folds the zone about each border of two segments into both (Malvar 1990) and takes the
//! orthonormal DCT-IV of what is folded: one complex FFT of half the length, turned before and after (Britanak, Yip &
//! Rao 2007). Every tile is computed from the same samples in the same order, and its power is
//! added in the order of the tiles: the number of threads changes no bit of the sums.

use std::cell::RefCell;
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use realfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::halving::{REACH, halve, halve_inline};
use crate::machine::processor::{Unit, Width};
use crate::parallel::for_each;
use crate::phase::{add_to, plain_sum};
use crate::{Error, Result};

/// Segments of a tile.
const EACH: usize = 2;

/// Weights and plans for segments of one length.
pub struct Lapped {
    /// Window at ½, 1½, … samples after the border of two segments, and as far before it.
    after: Vec<f64>,
    before: Vec<f64>,
    taps: [f64; REACH],
    /// e^{−iπ(8n+1)/8N} (2/N)^¼, once before the Fourier transform and once after it.
    turns: Vec<Complex<f64>>,
    fft: Arc<dyn Fft<f64>>,
    width: Width,
}

/// What a worker computes in; it stays with its thread, since fresh memory costs as much as what is computed in it.
#[derive(Default)]
struct Room {
    folded: Vec<f64>,
    turned: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
    power: Vec<f64>,
}

thread_local! {
    static ROOM: RefCell<Room> = RefCell::default();
}

/// What tiles without a missing sample tell.
pub struct Tiles {
    /// Samples at half the rate, of all tiles.
    pub halved: Vec<f64>,
    /// Power in each band, tile by tile.
    pub bands: Vec<f64>,
    /// Tiles before the first with a missing sample.
    pub count: usize,
}

/// Sums as `high + low`, which tiles are added to, and the coefficient that the first of them is of.
pub struct Sums<'a> {
    pub first: usize,
    pub high: &'a mut [f64],
    pub low: &'a mut [f64],
}

impl Lapped {
    /// Segments of twice as many samples as the window has after a border, halved by `taps`.
    pub fn new(after: Vec<f64>, before: Vec<f64>, taps: &[f64], width: Width) -> Result<Self> {
        let taps = <[f64; REACH]>::try_from(taps)
            .map_err(|_| Error::Input(format!("{} taps: {REACH} are needed", taps.len())))?;
        let half = after.len();
        if half < REACH || half % 4 != 0 || before.len() != half {
            return Err(Error::Input(format!("a window of {half} and {} samples", before.len())));
        }
        let n = 2.0 * half as f64;
        let scale = (2.0 / n).powf(0.25);
        let turns =
            (0..half).map(|k| Complex::from_polar(scale, -PI * (8.0 * k as f64 + 1.0) / (8.0 * n))).collect();
        let fft = FftPlanner::new().plan_fft_forward(half);
        Ok(Self { after, before, taps, turns, fft, width })
    }

    /// Samples of a segment.
    pub fn segment(&self) -> usize {
        2 * self.after.len()
    }

    fn with_room<T>(&self, work: impl FnOnce(&mut Room) -> T) -> T {
        ROOM.with_borrow_mut(|room| {
            let half = self.after.len();
            let zero = Complex::new(0.0, 0.0);
            room.folded.resize(2 * half, 0.0);
            room.power.resize(2 * half, 0.0);
            room.turned.resize(half, zero);
            room.scratch.resize(self.fft.get_inplace_scratch_len(), zero);
            work(room)
        })
    }

    /// Every second sample of a low-passed series; see [`halve`].
    pub fn halved(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; (x.len() / 2).saturating_sub(REACH)];
        halve(self.width, &self.taps, x, &mut out);
        out
    }

    /// Coefficients of consecutive segments; `x` has half a segment more at each end.
    pub fn segments(&self, x: &[f64]) -> Result<Vec<f64>> {
        let (n, half) = (self.segment(), self.after.len());
        if x.len() < 2 * n || x.len() % n != 0 {
            return Err(Error::Input(format!("{} samples are no segments of {n}", x.len())));
        }
        let mut out = vec![0.0; x.len() - n];
        self.with_room(|room| {
            for (to, start) in out.chunks_mut(n).zip((half..).step_by(n)) {
                self.transform(x, start, 0.0, room);
                for (k, (value, turn)) in room.turned.iter().zip(&self.turns).enumerate() {
                    let value = value * turn;
                    (to[2 * k], to[n - 1 - 2 * k]) = (value.re, -value.im);
                }
            }
        });
        Ok(out)
    }

    /// Transform of the segment that begins at `start`, before its last turn, in `room.turned`.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    fn transform(&self, x: &[f64], start: usize, mean: f64, room: &mut Room) {
        let (half, end) = (self.after.len(), start + self.segment());
        let zones =
            [&x[start - half..start], &x[start..start + half], &x[end - half..end], &x[end..end + half]];
        fold(&self.after, &self.before, zones, mean, &mut room.folded);
        let (pairs, _) = room.folded.as_chunks::<2>();
        let ends = pairs.iter().zip(pairs.iter().rev());
        for ((to, turn), (first, last)) in room.turned.iter_mut().zip(&self.turns).zip(ends) {
            *to = Complex::new(first[0], last[1]) * turn;
        }
        self.fft.process_with_scratch(&mut room.turned, &mut room.scratch);
    }

    /// Halves the rate of one tile, and leaves the power of its segments in `room.power`.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    fn tile(&self, x: &[f64], mean: f64, halved: &mut [f64], room: &mut Room) {
        let half = self.after.len();
        halve_inline(&self.taps, &x[half - REACH..x.len() - half + REACH], halved);
        for segment in 0..EACH {
            self.transform(x, half + segment * self.segment(), mean, room);
            // Coefficients 0, 2, 4, … stand in the real parts, those from the end in the imaginary ones.
            let (pairs, _) = room.power.as_chunks_mut::<2>();
            let count = pairs.len();
            for k in 0..count / 2 {
                let there = count - 1 - k;
                let (a, b) = (room.turned[k] * self.turns[k], room.turned[there] * self.turns[there]);
                let (low, high) = ([a.re * a.re, b.im * b.im], [b.re * b.re, a.im * a.im]);
                for (at, found) in [(k, low), (there, high)] {
                    let old = if segment == 0 { [0.0; 2] } else { pairs[at] };
                    pairs[at] = [old[0] + found[0], old[1] + found[1]];
                }
            }
        }
    }

    /// # Safety
    /// The processor has AVX2.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn tile_avx2(&self, x: &[f64], mean: f64, halved: &mut [f64], room: &mut Room) {
        self.tile(x, mean, halved, room);
    }

    /// # Safety
    /// The processor has AVX2 and AVX-512F and VL.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,avx512f,avx512vl")]
    unsafe fn tile_avx512(&self, x: &[f64], mean: f64, halved: &mut [f64], room: &mut Room) {
        self.tile(x, mean, halved, room);
    }

    /// Halves the rate of consecutive tiles and adds the power of their segments, as far as no sample is missing.
    ///
    /// `x` begins half a segment before the first tile and ends as far behind the last.
    pub fn tiles(&self, x: &[f64], sums: Sums<'_>, bands: usize, threads: usize) -> Result<Tiles> {
        let (half, tile) = (self.after.len(), EACH * self.segment());
        let count = x.len().saturating_sub(2 * half) / tile;
        if sums.high.len() != sums.low.len() || sums.first + sums.high.len() > self.segment() {
            return Err(Error::Input(format!("{} sums of {}", sums.high.len(), self.segment())));
        }
        let span = |t: usize| &x[t * tile..(t + 1) * tile + 2 * half];
        let means: Vec<f64> = (0..count)
            .map(|t| plain_sum(span(t)) / (tile + 2 * half) as f64)
            .take_while(|mean| !mean.is_nan())
            .collect();
        let mut halved = vec![0.0; means.len() * tile / 2];
        let items = halved.chunks_mut(tile / 2).zip(&means).enumerate();
        let (stop, kept) = (AtomicBool::new(false), sums.first..sums.first + sums.high.len());
        let work = |(): &mut (), (t, (halved, mean)): (usize, (&mut [f64], &f64))| {
            self.with_room(|room| {
                // SAFETY: a `Width` is only made of units that the processor has.
                unsafe {
                    match self.width.unit() {
                        Unit::Portable => self.tile(span(t), *mean, halved, room),
                        #[cfg(target_arch = "x86_64")]
                        Unit::Avx2 => self.tile_avx2(span(t), *mean, halved, room),
                        #[cfg(target_arch = "x86_64")]
                        Unit::Avx512 => self.tile_avx512(span(t), *mean, halved, room),
                    }
                }
                room.power[kept.clone()].to_vec()
            })
        };
        let power = for_each(threads, items, &stop, || (), work)?;
        let of_bands = sums.first.min(sums.high.len());
        let edge = |band: usize| of_bands * band / bands;
        let mut in_bands = Vec::with_capacity(bands * power.len());
        for one in &power {
            add_row(self.width, sums.high, sums.low, one);
            in_bands.extend((0..bands).map(|b| plain_sum(&one[edge(b)..edge(b + 1)])));
        }
        Ok(Tiles { halved, bands: in_bands, count: means.len() })
    }
}

/// The zones about both borders of a segment folded into it, shape (segment,).
///
/// `zones` are what lies before and after the first border, then before and after the second.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn fold(after: &[f64], before: &[f64], zones: [&[f64]; 4], mean: f64, out: &mut [f64]) {
    let half = after.len();
    let [a, b, c, d] = zones.map(|part| &part[..half]);
    let (left, right) = out.split_at_mut(half);
    let (before, right) = (&before[..half], &mut right[..half]);
    for j in 0..half {
        left[j] = after[j] * (b[j] - mean) + before[j] * (a[half - 1 - j] - mean);
    }
    for j in 0..half {
        right[half - 1 - j] = after[j] * (c[half - 1 - j] - mean) - before[j] * (d[j] - mean);
    }
}

/// Adds a number to each sum of two doubles (Knuth).
pub fn add_row(width: Width, high: &mut [f64], low: &mut [f64], row: &[f64]) {
    // SAFETY: a `Width` is only made of units that the processor has.
    unsafe {
        match width.unit() {
            Unit::Portable => add_each(high, low, row),
            #[cfg(target_arch = "x86_64")]
            _ => add_each_avx2(high, low, row),
        }
    }
}

#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn add_each(high: &mut [f64], low: &mut [f64], row: &[f64]) {
    for ((high, low), value) in high.iter_mut().zip(low).zip(row) {
        let mut sum = [*high, *low];
        add_to(&mut sum, *value);
        [*high, *low] = sum;
    }
}

/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn add_each_avx2(high: &mut [f64], low: &mut [f64], row: &[f64]) {
    add_each(high, low, row);
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: usize = 32;

    /// A window with after² + before² = 1, and taps that are anything.
    fn lapped(width: Width) -> Lapped {
        let angle = |j: usize| PI / 4.0 * (1.0 + (j as f64 + 0.5) / HALF as f64);
        let after = (0..HALF).map(|j| angle(j).sin()).collect();
        let before = (0..HALF).map(|j| angle(j).cos()).collect();
        let taps: Vec<f64> = (0..REACH).map(|i| 0.5 / (1.0 + i as f64)).collect();
        Lapped::new(after, before, &taps, width).unwrap()
    }

    fn values(n: usize) -> Vec<f64> {
        (0..n).map(|i| ((i * i * 31 + 7 * i) % 97) as f64 - 40.0).collect()
    }

    #[test]
    fn segments_are_their_definition() {
        let (n, x) = (2 * HALF, values(6 * HALF));
        for width in Width::available() {
            let found = lapped(width).segments(&x).unwrap();
            let Lapped { after, before, .. } = lapped(width);
            for (segment, found) in found.chunks(n).enumerate() {
                let (start, end) = (HALF + segment * n, HALF + (segment + 1) * n);
                let folded = |i: usize| {
                    let j = n - 1 - i;
                    if i < HALF {
                        after[i] * x[start + i] + before[i] * x[start - 1 - i]
                    } else {
                        after[j] * x[end - 1 - j] - before[j] * x[end + j]
                    }
                };
                for (k, found) in found.iter().enumerate() {
                    let turn = |i: usize| (PI / n as f64 * (i as f64 + 0.5) * (k as f64 + 0.5)).cos();
                    let sum: f64 = (0..n).map(|i| folded(i) * turn(i)).sum();
                    assert!((found - (2.0 / n as f64).sqrt() * sum).abs() < 1e-10, "{k}");
                }
            }
        }
        assert!(lapped(Width::portable()).segments(&x[1..]).is_err());
    }

    #[test]
    fn tiles_are_the_same_by_any_number_of_threads() {
        let (tile, kept) = (4 * HALF, 40);
        let x = values(9 * tile + 2 * HALF);
        for width in Width::available() {
            let lapped = lapped(width);
            let by = |x: &[f64], threads: usize| {
                let (mut high, mut low) = (vec![0.0; kept], vec![0.0; kept]);
                let sums = Sums { first: 20, high: &mut high, low: &mut low };
                let found = lapped.tiles(x, sums, 4, threads).unwrap();
                (found.count, found.halved, found.bands, high, low)
            };
            let whole = by(&x, 1);
            assert_eq!(whole, by(&x, 3));
            // The power of what `segments` gives, without the mean of each tile, and its halved samples.
            let mut power = vec![0.0; kept];
            for t in 0..9 {
                let x = &x[t * tile..(t + 1) * tile + 2 * HALF];
                let mean = x.iter().sum::<f64>() / x.len() as f64;
                let free: Vec<f64> = x.iter().map(|v| v - mean).collect();
                for segment in lapped.segments(&free).unwrap().chunks(2 * HALF) {
                    power.iter_mut().zip(&segment[20..]).for_each(|(sum, c)| *sum += c * c);
                }
                let halved = lapped.halved(&x[HALF - REACH..x.len() - HALF + REACH]);
                assert_eq!(halved, whole.1[t * tile / 2..(t + 1) * tile / 2]);
            }
            assert!(whole.3.iter().zip(&power).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
            // Nothing is told of a tile with a missing sample, nor of what follows.
            let mut holed = x.clone();
            holed[5 * tile + 2 * HALF + 3] = f64::NAN;
            let found = by(&holed, 2);
            assert_eq!((found.0, &found.1[..]), (5, &whole.1[..5 * tile / 2]));
        }
    }
}
