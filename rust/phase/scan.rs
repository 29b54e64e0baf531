//! Running sums, several samples at a time.

// Instructions of a wider unit may only be inlined into a function that has them enabled.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

/// Replaces `values` by the exclusive running sum of `values − slope`, starting at `carry`; returns the final sum.
/// The chain of dependent additions has one addition per four samples.
#[inline(always)]
pub(super) fn plain(values: &mut [f64], slope: f64, mut carry: f64) -> f64 {
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
    carry
}

/// Like [`plain`], eight samples at a time.
///
/// # Safety
/// The processor has AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn avx2(values: &mut [f64], slope: f64, carry: f64) -> f64 {
    use std::arch::x86_64::{
        __m256d, _mm256_add_pd, _mm256_cvtsd_f64, _mm256_loadu_pd, _mm256_permute_pd, _mm256_permute2f128_pd,
        _mm256_set1_pd, _mm256_setzero_pd, _mm256_storeu_pd, _mm256_sub_pd, _mm256_unpacklo_pd,
    };
    /// For v = [a, b, c, d]: [0, a, a+b, a+b+c] as a sum of two vectors, of which the second takes longer to compute;
    /// and the total in every lane.
    #[target_feature(enable = "avx2,fma")]
    fn parts(v: __m256d) -> (__m256d, __m256d, __m256d) {
        let pairs = _mm256_add_pd(v, _mm256_permute_pd::<0b0101>(v));
        let others = _mm256_permute2f128_pd::<0x01>(pairs, pairs);
        let late = _mm256_unpacklo_pd(_mm256_setzero_pd(), v);
        (late, _mm256_permute2f128_pd::<0x08>(pairs, pairs), _mm256_add_pd(pairs, others))
    }
    let slopes = _mm256_set1_pd(slope);
    let mut carry = _mm256_set1_pd(carry);
    let mut eights = values.chunks_exact_mut(8);
    for eight in &mut eights {
        let (low, high) = eight.split_at_mut(4);
        // SAFETY: each half is four doubles; the accesses are unaligned.
        let (a, b) = unsafe { (_mm256_loadu_pd(low.as_ptr()), _mm256_loadu_pd(high.as_ptr())) };
        let (a, upper_a, total_a) = parts(_mm256_sub_pd(a, slopes));
        let (b, upper_b, total_b) = parts(_mm256_sub_pd(b, slopes));
        let between = _mm256_add_pd(carry, total_a);
        // SAFETY: as above.
        unsafe {
            _mm256_storeu_pd(low.as_mut_ptr(), _mm256_add_pd(_mm256_add_pd(carry, upper_a), a));
            _mm256_storeu_pd(high.as_mut_ptr(), _mm256_add_pd(_mm256_add_pd(between, upper_b), b));
        }
        carry = _mm256_add_pd(carry, _mm256_add_pd(total_a, total_b));
    }
    let mut carry = _mm256_cvtsd_f64(carry);
    for value in eights.into_remainder() {
        let next = carry + (*value - slope);
        *value = carry;
        carry = next;
    }
    carry
}

/// Exclusive running sum of `values`.
///
/// # Safety
/// The processor has AVX-512F.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
pub(super) unsafe fn avx512(values: &[f64], out: &mut [f64]) {
    use std::arch::x86_64::{
        _mm512_add_pd, _mm512_castpd_si512, _mm512_castsi512_pd, _mm512_cvtsd_f64, _mm512_loadu_pd,
        _mm512_maskz_alignr_epi64, _mm512_permutexvar_pd, _mm512_set1_epi64, _mm512_setzero_pd,
        _mm512_storeu_pd,
    };
    /// The lanes shifted up by a number of places, with zeros below.
    macro_rules! up {
        ($v:expr, $by:literal) => {{
            let v = _mm512_castpd_si512($v);
            _mm512_castsi512_pd(_mm512_maskz_alignr_epi64::<{ 8 - $by }>(u8::MAX << $by, v, v))
        }};
    }
    let mut carry = _mm512_setzero_pd();
    let (eights, rest) = values.as_chunks::<8>();
    let (eights_out, rest_out) = out[..values.len()].as_chunks_mut::<8>();
    for (eight, out) in eights.iter().zip(eights_out) {
        // SAFETY: eight doubles each; the accesses are unaligned.
        let v = unsafe { _mm512_loadu_pd(eight.as_ptr()) };
        let two = _mm512_add_pd(v, up!(v, 1));
        let four = _mm512_add_pd(two, up!(two, 2));
        let all = _mm512_add_pd(four, up!(four, 4));
        // SAFETY: as above.
        unsafe { _mm512_storeu_pd(out.as_mut_ptr(), _mm512_add_pd(carry, up!(all, 1))) };
        carry = _mm512_add_pd(carry, _mm512_permutexvar_pd(_mm512_set1_epi64(7), all));
    }
    let mut carry = _mm512_cvtsd_f64(carry);
    for (value, out) in rest.iter().zip(rest_out) {
        *out = carry;
        carry += value;
    }
}

/// Sum of the values, in sixteen independent partial sums.
#[inline(always)]
pub(crate) fn sum(values: &[f64]) -> f64 {
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

#[cfg(test)]
mod tests {
    #[test]
    fn wide_equals_plain_on_every_length() {
        for n in 0..300_usize {
            let values: Vec<f64> = (0..n).map(|i| ((i * i * 7919) % 1000) as f64 / 64.0).collect();
            let mut expected = values.clone();
            let end = super::plain(&mut expected, 0.25, 3.0); // exact: multiples of 1/64
            let mut carry = 3.0;
            for (value, found) in values.iter().zip(&expected) {
                assert_eq!(carry, *found);
                carry += value - 0.25;
            }
            assert_eq!(carry, end);
            #[cfg(target_arch = "x86_64")]
            if crate::machine::processor::Width::best().is_wide() {
                let mut wide = values.clone();
                // SAFETY: a wide `Width` is only made on a processor with AVX2.
                let found = unsafe { super::avx2(&mut wide, 0.25, 3.0) };
                assert_eq!(found, end);
                assert_eq!(wide, expected);
            }
            #[cfg(target_arch = "x86_64")]
            if crate::machine::processor::Width::best().name() == "avx512" {
                let mut plain = values.clone();
                super::plain(&mut plain, 0.0, 0.0);
                let mut wide = vec![0.0; n];
                // SAFETY: the processor has AVX-512.
                unsafe { super::avx512(&values, &mut wide) };
                assert_eq!(wide, plain);
            }
        }
    }

    #[test]
    fn every_width_sums_to_the_same_bits() {
        for n in [0, 1, 15, 16, 17, 100] {
            let values: Vec<f64> = (0..n).map(|i| f64::from(i).sin()).collect();
            for width in crate::machine::processor::Width::available() {
                assert_eq!(crate::phase::wide_sum(width, &values), super::sum(&values));
            }
        }
    }
}
