//! The normals of `super`, operation for operation, four lanes to a register (AVX2 and FMA).

use std::arch::x86_64::{
    __m256d, __m256i, _mm256_add_epi64, _mm256_and_si256, _mm256_castpd_si256, _mm256_castsi256_pd,
    _mm256_fmadd_pd, _mm256_i64gather_pd, _mm256_loadu_si256, _mm256_mul_pd, _mm256_or_pd, _mm256_or_si256,
    _mm256_set1_epi64x, _mm256_set1_pd, _mm256_slli_epi64, _mm256_sqrt_pd, _mm256_srli_epi64,
    _mm256_storeu_pd, _mm256_storeu_si256, _mm256_sub_pd, _mm256_xor_si256,
};

use super::{
    ANGLE, ANGLE_BITS, ANGLE_MIDDLE, COS, EXPONENT, FRACTION, GROUP, LANES, LOG, LOGARITHMS, Lanes, MAGIC,
    MINUS_TWO_LOG_TWO, ONE, RADIUS, RADIUS_BITS, RADIUS_SHIFT, RECIPROCALS, SIGN, SIN,
};

/// Lanes of one register.
const WIDTH: usize = 4;
/// Registers of one word of the state.
const HALVES: usize = LANES / WIDTH;

/// The four words of four of the generators.
type Quarter = [__m256i; 4];

/// `super::normals_body`.
#[target_feature(enable = "avx2,fma")]
pub fn normals(state: &mut [Lanes; 4], out: &mut [f64]) {
    let mut local: [Quarter; HALVES] = [load(state, 0), load(state, 1)];
    let (groups, rest) = out.as_chunks_mut::<GROUP>();
    for group in groups {
        fill(&mut local, group);
    }
    if !rest.is_empty() {
        let mut last = [0.0; GROUP];
        fill(&mut local, &mut last);
        rest.copy_from_slice(&last[..rest.len()]);
    }
    for (half, words) in local.into_iter().enumerate() {
        store(words, state, half);
    }
}

#[target_feature(enable = "avx2,fma")]
fn load(state: &[Lanes; 4], half: usize) -> Quarter {
    let word = |row: &Lanes| {
        let lanes = &row[half * WIDTH..][..WIDTH];
        // SAFETY: four words are readable; the load is unaligned.
        unsafe { _mm256_loadu_si256(lanes.as_ptr().cast()) }
    };
    [word(&state[0]), word(&state[1]), word(&state[2]), word(&state[3])]
}

#[target_feature(enable = "avx2,fma")]
fn store(words: Quarter, state: &mut [Lanes; 4], half: usize) {
    for (row, word) in state.iter_mut().zip(words) {
        let lanes = &mut row[half * WIDTH..][..WIDTH];
        // SAFETY: four words are writable; the store is unaligned.
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), word) };
    }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn fill(state: &mut [Quarter; HALVES], group: &mut [f64; GROUP]) {
    let (cosines, sines) = group.split_at_mut(LANES);
    for half in 0..HALVES {
        let [cosine, sine] = pair(next(&mut state[half]));
        let (to_cosine, to_sine) =
            (&mut cosines[half * WIDTH..][..WIDTH], &mut sines[half * WIDTH..][..WIDTH]);
        // SAFETY: four numbers are writable at each place; the stores are unaligned.
        unsafe {
            _mm256_storeu_pd(to_cosine.as_mut_ptr(), cosine);
            _mm256_storeu_pd(to_sine.as_mut_ptr(), sine);
        }
    }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn next(state: &mut Quarter) -> __m256i {
    let [mut s0, mut s1, mut s2, mut s3] = *state;
    let out = _mm256_add_epi64(s0, s3);
    let t = _mm256_slli_epi64::<17>(s1);
    s2 = _mm256_xor_si256(s2, s0);
    s3 = _mm256_xor_si256(s3, s1);
    s1 = _mm256_xor_si256(s1, s2);
    s0 = _mm256_xor_si256(s0, s3);
    s2 = _mm256_xor_si256(s2, t);
    s3 = _mm256_or_si256(_mm256_slli_epi64::<45>(s3), _mm256_srli_epi64::<19>(s3));
    *state = [s0, s1, s2, s3];
    out
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn integer(word: u64) -> __m256i {
    _mm256_set1_epi64x(word.cast_signed())
}

/// The bits of `mask` from `word`, the others from `base`, as a number.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn number(word: __m256i, mask: u64, base: u64) -> __m256d {
    _mm256_castsi256_pd(_mm256_or_si256(_mm256_and_si256(word, integer(mask)), integer(base)))
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: __m256d) -> __m256d {
    let mut sum = _mm256_set1_pd(coefficients[N - 1]);
    for i in (0..N - 1).rev() {
        sum = _mm256_fmadd_pd(sum, x, _mm256_set1_pd(coefficients[i]));
    }
    sum
}

/// The entries of a table at indices from 0 to 15.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn look_up(table: &[f64; 16], index: __m256i) -> __m256d {
    // SAFETY: every index was masked to be one of the table.
    unsafe { _mm256_i64gather_pd::<8>(table.as_ptr(), index) }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn minus_two_log(u: __m256d) -> __m256d {
    let bits = _mm256_castpd_si256(u);
    let e = _mm256_sub_pd(
        _mm256_castsi256_pd(_mm256_or_si256(integer(MAGIC), _mm256_srli_epi64::<52>(bits))),
        _mm256_set1_pd(EXPONENT),
    );
    let m = number(bits, FRACTION, ONE);
    let i = _mm256_and_si256(_mm256_srli_epi64::<48>(bits), integer(15));
    let r = _mm256_fmadd_pd(m, look_up(&RECIPROCALS, i), _mm256_set1_pd(-1.0));
    let whole = _mm256_fmadd_pd(e, _mm256_set1_pd(MINUS_TWO_LOG_TWO), look_up(&LOGARITHMS, i));
    let whole = _mm256_fmadd_pd(r, _mm256_set1_pd(-2.0), whole);
    _mm256_fmadd_pd(_mm256_mul_pd(r, r), polynomial(&LOG, r), whole)
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn pair(word: __m256i) -> [__m256d; 2] {
    let radius = number(_mm256_srli_epi64::<{ RADIUS_SHIFT as i32 }>(word), RADIUS_BITS, RADIUS);
    let r = _mm256_sqrt_pd(minus_two_log(_mm256_sub_pd(radius, _mm256_set1_pd(4096.0))));
    let sign = _mm256_and_si256(word, integer(SIGN));
    let signed = _mm256_or_pd(r, _mm256_castsi256_pd(sign));
    let v = _mm256_sub_pd(number(word, ANGLE_BITS, ANGLE), _mm256_set1_pd(ANGLE_MIDDLE));
    let square = _mm256_mul_pd(v, v);
    let cosine = _mm256_mul_pd(signed, polynomial(&COS, square));
    let sine = _mm256_mul_pd(signed, _mm256_mul_pd(v, polynomial(&SIN, square)));
    [cosine, sine]
}
