//! Standard normal deviates from eight interleaved generators.
//!
//! Each 64-bit word gives a pair of normals by the method of Box & Muller 1958. 39 bits give the radius (which ends
//! at 7.4σ; one normal in 1e13 lies beyond), 23 bits give the angle in half a circle, and one bit gives the sign.
//! Logarithm and trigonometric functions are polynomials, which are free of branches and run eight lanes at a time.
//! Their relative error is below 6e-9, far too small to affect any sample statistic. Every machine runs the same
//! operations in the same order, fused multiply-adds included, so that the bits do not depend on the vector unit.

// Instructions of a wider unit may only be inlined into a function that has them enabled.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

use super::registers::{self, Registers};
use crate::machine::processor::{Unit, Width};

/// Number of interleaved generators of a stream.
pub(super) const LANES: usize = 8;
/// Number of normals generated at a time: a cosine and a sine from each lane.
const GROUP: usize = 2 * LANES;
/// Number of registers that hold the lanes if a register holds half of them.
const PARTS: usize = 2;

/// One word of each generator.
pub(super) type Lanes = [u64; LANES];

/// Bits of the double 1.0.
pub(super) const ONE: u64 = 0x3ff0_0000_0000_0000;
/// Mask of the fraction of a double.
const FRACTION: u64 = (1 << 52) - 1;
/// Bits of 4096 + 2^-40. The unit in the last place of 4096 is 2^-40, so that this adds half of the radius step
/// 2^-39.
const RADIUS: u64 = 0x40b0_0000_0000_0001;
/// Mask of the 39 bits of a radius after a right shift by `RADIUS_SHIFT`. The lowest bit is reserved for the half
/// step.
const RADIUS_BITS: u64 = ((1 << 39) - 1) << 1;
const RADIUS_SHIFT: u32 = 23;
/// Bits of 2^28 + 2^-24. The unit in the last place of 2^28 is 2^-24, so that this adds half of the angle step 2^-23.
const ANGLE: u64 = 0x41b0_0000_0000_0001;
/// Mask of the 23 bits of an angle. The lowest bit of a word, which has the poorest quality, is not used.
const ANGLE_BITS: u64 = ((1 << 23) - 1) << 1;
/// 2^28 plus half of the range of angles.
const ANGLE_MIDDLE: f64 = 268435456.5;
const SIGN: u64 = 1 << 63;

/// Approximations of 1/m for m in [1 + i/16, 1 + (i+1)/16). The last is exact, so that nothing cancels just below u =
/// 1.
const RECIPROCALS: [f64; 16] = [
    0.9696969696969697,
    0.9142857142857143,
    0.8648648648648649,
    0.8205128205128205,
    0.7804878048780488,
    0.7441860465116279,
    0.7111111111111111,
    0.6808510638297872,
    0.6530612244897959,
    0.6274509803921569,
    0.6037735849056604,
    0.5818181818181818,
    0.5614035087719298,
    0.5423728813559322,
    0.5245901639344263,
    0.5,
];
/// 2 ln of the entries of `RECIPROCALS`.
const LOGARITHMS: [f64; 16] = [
    -0.06154331733350732,
    -0.17922431737937433,
    -0.29036401968899567,
    -0.39565148665983985,
    -0.4956723278091624,
    -0.5909284257876718,
    -0.6818531739411864,
    -0.7688233978206641,
    -0.8521687906218003,
    -0.9321794598491985,
    -1.0091120215047906,
    -1.0831945648654888,
    -1.1546307300696472,
    -1.2236030822119859,
    -1.2902759227471694,
    -1.3862943611198906,
];
/// −2 ln 2.
const MINUS_TWO_LOG_TWO: f64 = -1.3862943611198906;
/// (−2 ln(1 + r) + 2r)/r² as a polynomial of r on |r| ≤ 1/32; relative error of the logarithm 4e-10.
const LOG: [f64; 4] = [0.9999999009255385, -0.6666665428787764, 0.5004067685231576, -0.40039575349356227];
/// sin(πv)/v as a polynomial of v² on |v| ≤ ½; relative error 5.4e-9.
const SIN: [f64; 5] =
    [3.1415926368926113, -5.167709684637824, 2.5500697238167405, -0.5982421118865865, 0.07756035914918306];
/// cos(πv) as a polynomial of v² on |v| ≤ ½; error 2.2e-10.
const COS: [f64; 6] = [
    0.9999999997806803,
    -4.934802137230286,
    4.058709164375249,
    -1.3352120568655836,
    0.23493755934880667,
    -0.024396716605332346,
];

/// Fills `out` with normals. A shorter slice receives the beginning of what a longer one receives.
pub(super) fn fill(width: Width, state: &mut [Lanes; 4], out: &mut [f64]) {
    // SAFETY: a `Width` is only made of units that the processor has.
    unsafe {
        match width.unit() {
            Unit::Portable => fill_by::<registers::Portable>(state, out),
            #[cfg(target_arch = "x86_64")]
            Unit::Avx2 => fill_avx2(state, out),
            #[cfg(target_arch = "x86_64")]
            Unit::Avx512 => fill_avx512(state, out),
        }
    }
}

/// Like [`fill`], compiled for AVX2 and FMA.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn fill_avx2(state: &mut [Lanes; 4], out: &mut [f64]) {
    // SAFETY: the contract of this function.
    unsafe { fill_by::<registers::Avx2>(state, out) };
}

/// Like [`fill`], compiled for AVX-512.
///
/// # Safety
/// The processor has AVX-512F.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
unsafe fn fill_avx512(state: &mut [Lanes; 4], out: &mut [f64]) {
    // SAFETY: the contract of this function.
    unsafe { fill_by::<registers::Avx512>(state, out) };
}

/// Fills `out` with normals, on the registers `R`.
///
/// # Safety
/// The processor has the instructions of `R`, here and below.
#[inline(always)]
unsafe fn fill_by<R: Registers>(state: &mut [Lanes; 4], out: &mut [f64]) {
    // SAFETY: this function's contract.
    unsafe {
        let part = |at: usize| state.map(|row| R::load(&row[(at * R::WIDTH) % LANES..][..R::WIDTH]));
        let mut local: [[R::Words; 4]; PARTS] = [part(0), part(1)];
        let (groups, rest) = out.as_chunks_mut::<GROUP>();
        for group in groups {
            one_group::<R>(&mut local, group);
        }
        if !rest.is_empty() {
            let mut last = [0.0; GROUP];
            one_group::<R>(&mut local, &mut last);
            rest.copy_from_slice(&last[..rest.len()]);
        }
        for (at, words) in (0..LANES).step_by(R::WIDTH).zip(local) {
            for (row, word) in state.iter_mut().zip(words) {
                R::store_words(word, &mut row[at..][..R::WIDTH]);
            }
        }
    }
}

/// Writes the next group of normals.
#[inline(always)]
unsafe fn one_group<R: Registers>(state: &mut [[R::Words; 4]; PARTS], group: &mut [f64; GROUP]) {
    let (cosines, sines) = group.split_at_mut(LANES);
    for (at, words) in (0..LANES).step_by(R::WIDTH).zip(state) {
        // SAFETY: this function's contract.
        unsafe {
            let [cosine, sine] = pair::<R>(next::<R>(words));
            R::store(cosine, &mut cosines[at..][..R::WIDTH]);
            R::store(sine, &mut sines[at..][..R::WIDTH]);
        }
    }
}

/// One step of xoshiro256+ in every lane.
#[inline(always)]
unsafe fn next<R: Registers>(state: &mut [R::Words; 4]) -> R::Words {
    let [mut s0, mut s1, mut s2, mut s3] = *state;
    // SAFETY: this function's contract.
    unsafe {
        let out = R::plus(s0, s3);
        let t = R::left(s1, 17);
        s2 = R::xor(s2, s0);
        s3 = R::xor(s3, s1);
        s1 = R::xor(s1, s2);
        s0 = R::xor(s0, s3);
        s2 = R::xor(s2, t);
        s3 = R::or(R::left(s3, 45), R::right(s3, 64 - 45));
        *state = [s0, s1, s2, s3];
        out
    }
}

/// The number whose bits inside `mask` come from `word`, and the others from `base`.
#[inline(always)]
unsafe fn number<R: Registers>(word: R::Words, mask: u64, base: u64) -> R::Numbers {
    // SAFETY: this function's contract.
    unsafe { R::number(R::or(R::and(word, R::word(mask)), R::word(base))) }
}

/// Value of a polynomial, by Horner's rule.
#[inline(always)]
unsafe fn polynomial<R: Registers, const N: usize>(coefficients: &[f64; N], x: R::Numbers) -> R::Numbers {
    // SAFETY: this function's contract.
    unsafe {
        let mut sum = R::splat(coefficients[N - 1]);
        for i in (0..N - 1).rev() {
            sum = R::fused(sum, x, R::splat(coefficients[i]));
        }
        sum
    }
}

/// −2 ln u for normal u in (0, 1). With u = 2^e·m, m in [1, 2), and m·c = 1 + r it is −2e ln 2 + 2 ln c − 2 ln(1 +
/// r).
#[inline(always)]
unsafe fn minus_two_log<R: Registers>(u: R::Numbers) -> R::Numbers {
    // SAFETY: this function's contract.
    unsafe {
        let bits = R::bits(u);
        let e = R::exponent(u);
        let m = number::<R>(bits, FRACTION, ONE);
        let i = R::right(bits, 48);
        let r = R::fused(m, R::look_up(&RECIPROCALS, i), R::splat(-1.0));
        let whole = R::fused(e, R::splat(MINUS_TWO_LOG_TWO), R::look_up(&LOGARITHMS, i));
        let whole = R::fused(r, R::splat(-2.0), whole);
        R::fused(R::times(r, r), polynomial::<R, 4>(&LOG, r), whole)
    }
}

/// Two normals per lane: r cos πv and r sin πv. The random sign of r makes v in (−½, ½) cover the circle.
#[inline(always)]
unsafe fn pair<R: Registers>(word: R::Words) -> [R::Numbers; 2] {
    // SAFETY: this function's contract.
    unsafe {
        let radius = number::<R>(R::right(word, RADIUS_SHIFT), RADIUS_BITS, RADIUS);
        let r = R::root(minus_two_log::<R>(R::minus(radius, R::splat(4096.0))));
        let signed = R::number(R::or(R::bits(r), R::and(word, R::word(SIGN))));
        let v = R::minus(number::<R>(word, ANGLE_BITS, ANGLE), R::splat(ANGLE_MIDDLE));
        let square = R::times(v, v);
        let cosine = R::times(signed, polynomial::<R, 6>(&COS, square));
        let sine = R::times(signed, R::times(v, polynomial::<R, 5>(&SIN, square)));
        [cosine, sine]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::registers::Portable;
    use super::*;

    fn logarithm(u: f64) -> f64 {
        // SAFETY: plain Rust is everywhere.
        unsafe { minus_two_log::<Portable>(Portable::splat(u))[0] }
    }

    fn of<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
        // SAFETY: as above.
        unsafe { polynomial::<Portable, N>(coefficients, Portable::splat(x))[0] }
    }

    #[test]
    fn logarithm_and_trigonometric_functions_are_accurate() {
        for k in 1..=40_000_u32 {
            let u = 2.0_f64.powf(-f64::from(k) * 40.0 / 40_000.0);
            let expected = -2.0 * u.ln();
            let found = logarithm(u);
            assert!((found - expected).abs() <= 4e-10 * expected, "{u}: {found} {expected}");
            let v = f64::from(k) / 80_000.0;
            let (sin, cos) = (v * of(&SIN, v * v), of(&COS, v * v));
            assert!((sin / (PI * v).sin() - 1.0).abs() < 5.4e-9, "sin {v}");
            assert!((cos - (PI * v).cos()).abs() < 2.3e-10, "cos {v}");
        }
        // At the largest radius fraction the number under the root is not negative.
        let last = 1.0 - 0.5_f64.powi(40);
        assert!((logarithm(last) / (2.0 * 0.5_f64.powi(40)) - 1.0).abs() < 1e-2);
    }
}
