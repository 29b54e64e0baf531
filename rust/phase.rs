//! Samples → phase θ, exactly.
//!
//! The phase is the running sum of the samples with the leading zero, θ[k] = Σ_{i<k} (x[i] − μ), in units of one
//! sample. A running sum of 10⁸ samples loses what the small averaging factors need, whatever is subtracted first, so
//! the phase has two levels: [`Record::local`] gives it inside one block, from a zero at the block's start and with
//! the block's own mean removed (second differences do not see either), and [`Record::global`] over the whole record,
//! from a base per block kept in two doubles.
//!
//! Both use **the same rounded μ** as the bases; otherwise the difference, times the block length, is a sawtooth.

use std::sync::atomic::AtomicBool;

use crate::deviation::parallel::for_each;
use crate::{Error, Result};

/// Samples (and phases) of one block. The error of the local phase goes as the square of it.
pub const BLOCK: usize = 16384;
/// Largest averaging factor that is served from the local phase.
pub const LOCAL: usize = 2048;
/// Plain summation inside this many samples, compensated across.
const CHUNK: usize = 512;

/// A number type that records come in.
pub trait Sample: Copy + Send + Sync + 'static {
    /// What can be subtracted from every sample: exactly for integers, with one rounding for floats.
    type Base: Copy + Send + Sync;
    /// Integer samples keep integer bases, so that their phase stays exact.
    const INTEGER: bool;
    /// The sample as something to subtract.
    fn base(self) -> Self::Base;
    /// `self − base`.
    fn minus(self, base: Self::Base) -> f64;
    /// `base + by` rounded to a base, and the step really taken as an unevaluated sum of two doubles.
    fn moved(base: Self::Base, by: f64) -> (Self::Base, [f64; 2]);
    /// The sample as a double, for finite checks and messages.
    fn value(self) -> f64;
}

macro_rules! float_sample {
    ($($kind:ty),*) => {$(
        impl Sample for $kind {
            type Base = f64;
            const INTEGER: bool = false;
            #[inline]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast)]
            fn base(self) -> f64 {
                self as f64
            }
            #[inline]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast)]
            fn minus(self, base: f64) -> f64 {
                self as f64 - base
            }
            fn moved(base: f64, by: f64) -> (f64, [f64; 2]) {
                let to = base + by;
                (to, two_sum(to, -base))
            }
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast)]
            fn value(self) -> f64 {
                self as f64
            }
        }
    )*};
}
float_sample!(f32, f64);

macro_rules! small_integer_sample {
    ($($kind:ty),*) => {$(
        impl Sample for $kind {
            type Base = f64; // holds every integer these can reach
            const INTEGER: bool = true;
            #[inline]
            fn base(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn minus(self, base: f64) -> f64 {
                f64::from(self) - base
            }
            fn moved(base: f64, by: f64) -> (f64, [f64; 2]) {
                (base + by.round(), [by.round(), 0.0])
            }
            fn value(self) -> f64 {
                f64::from(self)
            }
        }
    )*};
}
small_integer_sample!(i8, i16, i32, u8, u16, u32);

macro_rules! large_integer_sample {
    ($($kind:ty),*) => {$(
        impl Sample for $kind {
            type Base = $kind;
            const INTEGER: bool = true;
            #[inline]
            fn base(self) -> $kind {
                self
            }
            /// Halves of 32 bits: each difference is exact, so the sum is rounded once, over the whole range.
            #[inline]
            #[allow(clippy::unnecessary_cast)]
            fn minus(self, base: $kind) -> f64 {
                let high = (self >> 32) as i64 - (base >> 32) as i64;
                let low = (self & 0xffff_ffff) as i64 - (base & 0xffff_ffff) as i64;
                high as f64 * 4294967296.0 + low as f64
            }
            fn moved(base: $kind, by: f64) -> ($kind, [f64; 2]) {
                let limits = (i128::from(<$kind>::MIN), i128::from(<$kind>::MAX));
                let to = (i128::from(base) + by.round() as i128).clamp(limits.0, limits.1);
                let step = to - i128::from(base);
                let high = step as f64;
                (to as $kind, [high, (step - high as i128) as f64])
            }
            fn value(self) -> f64 {
                self as f64
            }
        }
    )*};
}
large_integer_sample!(i64, u64);

/// One column of numbers: every `step`-th of `data`, starting at `first`.
#[derive(Clone, Copy)]
pub struct Series<'a, T> {
    data: &'a [T],
    first: usize,
    step: isize,
    len: usize,
}

impl<'a, T: Sample> Series<'a, T> {
    /// All of a slice.
    pub fn new(data: &'a [T]) -> Self {
        Self { data, first: 0, step: 1, len: data.len() }
    }

    /// `len` samples at `first`, `first + step`, …; `None` where one would lie outside of `data`.
    pub fn strided(data: &'a [T], first: usize, step: isize, len: usize) -> Option<Self> {
        let last = first as i128 + step as i128 * (len as i128 - 1);
        let inside = len == 0 || (first < data.len() && (0..data.len() as i128).contains(&last));
        inside.then_some(Self { data, first, step, len })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Sample `index`.
    #[inline]
    pub fn at(&self, index: usize) -> T {
        self.data[(self.first as isize + index as isize * self.step) as usize]
    }

    /// Writes `x[start + i] − base` to `out[i]`.
    #[inline]
    pub fn load(&self, start: usize, base: T::Base, out: &mut [f64]) {
        if self.step == 1 {
            let from = &self.data[self.first + start..][..out.len()];
            for (slot, value) in out.iter_mut().zip(from) {
                *slot = value.minus(base);
            }
        } else {
            for (i, slot) in out.iter_mut().enumerate() {
                *slot = self.at(start + i).minus(base);
            }
        }
    }
}

/// What the samples are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Rates: the phase is their running sum.
    Rate,
    /// The phase itself.
    Angle,
}

/// A record that has been looked at once: offset, base of each block, gaps.
pub struct Record<'a, T: Sample> {
    series: Series<'a, T>,
    quantity: Quantity,
    mean: T::Base,
    bases: Vec<[f64; 2]>,
    gaps: usize,
    runs: Vec<(usize, usize)>,
}

struct Look {
    sum: [f64; 2],
    finite: usize,
}

impl<'a, T: Sample> Record<'a, T> {
    /// Looks at every sample once.
    pub fn new(series: Series<'a, T>, quantity: Quantity, threads: usize, stop: &AtomicBool) -> Result<Self> {
        let n = series.len();
        let first = (0..n).map(|i| series.at(i)).find(|x| !x.value().is_nan());
        let Some(first) = first else {
            return Err(Error::TooShort(if n == 0 {
                "no samples: give at least 3".into()
            } else {
                format!("all {n} samples are NaN: nothing to analyse")
            }));
        };
        let origin = first.base();
        let looks = look_at_blocks(series, origin, threads, stop)?;
        let gaps = n - looks.iter().map(|look| look.finite).sum::<usize>();
        let runs = if gaps == 0 { vec![(0, n)] } else { find_runs(series, &looks) };
        let (mean, bases) = match quantity {
            Quantity::Rate => bases::<T>(origin, &looks, n - gaps),
            Quantity::Angle => (origin, Vec::new()),
        };
        Ok(Self { series, quantity, mean, bases, gaps, runs })
    }

    /// Number of samples, gaps included.
    pub fn len(&self) -> usize {
        self.series.len()
    }

    /// Never true: an empty record is an error.
    pub fn is_empty(&self) -> bool {
        self.series.is_empty()
    }

    /// Number of NaN samples.
    pub fn gaps(&self) -> usize {
        self.gaps
    }

    /// Half-open runs of finite samples.
    pub fn runs(&self) -> &[(usize, usize)] {
        &self.runs
    }

    /// What the samples are.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Number of phase points: one more than rates.
    pub fn points(&self) -> usize {
        self.len() + usize::from(self.quantity == Quantity::Rate)
    }

    /// Phase points `start .. start + phase.len()` about a local origin and slope; returns the slope removed.
    ///
    /// Gaps of a rate count as zeros (terms that touch them are left out by their runs); gaps of a phase stay NaN.
    pub fn local(&self, start: usize, phase: &mut [f64]) -> f64 {
        let Some(samples) = phase.len().checked_sub(1) else { return 0.0 };
        if self.quantity == Quantity::Angle {
            self.series.load(start, self.mean, phase);
            let origin = phase.iter().copied().find(|v| !v.is_nan()).unwrap_or(0.0);
            for v in phase.iter_mut() {
                *v -= origin;
            }
            return 0.0;
        }
        self.series.load(start, self.mean, &mut phase[..samples]);
        if self.gaps > 0 {
            for v in phase.iter_mut() {
                *v = if v.is_nan() { 0.0 } else { *v };
            }
        }
        phase[samples] = 0.0;
        // Few enough bits that slope · index is exact: `global` adds it back.
        let mean = plain_sum(&phase[..samples]) / (samples.max(1)) as f64;
        let slope = if T::INTEGER { mean.round() } else { f64::from(mean as f32) };
        let slope = if slope.is_finite() && slope.abs() > 1e-30 { slope } else { 0.0 };
        running_sum(phase, slope);
        slope
    }

    /// The global phase of block `block` from what [`Record::local`] gave at its start.
    pub fn global(&self, block: usize, local: &[f64], slope: f64, out: &mut [f64]) {
        if self.quantity == Quantity::Angle {
            self.series.load(block * BLOCK, self.mean, out);
            return;
        }
        let [high, low] = self.bases[block];
        for (i, (slot, value)) in out.iter_mut().zip(local).enumerate() {
            *slot = high + (low + (slope * i as f64 + value));
        }
    }
}

/// Exclusive running sum of `values − slope`, in place: a chain of one addition per four samples.
pub(crate) fn running_sum(values: &mut [f64], slope: f64) {
    let mut carry = 0.0;
    let mut quads = values.chunks_exact_mut(4);
    for quad in &mut quads {
        let (a, b, c, d) = (quad[0] - slope, quad[1] - slope, quad[2] - slope, quad[3] - slope);
        let ab = a + b;
        quad[0] = carry;
        quad[1] = carry + a;
        quad[2] = carry + ab;
        quad[3] = carry + (ab + c);
        carry += ab + (c + d);
    }
    for value in quads.into_remainder() {
        let next = carry + (*value - slope);
        *value = carry;
        carry = next;
    }
}

pub(crate) fn plain_sum(values: &[f64]) -> f64 {
    let mut lanes = [0.0; 16];
    let chunks = values.chunks_exact(16);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += value;
        }
    }
    lanes.iter().sum::<f64>() + rest
}

fn look_at_blocks<T: Sample>(
    series: Series<'_, T>,
    origin: T::Base,
    threads: usize,
    stop: &AtomicBool,
) -> Result<Vec<Look>> {
    let n = series.len();
    let blocks = n.div_ceil(BLOCK);
    let threads = if n < 1 << 18 { 1 } else { threads };
    let looks = for_each(
        threads,
        blocks,
        stop,
        || [0.0; CHUNK],
        |buffer, block| {
            let (start, end) = (block * BLOCK, ((block + 1) * BLOCK).min(n));
            let mut look = Look { sum: [0.0; 2], finite: end - start };
            for at in (start..end).step_by(CHUNK) {
                let values = &mut buffer[..CHUNK.min(end - at)];
                series.load(at, origin, values);
                let mut sum = plain_sum(values);
                if !sum.is_finite() {
                    for (i, value) in values.iter_mut().enumerate() {
                        if value.is_nan() && series.at(at + i).value().is_nan() {
                            *value = 0.0;
                            look.finite -= 1;
                        } else if !value.is_finite() {
                            return Err(Error::Input(format!(
                                "sample {} is {}: only finite values and NaN (gaps) can be used",
                                at + i,
                                series.at(at + i).value()
                            )));
                        }
                    }
                    sum = plain_sum(values);
                }
                add_to(&mut look.sum, sum);
            }
            Ok(look)
        },
    )?;
    looks.into_iter().collect()
}

fn find_runs<T: Sample>(series: Series<'_, T>, looks: &[Look]) -> Vec<(usize, usize)> {
    let n = series.len();
    let mut runs = Vec::new();
    let mut open = None;
    for (block, look) in looks.iter().enumerate() {
        let (start, end) = (block * BLOCK, ((block + 1) * BLOCK).min(n));
        if look.finite == end - start {
            open.get_or_insert(start);
            continue;
        }
        for i in start..end {
            if series.at(i).value().is_nan() {
                runs.extend(open.take().map(|from| (from, i)));
            } else {
                open.get_or_insert(i);
            }
        }
    }
    runs.extend(open.map(|from| (from, n)));
    runs
}

/// The mean as a base, and the phase at the start of each block with exactly that base subtracted.
fn bases<T: Sample>(origin: T::Base, looks: &[Look], finite: usize) -> (T::Base, Vec<[f64; 2]>) {
    let mut total = [0.0; 2];
    for look in looks {
        add_to(&mut total, look.sum[0]);
        add_to(&mut total, look.sum[1]);
    }
    let (mean, step) = T::moved(origin, (total[0] + total[1]) / finite as f64);
    let mut at = [0.0; 2];
    let mut bases = Vec::with_capacity(looks.len() + 1);
    for look in looks {
        bases.push(at);
        let count = look.finite as f64;
        add_to(&mut at, look.sum[0]);
        add_to(&mut at, look.sum[1]);
        let product = count * step[0];
        add_to(&mut at, -product);
        add_to(&mut at, -count.mul_add(step[0], -product));
        add_to(&mut at, -count * step[1]);
    }
    bases.push(at); // of the last phase point, where the record ends with a full block
    (mean, bases)
}

/// a + b as an unevaluated sum of two doubles (Knuth).
pub fn two_sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    let virtual_b = sum - a;
    [sum, (a - (sum - virtual_b)) + (b - virtual_b)]
}

/// Adds to an unevaluated sum of two doubles.
pub fn add_to(sum: &mut [f64; 2], value: f64) {
    let [high, low] = two_sum(sum[0], value);
    let low = low + sum[1];
    let to = high + low;
    *sum = [to, low - (to - high)];
}
