//! Phase θ from samples, without loss of precision.
//!
//! The phase is the running sum of the samples with a leading zero, θ[k] = Σ_{i<k} (x[i] − μ), in units of one
//! sample. A running sum over 10⁸ samples loses digits that small averaging factors need, whatever is subtracted
//! first. So the phase has two levels. [`Record::local`] gives the phase inside one block, starting from zero and
//! with the mean of the block removed; second differences depend on neither. [`Record::global`] gives the phase over
//! the whole record, from a base per block that is stored in two doubles.
//!
//! Both levels must subtract **the same rounded μ**. Otherwise the difference, times the block length, adds a
//! sawtooth.

mod scan;
mod series;

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{_mm_sfence, _mm256_loadu_pd, _mm256_stream_pd};
use std::sync::atomic::AtomicBool;

use crate::machine::buffer_pool::Unwritten;
#[cfg(target_arch = "x86_64")]
use crate::machine::processor::Unit;
use crate::machine::processor::{Width, compiled_for_each_width};
use crate::parallel::for_each;
use crate::{Error, Result};

pub(crate) use scan::sum as plain_sum;
pub use series::{Sample, Series};

/// Number of samples, and of phase points, of one block. The error of the local phase grows with its square.
pub(crate) const BLOCK: usize = 16384;
/// Largest averaging factor that is served from the local phase.
pub(crate) const LOCAL: usize = 2048;
/// Number of samples that are summed plainly; the sums of such chunks are added with compensation.
const CHUNK: usize = 512;

/// From this many points on, the global phase is written past the caches, which are too small to keep it.
#[cfg(target_arch = "x86_64")]
const STREAMED: usize = 1 << 22;
/// Number of doubles in a cache line.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 8;

/// What the samples are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Rates: the phase is their running sum.
    Rate,
    /// The phase itself.
    Angle,
}

/// A record with the results of a first pass: offset, base of each block, and gaps.
pub struct Record<'a, T: Sample> {
    series: Series<'a, T>,
    quantity: Quantity,
    mean: T::Base,
    bases: Vec<[f64; 2]>,
    slopes: Vec<f64>,
    gaps: usize,
    runs: Vec<(usize, usize)>,
}

/// Sum (in two doubles) and number of the finite samples of a block.
struct BlockSum {
    sum: [f64; 2],
    finite: usize,
}

impl<'a, T: Sample> Record<'a, T> {
    /// Reads every sample once. Error if a sample is infinite or all are NaN.
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
        let looks = sum_blocks(series, origin, threads, stop)?;
        let gaps = n - looks.iter().map(|look| look.finite).sum::<usize>();
        let runs = if gaps == 0 { vec![(0, n)] } else { find_runs(series, &looks) };
        let (mean, bases, slopes) = match quantity {
            Quantity::Rate => bases::<T>(origin, &looks, n - gaps),
            Quantity::Angle => (phase_offset(series, first), Vec::new(), Vec::new()),
        };
        Ok(Self { series, quantity, mean, bases, slopes, gaps, runs })
    }

    /// Number of samples, gaps included.
    pub fn len(&self) -> usize {
        self.series.len()
    }

    /// Always false, because an empty record is an error.
    pub fn is_empty(&self) -> bool {
        self.series.is_empty()
    }

    /// Number of missing (NaN) samples.
    pub fn gaps(&self) -> usize {
        self.gaps
    }

    /// Half-open index ranges of finite samples.
    pub fn runs(&self) -> &[(usize, usize)] {
        &self.runs
    }

    /// Meaning of the samples.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Number of phase points; for rates, one more than samples.
    pub fn points(&self) -> usize {
        self.len() + usize::from(self.quantity == Quantity::Rate)
    }

    /// Writes phase points `start .. start + phase.len()`; returns the slope removed. For rates the phase starts at
    /// zero and has the slope of the block of `start` removed.
    ///
    /// Missing rates count as zeros; the callers skip terms that use them. Missing phase points stay NaN.
    pub(crate) fn local(&self, start: usize, phase: &mut [f64]) -> f64 {
        #[cfg(target_arch = "x86_64")]
        if Width::best().is_wide() {
            // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
            return unsafe { self.local_avx2(start, phase) };
        }
        self.local_by(start, phase, scan::plain)
    }

    /// Like [`Self::local`], compiled for AVX2 and FMA.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn local_avx2(&self, start: usize, phase: &mut [f64]) -> f64 {
        // SAFETY: the contract of this function is that of the sum.
        self.local_by(start, phase, |values, slope, carry| unsafe { scan::avx2(values, slope, carry) })
    }

    /// Body of [`Self::local`] for a given function that computes running sums.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    fn local_by(
        &self,
        start: usize,
        phase: &mut [f64],
        running: impl Fn(&mut [f64], f64, f64) -> f64,
    ) -> f64 {
        let Some(samples) = phase.len().checked_sub(1) else { return 0.0 };
        if self.quantity == Quantity::Angle {
            self.series.load(start, self.mean, phase);
            return 0.0;
        }
        let slope = self.slopes[start / BLOCK];
        let mut carry = 0.0;
        for at in (0..samples).step_by(CHUNK) {
            let part = &mut phase[at..samples.min(at + CHUNK)];
            self.series.load(start + at, self.mean, part);
            if self.gaps > 0 {
                part.iter_mut().for_each(|v| *v = if v.is_nan() { 0.0 } else { *v });
            }
            carry = running(part, slope, carry);
        }
        phase[samples] = carry;
        slope
    }

    /// Writes the global phase of block `block`, computed from the result of [`Record::local`] at the start of that
    /// block.
    pub(crate) fn global(&self, block: usize, local: &[f64], slope: f64, out: Unwritten<'_>) {
        let local = &local[..out.len()];
        // SAFETY: all branches write a value to each double of `out` and read none; `local` is as long as `out`.
        let out = unsafe { out.overwritten() };
        if self.quantity == Quantity::Angle {
            self.series.load(block * BLOCK, self.mean, out);
            return;
        }
        #[cfg(target_arch = "x86_64")]
        if Width::best().is_wide() {
            // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
            return unsafe {
                local_to_global_avx2(self.bases[block], local, slope, out, self.len() >= STREAMED);
            };
        }
        local_to_global(0, self.bases[block], local, slope, out);
    }
}

/// Like [`local_to_global`] from the first point on, compiled for AVX2 and FMA.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn local_to_global_avx2(base: [f64; 2], local: &[f64], slope: f64, out: &mut [f64], streamed: bool) {
    if !streamed {
        return local_to_global(0, base, local, slope, out);
    }
    let mut line = [0.0; LINE];
    let head = out.as_ptr().align_offset(64).min(out.len());
    local_to_global(0, base, local, slope, &mut out[..head]);
    let (lines, _) = out[head..].as_chunks_mut::<LINE>();
    for (i, to) in lines.iter_mut().enumerate() {
        let at = head + i * LINE;
        local_to_global(at, base, &local[at..], slope, &mut line);
        // SAFETY: the line is aligned to 64 bytes, of which two registers are written.
        unsafe {
            _mm256_stream_pd(to.as_mut_ptr(), _mm256_loadu_pd(line.as_ptr()));
            _mm256_stream_pd(to.as_mut_ptr().add(4), _mm256_loadu_pd(line.as_ptr().add(4)));
        }
    }
    let at = head + lines.len() * LINE;
    local_to_global(at, base, &local[at..], slope, &mut out[at..]);
    _mm_sfence();
}

/// Writes the local phase plus slope and base, from point `at` of its block on, to `out`.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn local_to_global(at: usize, [high, low]: [f64; 2], local: &[f64], slope: f64, out: &mut [f64]) {
    for (i, (slot, value)) in out.iter_mut().zip(local).enumerate() {
        *slot = high + (low + (slope * f64::from((at + i) as u32) + value));
    }
}

compiled_for_each_width! {
    /// Like [`plain_sum`], with the same bits, compiled for each vector unit.
    pub(crate) fn wide_sum(values: &[f64]) -> f64 = scan::sum
}

/// Exclusive running sum, on the given vector unit.
#[cfg_attr(not(target_arch = "x86_64"), allow(unused_variables, reason = "only x86 has wider units"))]
pub(crate) fn running_sum(values: &[f64], out: &mut [f64], width: Width) {
    #[cfg(target_arch = "x86_64")]
    if width.unit() == Unit::Avx512 {
        // SAFETY: a `Width` is only made of units that the processor has.
        unsafe { scan::avx512(values, out) };
        return;
    }
    out.copy_from_slice(values);
    #[cfg(target_arch = "x86_64")]
    if width.is_wide() {
        // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
        unsafe { scan::avx2(out, 0.0, 0.0) };
        return;
    }
    scan::plain(out, 0.0, 0.0);
}

/// Sums of all blocks, about `origin`.
fn sum_blocks<T: Sample>(
    series: Series<'_, T>,
    origin: T::Base,
    threads: usize,
    stop: &AtomicBool,
) -> Result<Vec<BlockSum>> {
    let n = series.len();
    let blocks = n.div_ceil(BLOCK);
    let threads = if n < 1 << 18 { 1 } else { threads };
    let looks = for_each(
        threads,
        0..blocks,
        stop,
        || [0.0; CHUNK],
        |buffer, block| {
            let (start, end) = (block * BLOCK, ((block + 1) * BLOCK).min(n));
            let mut look = BlockSum { sum: [0.0; 2], finite: end - start };
            for at in (start..end).step_by(CHUNK) {
                let values = &mut buffer[..CHUNK.min(end - at)];
                series.load(at, origin, values);
                let mut sum = scan::sum(values);
                if !sum.is_finite() {
                    for (i, value) in values.iter_mut().enumerate() {
                        if value.is_nan() && series.at(at + i).value().is_nan() {
                            *value = 0.0;
                            look.finite -= 1;
                        } else if !value.is_finite() {
                            return Err(Error::Input(format!(
                                "sample {} is {} (counted from 0): only finite values and NaN (gaps) can be used",
                                at + i,
                                series.at(at + i).value()
                            )));
                        }
                    }
                    sum = scan::sum(values);
                }
                add_to(&mut look.sum, sum);
            }
            Ok(look)
        },
    )?;
    looks.into_iter().collect()
}

/// Constant to subtract from phase data. If the phase stays near one level, the constant is the first point, and the
/// difference is exact. For drifting floats it is zero, because subtracting a small number from large ones would cost
/// their last digits.
fn phase_offset<T: Sample>(series: Series<'_, T>, first: T) -> T::Base {
    let about = first.value();
    let (low, high) = (about.min(4.0 * about) / 2.0, about.max(about / 4.0) * 2.0);
    let near = |x: f64| x.is_nan() || (low <= x && x <= high);
    let mut some = (0..series.len()).step_by(64).map(|i| series.at(i).value());
    if T::INTEGER || some.all(near) { first.base() } else { T::ZERO }
}

/// Half-open index ranges of finite samples.
fn find_runs<T: Sample>(series: Series<'_, T>, looks: &[BlockSum]) -> Vec<(usize, usize)> {
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

/// The mean as a base, the phase at the start of each block with exactly that base subtracted, and the mean of each
/// block about the base. The block means have few enough bits for their product with an index to be exact.
fn bases<T: Sample>(
    origin: T::Base,
    looks: &[BlockSum],
    finite: usize,
) -> (T::Base, Vec<[f64; 2]>, Vec<f64>) {
    let mut total = [0.0; 2];
    for look in looks {
        add_to(&mut total, look.sum[0]);
        add_to(&mut total, look.sum[1]);
    }
    let (mean, step) = T::shifted_base(origin, (total[0] + total[1]) / finite as f64);
    let mut at = [0.0; 2];
    let mut bases = Vec::with_capacity(looks.len() + 1);
    let mut slopes = Vec::with_capacity(looks.len() + 1);
    for look in looks {
        let own = (look.sum[0] + look.sum[1]) / look.finite as f64 - step[0];
        let own = if T::INTEGER { own.round() } else { f64::from(own as f32) };
        slopes.push(if own.is_finite() && own.abs() > 1e-30 { own } else { 0.0 });
        bases.push(at);
        let count = look.finite as f64;
        add_to(&mut at, look.sum[0]);
        add_to(&mut at, look.sum[1]);
        let product = count * step[0];
        add_to(&mut at, -product);
        add_to(&mut at, -count.mul_add(step[0], -product));
        add_to(&mut at, -count * step[1]);
    }
    // The last phase point needs a base if the record ends with a full block.
    bases.push(at);
    slopes.push(0.0);
    (mean, bases, slopes)
}

/// a + b as an unevaluated sum of two doubles (Knuth).
pub(crate) fn two_sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    let virtual_b = sum - a;
    [sum, (a - (sum - virtual_b)) + (b - virtual_b)]
}

/// Adds `value` to an unevaluated sum of two doubles.
pub fn add_to(sum: &mut [f64; 2], value: f64) {
    let [high, low] = two_sum(sum[0], value);
    let low = low + sum[1];
    let to = high + low;
    *sum = [to, low - (to - high)];
}

#[cfg(all(test, target_arch = "x86_64", not(miri)))]
mod tests {
    use super::*;

    #[test]
    fn streaming_stores_write_the_same_phase() {
        if !Width::best().is_wide() {
            return;
        }
        let local: Vec<f64> = (0..100).map(|i| f64::from(i * i % 97) / 7.0).collect();
        let mut room = [vec![0.0; 120], vec![0.0; 120]];
        for start in 0..9 {
            for n in 0..=local.len() {
                for (out, streamed) in room.iter_mut().zip([false, true]) {
                    out.fill(-1.0);
                    let out = &mut out[start..][..n];
                    // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
                    unsafe { local_to_global_avx2([1e6, 1e-12], &local, 0.375, out, streamed) };
                }
                assert_eq!(room[0], room[1], "{n} from {start}");
            }
        }
    }
}
