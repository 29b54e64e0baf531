//! White noise through first-order or second-order sections, started in their stationary state.

use super::Process;
use super::quad::{self, LANES, Quad};
use crate::machine::processor::Width;
use crate::rng::Stream;
use crate::{Error, Result};

/// Number of samples advanced at a time.
const STEP: usize = 2 * LANES;

/// First-order recursion x ← φ x + normal; the sample is x before the step. Stationary for |φ| < 1, a random walk for
/// φ = 1.
pub(super) struct Lag {
    drive: f64,
    state: f64,
    /// φ⁰ … φ⁷.
    powers: [f64; STEP],
    /// φ⁸.
    eighth: f64,
}

impl Lag {
    /// Process with the recursion x ← φx + `drive`·deviate, from the initial `state` on.
    fn new(phi: f64, drive: f64, state: f64) -> Self {
        let mut powers = [1.0; STEP];
        for i in 1..STEP {
            powers[i] = powers[i - 1] * phi;
        }
        Self { drive, state, powers, eighth: powers[STEP - 1] * phi }
    }

    /// Stationary process from its standard deviation and the correlation φ of adjacent samples.
    pub(super) fn gauss_markov(sigma: f64, phi: f64, start: &mut Stream) -> Result<Self> {
        if phi.abs() >= 1.0 {
            return Err(Error::Input(format!(
                "noise process gauss_markov: phi = {phi} must lie between -1 and 1"
            )));
        }
        let mut first = [0.0];
        start.normals(&mut first);
        Ok(Self::new(phi, sigma * ((1.0 - phi) * (1.0 + phi)).sqrt(), sigma * first[0]))
    }

    /// Random walk from zero, from the standard deviation of its steps.
    pub(super) fn random_walk(step: f64) -> Self {
        Self::new(1.0, step, 0.0)
    }

    /// Replaces deviates by samples of the process.
    ///
    /// Computes eight samples at a time. The response from a zero state is computed by doubling, without waiting for
    /// the previous step; then the contribution of the state is added.
    ///
    /// # Safety
    /// The processor has the instructions of `Q`.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    unsafe fn advance<Q: Quad>(&mut self, samples: &mut [f64]) {
        let (steps, rest) = samples.as_chunks_mut::<STEP>();
        debug_assert!(rest.is_empty(), "windows are whole steps");
        // SAFETY: this function's contract.
        unsafe {
            let zero = Q::splat(0.0);
            let [_, phi, square, _, fourth, ..] = self.powers.map(|power| Q::splat(power));
            let powers = load_step::<Q>(&self.powers);
            let (drive, eighth) = (Q::splat(self.drive), Q::splat(self.eighth));
            let mut state = Q::splat(self.state);
            for step in steps {
                let [a, b] = load_step::<Q>(step);
                let [a, b] = [Q::times(drive, a), Q::times(drive, b)];
                let [a, b] = [Q::fused(phi, Q::delayed(zero, a), a), Q::fused(phi, Q::delayed(a, b), b)];
                let [a, b] = [
                    Q::fused(square, Q::delayed_twice(zero, a), a),
                    Q::fused(square, Q::delayed_twice(a, b), b),
                ];
                let b = Q::fused(fourth, a, b);
                let before = [Q::delayed(zero, a), Q::delayed(a, b)];
                let (fours, _) = step.as_chunks_mut::<LANES>();
                for ((four, power), before) in fours.iter_mut().zip(powers).zip(before) {
                    Q::fused(power, state, before).store(four);
                }
                state = Q::fused(eighth, state, b.last());
            }
            self.state = state.first();
        }
    }

    /// Like [`Self::advance`], compiled for AVX2 and FMA.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn advance_avx2(&mut self, samples: &mut [f64]) {
        // SAFETY: the contract of this function.
        unsafe { self.advance::<quad::Avx2>(samples) };
    }

    /// Like [`Self::advance`], on the given vector unit.
    fn advance_by(&mut self, width: Width, samples: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if width.is_wide() {
            // SAFETY: a wide `Width` is only made on a processor with AVX2 and FMA.
            return unsafe { self.advance_avx2(samples) };
        }
        let _ = width;
        // SAFETY: the baseline is everywhere.
        unsafe { self.advance::<quad::Portable>(samples) };
    }
}

/// Loads eight samples as two vectors.
///
/// # Safety
/// The processor has the instructions of `Q`.
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
unsafe fn load_step<Q: Quad>(step: &[f64; STEP]) -> [Q; 2] {
    let (fours, _) = step.as_chunks::<LANES>();
    // SAFETY: this function's contract.
    unsafe { [Q::load(&fours[0]), Q::load(&fours[1])] }
}

impl Process for Lag {
    fn run(&mut self, samples: &mut [f64]) {
        self.advance_by(Width::best(), samples);
    }
}

/// White noise through a cascade of sections (b0 + b1 z⁻¹ + b2 z⁻²)/(1 + a1 z⁻¹ + a2 z⁻²), in transposed direct form
/// II.
pub(super) struct Filtered {
    /// b0, b1, b2, a1, a2 of each section.
    sections: Vec<[f64; 5]>,
    state: Vec<[f64; 2]>,
}

impl Filtered {
    /// Process from the standard deviation of the white noise and at least one section.
    pub(super) fn new(sd: f64, sections: &[[f64; 5]], start: &mut Stream) -> Result<Self> {
        let mut sections = sections.to_vec();
        for [.., a1, a2] in &sections {
            // The stability triangle (Oppenheim & Schafer §6.9).
            if !(*a2 < 1.0 && a1.abs() < 1.0 + a2) {
                return Err(Error::Input(format!(
                    "noise process filtered: the section a1 = {a1}, a2 = {a2} is unstable; \
                     it needs a2 < 1 and |a1| < 1 + a2"
                )));
            }
        }
        for b in &mut sections[0][..3] {
            *b *= sd;
        }
        let mut this = Self { state: vec![[0.0; 2]; sections.len()], sections };
        let root = cholesky(this.stationary());
        let mut normals = vec![0.0; root.len()];
        start.normals(&mut normals);
        for (i, row) in root.iter().enumerate() {
            this.state[i / 2][i % 2] = row.iter().zip(&normals).map(|(l, normal)| l * normal).sum();
        }
        Ok(this)
    }

    /// The next sample for this deviate; updates the state.
    fn step(&mut self, mut x: f64) -> f64 {
        for ([b0, b1, b2, a1, a2], z) in self.sections.iter().zip(&mut self.state) {
            let y = b0 * x + z[0];
            z[0] = b1 * x - a1 * y + z[1];
            z[1] = b2 * x - a2 * y;
            x = y;
        }
        x
    }

    /// Stationary covariance of the state z of z' = F z + g w: the sum of F^k g gᵀ F^kᵀ, computed by doubling.
    /// Doubling keeps it positive even if poles are close to the unit circle.
    fn stationary(&mut self) -> Matrix {
        let size = 2 * self.sections.len();
        let mut moved = |place: Option<usize>| -> Vec<f64> {
            self.state.fill([0.0; 2]);
            if let Some(i) = place {
                self.state[i / 2][i % 2] = 1.0;
            }
            self.step(if place.is_none() { 1.0 } else { 0.0 });
            self.state.as_flattened().to_vec()
        };
        let g = moved(None);
        let columns: Vec<_> = (0..size).map(|i| moved(Some(i))).collect();
        let mut f: Matrix = transposed(&columns);
        let mut p: Matrix = g.iter().map(|a| g.iter().map(|b| a * b).collect()).collect();
        for _ in 0..64 {
            let more = product(&product(&f, &p), &transposed(&f));
            for (value, addend) in p.iter_mut().flatten().zip(more.iter().flatten()) {
                *value += addend;
            }
            f = product(&f, &f);
        }
        p
    }
}

/// Matrix as a list of rows.
type Matrix = Vec<Vec<f64>>;

/// Transpose of a matrix.
fn transposed(a: &Matrix) -> Matrix {
    (0..a.len()).map(|j| a.iter().map(|row| row[j]).collect()).collect()
}

/// Product of two matrices.
fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = transposed(b);
    a.iter()
        .map(|row| columns.iter().map(|column| row.iter().zip(column).map(|(x, y)| x * y).sum()).collect())
        .collect()
}

/// Cholesky factor: lower triangular L with L Lᵀ = p. Directions without variance give zeros.
fn cholesky(mut p: Matrix) -> Matrix {
    for j in 0..p.len() {
        let pivot = (p[j][j] - p[j][..j].iter().map(|x| x * x).sum::<f64>()).max(0.0).sqrt();
        p[j][j] = pivot;
        for i in j + 1..p.len() {
            let rest = p[i][j] - p[i][..j].iter().zip(&p[j][..j]).map(|(x, y)| x * y).sum::<f64>();
            p[i][j] = if pivot > 0.0 { rest / pivot } else { 0.0 };
        }
        for value in &mut p[j][j + 1..] {
            *value = 0.0;
        }
    }
    p
}

impl Process for Filtered {
    fn run(&mut self, samples: &mut [f64]) {
        for ([b0, b1, b2, a1, a2], [first, second]) in self.sections.iter().zip(&mut self.state) {
            let (mut z1, mut z2) = (*first, *second);
            for x in &mut *samples {
                let w = *x;
                let y = b0 * w + z1;
                z1 = b1 * w - a1 * y + z2;
                z2 = b2 * w - a2 * y;
                *x = y;
            }
            (*first, *second) = (z1, z2);
        }
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
            let mut lags: Vec<_> = Width::available().map(|width| (width, Lag::new(phi, 0.3, 2.0))).collect();
            let mut state = 2.0;
            for steps in 0..20 {
                let mut x = vec![0.0; steps * STEP];
                Stream::new(key, steps as u64).normals(&mut x);
                let normals = x.clone();
                let mut found = lags.iter_mut().map(|(width, lag)| {
                    let mut y = normals.clone();
                    lag.advance_by(*width, &mut y);
                    y
                });
                x.clone_from(&found.next().expect("plain Rust is everywhere"));
                found.for_each(|y| assert_eq!(x, y, "phi {phi}"));
                for (x, normal) in x.iter().zip(normals) {
                    assert!((x - state).abs() < 1e-12, "phi {phi}: {x} {state}");
                    state = phi * state + 0.3 * normal;
                }
            }
        }
    }
}
