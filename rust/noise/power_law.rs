//! Noise whose spectrum is any power of frequency: white noise through a ladder of first-order sections.

use super::Process;
use super::bank::Ladder;
use super::simple::{RandomWalk, White};
use crate::rng::Stream;
use crate::{Error, Result};

/// Samples advanced at a time.
const STEP: usize = 8;
/// Sections advanced at a time.
const GROUP: usize = 4;

/// Spectrum level² (2 sin(w/2))^exponent for an exponent in (−3, 1], for records of `n` samples.
pub fn new(exponent: f64, level: f64, n: usize, start: &mut Stream) -> Result<Box<dyn Process>> {
    if !(exponent > -3.0 && exponent <= 1.0) {
        return Err(Error::Input(format!("noise process power_law: exponent {exponent} is outside (-3, 1]")));
    }
    let d = -0.5 * exponent;
    #[expect(clippy::float_cmp, reason = "only the exact whole orders have no ladder")]
    if d == 1.0 {
        return Ok(Box::new(RandomWalk::new(level)));
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

/// A ladder that advances eight samples at a time. For section φ the state is z = Σ_{l≥1} φ^l e_{k−l}.
pub struct Bank {
    /// w φ^i of four sections: how their states reach sample i of a step.
    readout: Vec<[[f64; STEP]; GROUP]>,
    /// φ^(8−i): how the normal of sample i reaches the next states.
    drive: Vec<[[f64; GROUP]; STEP]>,
    /// φ⁸.
    decay: Vec<[f64; GROUP]>,
    state: Vec<[f64; GROUP]>,
    /// Response of the whole ladder to an impulse.
    impulse: [f64; STEP],
}

impl Bank {
    fn new(ladder: &Ladder, level: f64, start: &mut Stream) -> Self {
        let count = ladder.gaps.len();
        let initial = stationary(&ladder.gaps, start);
        let groups = count.div_ceil(GROUP);
        let mut this = Self {
            readout: vec![[[0.0; STEP]; GROUP]; groups],
            drive: vec![[[0.0; GROUP]; STEP]; groups],
            decay: vec![[0.0; GROUP]; groups],
            state: vec![[0.0; GROUP]; groups],
            impulse: [0.0; STEP],
        };
        for (j, (gap, weight)) in ladder.gaps.iter().zip(&ladder.weights).enumerate() {
            let (group, place) = (j / GROUP, j % GROUP);
            let power = |i: usize| (i as f64 * (-gap).ln_1p()).exp();
            for i in 0..STEP {
                this.readout[group][place][i] = level * weight * power(i);
                this.drive[group][i][place] = power(STEP - i);
                this.impulse[i] += level * weight * power(i);
            }
            this.decay[group][place] = power(STEP);
            this.state[group][place] = (1.0 - gap) * initial[j];
        }
        this.impulse[0] += level * ladder.direct;
        this
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
    fn run(&mut self, samples: &mut [f64]) {
        #[cfg(target_arch = "x86_64")]
        if crate::rng::wide() {
            // SAFETY: `wide` has just found AVX2 and FMA on this machine.
            unsafe { advance_wide(self, samples) };
            return;
        }
        advance(self, samples);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn advance_wide(bank: &mut Bank, samples: &mut [f64]) {
    advance(bank, samples);
}

#[expect(clippy::inline_always, reason = "compiled again inside the caller with its wider registers")]
#[inline(always)]
fn advance(bank: &mut Bank, samples: &mut [f64]) {
    let (steps, rest) = samples.as_chunks_mut::<STEP>();
    debug_assert!(rest.is_empty(), "blocks are whole steps");
    for step in steps {
        let e = *step;
        let mut sums = [[0.0; STEP]; GROUP];
        for ((readout, drive), (decay, state)) in
            bank.readout.iter().zip(&bank.drive).zip(bank.decay.iter().zip(&mut bank.state))
        {
            let before = *state;
            for q in 0..GROUP {
                for i in 0..STEP {
                    sums[q][i] = readout[q][i].mul_add(before[q], sums[q][i]);
                }
            }
            let mut driven = [0.0; GROUP];
            for i in 0..STEP {
                for q in 0..GROUP {
                    driven[q] = drive[i][q].mul_add(e[i], driven[q]);
                }
            }
            for q in 0..GROUP {
                state[q] = decay[q].mul_add(before[q], driven[q]);
            }
        }
        let mut y = [0.0; STEP];
        for i in 0..STEP {
            y[i] = (sums[0][i] + sums[1][i]) + (sums[2][i] + sums[3][i]);
        }
        for (l, normal) in e.iter().enumerate() {
            for (sum, response) in y[l..].iter_mut().zip(&bank.impulse) {
                *sum = response.mul_add(*normal, *sum);
            }
        }
        *step = y;
    }
}

/// Running sum of a process, from zero.
struct Summed {
    inner: Bank,
    sum: f64,
}

impl Process for Summed {
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
        let mut before = [0.0; STEP];
        start.normals(&mut before);
        inner.run(&mut before);
        Self { inner, last: before[STEP - 1] }
    }
}

impl Process for Differenced {
    fn run(&mut self, samples: &mut [f64]) {
        self.inner.run(samples);
        for x in samples {
            let new = *x;
            *x = new - self.last;
            self.last = new;
        }
    }
}
