//! White noise through one section of first or second order, started in its stationary state.

use super::Process;
use crate::rng::Stream;
use crate::{Error, Result};

/// Samples advanced at a time.
pub(super) const STEP: usize = 8;

/// x ← φ x + normal, the sample being x before the step: stationary for |φ| < 1, a random walk for φ = 1.
pub struct Lag {
    pub(super) drive: f64,
    pub(super) state: f64,
    /// φ⁰ … φ⁷.
    pub(super) powers: [f64; STEP],
    pub(super) eighth: f64,
}

impl Lag {
    fn new(phi: f64, drive: f64, state: f64) -> Self {
        let mut powers = [1.0; STEP];
        for i in 1..STEP {
            powers[i] = powers[i - 1] * phi;
        }
        Self { drive, state, powers, eighth: powers[STEP - 1] * phi }
    }

    /// Stationary, of a standard deviation and a correlation of neighbours.
    pub fn gauss_markov(sigma: f64, phi: f64, start: &mut Stream) -> Result<Self> {
        if phi.abs() >= 1.0 {
            return Err(Error::Input(format!(
                "noise process gauss_markov: phi = {phi} must lie between -1 and 1"
            )));
        }
        let mut first = [0.0];
        start.normals(&mut first);
        Ok(Self::new(phi, sigma * ((1.0 - phi) * (1.0 + phi)).sqrt(), sigma * first[0]))
    }

    /// From zero, with steps of a standard deviation.
    pub fn random_walk(step: f64) -> Self {
        Self::new(1.0, step, 0.0)
    }

    /// Eight samples from a zero state, by doubling, which do not wait for the step before, then what its state adds.
    fn advance(&mut self, samples: &mut [f64]) {
        let (steps, rest) = samples.as_chunks_mut::<STEP>();
        debug_assert!(rest.is_empty(), "blocks are whole steps");
        let [_, phi, square, _, fourth, ..] = self.powers;
        for step in steps {
            let mut driven = step.map(|normal| self.drive * normal);
            driven = combine(phi, delayed::<1>(driven), driven);
            driven = combine(square, delayed::<2>(driven), driven);
            driven = combine(fourth, delayed::<4>(driven), driven);
            let before = delayed::<1>(driven);
            for i in 0..STEP {
                step[i] = self.powers[i].mul_add(self.state, before[i]);
            }
            self.state = self.eighth.mul_add(self.state, driven[STEP - 1]);
        }
    }
}

/// The samples `K` places later, zeros before.
fn delayed<const K: usize>(samples: [f64; STEP]) -> [f64; STEP] {
    std::array::from_fn(|i| if i < K { 0.0 } else { samples[i - K] })
}

/// factor·a + b.
fn combine(factor: f64, a: [f64; STEP], b: [f64; STEP]) -> [f64; STEP] {
    std::array::from_fn(|i| factor.mul_add(a[i], b[i]))
}

impl Process for Lag {
    fn run(&mut self, samples: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if crate::rng::is_wide() {
            // SAFETY: `is_wide` has just found AVX2 and FMA on this machine.
            unsafe { super::wide::lag(self, samples) };
            return;
        }
        self.advance(samples);
    }
}

/// White noise through (b0 + b1 z⁻¹ + b2 z⁻²)/(1 + a1 z⁻¹ + a2 z⁻²), transposed direct form II.
pub struct Filtered {
    b: [f64; 3],
    a: [f64; 2],
    z: [f64; 2],
}

impl Filtered {
    /// Standard deviation of the white noise, and the coefficients.
    pub fn new(sd: f64, b: [f64; 3], a: [f64; 2], start: &mut Stream) -> Result<Self> {
        let [a1, a2] = a;
        // The stability triangle (Oppenheim & Schafer §6.9).
        if !(a2 < 1.0 && a1.abs() < 1.0 + a2) {
            return Err(Error::Input(format!(
                "noise process filtered: the section a1 = {a1}, a2 = {a2} is unstable; \
                 it needs a2 < 1 and |a1| < 1 + a2"
            )));
        }
        let b = b.map(|value| sd * value);
        let [p11, p12, p22] = stationary([b[1] - a1 * b[0], b[2] - a2 * b[0]], a);
        let mut normal = [0.0; 2];
        start.normals(&mut normal);
        let l11 = p11.max(0.0).sqrt();
        let l21 = if l11 > 0.0 { p12 / l11 } else { 0.0 };
        let l22 = (p22 - l21 * l21).max(0.0).sqrt();
        Ok(Self { b, a, z: [l11 * normal[0], l21 * normal[0] + l22 * normal[1]] })
    }
}

/// Covariance [p11, p12, p22] of z in z' = F z + g w, F = [[−a1, 1], [−a2, 0]]: the sum of F^k g gᵀ F^kᵀ by
/// doubling, which stays positive however near the poles are to the unit circle.
fn stationary(g: [f64; 2], a: [f64; 2]) -> [f64; 3] {
    let mut f = [[-a[0], 1.0], [-a[1], 0.0]];
    let mut p = [[g[0] * g[0], g[0] * g[1]], [g[0] * g[1], g[1] * g[1]]];
    for _ in 0..64 {
        let fp = product(f, p);
        let transposed = [[f[0][0], f[1][0]], [f[0][1], f[1][1]]];
        let more = product(fp, transposed);
        for (row, extra) in p.iter_mut().zip(more) {
            for (value, addend) in row.iter_mut().zip(extra) {
                *value += addend;
            }
        }
        f = product(f, f);
    }
    [p[0][0], p[0][1], p[1][1]]
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let entry = |i: usize, j: usize| a[i][0] * b[0][j] + a[i][1] * b[1][j];
    [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]]
}

impl Process for Filtered {
    fn run(&mut self, samples: &mut [f64]) {
        let ([b0, b1, b2], [a1, a2], [mut z1, mut z2]) = (self.b, self.a, self.z);
        for x in samples {
            let w = *x;
            let y = b0 * w + z1;
            z1 = b1 * w - a1 * y + z2;
            z2 = b2 * w - a2 * y;
            *x = y;
        }
        self.z = [z1, z2];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::StreamKey;

    #[test]
    fn wide_equals_narrow_equals_the_recursion() {
        let key = StreamKey { seed: 1, replicate: 0, effect: 0, axis: 0 };
        for phi in [1.0, 0.999, 0.5, 0.0, -0.9] {
            let (mut wide, mut narrow) = (Lag::new(phi, 0.3, 2.0), Lag::new(phi, 0.3, 2.0));
            let mut state = 2.0;
            for steps in 0..20 {
                let mut x = vec![0.0; steps * STEP];
                Stream::new(key, steps as u64).normals(&mut x);
                let (mut y, normals) = (x.clone(), x.clone());
                wide.run(&mut x);
                narrow.advance(&mut y);
                assert_eq!(x, y, "phi {phi}");
                for (x, normal) in x.iter().zip(normals) {
                    assert!((x - state).abs() < 1e-12, "phi {phi}: {x} {state}");
                    state = phi * state + 0.3 * normal;
                }
            }
        }
    }
}
