//! Independent random streams and the normal deviates drawn from them.
//!
//! A stream is identified by a key (seed, replicate, effect, axis) and a block number. Threefry-4×64-20 (Salmon et
//! al. 2011, SC'11) maps them to the states of eight interleaved xoshiro256+ generators (Blackman & Vigna 2021, ACM
//! TOMS 47, 36). For one key this is a bijection of (block, lane). So no two blocks share a state, and any thread can
//! draw any block at any time.

mod normals;
mod registers;
mod threefry;

use crate::machine::processor::Width;
use normals::{LANES, Lanes, ONE};

/// Key of a family of streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamKey {
    /// The user's seed.
    pub seed: u64,
    /// Number of the repetition of a simulation.
    pub replicate: u64,
    /// Number of the effect.
    pub effect: u64,
    /// Number of the column of a sensor.
    pub axis: u64,
}

/// Block number of the stream that draws initial states.
pub(crate) const START: u64 = u64::MAX;

/// Random generators of one block.
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
        // Exclude the all-zero state, which xoshiro cannot leave.
        for lane in 0..LANES {
            if state.iter().all(|row| row[lane] == 0) {
                state[0][lane] = 1;
            }
        }
        Self { state }
    }

    /// Fills `out` with independent standard normal deviates. A shorter slice receives the beginning of what a longer
    /// one receives.
    pub fn normals(&mut self, out: &mut [f64]) {
        normals::fill(Width::best(), &mut self.state, out);
    }

    /// Fills `out` with uniform deviates in (0, 1], multiples of 2^-52.
    pub fn uniforms(&mut self, out: &mut [f64]) {
        for group in out.chunks_mut(LANES) {
            let words = next(&mut self.state);
            for (value, word) in group.iter_mut().zip(words) {
                *value = uniform(word);
            }
        }
    }
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

/// Uniform deviate in (0, 1] from the upper 52 bits of a word.
fn uniform(word: u64) -> f64 {
    2.0 - f64::from_bits(ONE | (word >> 12))
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: StreamKey = StreamKey { seed: 1, replicate: 0, effect: 0, axis: 0 };

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
        let neighbors = x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64;
        assert!(neighbors.abs() < 5.0 / (n as f64).sqrt());
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
            let of = |width| {
                let mut out = vec![0.0; n];
                normals::fill(width, &mut Stream::new(KEY, 3).state, &mut out);
                out
            };
            let narrow = of(Width::portable());
            Width::available().for_each(|width| assert_eq!(of(width), narrow));
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
