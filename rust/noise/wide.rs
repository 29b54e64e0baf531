//! The ladder of `power_law`, operation for operation, four sections to a register (AVX2 and FMA).

use std::arch::x86_64::{
    __m256d, _mm256_add_pd, _mm256_fmadd_pd, _mm256_hadd_pd, _mm256_loadu_pd, _mm256_permute2f128_pd,
    _mm256_set1_pd, _mm256_setzero_pd, _mm256_storeu_pd,
};

use super::power_law::{Bank, LANES};

/// The same choice of a ladder by its length, compiled for other registers.
macro_rules! advance_with {
    ($(#[$doc:meta])* $name:ident, $features:literal) => {
        $(#[$doc])*
        #[target_feature(enable = $features)]
        pub fn $name(bank: &mut Bank, samples: &mut [f64]) -> bool {
            match bank.state.len() {
                1 => ladder::<1>(bank, samples),
                2 => ladder::<2>(bank, samples),
                3 => ladder::<3>(bank, samples),
                4 => ladder::<4>(bank, samples),
                5 => ladder::<5>(bank, samples),
                6 => ladder::<6>(bank, samples),
                7 => ladder::<7>(bank, samples),
                8 => ladder::<8>(bank, samples),
                9 => ladder::<9>(bank, samples),
                _ => return false,
            }
            true
        }
    };
}

advance_with!(
    /// Advances a ladder over samples whose number is a multiple of four; false if it is longer than any that
    /// is foreseen, and nothing was done.
    advance,
    "avx2,fma"
);

advance_with!(
    /// `advance` with the thirty-two registers of AVX-512, in which all constants of a ladder stay.
    advance_512,
    "avx2,fma,avx512f,avx512vl"
);

#[inline]
#[target_feature(enable = "avx2,fma")]
fn load(lanes: &[f64; LANES]) -> __m256d {
    // SAFETY: four doubles are readable; the load is unaligned.
    unsafe { _mm256_loadu_pd(lanes.as_ptr()) }
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn store(register: __m256d, lanes: &mut [f64; LANES]) {
    // SAFETY: four doubles are writable; the store is unaligned.
    unsafe { _mm256_storeu_pd(lanes.as_mut_ptr(), register) };
}

/// total += samples.
#[target_feature(enable = "avx2")]
pub fn add(total: &mut [f64], samples: &[f64]) {
    super::simple::add_body(total, samples);
}

/// samples *= factor.
#[target_feature(enable = "avx2")]
pub fn scale(samples: &mut [f64], factor: f64) {
    super::simple::scale_body(samples, factor);
}

/// The number of registers is a constant, so that they stay registers.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn ladder<const G: usize>(bank: &mut Bank, samples: &mut [f64]) {
    let mut state = [_mm256_setzero_pd(); G];
    let (mut phi, mut weight) = (state, state);
    for g in 0..G {
        state[g] = load(&bank.state[g]);
        phi[g] = load(&bank.phi[g]);
        weight[g] = load(&bank.weight[g]);
    }
    let direct = _mm256_set1_pd(bank.direct);
    let (fours, rest) = samples.as_chunks_mut::<LANES>();
    debug_assert!(rest.is_empty(), "blocks are whole steps");
    for four in fours {
        let mut sums = [_mm256_setzero_pd(); LANES];
        for (sum, normal) in sums.iter_mut().zip(*four) {
            let e = _mm256_set1_pd(normal);
            for g in 0..G {
                state[g] = _mm256_fmadd_pd(phi[g], state[g], e);
                *sum = _mm256_fmadd_pd(weight[g], state[g], *sum);
            }
        }
        // Sums of the lanes of four samples: (a + b) + (c + d) of each.
        let first = _mm256_hadd_pd(sums[0], sums[1]);
        let second = _mm256_hadd_pd(sums[2], sums[3]);
        let low = _mm256_permute2f128_pd::<0x20>(first, second);
        let high = _mm256_permute2f128_pd::<0x31>(first, second);
        store(_mm256_fmadd_pd(direct, load(four), _mm256_add_pd(low, high)), four);
    }
    for (register, lanes) in state.into_iter().zip(&mut bank.state) {
        store(register, lanes);
    }
}
