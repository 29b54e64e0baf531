//! Vector registers of eight or four lanes, with the operations that the normal deviates need.
//!
//! Every implementation runs the same operations in the same order and so gives the same bits.

// Instructions of a wider unit may only be inlined into a function that has them enabled.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

use std::array;

/// Bits of 2^52. An integer k in the low bits makes the double 2^52 + k.
const MAGIC: u64 = 0x4330_0000_0000_0000;
/// 2^52 plus the bias of exponents.
const EXPONENT: f64 = 4503599627370496.0 + 1023.0;

/// A vector unit.
///
/// # Safety
/// Functions of an implementation may only be called where the processor has its instructions. Slices are `WIDTH` long.
pub(super) unsafe trait Registers {
    /// Number of lanes of a register: 4 or 8.
    const WIDTH: usize;
    type Words: Copy;
    type Numbers: Copy;
    /// The words of the slice, one for each lane.
    unsafe fn load(words: &[u64]) -> Self::Words;
    /// Writes the words to the slice `to`.
    unsafe fn store_words(words: Self::Words, to: &mut [u64]);
    /// Writes the numbers to the slice `to`.
    unsafe fn store(numbers: Self::Numbers, to: &mut [f64]);
    /// The same word in every lane.
    unsafe fn word(value: u64) -> Self::Words;
    /// The same number in every lane.
    unsafe fn splat(value: f64) -> Self::Numbers;
    /// a + b, modulo 2^64.
    unsafe fn plus(a: Self::Words, b: Self::Words) -> Self::Words;
    /// Bitwise a & b.
    unsafe fn and(a: Self::Words, b: Self::Words) -> Self::Words;
    /// Bitwise a | b.
    unsafe fn or(a: Self::Words, b: Self::Words) -> Self::Words;
    /// Bitwise a ^ b.
    unsafe fn xor(a: Self::Words, b: Self::Words) -> Self::Words;
    /// Left shift by less than 64 bits, a constant known to the compiler.
    unsafe fn left(a: Self::Words, by: u32) -> Self::Words;
    /// Logical right shift by less than 64 bits, a constant known to the compiler.
    unsafe fn right(a: Self::Words, by: u32) -> Self::Words;
    /// The bits of the numbers.
    unsafe fn bits(a: Self::Numbers) -> Self::Words;
    /// The numbers with these bits.
    unsafe fn number(a: Self::Words) -> Self::Numbers;
    /// a − b.
    unsafe fn minus(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// a·b.
    unsafe fn times(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// a·b + c, rounded once.
    unsafe fn fused(a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers;
    /// Square root.
    unsafe fn root(a: Self::Numbers) -> Self::Numbers;
    /// The table entries at the last four bits of each word.
    unsafe fn look_up(table: &[f64; 16], at: Self::Words) -> Self::Numbers;
    /// The exponent e of normal numbers 2^e·m, m in [1, 2).
    #[inline(always)]
    unsafe fn exponent(a: Self::Numbers) -> Self::Numbers {
        // SAFETY: contract of the trait.
        unsafe {
            let high = Self::or(Self::word(MAGIC), Self::right(Self::bits(a), 52));
            Self::minus(Self::number(high), Self::splat(EXPONENT))
        }
    }
}

/// Defines functions of [`Registers`], each by one expression.
macro_rules! operations {
    ($($name:ident($($argument:ident: $kind:ty),*) $(-> $out:ty)? = $body:expr;)*) => {$(
        #[inline(always)]
        #[allow(unused_unsafe, reason = "some expressions are plain Rust")]
        unsafe fn $name($($argument: $kind),*) $(-> $out)? {
            // SAFETY: instructions are there by the contract of the trait, and slices are as long as it says; an index
            // of a table is one of it.
            unsafe { $body }
        }
    )*};
}

/// Number of lanes of the implementation in plain Rust.
const WIDTH: usize = 4;

/// Implementation in plain Rust.
pub(super) struct Portable;

// SAFETY: needs no instructions beyond the baseline.
unsafe impl Registers for Portable {
    const WIDTH: usize = WIDTH;
    type Words = [u64; WIDTH];
    type Numbers = [f64; WIDTH];
    operations! {
        load(words: &[u64]) -> Self::Words = array::from_fn(|i| words[i]);
        store_words(words: Self::Words, to: &mut [u64]) = to.copy_from_slice(&words);
        store(numbers: Self::Numbers, to: &mut [f64]) = to.copy_from_slice(&numbers);
        word(value: u64) -> Self::Words = [value; WIDTH];
        splat(value: f64) -> Self::Numbers = [value; WIDTH];
        plus(a: Self::Words, b: Self::Words) -> Self::Words = array::from_fn(|i| a[i].wrapping_add(b[i]));
        and(a: Self::Words, b: Self::Words) -> Self::Words = array::from_fn(|i| a[i] & b[i]);
        or(a: Self::Words, b: Self::Words) -> Self::Words = array::from_fn(|i| a[i] | b[i]);
        xor(a: Self::Words, b: Self::Words) -> Self::Words = array::from_fn(|i| a[i] ^ b[i]);
        left(a: Self::Words, by: u32) -> Self::Words = a.map(|a| a << by);
        right(a: Self::Words, by: u32) -> Self::Words = a.map(|a| a >> by);
        bits(a: Self::Numbers) -> Self::Words = a.map(f64::to_bits);
        number(a: Self::Words) -> Self::Numbers = a.map(f64::from_bits);
        minus(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers = array::from_fn(|i| a[i] - b[i]);
        times(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers = array::from_fn(|i| a[i] * b[i]);
        fused(a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers =
            array::from_fn(|i| a[i].mul_add(b[i], c[i]));
        root(a: Self::Numbers) -> Self::Numbers = a.map(f64::sqrt);
        look_up(table: &[f64; 16], at: Self::Words) -> Self::Numbers = at.map(|at| table[at as usize % 16]);
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    #[allow(clippy::wildcard_imports, reason = "all imported names begin with _mm or __m")]
    use std::arch::x86_64::*;

    use super::Registers;

    /// Implementation by AVX2 with FMA, whose registers hold half of the lanes.
    pub(crate) struct Avx2;

    // SAFETY: every function needs this vector unit, which the caller proves by its `Width`.
    unsafe impl Registers for Avx2 {
        const WIDTH: usize = 4;
        type Words = __m256i;
        type Numbers = __m256d;
        operations! {
            load(words: &[u64]) -> Self::Words = _mm256_loadu_si256(words[..4].as_ptr().cast());
            store_words(words: Self::Words, to: &mut [u64]) = _mm256_storeu_si256(to[..4].as_mut_ptr().cast(), words);
            store(numbers: Self::Numbers, to: &mut [f64]) = _mm256_storeu_pd(to[..4].as_mut_ptr(), numbers);
            word(value: u64) -> Self::Words = _mm256_set1_epi64x(value.cast_signed());
            splat(value: f64) -> Self::Numbers = _mm256_set1_pd(value);
            plus(a: Self::Words, b: Self::Words) -> Self::Words = _mm256_add_epi64(a, b);
            and(a: Self::Words, b: Self::Words) -> Self::Words = _mm256_and_si256(a, b);
            or(a: Self::Words, b: Self::Words) -> Self::Words = _mm256_or_si256(a, b);
            xor(a: Self::Words, b: Self::Words) -> Self::Words = _mm256_xor_si256(a, b);
            left(a: Self::Words, by: u32) -> Self::Words = _mm256_sllv_epi64(a, Self::word(by.into()));
            right(a: Self::Words, by: u32) -> Self::Words = _mm256_srlv_epi64(a, Self::word(by.into()));
            bits(a: Self::Numbers) -> Self::Words = _mm256_castpd_si256(a);
            number(a: Self::Words) -> Self::Numbers = _mm256_castsi256_pd(a);
            minus(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers = _mm256_sub_pd(a, b);
            times(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers = _mm256_mul_pd(a, b);
            fused(a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers = _mm256_fmadd_pd(a, b, c);
            root(a: Self::Numbers) -> Self::Numbers = _mm256_sqrt_pd(a);
            look_up(table: &[f64; 16], at: Self::Words) -> Self::Numbers =
                _mm256_i64gather_pd::<8>(table.as_ptr(), Self::and(at, Self::word(15)));
        }
    }

    /// Implementation by AVX-512F.
    pub(crate) struct Avx512;

    // SAFETY: every function needs this vector unit, which the caller proves by its `Width`.
    unsafe impl Registers for Avx512 {
        const WIDTH: usize = 8;
        type Words = __m512i;
        type Numbers = __m512d;
        operations! {
            load(words: &[u64]) -> Self::Words = _mm512_loadu_si512(words[..8].as_ptr().cast());
            store_words(words: Self::Words, to: &mut [u64]) = _mm512_storeu_si512(to[..8].as_mut_ptr().cast(), words);
            store(numbers: Self::Numbers, to: &mut [f64]) = _mm512_storeu_pd(to[..8].as_mut_ptr(), numbers);
            word(value: u64) -> Self::Words = _mm512_set1_epi64(value.cast_signed());
            splat(value: f64) -> Self::Numbers = _mm512_set1_pd(value);
            plus(a: Self::Words, b: Self::Words) -> Self::Words = _mm512_add_epi64(a, b);
            and(a: Self::Words, b: Self::Words) -> Self::Words = _mm512_and_si512(a, b);
            or(a: Self::Words, b: Self::Words) -> Self::Words = _mm512_or_si512(a, b);
            xor(a: Self::Words, b: Self::Words) -> Self::Words = _mm512_xor_si512(a, b);
            left(a: Self::Words, by: u32) -> Self::Words = _mm512_sllv_epi64(a, Self::word(by.into()));
            right(a: Self::Words, by: u32) -> Self::Words = _mm512_srlv_epi64(a, Self::word(by.into()));
            bits(a: Self::Numbers) -> Self::Words = _mm512_castpd_si512(a);
            number(a: Self::Words) -> Self::Numbers = _mm512_castsi512_pd(a);
            minus(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers = _mm512_sub_pd(a, b);
            times(a: Self::Numbers, b: Self::Numbers) -> Self::Numbers = _mm512_mul_pd(a, b);
            fused(a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers = _mm512_fmadd_pd(a, b, c);
            root(a: Self::Numbers) -> Self::Numbers = _mm512_sqrt_pd(a);
            look_up(table: &[f64; 16], at: Self::Words) -> Self::Numbers = {
                let (low, high) = (_mm512_loadu_pd(table.as_ptr()), _mm512_loadu_pd(table[8..].as_ptr()));
                _mm512_permutex2var_pd(low, at, high)
            };
            exponent(a: Self::Numbers) -> Self::Numbers = _mm512_getexp_pd(a);
        }
    }
}
#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};
