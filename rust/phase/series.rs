//! Strided columns of numbers of any type, and bases that can be subtracted from them exactly.

use super::two_sum;

/// A number type of recorded samples.
pub trait Sample: Copy + Send + Sync + 'static {
    /// Type of the base that is subtracted from every sample: exactly for integers, with one rounding for floats.
    type Base: Copy + Send + Sync;
    /// True for integer types, which keep integer bases so that their phase stays exact.
    const INTEGER: bool;
    /// The base zero.
    const ZERO: Self::Base;
    /// The sample as a base.
    fn base(self) -> Self::Base;
    /// `self − base`.
    fn minus(self, base: Self::Base) -> f64;
    /// `base + by` rounded to a base, and the rounded step as an unevaluated sum of two doubles.
    fn shifted_base(base: Self::Base, by: f64) -> (Self::Base, [f64; 2]);
    /// The sample as a double, for tests of finiteness and for messages.
    fn value(self) -> f64;
}

macro_rules! float_sample {
    ($($kind:ty),*) => {$(
        impl Sample for $kind {
            type Base = f64;
            const INTEGER: bool = false;
            const ZERO: f64 = 0.0;
            #[inline]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "depends on the type")]
            fn base(self) -> f64 {
                self as f64
            }
            #[inline]
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "depends on the type")]
            fn minus(self, base: f64) -> f64 {
                self as f64 - base
            }
            fn shifted_base(base: f64, by: f64) -> (f64, [f64; 2]) {
                let to = base + by;
                (to, two_sum(to, -base))
            }
            #[allow(clippy::cast_lossless, clippy::unnecessary_cast, reason = "depends on the type")]
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
            type Base = f64; // represents all values of these types exactly
            const INTEGER: bool = true;
            const ZERO: f64 = 0.0;
            #[inline]
            fn base(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn minus(self, base: f64) -> f64 {
                f64::from(self) - base
            }
            fn shifted_base(base: f64, by: f64) -> (f64, [f64; 2]) {
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
            const ZERO: $kind = 0;
            #[inline]
            fn base(self) -> $kind {
                self
            }
            /// Subtracts the upper and the lower 32 bits separately. Each difference is exact, so that the result is
            /// rounded only once.
            #[inline]
            #[allow(clippy::unnecessary_cast, reason = "depends on the type")]
            fn minus(self, base: $kind) -> f64 {
                let high = (self >> 32) as i64 - (base >> 32) as i64;
                let low = (self & 0xffff_ffff) as i64 - (base & 0xffff_ffff) as i64;
                high as f64 * 4294967296.0 + low as f64
            }
            fn shifted_base(base: $kind, by: f64) -> ($kind, [f64; 2]) {
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

/// One column of numbers: every `step`-th number of `data`, starting at `first`.
#[derive(Clone, Copy)]
pub struct Series<'a, T> {
    data: &'a [T],
    first: usize,
    step: isize,
    len: usize,
}

impl<'a, T: Sample> Series<'a, T> {
    /// All numbers of a slice.
    pub fn new(data: &'a [T]) -> Self {
        Self { data, first: 0, step: 1, len: data.len() }
    }

    /// `len` samples at `first`, `first + step`, …; `None` if one of them would lie outside of `data`.
    pub fn strided(data: &'a [T], first: usize, step: isize, len: usize) -> Option<Self> {
        let last = first as i128 + step as i128 * (len as i128 - 1);
        let inside = len == 0 || (first < data.len() && (0..data.len() as i128).contains(&last));
        inside.then_some(Self { data, first, step, len })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The sample at `index`.
    #[inline]
    pub fn at(&self, index: usize) -> T {
        self.data[(self.first as isize + index as isize * self.step) as usize]
    }

    /// Writes `x[start + i] − base` to `out[i]`.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
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
