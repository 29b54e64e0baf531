//! First-order sections side by side, all driven by the same normals.
//!
//! The [`FAST`] fastest advance with every sample. The others hardly move within a window: there any of them is a sum of
//! the same four exponentials (interpolation in the rate of decay, at Chebyshev points), so that four sections stand
//! for all of them, and each is brought up to date at the end of the window.

use std::f64::consts::PI;

use super::bank::Ladder;
use super::{Process, WINDOW};
use crate::rng::Stream;

/// Sections side by side in a register.
pub(super) const LANES: usize = 4;
/// Sections that are never replaced.
const FAST: usize = 2 * LANES;

/// Sections s ← φ s + e; the sample is Σ w s + direct·e. They go two samples at a time, so as to wait for themselves
/// half as often: Σ w s of the first is Σ w φ s + (Σ w) e of the state before.
pub struct Sections {
    pub(super) groups: Vec<Group>,
    pub(super) state: Vec<[f64; LANES]>,
    /// Of a normal in the first sample and in the second.
    pub(super) direct: [f64; 2],
    slow: Option<Slow>,
}

/// The constants of some sections: φ, φ², w, w φ.
pub(super) struct Group {
    pub(super) phi: [f64; LANES],
    pub(super) square: [f64; LANES],
    pub(super) weight: [f64; LANES],
    pub(super) earlier: [f64; LANES],
}

/// What the last group of sections stands for.
struct Slow {
    state: Vec<f64>,
    /// φ^WINDOW of each section.
    decay: Vec<f64>,
    /// The state of each that goes into those that stand for it.
    project: Vec<[f64; LANES]>,
    /// Of each exponential in each section, so many together.
    share: [Vec<f64>; LANES],
    /// ψ^WINDOW of the exponentials, and their states when the window began.
    fade: [f64; LANES],
    begun: [f64; LANES],
}

impl Sections {
    /// In their stationary state.
    pub fn new(ladder: &Ladder, level: f64, start: &mut Stream) -> Self {
        let state = stationary(&ladder.gaps, start);
        let weight = &ladder.weights;
        let phi: Vec<_> = ladder.gaps.iter().map(|gap| 1.0 - gap).collect();
        let direct = ladder.direct;
        if phi.len() <= FAST + LANES {
            return Self::grouped(groups(&phi), &groups(weight), groups(&state), direct, level);
        }
        // Gaps rise: the slow ones come first.
        let split = phi.len() - FAST;
        let (slow, psi, together) = Slow::new(&ladder.gaps[..split], &weight[..split], &state[..split]);
        let with = |fast: &[f64], last: [f64; LANES]| {
            let mut all = groups(fast);
            all.push(last);
            all
        };
        let state = with(&state[split..], [0.0; LANES]);
        let weight = with(&weight[split..], together);
        Self { slow: Some(slow), ..Self::grouped(with(&phi[split..], psi), &weight, state, direct, level) }
    }

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

    /// One section after the other: what the wide path does, operation for operation.
    fn advance(&mut self, samples: &mut [f64]) {
        let (pairs, rest) = samples.as_chunks_mut::<2>();
        debug_assert!(rest.is_empty(), "windows are whole pairs");
        for pair in pairs {
            let e = *pair;
            let mut sums = [[0.0; LANES]; 2];
            for (group, state) in self.groups.iter().zip(&mut self.state) {
                for q in 0..LANES {
                    sums[0][q] = group.earlier[q].mul_add(state[q], sums[0][q]);
                    state[q] = group.square[q].mul_add(state[q], group.phi[q].mul_add(e[0], e[1]));
                    sums[1][q] = group.weight[q].mul_add(state[q], sums[1][q]);
                }
            }
            for ((x, [a, b, c, d]), direct) in pair.iter_mut().zip(sums).zip(self.direct) {
                *x = direct.mul_add(*x, (a + b) + (c + d));
            }
        }
    }

    fn narrow(&mut self, samples: &mut [f64]) {
        self.windows(samples, Self::advance);
    }

    /// Windows, with the slow sections brought up to date after each.
    #[expect(clippy::inline_always, reason = "compiled again inside `wide` with its registers")]
    #[inline(always)]
    pub(super) fn windows(&mut self, samples: &mut [f64], advance: impl Fn(&mut Self, &mut [f64])) {
        debug_assert!(samples.len() % WINDOW == 0, "samples come in whole windows");
        for window in samples.chunks_exact_mut(WINDOW) {
            if let (Some(slow), Some(state)) = (&mut self.slow, self.state.last_mut()) {
                *state = slow.begin();
            }
            advance(self, window);
            if let (Some(slow), Some(state)) = (&mut self.slow, self.state.last()) {
                slow.end(state);
            }
        }
    }
}

impl Slow {
    /// With φ and weights of the sections that stand for it.
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

    /// The states of the exponentials at the beginning of a window.
    #[expect(clippy::inline_always, reason = "compiled again inside `wide` with its registers")]
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

    /// Their states at its end.
    #[expect(clippy::inline_always, reason = "compiled again inside `wide` with its registers")]
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

fn groups(values: &[f64]) -> Vec<[f64; LANES]> {
    let parts = values.chunks(LANES);
    parts.map(|part| std::array::from_fn(|q| part.get(q).copied().unwrap_or(0.0))).collect()
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

impl Process for Sections {
    fn run(&mut self, samples: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if crate::rng::is_wide() {
            if std::arch::is_x86_feature_detected!("avx512vl") {
                // SAFETY: AVX2, FMA and AVX-512 have just been found on this machine.
                unsafe { super::wide::advance_512(self, samples) };
            } else {
                // SAFETY: `is_wide` has just found AVX2 and FMA on this machine.
                unsafe { super::wide::advance(self, samples) };
            }
            return;
        }
        self.narrow(samples);
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
            let sections = || Sections::new(&Ladder::new(0.5, n), 1.0, &mut Stream::new(KEY, 0));
            let (mut wide, mut narrow) = (sections(), sections());
            for windows in 0..8 {
                let mut x = vec![0.0; windows * WINDOW];
                Stream::new(KEY, windows as u64).normals(&mut x);
                let mut y = x.clone();
                wide.run(&mut x);
                narrow.narrow(&mut y);
                assert_eq!(x, y);
            }
        }
    }

    #[test]
    fn four_exponentials_stand_for_all_slow_sections() {
        for n in LENGTHS {
            for d in [0.05, 0.25, 0.5, 0.75, 0.95] {
                let ladder = Ladder::new(d, n);
                let mut sections = Sections::new(&ladder, 1.0, &mut Stream::new(KEY, 0));
                let mut state = stationary(&ladder.gaps, &mut Stream::new(KEY, 0));
                let (mut worst, mut square) = (0.0_f64, 0.0);
                let blocks = 50_u64;
                for block in 1..=blocks {
                    let mut x = vec![0.0; 4096];
                    Stream::new(KEY, block).normals(&mut x);
                    let normals = x.clone();
                    sections.run(&mut x);
                    for (x, e) in x.iter().zip(normals) {
                        let mut y = ladder.direct * e;
                        for ((state, gap), weight) in state.iter_mut().zip(&ladder.gaps).zip(&ladder.weights)
                        {
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
