//! Independent random streams and the normal deviates drawn from them.
//!
//! A stream is named by (seed, replicate, effect, axis) and a block number. Threefry-4×64-20 (Salmon et al.
//! 2011, SC'11) maps the name to the states of eight interleaved xoshiro256+ generators (Blackman & Vigna
//! 2021, ACM TOMS 47, 36): for one name it is a bijection of (block, lane), so that no two blocks share a
//! state, and any block can be drawn at any time by any thread.
//!
//! Normals come in pairs by Box & Muller 1958 with polynomial logarithm and circular functions (relative
//! error below 1e-10, far under what any sample could show), because that is free of branches and tables
//! and runs eight lanes at a time. The same operations in the same order, fused multiply-adds included, run on
//! every machine: the bits are the same with and without wide registers.

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
    /// Place of the effect in the list.
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
        let mut state = threefry(words, [[block; LANES], lanes, [0; LANES], [0; LANES]]);
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
/// Bits of √½.
const ROOT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
/// Bits of 2^52: an integer k in the low bits makes the float 2^52 + k.
const MAGIC: u64 = 0x4330_0000_0000_0000;
/// Keeps that k positive.
const BIAS: u64 = 1024;

/// (0, 1] from the upper 52 bits.
fn uniform(word: u64) -> f64 {
    2.0 - f64::from_bits(ONE | (word >> 12))
}

/// −4·artanh(t)/t as a polynomial of t² on |t| ≤ (√2−1)/(√2+1); error 4e-12.
const LOG: [f64; 5] =
    [-4.000000000016719, -1.3333333049495606, -0.8000076934862784, -0.5707010182946016, -0.47232722981244935];
/// sin(πv)/v as a polynomial of v² on |v| ≤ ½; error 3e-11.
const SIN: [f64; 6] = [
    3.141592653536132,
    -5.167712764593,
    2.550163317938427,
    -0.599252186531583,
    0.08205035020147247,
    -0.007028303855203096,
];
/// cos(πv) as a polynomial of v² on |v| ≤ ½; error 8e-13.
const COS: [f64; 7] = [
    0.9999999999992479,
    -4.93480220024985,
    4.0587121075374375,
    -1.33526231526157,
    0.2353254365877112,
    -0.02577631642731586,
    0.0018399894372694043,
];

fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let mut sum = coefficients[N - 1];
    for i in (0..N - 1).rev() {
        sum = sum.mul_add(x, coefficients[i]);
    }
    sum
}

/// −2 ln u for u in (0, 1], u = 2^e·m with m in [√½, √2): −2e ln 2 − 4 artanh((m−1)/(m+1)).
fn minus_two_log(u: f64) -> f64 {
    let bits = u.to_bits();
    let shifted = bits.wrapping_sub(ROOT_HALF).wrapping_add(BIAS << 52) >> 52;
    let m = f64::from_bits(bits.wrapping_sub(shifted.wrapping_sub(BIAS) << 52));
    let e = f64::from_bits(MAGIC | shifted) - (4503599627370496.0 + BIAS as f64);
    let t = (m - 1.0) / (m + 1.0);
    (e * -2.0).mul_add(std::f64::consts::LN_2, t * polynomial(&LOG, t * t))
}

/// Sixteen normals: r cos πv in the first eight places, r sin πv in the last, r with a random sign so that
/// v in [−½, ½) covers the circle.
fn pair(state: &mut [Lanes; 4]) -> [f64; GROUP] {
    let radius = next(state);
    let angle = next(state);
    let mut out = [0.0; GROUP];
    let (cosines, sines) = out.split_at_mut(LANES);
    for i in 0..LANES {
        let r = minus_two_log(uniform(radius[i])).sqrt();
        // Bit 11 is the highest one that `uniform` leaves unused.
        let signed = f64::from_bits(r.to_bits() | ((radius[i] << 52) & (1 << 63)));
        let v = f64::from_bits(ONE | (angle[i] >> 12)) - 1.5;
        let square = v * v;
        cosines[i] = signed * polynomial(&COS, square);
        sines[i] = signed * (v * polynomial(&SIN, square));
    }
    out
}

/// Threefry-4×64 with 20 rounds, of every lane's counter.
fn threefry(key: [u64; 4], counter: [Lanes; 4]) -> [Lanes; 4] {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        // SAFETY: AVX-512 has just been found on this machine.
        return unsafe { threefry_wide(key, counter) };
    }
    threefry_body(key, counter)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn threefry_wide(key: [u64; 4], counter: [Lanes; 4]) -> [Lanes; 4] {
    threefry_body(key, counter)
}

/// Inlined, so that it is compiled again inside `threefry_wide` with its registers.
#[inline(always)]
fn threefry_body(key: [u64; 4], counter: [Lanes; 4]) -> [Lanes; 4] {
    const ROTATIONS: [[u32; 2]; 8] =
        [[14, 16], [52, 57], [23, 40], [5, 37], [25, 33], [46, 12], [58, 22], [32, 32]];
    let parity = key.iter().fold(0x1BD1_1BDA_A9FC_1A22, |all, word| all ^ word);
    let extended = [key[0], key[1], key[2], key[3], parity];
    let [mut x0, mut x1, mut x2, mut x3] = counter;
    plus(&mut x0, key[0]);
    plus(&mut x1, key[1]);
    plus(&mut x2, key[2]);
    plus(&mut x3, key[3]);
    for round in 0..20 {
        let [first, second] = ROTATIONS[round % 8];
        if round % 2 == 0 {
            mix(&mut x0, &mut x1, first);
            mix(&mut x2, &mut x3, second);
        } else {
            mix(&mut x0, &mut x3, first);
            mix(&mut x2, &mut x1, second);
        }
        if round % 4 == 3 {
            let injection = round / 4 + 1;
            let word = |i: usize| extended[(injection + i) % 5];
            plus(&mut x0, word(0));
            plus(&mut x1, word(1));
            plus(&mut x2, word(2));
            plus(&mut x3, word(3).wrapping_add(injection as u64));
        }
    }
    [x0, x1, x2, x3]
}

#[expect(clippy::inline_always, reason = "part of `threefry_body`")]
#[inline(always)]
fn plus(x: &mut Lanes, word: u64) {
    for lane in x {
        *lane = lane.wrapping_add(word);
    }
}

#[expect(clippy::inline_always, reason = "part of `threefry_body`")]
#[inline(always)]
fn mix(a: &mut Lanes, b: &mut Lanes, bits: u32) {
    for (a, b) in a.iter_mut().zip(b) {
        *a = a.wrapping_add(*b);
        *b = b.rotate_left(bits) ^ *a;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: StreamKey = StreamKey { seed: 1, replicate: 0, effect: 0, axis: 0 };

    #[test]
    fn threefry_known_answers() {
        // Random123's kat_vectors, threefry4x64 20.
        let one = |key, counter: [u64; 4]| {
            let all = threefry(key, counter.map(|word| [word; LANES]));
            assert_eq!(all, threefry_body(key, counter.map(|word| [word; LANES])));
            all.map(|lanes| lanes[LANES - 1])
        };
        assert_eq!(
            one([0; 4], [0; 4]),
            [0x09218ebde6c85537, 0x55941f5266d86105, 0x4bd25e16282434dc, 0xee29ec846bd2e40b]
        );
        assert_eq!(
            one([u64::MAX; 4], [u64::MAX; 4]),
            [0x29c24097942bba1b, 0x0371bbfb0f6f4e11, 0x3c231ffa33f83a1c, 0xcd29113fde32d168]
        );
    }

    #[test]
    fn the_logarithm_is_one() {
        for k in 0..4000_u32 {
            let u = 2.0_f64.powf(-f64::from(k) * 52.0 / 4000.0);
            let expected = -2.0 * u.ln();
            let found = minus_two_log(u);
            assert!((found - expected).abs() <= 1e-10 * expected + 1e-300, "{u}: {found} {expected}");
        }
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
