//! Vectors of four doubles, for recursions that are written once and compiled for every vector unit.
//!
//! Every implementation runs the same operations in the same order, fused multiply-adds included, and so gives the
//! same bits.

// Instructions of a wider unit may only be inlined into a function that has them enabled.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

/// Number of doubles in a vector.
pub(super) const LANES: usize = 4;

/// A vector of four doubles.
///
/// # Safety
/// Functions of an implementation may only be called where the processor has its instructions.
pub(super) unsafe trait Quad: Copy {
    /// The same value in every lane.
    unsafe fn splat(value: f64) -> Self;
    /// The vector of these doubles.
    unsafe fn load(lanes: &[f64; LANES]) -> Self;
    /// Writes the doubles of the vector.
    unsafe fn store(self, lanes: &mut [f64; LANES]);
    /// a·b.
    unsafe fn times(a: Self, b: Self) -> Self;
    /// a·b + c, rounded once.
    unsafe fn fused(a: Self, b: Self, c: Self) -> Self;
    /// The last double of `before` and the first three of `here`.
    unsafe fn delayed(before: Self, here: Self) -> Self;
    /// The last two doubles of `before` and the first two of `here`.
    unsafe fn delayed_twice(before: Self, here: Self) -> Self;
    /// The last double in every lane.
    unsafe fn last(self) -> Self;
    /// The first double.
    unsafe fn first(self) -> f64;
    /// The sums (a + b) + (c + d) of the lanes of each row.
    unsafe fn sums(rows: [Self; LANES]) -> Self;
}

/// Implementation in plain Rust.
#[derive(Clone, Copy)]
pub(super) struct Portable([f64; LANES]);

// SAFETY: needs no instructions beyond the baseline.
unsafe impl Quad for Portable {
    #[inline(always)]
    unsafe fn splat(value: f64) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    unsafe fn load(lanes: &[f64; LANES]) -> Self {
        Self(*lanes)
    }
    #[inline(always)]
    unsafe fn store(self, lanes: &mut [f64; LANES]) {
        *lanes = self.0;
    }
    #[inline(always)]
    unsafe fn times(a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| a.0[i] * b.0[i]))
    }
    #[inline(always)]
    unsafe fn fused(a: Self, b: Self, c: Self) -> Self {
        Self(std::array::from_fn(|i| a.0[i].mul_add(b.0[i], c.0[i])))
    }
    #[inline(always)]
    unsafe fn delayed(before: Self, here: Self) -> Self {
        Self([before.0[3], here.0[0], here.0[1], here.0[2]])
    }
    #[inline(always)]
    unsafe fn delayed_twice(before: Self, here: Self) -> Self {
        Self([before.0[2], before.0[3], here.0[0], here.0[1]])
    }
    #[inline(always)]
    unsafe fn last(self) -> Self {
        Self([self.0[3]; LANES])
    }
    #[inline(always)]
    unsafe fn first(self) -> f64 {
        self.0[0]
    }
    #[inline(always)]
    unsafe fn sums(rows: [Self; LANES]) -> Self {
        Self(rows.map(|Self([a, b, c, d])| (a + b) + (c + d)))
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m256d, _mm256_add_pd, _mm256_cvtsd_f64, _mm256_fmadd_pd, _mm256_hadd_pd, _mm256_loadu_pd,
        _mm256_mul_pd, _mm256_permute2f128_pd, _mm256_permute4x64_pd, _mm256_set1_pd, _mm256_shuffle_pd,
        _mm256_storeu_pd,
    };

    use super::LANES;

    /// Implementation by AVX2 with FMA.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(__m256d);

    // SAFETY: every function needs AVX2 and FMA, which the caller proves by a wide `Width`.
    unsafe impl super::Quad for Avx2 {
        #[inline(always)]
        unsafe fn splat(value: f64) -> Self {
            // SAFETY: AVX2 is there (contract of the trait), here and below.
            Self(unsafe { _mm256_set1_pd(value) })
        }
        #[inline(always)]
        unsafe fn load(lanes: &[f64; LANES]) -> Self {
            // SAFETY: four doubles are readable; the load is unaligned.
            Self(unsafe { _mm256_loadu_pd(lanes.as_ptr()) })
        }
        #[inline(always)]
        unsafe fn store(self, lanes: &mut [f64; LANES]) {
            // SAFETY: four doubles are writable; the store is unaligned.
            unsafe { _mm256_storeu_pd(lanes.as_mut_ptr(), self.0) };
        }
        #[inline(always)]
        unsafe fn times(a: Self, b: Self) -> Self {
            // SAFETY: contract of the trait.
            Self(unsafe { _mm256_mul_pd(a.0, b.0) })
        }
        #[inline(always)]
        unsafe fn fused(a: Self, b: Self, c: Self) -> Self {
            // SAFETY: contract of the trait.
            Self(unsafe { _mm256_fmadd_pd(a.0, b.0, c.0) })
        }
        #[inline(always)]
        unsafe fn delayed(before: Self, here: Self) -> Self {
            // SAFETY: contract of the trait.
            unsafe { Self(_mm256_shuffle_pd::<0b0101>(Self::delayed_twice(before, here).0, here.0)) }
        }
        #[inline(always)]
        unsafe fn delayed_twice(before: Self, here: Self) -> Self {
            // SAFETY: contract of the trait.
            Self(unsafe { _mm256_permute2f128_pd::<0x21>(before.0, here.0) })
        }
        #[inline(always)]
        unsafe fn last(self) -> Self {
            // SAFETY: contract of the trait.
            Self(unsafe { _mm256_permute4x64_pd::<0xff>(self.0) })
        }
        #[inline(always)]
        unsafe fn first(self) -> f64 {
            // SAFETY: contract of the trait.
            unsafe { _mm256_cvtsd_f64(self.0) }
        }
        #[inline(always)]
        unsafe fn sums([a, b, c, d]: [Self; LANES]) -> Self {
            // SAFETY: contract of the trait.
            unsafe {
                let (first, second) = (_mm256_hadd_pd(a.0, b.0), _mm256_hadd_pd(c.0, d.0));
                let low = _mm256_permute2f128_pd::<0x20>(first, second);
                let high = _mm256_permute2f128_pd::<0x31>(first, second);
                Self(_mm256_add_pd(low, high))
            }
        }
    }
}
#[cfg(target_arch = "x86_64")]
pub(super) use x86::Avx2;
