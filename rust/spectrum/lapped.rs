//! Orthogonal spectra of overlapping segments (lapped transform), and samples at half the rate: tiles of a pyramid
//! (`summary/level.py`).
//!
//! The lapped transform folds the zone around each border of two segments into both segments (Malvar 1990). Then it
//! takes the orthonormal DCT-IV: one complex FFT of half the length, with rotations before and after (Britanak, Yip &
//! Rao 2007). Every tile is computed from the same samples in the same order, and its power is added in the order of
//! the tiles, so that the number of threads does not change a bit of the sums.

use std::cell::RefCell;
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use realfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::fold::Weights;
use super::halving::{REACH, halve, halve_split, split};
use crate::machine::processor::{Width, compiled_for_each_width};
use crate::parallel::for_each;
use crate::phase::{add_to, plain_sum};
use crate::{Error, Result};

/// Number of segments in a tile.
const EACH: usize = 2;

/// Weights and FFT plan for segments of one length.
pub(crate) struct Lapped {
    /// Number of samples in half a segment.
    half: usize,
    taps: [f64; REACH],
    weights: Weights,
    fft: Arc<dyn Fft<f64>>,
    width: Width,
}

/// Work arrays of a worker. They stay with its thread because allocating fresh memory costs as much as the
/// computation.
#[derive(Default)]
struct Scratch {
    /// Even and odd samples of a tile and its margins.
    even: Vec<f64>,
    odd: Vec<f64>,
    turned: Vec<Complex<f64>>,
    fft_work: Vec<Complex<f64>>,
    /// Power of the requested coefficients 0, 2, 4, … and n − 1, n − 3, ….
    power: [Vec<f64>; 2],
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Result for tiles without a missing sample.
pub(crate) struct Tiles {
    /// Power in each band, tile by tile.
    pub bands: Vec<f64>,
    /// Number of tiles before the first one with a missing sample.
    pub count: usize,
}

/// Sums in two doubles, `high + low`, to which the power of tiles is added; `first` is the coefficient of the first
/// sum.
pub(crate) struct Sums<'a> {
    pub first: usize,
    pub high: &'a mut [f64],
    pub low: &'a mut [f64],
}

impl Lapped {
    /// Transform for segments twice as long as `after`. The window is given at ½, 1½, … samples after a border and
    /// before it. `taps` is the low-pass filter for halving the rate.
    pub(crate) fn new(after: &[f64], before: &[f64], taps: &[f64], width: Width) -> Result<Self> {
        let taps = <[f64; REACH]>::try_from(taps)
            .map_err(|_| Error::Input(format!("{} taps: {REACH} are needed", taps.len())))?;
        let half = after.len();
        if half < REACH || half % 4 != 0 || before.len() != half {
            return Err(Error::Input(format!("a window of {half} and {} samples", before.len())));
        }
        let n = 2.0 * half as f64;
        // e^{−iπ(8k+1)/8n} (2/n)^¼, once before the Fourier transform and once after it.
        let turn = |k| Complex::from_polar((2.0 / n).powf(0.25), -PI * (8.0 * k as f64 + 1.0) / (8.0 * n));
        let weights = Weights::new(after, before, &(0..half).map(turn).collect::<Vec<_>>());
        let fft = FftPlanner::new().plan_fft_forward(half);
        Ok(Self { half, taps, weights, fft, width })
    }

    /// Number of samples in a segment.
    pub(crate) fn segment(&self) -> usize {
        2 * self.half
    }

    /// Runs `work` with the work arrays of this thread.
    fn with_scratch<T>(&self, samples: usize, work: impl FnOnce(&mut Scratch) -> T) -> T {
        SCRATCH.with_borrow_mut(|arrays| {
            let zero = Complex::new(0.0, 0.0);
            arrays.even.resize(samples / 2, 0.0);
            arrays.odd.resize(samples / 2, 0.0);
            arrays.turned.resize(self.half, zero);
            arrays.fft_work.resize(self.fft.get_inplace_scratch_len(), zero);
            work(arrays)
        })
    }

    /// Samples at half the rate; see [`halve`].
    pub(crate) fn halved(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; (x.len() / 2).saturating_sub(REACH)];
        halve(self.width, &self.taps, x, &mut out);
        out
    }

    /// Coefficients of consecutive segments. `x` extends half a segment beyond them at each end.
    pub(crate) fn segments(&self, x: &[f64]) -> Result<Vec<f64>> {
        let n = self.segment();
        if x.len() < 2 * n || x.len() % n != 0 {
            return Err(Error::Input(format!("{} samples are no segments of {n}", x.len())));
        }
        let mut out = vec![0.0; x.len() - n];
        self.with_scratch(x.len(), |arrays| {
            split(x, &mut arrays.even, &mut arrays.odd);
            for (segment, to) in out.chunks_mut(n).enumerate() {
                self.transform(segment, 0.0, arrays);
                self.weights.turn(&mut arrays.turned);
                for (k, value) in arrays.turned.iter().enumerate() {
                    (to[2 * k], to[n - 1 - 2 * k]) = (value.re, -value.im);
                }
            }
        });
        Ok(out)
    }

    /// Writes the transform of one segment, before the final rotation, to `arrays.turned`. Its samples are in `arrays`.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    fn transform(&self, segment: usize, mean: f64, arrays: &mut Scratch) {
        let border = self.half / 2 + segment * self.half;
        self.weights.fold(&arrays.even, &arrays.odd, border, mean, &mut arrays.turned);
        self.fft.process_with_scratch(&mut arrays.turned, &mut arrays.fft_work);
    }

    /// Halves the rate of one tile. Returns the power of its segments at the coefficients `kept`, or `None` if a
    /// sample is missing.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    fn tile(
        &self,
        x: &[f64],
        kept: &Range<usize>,
        halved: &mut [f64],
        arrays: &mut Scratch,
    ) -> Option<Vec<f64>> {
        split(x, &mut arrays.even, &mut arrays.odd);
        let mean = (plain_sum(&arrays.even) + plain_sum(&arrays.odd)) / x.len() as f64;
        if mean.is_nan() {
            return None;
        }
        let beyond = self.half / 2 - REACH / 2;
        let inner = beyond..x.len() / 2 - beyond;
        halve_split(&self.taps, &arrays.even[inner.clone()], &arrays.odd[inner], halved);
        // Even coefficients ascend and odd ones descend; this is the range of places that holds both.
        let pairs = kept.start / 2..kept.end.div_ceil(2);
        let from = pairs.start.min(self.half - pairs.end);
        let to = pairs.end.max(self.half - pairs.start);
        arrays.power.iter_mut().for_each(|power| power.resize(to - from, 0.0));
        for segment in 0..EACH {
            self.transform(segment, mean, arrays);
            if segment == 0 {
                self.weights.power(&arrays.turned, from, &mut arrays.power, |_, new| new);
            } else {
                self.weights.power(&arrays.turned, from, &mut arrays.power, |old, new| old + new);
            }
        }
        let [even, odd] = &arrays.power;
        let even = &even[pairs.start - from..pairs.end - from];
        let odd = &odd[self.half - pairs.end - from..self.half - pairs.start - from];
        let mut power = vec![0.0; 2 * pairs.len()];
        for ((to, even), odd) in power.as_chunks_mut::<2>().0.iter_mut().zip(even).zip(odd.iter().rev()) {
            *to = [*even, *odd];
        }
        power.truncate(kept.end - 2 * pairs.start);
        power.drain(..kept.start % 2);
        Some(power)
    }

    /// Halves the rate of consecutive tiles and adds the power of their segments, up to the first tile with a missing
    /// sample.
    ///
    /// `x` starts half a segment before the first tile and ends half a segment after the last. `halved` is valid up
    /// to the first tile with a missing sample.
    pub(crate) fn tiles(
        &self,
        x: &[f64],
        halved: &mut [f64],
        sums: Sums<'_>,
        bands: usize,
        threads: usize,
    ) -> Result<Tiles> {
        let (half, tile) = (self.half, EACH * self.segment());
        let count = x.len().saturating_sub(2 * half) / tile;
        if sums.high.len() != sums.low.len() || sums.first + sums.high.len() > self.segment() {
            return Err(Error::Input(format!("{} sums of {}", sums.high.len(), self.segment())));
        }
        if halved.len() != count * tile / 2 {
            return Err(Error::Input(format!("room for {} halved samples of {count} tiles", halved.len())));
        }
        let items = halved.chunks_mut(tile / 2).enumerate();
        let (stop, kept) = (AtomicBool::new(false), sums.first..sums.first + sums.high.len());
        // Tiles after the first one with a missing sample are left to another call.
        let holed = AtomicUsize::new(count);
        let work = |(): &mut (), (t, halved): (usize, &mut [f64])| {
            if t > holed.load(Ordering::Relaxed) {
                return None;
            }
            let x = &x[t * tile..(t + 1) * tile + 2 * half];
            let power =
                self.with_scratch(x.len(), |arrays| tile_of(self.width, self, x, &kept, halved, arrays));
            if power.is_none() {
                holed.fetch_min(t, Ordering::Relaxed);
            }
            power
        };
        let power: Vec<_> =
            for_each(threads, items, &stop, || (), work)?.into_iter().map_while(|p| p).collect();
        let of_bands = sums.first.min(sums.high.len());
        let edge = |band: usize| of_bands * band / bands;
        let mut in_bands = Vec::with_capacity(bands * power.len());
        for one in &power {
            add_row(self.width, sums.high, sums.low, one);
            in_bands.extend((0..bands).map(|b| plain_sum(&one[edge(b)..edge(b + 1)])));
        }
        Ok(Tiles { bands: in_bands, count: power.len() })
    }
}

compiled_for_each_width! {
    /// [`Lapped::tile`], compiled for each vector unit.
    fn tile_of(
        lapped: &Lapped, x: &[f64], kept: &Range<usize>, halved: &mut [f64], arrays: &mut Scratch
    ) -> Option<Vec<f64>> = Lapped::tile
}

compiled_for_each_width! {
    /// Adds a row of numbers to sums in two doubles (Knuth).
    pub(crate) fn add_row(high: &mut [f64], low: &mut [f64], row: &[f64]) = add_each
}

/// Adds a row to a row of compensated sums.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn add_each(high: &mut [f64], low: &mut [f64], row: &[f64]) {
    for ((high, low), value) in high.iter_mut().zip(low).zip(row) {
        let mut sum = [*high, *low];
        add_to(&mut sum, *value);
        [*high, *low] = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: usize = 32;

    /// A window with after² + before² = 1; any taps will do.
    fn window() -> [Vec<f64>; 2] {
        let angle = |j: usize| PI / 4.0 * (1.0 + (j as f64 + 0.5) / HALF as f64);
        [(0..HALF).map(|j| angle(j).sin()).collect(), (0..HALF).map(|j| angle(j).cos()).collect()]
    }

    fn lapped(width: Width) -> Lapped {
        let [after, before] = window();
        let taps: Vec<f64> = (0..REACH).map(|i| 0.5 / (1.0 + i as f64)).collect();
        Lapped::new(&after, &before, &taps, width).unwrap()
    }

    fn values(n: usize) -> Vec<f64> {
        (0..n).map(|i| ((i * i * 31 + 7 * i) % 97) as f64 - 40.0).collect()
    }

    #[test]
    fn segments_are_their_definition() {
        let (n, x) = (2 * HALF, values(6 * HALF));
        for width in Width::available() {
            let found = lapped(width).segments(&x).unwrap();
            let [after, before] = window();
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
                let mut halved = vec![0.0; 9 * tile / 2];
                let found = lapped.tiles(x, &mut halved, sums, 4, threads).unwrap();
                halved.truncate(found.count * tile / 2);
                (found.count, halved, found.bands, high, low)
            };
            let whole = by(&x, 1);
            assert_eq!(whole, by(&x, 3));
            // The reference: power of the result of `segments` without the mean of each tile, and its halved samples.
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
            // Tiles from the first one with a missing sample on give no result.
            let mut holed = x.clone();
            holed[5 * tile + 2 * HALF + 3] = f64::NAN;
            let found = by(&holed, 2);
            assert_eq!((found.0, &found.1[..]), (5, &whole.1[..5 * tile / 2]));
        }
    }
}
