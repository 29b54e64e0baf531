//! Exponentials and logarithms without branches, so that the compiler can vectorize loops over them.

// Functions are inlined so that they are compiled with the instructions of their caller.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

/// ln 2 in two parts. The first ends with zeros, so that its product with a small whole number is exact (Cody & Waite
/// 1980).
const LN2_HIGH: f64 = 6.93147180369123816490e-01;
const LN2_LOW: f64 = 1.90821492927058770002e-10;

/// a·b + c, rounded once if `FUSED`.
#[inline(always)]
pub(super) fn fused<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// e^x for x ≤ 0 with a relative error of 3e-16; not less than 1e-304.
#[inline(always)]
pub(super) fn exp<const FUSED: bool>(x: f64) -> f64 {
    // Adding this number rounds x to the nearest whole number in the last bits.
    const ROUND: f64 = 6755399441055744.0;
    // Coefficients 1/j!. For |r| ≤ ½ ln 2 the next term is 2e-16.
    const SERIES: [f64; 13] = [
        1.0 / 479001600.0,
        1.0 / 39916800.0,
        1.0 / 3628800.0,
        1.0 / 362880.0,
        1.0 / 40320.0,
        1.0 / 5040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let x = if x > -700.0 { x } else { -700.0 };
    let shifted = fused::<FUSED>(x, std::f64::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    let r = fused::<FUSED>(n, -LN2_LOW, fused::<FUSED>(n, -LN2_HIGH, x));
    let mut sum = SERIES[0];
    for c in &SERIES[1..] {
        sum = fused::<FUSED>(sum, r, *c);
    }
    sum * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

/// ln x for a positive normal number, with an error of 2e-16 relative to the larger of |ln x| and 1. The result for
/// other numbers is unspecified.
#[inline(always)]
pub(super) fn ln<const FUSED: bool>(x: f64) -> f64 {
    // Minimax of (ln(1 + s) − ln(1 − s) − 2s)/s in s² (Sun's fdlibm, e_log.c).
    const SERIES: [f64; 7] = [
        1.479819860511658591e-01,
        1.531383769920937332e-01,
        1.818357216161805012e-01,
        2.222219843214978396e-01,
        2.857142874366239149e-01,
        3.999999999940941908e-01,
        6.666666666666735130e-01,
    ];
    // Bits of √½. The exponent is chosen so that the remaining factor lies between √½ and √2.
    const ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
    const ONE: u64 = 0x3ff0_0000_0000_0000;
    // 2⁵², which turns a whole number in the low bits into a double.
    const WHOLE: f64 = 4503599627370496.0;
    let bits = x.to_bits().wrapping_add(ONE - ROOT);
    let exponent = f64::from_bits((bits >> 52) | WHOLE.to_bits()) - (WHOLE + 1023.0);
    let f = f64::from_bits((bits & 0x000f_ffff_ffff_ffff).wrapping_add(ROOT)) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let mut rest = SERIES[0];
    for c in &SERIES[1..] {
        rest = fused::<FUSED>(rest, z, *c);
    }
    let half = 0.5 * f * f;
    let small = fused::<FUSED>(s, half + rest * z, exponent * LN2_LOW);
    fused::<FUSED>(exponent, LN2_HIGH, f - (half - small))
}
