//! The innermost loop, generic over the vector width: `Σ_k (θ[k+2m] − 2θ[k+m] + θ[k])²` for several m in one pass.
//!
//! There are three shapes. A *chain* m, 2m, 4m, … shares loads, because θ[k+2m] of one factor is θ[k+m'] of the next;
//! this reaches the FMA limit. *Rows* sum the terms at k, k+m, k+2m, … of one factor, which share loads in the same
//! way; they suit every m that is long enough for a row. *Several* short factors share only θ[k] and are limited by
//! loads.
//!
//! Every second difference is computed from first differences, so that neither an offset nor a drift of the phase
//! adds rounding errors.

// Instructions of a wider unit may only be inlined into a function that has them enabled.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

/// A vector of doubles.
///
/// # Safety
/// Functions of an implementation may only be called where the processor has its instructions.
pub(super) unsafe trait Lanes: Copy {
    /// Doubles in one vector.
    const WIDTH: usize;
    /// Zeros.
    unsafe fn zero() -> Self;
    /// The `WIDTH` doubles from `from` on.
    ///
    /// # Safety
    /// `WIDTH` doubles must be readable from `from`; any alignment.
    unsafe fn load(from: *const f64) -> Self;
    /// The first `count` < `WIDTH` doubles, followed by zeros.
    ///
    /// # Safety
    /// `count` doubles must be readable from `from`.
    unsafe fn load_some(from: *const f64, count: usize) -> Self;
    /// a − b.
    unsafe fn minus(a: Self, b: Self) -> Self;
    /// a − 2b.
    unsafe fn minus_twice(a: Self, b: Self) -> Self;
    /// d² + sum.
    unsafe fn add_square(d: Self, sum: Self) -> Self;
    /// Sum of the lanes, in a fixed order.
    unsafe fn total(self) -> f64;
}

/// Portable fallback of four doubles.
#[derive(Clone, Copy)]
pub(super) struct Portable([f64; 4]);

// SAFETY: needs no instructions beyond the baseline.
unsafe impl Lanes for Portable {
    const WIDTH: usize = 4;
    #[inline(always)]
    unsafe fn zero() -> Self {
        Self([0.0; 4])
    }
    #[inline(always)]
    unsafe fn load(from: *const f64) -> Self {
        // SAFETY: the caller vouches for WIDTH readable doubles; the read is unaligned.
        Self(unsafe { from.cast::<[f64; 4]>().read_unaligned() })
    }
    #[inline(always)]
    unsafe fn load_some(from: *const f64, count: usize) -> Self {
        // SAFETY: the caller vouches for `count` readable doubles.
        Self(std::array::from_fn(|i| if i < count { unsafe { from.add(i).read() } } else { 0.0 }))
    }
    #[inline(always)]
    unsafe fn minus(a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| a.0[i] - b.0[i]))
    }
    #[inline(always)]
    unsafe fn minus_twice(a: Self, b: Self) -> Self {
        Self(std::array::from_fn(|i| a.0[i] - 2.0 * b.0[i]))
    }
    #[inline(always)]
    unsafe fn add_square(d: Self, sum: Self) -> Self {
        Self(std::array::from_fn(|i| d.0[i] * d.0[i] + sum.0[i]))
    }
    #[inline(always)]
    unsafe fn total(self) -> f64 {
        (self.0[0] + self.0[1]) + (self.0[2] + self.0[3])
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::{
        __m256d, __m512d, _mm256_fmadd_pd, _mm256_fnmadd_pd, _mm256_loadu_pd, _mm256_loadu_si256,
        _mm256_maskload_pd, _mm256_set1_pd, _mm256_setzero_pd, _mm256_storeu_pd, _mm256_sub_pd,
        _mm512_fmadd_pd, _mm512_fnmadd_pd, _mm512_loadu_pd, _mm512_maskz_loadu_pd, _mm512_set1_pd,
        _mm512_setzero_pd, _mm512_storeu_pd, _mm512_sub_pd,
    };

    /// Four doubles of AVX2 with FMA.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx2(__m256d);

    // SAFETY: every function needs AVX2 and FMA, which the one dispatcher in `sums.rs` has asked for.
    unsafe impl super::Lanes for Avx2 {
        const WIDTH: usize = 4;
        #[inline(always)]
        unsafe fn zero() -> Self {
            // SAFETY: AVX is there (contract of the trait).
            Self(unsafe { _mm256_setzero_pd() })
        }
        #[inline(always)]
        unsafe fn load(from: *const f64) -> Self {
            // SAFETY: four readable doubles (contract of `load`); the load is unaligned.
            Self(unsafe { _mm256_loadu_pd(from) })
        }
        #[inline(always)]
        unsafe fn load_some(from: *const f64, count: usize) -> Self {
            const MASK: [i64; 8] = [-1, -1, -1, -1, 0, 0, 0, 0];
            let mask = &MASK[4 - count.min(4)..];
            // SAFETY: four whole numbers are readable from `mask`; of `from` only the `count` lanes of the mask are.
            Self(unsafe { _mm256_maskload_pd(from, _mm256_loadu_si256(mask.as_ptr().cast())) })
        }
        #[inline(always)]
        unsafe fn minus(a: Self, b: Self) -> Self {
            // SAFETY: AVX is there (contract of the trait).
            Self(unsafe { _mm256_sub_pd(a.0, b.0) })
        }
        #[inline(always)]
        unsafe fn minus_twice(a: Self, b: Self) -> Self {
            // SAFETY: FMA is there (contract of the trait).
            Self(unsafe { _mm256_fnmadd_pd(_mm256_set1_pd(2.0), b.0, a.0) })
        }
        #[inline(always)]
        unsafe fn add_square(d: Self, sum: Self) -> Self {
            // SAFETY: FMA is there (contract of the trait).
            Self(unsafe { _mm256_fmadd_pd(d.0, d.0, sum.0) })
        }
        #[inline(always)]
        unsafe fn total(self) -> f64 {
            let mut lanes = [0.0; 4];
            // SAFETY: four writable doubles; the store is unaligned.
            unsafe { _mm256_storeu_pd(lanes.as_mut_ptr(), self.0) };
            (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
        }
    }

    /// Eight doubles of AVX-512.
    #[derive(Clone, Copy)]
    pub(crate) struct Avx512(__m512d);

    // SAFETY: every function needs AVX-512F, which the one dispatcher in `sums.rs` has asked for.
    unsafe impl super::Lanes for Avx512 {
        const WIDTH: usize = 8;
        #[inline(always)]
        unsafe fn zero() -> Self {
            // SAFETY: AVX-512F is there (contract of the trait).
            Self(unsafe { _mm512_setzero_pd() })
        }
        #[inline(always)]
        unsafe fn load(from: *const f64) -> Self {
            // SAFETY: eight readable doubles (contract of `load`); the load is unaligned.
            Self(unsafe { _mm512_loadu_pd(from) })
        }
        #[inline(always)]
        unsafe fn load_some(from: *const f64, count: usize) -> Self {
            let mask = (1_u8 << count.min(7)) - 1;
            // SAFETY: only the lanes of the mask are read, of which `count` doubles are readable.
            Self(unsafe { _mm512_maskz_loadu_pd(mask, from) })
        }
        #[inline(always)]
        unsafe fn minus(a: Self, b: Self) -> Self {
            // SAFETY: AVX-512F is there (contract of the trait).
            Self(unsafe { _mm512_sub_pd(a.0, b.0) })
        }
        #[inline(always)]
        unsafe fn minus_twice(a: Self, b: Self) -> Self {
            // SAFETY: AVX-512F is there (contract of the trait).
            Self(unsafe { _mm512_fnmadd_pd(_mm512_set1_pd(2.0), b.0, a.0) })
        }
        #[inline(always)]
        unsafe fn add_square(d: Self, sum: Self) -> Self {
            // SAFETY: AVX-512F is there (contract of the trait).
            Self(unsafe { _mm512_fmadd_pd(d.0, d.0, sum.0) })
        }
        #[inline(always)]
        unsafe fn total(self) -> f64 {
            let mut lanes = [0.0; 8];
            // SAFETY: eight writable doubles; the store is unaligned.
            unsafe { _mm512_storeu_pd(lanes.as_mut_ptr(), self.0) };
            let [a, b, c, d, e, f, g, h] = lanes;
            ((a + b) + (c + d)) + ((e + f) + (g + h))
        }
    }
}
#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[inline(always)]
/// Square of the second difference.
fn term(a: f64, b: f64, c: f64) -> f64 {
    let d = (c - a) - 2.0 * (b - a);
    d * d
}

/// Sums for the factors m, 2m, … 2^(T−1)·m over k = 0..n.
///
/// # Safety
/// The processor has the instructions of `V`; `n + 2^T·m` doubles are readable from `theta`.
#[inline(always)]
pub(super) unsafe fn chain<V: Lanes, const T: usize>(theta: *const f64, m: usize, n: usize) -> [f64; T] {
    // SAFETY: the largest index read is n − 1 + 2^T·m; vectors end at or before n.
    unsafe {
        let mut sums = [V::zero(); T];
        let whole = n - n % V::WIDTH;
        let mut k = 0;
        while k < whole {
            let at = theta.add(k);
            let a = V::load(at);
            let mut last = V::minus(V::load(at.add(m)), a);
            for (t, sum) in sums.iter_mut().enumerate() {
                let next = V::minus(V::load(at.add(m << (t + 1))), a);
                *sum = V::add_square(V::minus_twice(next, last), *sum);
                last = next;
            }
            k += V::WIDTH;
        }
        let mut out = sums.map(|sum| sum.total());
        for k in whole..n {
            for (t, slot) in out.iter_mut().enumerate() {
                *slot += term(*theta.add(k), *theta.add(k + (m << t)), *theta.add(k + (m << (t + 1))));
            }
        }
        out
    }
}

/// Sums for T arbitrary factors over k = 0..n. Each has `U` independent partial sums, which hide the latency when T
/// is small.
///
/// # Safety
/// The processor has the instructions of `V`; `n + 2·max(m)` doubles are readable from `theta`.
#[inline(always)]
pub(super) unsafe fn several<V: Lanes, const T: usize, const U: usize>(
    theta: *const f64,
    m: [usize; T],
    n: usize,
) -> [f64; T] {
    // SAFETY: the largest index read is n − 1 + 2·max(m); vectors end at or before n.
    unsafe {
        let mut sums = [[V::zero(); U]; T];
        let stride = V::WIDTH * U;
        let whole = n - n % stride;
        let mut k = 0;
        while k < whole {
            for u in 0..U {
                let at = theta.add(k + u * V::WIDTH);
                let a = V::load(at);
                for (&m, sums) in m.iter().zip(&mut sums) {
                    let (b, c) = (V::load(at.add(m)), V::load(at.add(2 * m)));
                    let d = V::minus_twice(V::minus(c, a), V::minus(b, a));
                    sums[u] = V::add_square(d, sums[u]);
                }
            }
            k += stride;
        }
        let mut out = sums.map(|sum| sum.iter().map(|s| s.total()).sum::<f64>());
        for k in whole..n {
            for (t, slot) in out.iter_mut().enumerate() {
                *slot += term(*theta.add(k), *theta.add(k + m[t]), *theta.add(k + 2 * m[t]));
            }
        }
        out
    }
}

/// Number of partial sums of a block of rows; more would not fit into sixteen registers.
const SUMS: usize = 8;

/// Sum of the squared second differences for one factor m over `blocks` blocks of J rows.
///
/// The terms start at k = (block·J + row)·m + i, i = 0..row. With `row` = m these are the terms k = 0..blocks·J·m.
/// J + 2 loads serve J terms.
///
/// # Safety
/// The processor has the instructions of `V`; `(blocks·J + 1)·m + row` doubles are readable from `theta`.
#[inline(always)]
pub(super) unsafe fn rows<V: Lanes, const J: usize>(
    theta: *const f64,
    m: usize,
    row: usize,
    blocks: usize,
) -> f64 {
    // SAFETY: the largest index read is ((blocks − 1)·J + J + 1)·m + row − 1; lanes beyond a row are not read.
    unsafe {
        let mut sums = [V::zero(); SUMS];
        let whole = row - row % V::WIDTH;
        for block in 0..blocks {
            let start = theta.add(block * J * m);
            let mut i = 0;
            while i < whole {
                let at = start.add(i);
                let mut last = V::load(at.add(m));
                let mut gain = V::minus(last, V::load(at));
                for j in 0..J {
                    let next = V::load(at.add((j + 2) * m));
                    let more = V::minus(next, last);
                    sums[j % SUMS] = V::add_square(V::minus(more, gain), sums[j % SUMS]);
                    (last, gain) = (next, more);
                }
                i += V::WIDTH;
            }
            if whole < row {
                let (at, count) = (start.add(whole), row - whole);
                let mut last = V::load_some(at.add(m), count);
                let mut gain = V::minus(last, V::load_some(at, count));
                for j in 0..J {
                    let next = V::load_some(at.add((j + 2) * m), count);
                    let more = V::minus(next, last);
                    sums[j % SUMS] = V::add_square(V::minus(more, gain), sums[j % SUMS]);
                    (last, gain) = (next, more);
                }
            }
        }
        sums.iter().map(|sum| sum.total()).sum()
    }
}
