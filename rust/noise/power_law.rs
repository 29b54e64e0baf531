//! Noise whose spectrum is any power of frequency: white noise through a ladder of first-order sections.

use super::Process;
use super::bank::Ladder;
use super::section::Lag;
use super::simple::White;
use crate::rng::Stream;
use crate::{Error, Result};

/// Spectrum level² (2 sin(w/2))^exponent for an exponent in (−3, 1], for records of `n` samples.
pub fn new(exponent: f64, level: f64, n: usize, start: &mut Stream) -> Result<Box<dyn Process>> {
    if !(exponent > -3.0 && exponent <= 1.0) {
        return Err(Error::Input(format!("noise process power_law: exponent {exponent} is outside (-3, 1]")));
    }
    let d = -0.5 * exponent;
    #[expect(clippy::float_cmp, reason = "only the exact whole orders have no ladder")]
    if d == 1.0 {
        return Ok(Box::new(Lag::random_walk(level)));
    }
    if d == 0.0 {
        return Ok(Box::new(White::new(level)));
    }
    let fraction = d - d.floor();
    // Of an integrated power of frequency much more lies below the band: it needs a longer ladder.
    let design = if d > 1.0 { n.saturating_mul(1000) } else { n };
    let bank = Bank::new(&Ladder::new(fraction, design), level, start);
    Ok(match d.floor() {
        0.0 => Box::new(bank),
        1.0 => Box::new(Summed { inner: bank, sum: 0.0 }),
        _ => Box::new(Differenced::new(bank, start)),
    })
}

/// Sections side by side in a register.
pub(super) const LANES: usize = 4;

/// Sections s ← φ s + e, all driven by the same normals; the sample is Σ w s + direct·e.
pub struct Bank {
    pub(super) phi: Vec<[f64; LANES]>,
    pub(super) weight: Vec<[f64; LANES]>,
    pub(super) state: Vec<[f64; LANES]>,
    pub(super) direct: f64,
}

impl Bank {
    fn new(ladder: &Ladder, level: f64, start: &mut Stream) -> Self {
        let groups = |values: Vec<f64>| -> Vec<[f64; LANES]> {
            values
                .chunks(LANES)
                .map(|part| std::array::from_fn(|q| part.get(q).copied().unwrap_or(0.0)))
                .collect()
        };
        Self {
            phi: groups(ladder.gaps.iter().map(|gap| 1.0 - gap).collect()),
            weight: groups(ladder.weights.iter().map(|weight| level * weight).collect()),
            state: groups(stationary(&ladder.gaps, start)),
            direct: level * ladder.direct,
        }
    }

    /// One section after the other: what the wide path does, operation for operation.
    fn narrow(&mut self, samples: &mut [f64]) {
        for x in samples {
            let e = *x;
            let mut sums = [0.0; LANES];
            for ((phi, weight), state) in self.phi.iter().zip(&self.weight).zip(&mut self.state) {
                for q in 0..LANES {
                    state[q] = phi[q].mul_add(state[q], e);
                    sums[q] = weight[q].mul_add(state[q], sums[q]);
                }
            }
            let [a, b, c, d] = sums;
            *x = self.direct.mul_add(e, (a + b) + (c + d));
        }
    }
}

/// One draw of the states `s_j = Σ φ_j^l e_{−l}` in the stationary state, whose covariance is `1/(1−φ_i φ_j)`.
///
/// Its Cholesky factor is known: `L_jk = √(1−φ_k²)/(1−φ_j φ_k) Π_{i<k} (φ_j−φ_i)/(1−φ_j φ_i)`, the
/// Takenaka–Malmquist functions at `φ_j`, exact where a numerical factor of so ill-conditioned a matrix is not.
fn stationary(gaps: &[f64], start: &mut Stream) -> Vec<f64> {
    let mut normals = vec![0.0; gaps.len()];
    start.normals(&mut normals);
    let row = |j: usize| -> f64 {
        let a = gaps[j];
        // 1 − φ_j φ_i without cancellation.
        let one_minus = |b: f64| a + b - a * b;
        let mut ladder = 1.0;
        let mut sum = 0.0;
        for (k, &b) in gaps.iter().enumerate().take(j + 1) {
            sum += normals[k] * ladder * (b * (2.0 - b)).sqrt() / one_minus(b);
            ladder *= (b - a) / one_minus(b);
        }
        sum
    };
    (0..gaps.len()).map(row).collect()
}

impl Process for Bank {
    fn cost(&self) -> f64 {
        // A register of sections takes half the time of a normal deviate.
        0.5 * self.state.len() as f64
    }

    fn run(&mut self, samples: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if crate::rng::is_wide() {
            let done = if std::arch::is_x86_feature_detected!("avx512vl") {
                // SAFETY: AVX2, FMA and AVX-512 have just been found on this machine.
                unsafe { super::wide::advance_512(self, samples) }
            } else {
                // SAFETY: `is_wide` has just found AVX2 and FMA on this machine.
                unsafe { super::wide::advance(self, samples) }
            };
            if done {
                return;
            }
        }
        self.narrow(samples);
    }
}

/// Running sum of a process, from zero.
struct Summed {
    inner: Bank,
    sum: f64,
}

impl Process for Summed {
    fn cost(&self) -> f64 {
        self.inner.cost() + 0.5
    }

    fn run(&mut self, samples: &mut [f64]) {
        self.inner.run(samples);
        for x in samples {
            let here = self.sum;
            self.sum += *x;
            *x = here;
        }
    }
}

/// Difference of neighbouring samples of a process.
struct Differenced {
    inner: Bank,
    last: f64,
}

impl Differenced {
    fn new(mut inner: Bank, start: &mut Stream) -> Self {
        let mut before = [0.0; 8];
        start.normals(&mut before);
        inner.run(&mut before);
        Self { inner, last: before[7] }
    }
}

impl Process for Differenced {
    fn cost(&self) -> f64 {
        self.inner.cost() + 0.5
    }

    fn run(&mut self, samples: &mut [f64]) {
        self.inner.run(samples);
        for x in samples {
            let new = *x;
            *x = new - self.last;
            self.last = new;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::StreamKey;

    #[test]
    fn wide_equals_narrow() {
        let key = StreamKey { seed: 1, replicate: 0, effect: 0, axis: 0 };
        for n in [1, 100, 10_000, 1_000_000, 100_000_000, 10_000_000_000] {
            let bank = || Bank::new(&Ladder::new(0.5, n), 1.0, &mut Stream::new(key, 0));
            let (mut wide, mut narrow) = (bank(), bank());
            for length in (0..300).step_by(4) {
                let mut x = vec![0.0; length];
                Stream::new(key, length as u64).normals(&mut x);
                let mut y = x.clone();
                wide.run(&mut x);
                narrow.narrow(&mut y);
                assert_eq!(x, y);
            }
        }
    }
}
