//! The recursions of `sections` and `section`, operation for operation, four sections or samples to a register (AVX2
//! and FMA).

use std::arch::x86_64::{
    __m256d, _mm256_add_pd, _mm256_cvtsd_f64, _mm256_fmadd_pd, _mm256_hadd_pd, _mm256_loadu_pd,
    _mm256_mul_pd, _mm256_permute2f128_pd, _mm256_permute4x64_pd, _mm256_set1_pd, _mm256_setzero_pd,
    _mm256_shuffle_pd, _mm256_storeu_pd,
};

use super::section::{Lag, STEP};
use super::sections::{LANES, Sections};

/// The same choice of a loop by the number of groups, compiled for other registers.
macro_rules! advance_with {
    ($(#[$doc:meta])* $name:ident, $features:literal) => {
        $(#[$doc])*
        #[target_feature(enable = $features)]
        pub fn $name(sections: &mut Sections, samples: &mut [f64]) {
            match sections.state.len() {
                1 => sections.windows(samples, |sections, window| ladder::<1>(sections, window)),
                2 => sections.windows(samples, |sections, window| ladder::<2>(sections, window)),
                _ => sections.windows(samples, |sections, window| ladder::<3>(sections, window)),
            }
        }
    };
}

advance_with!(
    /// Advances sections over whole windows.
    advance,
    "avx2,fma"
);

advance_with!(
    /// `advance` with the thirty-two registers of AVX-512, in which all constants of the sections stay.
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
fn ladder<const G: usize>(sections: &mut Sections, samples: &mut [f64]) {
    let mut state = [_mm256_setzero_pd(); G];
    let (mut phi, mut square, mut weight, mut earlier) = (state, state, state, state);
    for g in 0..G {
        state[g] = load(&sections.state[g]);
        let group = &sections.groups[g];
        (phi[g], square[g]) = (load(&group.phi), load(&group.square));
        (weight[g], earlier[g]) = (load(&group.weight), load(&group.earlier));
    }
    let [first, second] = sections.direct;
    let direct = load(&[first, second, first, second]);
    let (fours, rest) = samples.as_chunks_mut::<LANES>();
    debug_assert!(rest.is_empty(), "windows are whole steps");
    for four in fours {
        let mut sums = [_mm256_setzero_pd(); LANES];
        for pair in 0..2 {
            let e = [_mm256_set1_pd(four[2 * pair]), _mm256_set1_pd(four[2 * pair + 1])];
            for g in 0..G {
                sums[2 * pair] = _mm256_fmadd_pd(earlier[g], state[g], sums[2 * pair]);
                state[g] = _mm256_fmadd_pd(square[g], state[g], _mm256_fmadd_pd(phi[g], e[0], e[1]));
                sums[2 * pair + 1] = _mm256_fmadd_pd(weight[g], state[g], sums[2 * pair + 1]);
            }
        }
        // Sums of the lanes of four samples: (a + b) + (c + d) of each.
        let first = _mm256_hadd_pd(sums[0], sums[1]);
        let second = _mm256_hadd_pd(sums[2], sums[3]);
        let low = _mm256_permute2f128_pd::<0x20>(first, second);
        let high = _mm256_permute2f128_pd::<0x31>(first, second);
        store(_mm256_fmadd_pd(direct, load(four), _mm256_add_pd(low, high)), four);
    }
    for (register, lanes) in state.into_iter().zip(&mut sections.state) {
        store(register, lanes);
    }
}

/// `section::Lag::advance`: eight samples as two registers.
#[target_feature(enable = "avx2,fma")]
pub fn lag(lag: &mut Lag, samples: &mut [f64]) {
    let [_, phi, square, _, fourth, ..] = lag.powers.map(|power| _mm256_set1_pd(power));
    let powers = load_two(&lag.powers);
    let (drive, eighth) = (_mm256_set1_pd(lag.drive), _mm256_set1_pd(lag.eighth));
    let mut state = _mm256_set1_pd(lag.state);
    let (steps, rest) = samples.as_chunks_mut::<STEP>();
    debug_assert!(rest.is_empty(), "windows are whole steps");
    for step in steps {
        let mut driven = load_two(step).map(|normals| _mm256_mul_pd(drive, normals));
        let before = delayed(driven);
        driven = [_mm256_fmadd_pd(phi, before[0], driven[0]), _mm256_fmadd_pd(phi, before[1], driven[1])];
        let before = delayed_twice(driven);
        driven =
            [_mm256_fmadd_pd(square, before[0], driven[0]), _mm256_fmadd_pd(square, before[1], driven[1])];
        driven[1] = _mm256_fmadd_pd(fourth, driven[0], driven[1]);
        let before = delayed(driven);
        let (fours, _) = step.as_chunks_mut::<LANES>();
        for ((four, power), before) in fours.iter_mut().zip(powers).zip(before) {
            store(_mm256_fmadd_pd(power, state, before), four);
        }
        state = _mm256_fmadd_pd(eighth, state, _mm256_permute4x64_pd::<0xff>(driven[1]));
    }
    lag.state = _mm256_cvtsd_f64(state);
}

#[inline]
#[target_feature(enable = "avx2,fma")]
fn load_two(step: &[f64; STEP]) -> [__m256d; 2] {
    let (fours, _) = step.as_chunks::<LANES>();
    [load(&fours[0]), load(&fours[1])]
}

/// Eight samples two places later, zeros before.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn delayed_twice([low, high]: [__m256d; 2]) -> [__m256d; 2] {
    [_mm256_permute2f128_pd::<0x08>(low, low), _mm256_permute2f128_pd::<0x21>(low, high)]
}

/// One place later, a zero before.
#[inline]
#[target_feature(enable = "avx2,fma")]
fn delayed(samples: [__m256d; 2]) -> [__m256d; 2] {
    let [low, high] = delayed_twice(samples);
    [_mm256_shuffle_pd::<0b0101>(low, samples[0]), _mm256_shuffle_pd::<0b0101>(high, samples[1])]
}
