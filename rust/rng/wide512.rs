//! The normals of `super`, operation for operation, eight lanes to a register (AVX-512).

use std::arch::x86_64::{
    __m512d, __m512i, _mm512_add_epi64, _mm512_and_si512, _mm512_castpd_si512, _mm512_castsi512_pd,
    _mm512_fmadd_pd, _mm512_getexp_pd, _mm512_loadu_pd, _mm512_loadu_si512, _mm512_mul_pd, _mm512_or_si512,
    _mm512_permutex2var_pd, _mm512_rol_epi64, _mm512_set1_epi64, _mm512_set1_pd, _mm512_slli_epi64,
    _mm512_sqrt_pd, _mm512_srli_epi64, _mm512_storeu_pd, _mm512_storeu_si512, _mm512_sub_pd,
    _mm512_xor_si512,
};

use super::{
    ANGLE, ANGLE_BITS, ANGLE_MIDDLE, COS, FRACTION, GROUP, LANES, LOG, LOGARITHMS, Lanes, MINUS_TWO_LOG_TWO,
    ONE, RADIUS, RADIUS_BITS, RADIUS_SHIFT, RECIPROCALS, SIGN, SIN,
};

/// `super::normals_body`.
#[target_feature(enable = "avx512f")]
pub fn normals(state: &mut [Lanes; 4], out: &mut [f64]) {
    let mut local = [load(&state[0]), load(&state[1]), load(&state[2]), load(&state[3])];
    let (groups, rest) = out.as_chunks_mut::<GROUP>();
    for group in groups {
        fill(&mut local, group);
    }
    if !rest.is_empty() {
        let mut last = [0.0; GROUP];
        fill(&mut local, &mut last);
        rest.copy_from_slice(&last[..rest.len()]);
    }
    for (row, word) in state.iter_mut().zip(local) {
        // SAFETY: eight words are writable; the store is unaligned.
        unsafe { _mm512_storeu_si512(row.as_mut_ptr().cast(), word) };
    }
}

#[target_feature(enable = "avx512f")]
fn load(row: &Lanes) -> __m512i {
    // SAFETY: eight words are readable; the load is unaligned.
    unsafe { _mm512_loadu_si512(row.as_ptr().cast()) }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn fill(state: &mut [__m512i; 4], group: &mut [f64; GROUP]) {
    let [cosine, sine] = pair(next(state));
    let (cosines, sines) = group.split_at_mut(LANES);
    // SAFETY: eight numbers are writable at each place; the stores are unaligned.
    unsafe {
        _mm512_storeu_pd(cosines.as_mut_ptr(), cosine);
        _mm512_storeu_pd(sines.as_mut_ptr(), sine);
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn next(state: &mut [__m512i; 4]) -> __m512i {
    let [mut s0, mut s1, mut s2, mut s3] = *state;
    let out = _mm512_add_epi64(s0, s3);
    let t = _mm512_slli_epi64::<17>(s1);
    s2 = _mm512_xor_si512(s2, s0);
    s3 = _mm512_xor_si512(s3, s1);
    s1 = _mm512_xor_si512(s1, s2);
    s0 = _mm512_xor_si512(s0, s3);
    s2 = _mm512_xor_si512(s2, t);
    s3 = _mm512_rol_epi64::<45>(s3);
    *state = [s0, s1, s2, s3];
    out
}

#[inline]
#[target_feature(enable = "avx512f")]
fn integer(word: u64) -> __m512i {
    _mm512_set1_epi64(word.cast_signed())
}

/// The bits of `mask` from `word`, the others from `base`, as a number.
#[inline]
#[target_feature(enable = "avx512f")]
fn number(word: __m512i, mask: u64, base: u64) -> __m512d {
    _mm512_castsi512_pd(_mm512_or_si512(_mm512_and_si512(word, integer(mask)), integer(base)))
}

#[inline]
#[target_feature(enable = "avx512f")]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: __m512d) -> __m512d {
    let mut sum = _mm512_set1_pd(coefficients[N - 1]);
    for i in (0..N - 1).rev() {
        sum = _mm512_fmadd_pd(sum, x, _mm512_set1_pd(coefficients[i]));
    }
    sum
}

/// The entries of a table at the last four bits of each index.
#[inline]
#[target_feature(enable = "avx512f")]
fn look_up(table: &[f64; 16], index: __m512i) -> __m512d {
    let (low, high) = table.split_at(LANES);
    // SAFETY: eight numbers are readable at each place; the loads are unaligned.
    let (low, high) = unsafe { (_mm512_loadu_pd(low.as_ptr()), _mm512_loadu_pd(high.as_ptr())) };
    _mm512_permutex2var_pd(low, index, high)
}

#[inline]
#[target_feature(enable = "avx512f")]
fn minus_two_log(u: __m512d) -> __m512d {
    let bits = _mm512_castpd_si512(u);
    // The exponent of a normal number, and its fraction from 1 to 2.
    let e = _mm512_getexp_pd(u);
    let m = number(bits, FRACTION, ONE);
    let i = _mm512_srli_epi64::<48>(bits);
    let r = _mm512_fmadd_pd(m, look_up(&RECIPROCALS, i), _mm512_set1_pd(-1.0));
    let whole = _mm512_fmadd_pd(e, _mm512_set1_pd(MINUS_TWO_LOG_TWO), look_up(&LOGARITHMS, i));
    let whole = _mm512_fmadd_pd(r, _mm512_set1_pd(-2.0), whole);
    _mm512_fmadd_pd(_mm512_mul_pd(r, r), polynomial(&LOG, r), whole)
}

#[inline]
#[target_feature(enable = "avx512f")]
fn pair(word: __m512i) -> [__m512d; 2] {
    let radius = number(_mm512_srli_epi64::<RADIUS_SHIFT>(word), RADIUS_BITS, RADIUS);
    let r = _mm512_sqrt_pd(minus_two_log(_mm512_sub_pd(radius, _mm512_set1_pd(4096.0))));
    let sign = _mm512_and_si512(word, integer(SIGN));
    let signed = _mm512_castsi512_pd(_mm512_or_si512(_mm512_castpd_si512(r), sign));
    let v = _mm512_sub_pd(number(word, ANGLE_BITS, ANGLE), _mm512_set1_pd(ANGLE_MIDDLE));
    let square = _mm512_mul_pd(v, v);
    let cosine = _mm512_mul_pd(signed, polynomial(&COS, square));
    let sine = _mm512_mul_pd(signed, _mm512_mul_pd(v, polynomial(&SIN, square)));
    [cosine, sine]
}
