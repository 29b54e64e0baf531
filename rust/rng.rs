//! Independent random streams and the normal deviates drawn from them.
//!
//! A stream is named by (seed, replicate, effect, axis) and a block number. Threefry-4×64-20 (Salmon et al.
//! 2011, SC'11) maps the name to the states of eight interleaved xoshiro256+ generators (Blackman & Vigna
//! 2021, ACM TOMS 47, 36): for one name it is a bijection of (block, lane), so that no two blocks share a
//! state, and any block can be drawn at any time by any thread.
//!
//! Normals come in pairs by Box & Muller 1958, one word to a pair: 39 bits are the radius (which ends at 7.4σ,
//! beyond which lies one normal in 1e13), 23 bits the angle in half a circle, one the sign. Logarithm and
//! circular functions are polynomials (relative error below 6e-9, far under what any sample could show),
//! because they are free of branches and run eight lanes at a time. The same operations in the same order, fused
//! multiply-adds included, run on every machine: the bits are the same with and without wide registers.

mod threefry;
#[cfg(target_arch = "x86_64")]
mod wide;
#[cfg(target_arch = "x86_64")]
mod wide512;

/// Interleaved generators of one stream.
const LANES: usize = 8;
/// Normals made at a time: a cosine and a sine of each lane.
const GROUP: usize = 2 * LANES;

type Lanes = [u64; LANES];

/// The name of a family of blocks: (seed, replicate, effect, axis).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamKey {
    /// The user's seed.
    pub seed: u64,
    /// Which repetition of the same simulation.
    pub replicate: u64,
    /// Number of the effect.
    pub effect: u64,
    /// Which column of a sensor.
    pub axis: u64,
}

/// Block number of the stream that draws initial states.
pub const START: u64 = u64::MAX;

/// One block's generators.
#[derive(Debug, Clone)]
pub struct Stream {
    state: [Lanes; 4],
}

impl Stream {
    /// The stream of one block.
    pub fn new(key: StreamKey, block: u64) -> Self {
        let words = [key.seed, key.replicate, key.effect, key.axis];
        let lanes = std::array::from_fn(|lane| lane as u64);
        let mut state = threefry::threefry(words, [[block; LANES], lanes, [0; LANES], [0; LANES]]);
        // The one state that xoshiro cannot leave, excluded for certain rather than almost surely.
        for lane in 0..LANES {
            if state.iter().all(|row| row[lane] == 0) {
                state[0][lane] = 1;
            }
        }
        Self { state }
    }

    /// Fills with independent standard normal deviates. A shorter slice gets the beginning of what a longer
    /// one would get.
    pub fn normals(&mut self, out: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx512f") {
            // SAFETY: AVX-512 has just been found on this machine.
            unsafe { wide512::normals(&mut self.state, out) };
            return;
        } else if is_wide() {
            // SAFETY: `is_wide` has just found AVX2 and FMA on this machine.
            unsafe { wide::normals(&mut self.state, out) };
            return;
        }
        normals_body(&mut self.state, out);
    }

    /// Fills with uniform deviates of (0, 1], multiples of 2^-52.
    pub fn uniforms(&mut self, out: &mut [f64]) {
        for group in out.chunks_mut(LANES) {
            let words = next(&mut self.state);
            for (value, word) in group.iter_mut().zip(words) {
                *value = uniform(word);
            }
        }
    }
}

/// Whether the machine has the wide registers and the fused multiply-add that the hot loops are compiled for.
#[cfg(target_arch = "x86_64")]
pub(crate) fn is_wide() -> bool {
    std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma")
}

fn normals_body(state: &mut [Lanes; 4], out: &mut [f64]) {
    let mut local = *state;
    let (groups, rest) = out.as_chunks_mut::<GROUP>();
    for group in groups {
        *group = pair(&mut local);
    }
    if !rest.is_empty() {
        let last = pair(&mut local);
        rest.copy_from_slice(&last[..rest.len()]);
    }
    *state = local;
}

/// One step of xoshiro256+ in every lane.
fn next(state: &mut [Lanes; 4]) -> Lanes {
    let mut out = [0; LANES];
    let [s0, s1, s2, s3] = state;
    for i in 0..LANES {
        out[i] = s0[i].wrapping_add(s3[i]);
        let t = s1[i] << 17;
        s2[i] ^= s0[i];
        s3[i] ^= s1[i];
        s1[i] ^= s2[i];
        s0[i] ^= s3[i];
        s2[i] ^= t;
        s3[i] = s3[i].rotate_left(45);
    }
    out
}

/// Bits of 1.
const ONE: u64 = 0x3ff0_0000_0000_0000;
/// Bits of the fraction of a double.
const FRACTION: u64 = (1 << 52) - 1;
/// Bits of 2^52: an integer k in the low bits makes the float 2^52 + k.
const MAGIC: u64 = 0x4330_0000_0000_0000;
/// 2^52 and the bias of exponents.
const EXPONENT: f64 = 4503599627370496.0 + 1023.0;

/// Bits of 4096, whose unit in the last place is 2^-40, and of one half of 2^-39.
const RADIUS: u64 = 0x40b0_0000_0000_0001;
/// The 39 bits of a radius, after a shift to the right by `RADIUS_SHIFT`, leaving the last one to the half.
const RADIUS_BITS: u64 = ((1 << 39) - 1) << 1;
const RADIUS_SHIFT: u32 = 23;
/// Bits of 2^28, whose unit in the last place is 2^-24, and of one half of 2^-23.
const ANGLE: u64 = 0x41b0_0000_0000_0001;
/// The 23 bits of an angle; the last bit of a word, the poorest, is not used.
const ANGLE_BITS: u64 = ((1 << 23) - 1) << 1;
/// 2^28 and half of the range of angles.
const ANGLE_MIDDLE: f64 = 268435456.5;
const SIGN: u64 = 1 << 63;

/// (0, 1] from the upper 52 bits.
fn uniform(word: u64) -> f64 {
    2.0 - f64::from_bits(ONE | (word >> 12))
}

/// Near 1/m for m in [1 + i/16, 1 + (i+1)/16). The last is exact, so that nothing cancels below u = 1.
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
/// 2 ln of them.
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

fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let mut sum = coefficients[N - 1];
    for i in (0..N - 1).rev() {
        sum = sum.mul_add(x, coefficients[i]);
    }
    sum
}

/// −2 ln u for normal u in (0, 1), u = 2^e·m with m in [1, 2), m·c = 1 + r: −2e ln 2 + 2 ln c − 2 ln(1 + r).
fn minus_two_log(u: f64) -> f64 {
    let bits = u.to_bits();
    let e = f64::from_bits(MAGIC | (bits >> 52)) - EXPONENT;
    let m = f64::from_bits((bits & FRACTION) | ONE);
    let i = (bits >> 48) as usize % 16;
    let r = m.mul_add(RECIPROCALS[i], -1.0);
    let whole = r.mul_add(-2.0, e.mul_add(MINUS_TWO_LOG_TWO, LOGARITHMS[i]));
    (r * r).mul_add(polynomial(&LOG, r), whole)
}

/// Sixteen normals: r cos πv in the first eight places, r sin πv in the last, r with a random sign so that
/// v in (−½, ½) covers the circle.
fn pair(state: &mut [Lanes; 4]) -> [f64; GROUP] {
    let words = next(state);
    let mut out = [0.0; GROUP];
    let (cosines, sines) = out.split_at_mut(LANES);
    for (i, word) in words.into_iter().enumerate() {
        let u = f64::from_bits(((word >> RADIUS_SHIFT) & RADIUS_BITS) | RADIUS) - 4096.0;
        let r = minus_two_log(u).sqrt();
        let signed = f64::from_bits(r.to_bits() | (word & SIGN));
        let v = f64::from_bits((word & ANGLE_BITS) | ANGLE) - ANGLE_MIDDLE;
        let square = v * v;
        cosines[i] = signed * polynomial(&COS, square);
        sines[i] = signed * (v * polynomial(&SIN, square));
    }
    out
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const KEY: StreamKey = StreamKey { seed: 1, replicate: 0, effect: 0, axis: 0 };

    #[test]
    fn logarithm_and_circular_functions_are_what_they_say() {
        for k in 1..=40_000_u32 {
            let u = 2.0_f64.powf(-f64::from(k) * 40.0 / 40_000.0);
            let expected = -2.0 * u.ln();
            let found = minus_two_log(u);
            assert!((found - expected).abs() <= 4e-10 * expected, "{u}: {found} {expected}");
            let v = f64::from(k) / 80_000.0;
            let (sin, cos) = (v * polynomial(&SIN, v * v), polynomial(&COS, v * v));
            assert!((sin / (PI * v).sin() - 1.0).abs() < 5.4e-9, "sin {v}");
            assert!((cos - (PI * v).cos()).abs() < 2.3e-10, "cos {v}");
        }
        // The largest radius fraction there is: no negative number under the root.
        let last = 1.0 - 0.5_f64.powi(40);
        assert!((minus_two_log(last) / (2.0 * 0.5_f64.powi(40)) - 1.0).abs() < 1e-2);
    }

    #[test]
    fn moments_of_normals() {
        let n = 1 << 22;
        let mut x = vec![0.0; n];
        Stream::new(KEY, 0).normals(&mut x);
        let moment = |p: i32| x.iter().map(|v| v.powi(p)).sum::<f64>() / n as f64;
        // Standard errors √((2p−1)!! − ((p−1)!!)²)/√n; five of them.
        for (p, mean, spread) in
            [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0), (6, 15.0, 10170.0)]
        {
            let error = f64::sqrt(spread / n as f64);
            assert!((moment(p) - mean).abs() < 5.0 * error, "moment {p}: {}", moment(p));
        }
        let neighbours = x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64;
        assert!(neighbours.abs() < 5.0 / (n as f64).sqrt());
        let pairs = x.windows(9).map(|w| (w[0] * w[8]).powi(1)).sum::<f64>() / n as f64;
        assert!(pairs.abs() < 5.0 / (n as f64).sqrt());
    }

    #[test]
    fn shorter_is_the_beginning_of_longer() {
        let mut long = [0.0; 100];
        Stream::new(KEY, 7).normals(&mut long);
        for n in 0..100 {
            let mut short = vec![0.0; n];
            Stream::new(KEY, 7).normals(&mut short);
            assert_eq!(short, long[..n]);
        }
    }

    #[test]
    fn wide_equals_narrow() {
        for n in 0..300 {
            let (mut wide, mut narrow) = (vec![0.0; n], vec![0.0; n]);
            Stream::new(KEY, 3).normals(&mut wide);
            normals_body(&mut Stream::new(KEY, 3).state, &mut narrow);
            assert_eq!(wide, narrow);
            // The widest registers of the machine have been tried; now those that most machines have.
            #[cfg(target_arch = "x86_64")]
            if is_wide() {
                // SAFETY: `is_wide` has just found AVX2 and FMA on this machine.
                unsafe { wide::normals(&mut Stream::new(KEY, 3).state, &mut wide) };
                assert_eq!(wide, narrow);
            }
        }
    }

    #[test]
    fn every_part_of_the_name_matters() {
        let first = |key, block| {
            let mut x = [0.0; 4];
            Stream::new(key, block).normals(&mut x);
            x.map(f64::to_bits)
        };
        let base = first(KEY, 0);
        assert_ne!(base, first(KEY, 1));
        assert_ne!(base, first(StreamKey { seed: 2, ..KEY }, 0));
        assert_ne!(base, first(StreamKey { replicate: 1, ..KEY }, 0));
        assert_ne!(base, first(StreamKey { effect: 1, ..KEY }, 0));
        assert_ne!(base, first(StreamKey { axis: 1, ..KEY }, 0));
    }
}
