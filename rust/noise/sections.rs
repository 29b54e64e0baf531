//! Parallel first-order sections that are all driven by the same normals.
//!
//! The [`FAST`] fastest sections advance with every sample. The other sections hardly change within a window. There
//! each of them is well approximated by a sum of the same four exponentials (interpolation in the decay rate, at
//! Chebyshev points). So four sections represent all slow ones, and each slow section is updated at the end of the
//! window.
//!
//! ```text
//! e ──┬──► s₁ ← φ₁ s₁ + e ──► w₁ ──┐
//!     ├──► …  eight fast          ├──► Σ w s + direct · e  ──► x        every sample
//!     ├──► s₈ ← φ₈ s₈ + e ──► w₈ ──┤
//!     └──► t ← ψ t + e (four) ─► w ┘
//!            ▲            │
//!    project │            │ share                                        every window of 256 samples
//!            │            ▼
//!          all slow s_j:  s_j ← φ_j²⁵⁶ s_j + Σ_q share_jq (t_q − ψ_q²⁵⁶ t_q at the start of the window)
//! ```

use std::f64::consts::PI;

use super::bank::PoleBank;
use super::quad::{self, LANES, Quad};
use super::{Process, WINDOW};
use crate::machine::processor::{Unit, Width};
use crate::rng::Stream;

/// Number of sections that are always advanced sample by sample.
const FAST: usize = 2 * LANES;

/// Sections s ← φ s + e; the sample is Σ w s + direct·e. Two samples are advanced at a time, which halves the chain
/// of dependent operations: in terms of the state before, Σ w s of the first sample is Σ w φ s + (Σ w) e.
pub(super) struct Sections {
    groups: Vec<Group>,
    state: Vec<[f64; LANES]>,
    /// Weight of the normal in the first sample of a pair and in the second.
    direct: [f64; 2],
    slow: Option<Slow>,
}

/// Constants of a group of sections: φ, φ², w, w φ.
struct Group {
    phi: [f64; LANES],
    square: [f64; LANES],
    weight: [f64; LANES],
    earlier: [f64; LANES],
}

/// The slow sections, which the last group of sections represents.
struct Slow {
    state: Vec<f64>,
    /// φ^WINDOW of each section.
    decay: Vec<f64>,
    /// Weights with which the state of each section contributes to the four representatives.
    project: Vec<[f64; LANES]>,
    /// Weights of the four exponentials in each section.
    share: [Vec<f64>; LANES],
    /// ψ^WINDOW of the four exponentials, and their states at the start of the window.
    fade: [f64; LANES],
    begun: [f64; LANES],
}

impl Sections {
    /// Sections in their stationary state.
    pub(super) fn new(bank: &PoleBank, level: f64, start: &mut Stream) -> Self {
        let state = stationary(&bank.gaps, start);
        let weight = &bank.weights;
        let phi: Vec<_> = bank.gaps.iter().map(|gap| 1.0 - gap).collect();
        let direct = bank.direct;
        if phi.len() <= FAST + LANES {
            return Self::grouped(groups(&phi), &groups(weight), groups(&state), direct, level);
        }
        // The gaps are ascending, so the slow sections come first.
        let split = phi.len() - FAST;
        let (slow, psi, together) = Slow::new(&bank.gaps[..split], &weight[..split], &state[..split]);
        let with = |fast: &[f64], last: [f64; LANES]| {
            let mut all = groups(fast);
            all.push(last);
            all
        };
        let state = with(&state[split..], [0.0; LANES]);
        let weight = with(&weight[split..], together);
        Self { slow: Some(slow), ..Self::grouped(with(&phi[split..], psi), &weight, state, direct, level) }
    }

    /// Sections from the constants and states of their groups of four.
    fn grouped(
        phi: Vec<[f64; LANES]>,
        weight: &[[f64; LANES]],
        state: Vec<[f64; LANES]>,
        direct: f64,
        level: f64,
    ) -> Self {
        let direct = [direct + weight.iter().flatten().sum::<f64>(), direct].map(|direct| level * direct);
        let group = |(phi, weight): ([f64; LANES], &[f64; LANES])| Group {
            phi,
            square: phi.map(|phi| phi * phi),
            weight: weight.map(|weight| level * weight),
            earlier: std::array::from_fn(|q| level * weight[q] * phi[q]),
        };
        Self { groups: phi.into_iter().zip(weight).map(group).collect(), state, direct, slow: None }
    }

    /// Computes whole windows.
    ///
    /// # Safety
    /// The processor has the instructions of `Q`.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    unsafe fn advance<Q: Quad>(&mut self, samples: &mut [f64]) {
        // SAFETY: the contract of the loops is this function's.
        unsafe {
            match self.state.len() {
                1 => self.windows::<Q, 1>(samples),
                2 => self.windows::<Q, 2>(samples),
                _ => self.windows::<Q, 3>(samples),
            }
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

    /// Like [`Self::advance_avx2`], compiled for AVX-512, whose thirty-two registers hold all constants of the
    /// sections.
    ///
    /// # Safety
    /// The processor has AVX2, FMA and AVX-512F and VL.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
    unsafe fn advance_avx512(&mut self, samples: &mut [f64]) {
        // SAFETY: the contract of this function.
        unsafe { self.advance::<quad::Avx2>(samples) };
    }

    /// Like [`Self::advance`], on the given vector unit.
    fn advance_by(&mut self, width: Width, samples: &mut [f64]) {
        // SAFETY: a `Width` is only made of units that the processor has.
        unsafe {
            match width.unit() {
                Unit::Portable => self.advance::<quad::Portable>(samples),
                #[cfg(target_arch = "x86_64")]
                Unit::Avx2 => self.advance_avx2(samples),
                #[cfg(target_arch = "x86_64")]
                Unit::Avx512 => self.advance_avx512(samples),
            }
        }
    }

    /// Computes windows, and updates the slow sections after each.
    ///
    /// # Safety
    /// As [`Self::advance`].
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    unsafe fn windows<Q: Quad, const G: usize>(&mut self, samples: &mut [f64]) {
        debug_assert!(samples.len() % WINDOW == 0, "samples come in whole windows");
        for window in samples.chunks_exact_mut(WINDOW) {
            if let (Some(slow), Some(state)) = (&mut self.slow, self.state.last_mut()) {
                *state = slow.begin();
            }
            // SAFETY: this function's contract.
            unsafe { self.window::<Q, G>(window) };
            if let (Some(slow), Some(state)) = (&mut self.slow, self.state.last()) {
                slow.end(state);
            }
        }
    }

    /// Computes one window. The number of groups is a constant, so that all states stay in registers.
    ///
    /// # Safety
    /// As [`Self::advance`].
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    unsafe fn window<Q: Quad, const G: usize>(&mut self, samples: &mut [f64]) {
        // SAFETY: this function's contract.
        unsafe {
            let zero = Q::splat(0.0);
            let mut state = [zero; G];
            let (mut phi, mut square, mut weight, mut earlier) = (state, state, state, state);
            for g in 0..G {
                state[g] = Q::load(&self.state[g]);
                let group = &self.groups[g];
                (phi[g], square[g]) = (Q::load(&group.phi), Q::load(&group.square));
                (weight[g], earlier[g]) = (Q::load(&group.weight), Q::load(&group.earlier));
            }
            let [first, second] = self.direct;
            let direct = Q::load(&[first, second, first, second]);
            let (fours, rest) = samples.as_chunks_mut::<LANES>();
            debug_assert!(rest.is_empty(), "windows are whole steps");
            for four in fours {
                let mut sums = [zero; LANES];
                for pair in 0..2 {
                    let e = [Q::splat(four[2 * pair]), Q::splat(four[2 * pair + 1])];
                    for g in 0..G {
                        sums[2 * pair] = Q::fused(earlier[g], state[g], sums[2 * pair]);
                        state[g] = Q::fused(square[g], state[g], Q::fused(phi[g], e[0], e[1]));
                        sums[2 * pair + 1] = Q::fused(weight[g], state[g], sums[2 * pair + 1]);
                    }
                }
                Q::fused(direct, Q::load(four), Q::sums(sums)).store(four);
            }
            for (register, lanes) in state.into_iter().zip(&mut self.state) {
                register.store(lanes);
            }
        }
    }
}

impl Slow {
    /// The slow sections, and the φ and weights of the four sections that represent them.
    fn new(gaps: &[f64], weight: &[f64], state: &[f64]) -> (Self, [f64; LANES], [f64; LANES]) {
        let rates: Vec<_> = gaps.iter().map(|gap| -(-gap).ln_1p()).collect();
        let highest = rates.iter().copied().fold(0.0, f64::max);
        let nodes: [f64; LANES] =
            std::array::from_fn(|q| 0.5 * highest * (1.0 - (PI * (q as f64 + 0.5) / LANES as f64).cos()));
        let lagrange = |rate: f64, q: usize| -> f64 {
            let others = nodes.iter().enumerate().filter(|(other, _)| *other != q);
            others.map(|(_, node)| (rate - node) / (nodes[q] - node)).product()
        };
        let share: [Vec<f64>; LANES] =
            std::array::from_fn(|q| rates.iter().map(|rate| lagrange(*rate, q)).collect());
        let together: [f64; LANES] =
            std::array::from_fn(|q| share[q].iter().zip(weight).map(|(share, weight)| share * weight).sum());
        let project =
            (0..gaps.len()).map(|g| std::array::from_fn(|q| share[q][g] * weight[g] / together[q])).collect();
        let psi = nodes.map(|rate| (-rate).exp());
        let decay = gaps.iter().map(|gap| whole_window(1.0 - gap)).collect();
        let slow = Self {
            state: state.to_vec(),
            decay,
            project,
            share,
            fade: psi.map(whole_window),
            begun: [0.0; LANES],
        };
        (slow, psi, together)
    }

    /// States of the four representatives at the start of a window.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    fn begin(&mut self) -> [f64; LANES] {
        let mut sum = [0.0; LANES];
        for (state, project) in self.state.iter().zip(&self.project) {
            for q in 0..LANES {
                sum[q] = project[q].mul_add(*state, sum[q]);
            }
        }
        self.begun = sum;
        sum
    }

    /// Updates the slow sections from the states of the four representatives at the end of a window.
    #[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
    #[inline(always)]
    fn end(&mut self, state: &[f64; LANES]) {
        for (section, decay) in self.state.iter_mut().zip(&self.decay) {
            *section *= decay;
        }
        for (q, state) in state.iter().enumerate() {
            let driven = (-self.fade[q]).mul_add(self.begun[q], *state);
            for (section, share) in self.state.iter_mut().zip(&self.share[q]) {
                *section = share.mul_add(driven, *section);
            }
        }
    }
}

/// φ^WINDOW.
fn whole_window(phi: f64) -> f64 {
    (0..WINDOW.ilog2()).fold(phi, |power, _| power * power)
}

/// The values in groups of four; the last group is padded with zeros.
fn groups(values: &[f64]) -> Vec<[f64; LANES]> {
    let parts = values.chunks(LANES);
    parts.map(|part| std::array::from_fn(|q| part.get(q).copied().unwrap_or(0.0))).collect()
}

/// Random stationary states `s_j = Σ φ_j^l e_{−l}`, whose covariance is `1/(1−φ_i φ_j)`.
///
/// The Cholesky factor of this covariance is known: `L_jk = √(1−φ_k²)/(1−φ_j φ_k) Π_{i<k} (φ_j−φ_i)/(1−φ_j φ_i)`, the
/// Takenaka–Malmquist functions at `φ_j`, exact where a numerical factor of so ill-conditioned a matrix is not.
fn stationary(gaps: &[f64], start: &mut Stream) -> Vec<f64> {
    let mut normals = vec![0.0; gaps.len()];
    start.normals(&mut normals);
    let row = |j: usize| -> f64 {
        let a = gaps[j];
        // 1 − φ_j φ_i without cancellation.
        let one_minus = |b: f64| a + b - a * b;
        let mut product = 1.0;
        let mut sum = 0.0;
        for (k, &b) in gaps.iter().enumerate().take(j + 1) {
            sum += normals[k] * product * (b * (2.0 - b)).sqrt() / one_minus(b);
            product *= (b - a) / one_minus(b);
        }
        sum
    };
    (0..gaps.len()).map(row).collect()
}

impl Process for Sections {
    fn run(&mut self, samples: &mut [f64]) {
        self.advance_by(Width::best(), samples);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::StreamKey;

    const KEY: StreamKey = StreamKey { seed: 1, replicate: 0, effect: 0, axis: 0 };
    const LENGTHS: [usize; 6] = [1, 100, 10_000, 1_000_000, 100_000_000, 10_000_000_000];

    #[test]
    fn wide_equals_narrow() {
        for n in LENGTHS {
            let sections = || Sections::new(&PoleBank::new(0.5, n), 1.0, &mut Stream::new(KEY, 0));
            for width in Width::available() {
                let (mut wide, mut narrow) = (sections(), sections());
                for windows in 0..8 {
                    let mut x = vec![0.0; windows * WINDOW];
                    Stream::new(KEY, windows as u64).normals(&mut x);
                    let mut y = x.clone();
                    wide.advance_by(width, &mut x);
                    narrow.advance_by(Width::portable(), &mut y);
                    assert_eq!(x, y);
                }
            }
        }
    }

    #[test]
    fn four_exponentials_stand_for_all_slow_sections() {
        for n in LENGTHS {
            for d in [0.05, 0.25, 0.5, 0.75, 0.95] {
                let bank = PoleBank::new(d, n);
                let mut sections = Sections::new(&bank, 1.0, &mut Stream::new(KEY, 0));
                let mut state = stationary(&bank.gaps, &mut Stream::new(KEY, 0));
                let (mut worst, mut square) = (0.0_f64, 0.0);
                let blocks = 50_u64;
                for block in 1..=blocks {
                    let mut x = vec![0.0; 4096];
                    Stream::new(KEY, block).normals(&mut x);
                    let normals = x.clone();
                    sections.run(&mut x);
                    for (x, e) in x.iter().zip(normals) {
                        let mut y = bank.direct * e;
                        for ((state, gap), weight) in state.iter_mut().zip(&bank.gaps).zip(&bank.weights) {
                            *state += e - gap * *state;
                            y += weight * *state;
                        }
                        worst = worst.max((x - y).abs());
                        square += y * y;
                    }
                }
                let rms = (square / (4096 * blocks) as f64).sqrt();
                assert!(worst < 1e-5 * rms, "n {n} d {d}: {worst} of {rms}");
            }
        }
    }
}
