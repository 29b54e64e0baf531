//! Cosine-transform ordinates of a record.
//!
//! The orthonormal DCT-II of n samples, c_j = √(2/n) Σ x_k cos(πj(k+½)/n), j = 1…n−1, stands where other
//! programs have a tapered periodogram. Its ordinates at f_j = j/(2nτ0) are *exactly* uncorrelated with
//! variance S(f_j) for white noise and for a random walk, and nearly so for everything between and for
//! lags (the even extension has no jump, so nothing leaks from the slow end), at twice the frequency
//! resolution of a Fourier transform, with no taper and with the mean removed by leaving out c_0.
//!
//! One real FFT of length n (Makhoul 1980, IEEE TASSP 28, 27–34) does it.

mod fold;
pub mod halving;
pub mod lapped;
pub mod spans;

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use crate::{Error, Result};

fn check(stop: &AtomicBool) -> Result<()> {
    if stop.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
}

/// Longest transform whose plan is kept: tables of this length are 32 MiB.
const KEPT: usize = 1 << 21;
/// Plans kept at once; a record and its halves need no more.
const PLANS: usize = 4;

/// Plans of the last lengths. A length with a large prime factor costs twenty transforms to plan.
static FORWARD: Mutex<Vec<(usize, Arc<dyn RealToComplex<f64>>)>> = Mutex::new(Vec::new());
static INVERSE: Mutex<Vec<(usize, Arc<dyn ComplexToReal<f64>>)>> = Mutex::new(Vec::new());

/// The plan of length `n`, made where it is not kept. A fork may inherit a locked list whose owner does not exist in
/// the child: where the list is in use the plan is made anew.
fn planned<T: ?Sized>(
    kept: &Mutex<Vec<(usize, Arc<T>)>>,
    n: usize,
    make: impl FnOnce(&mut RealFftPlanner<f64>) -> Arc<T>,
) -> Arc<T> {
    if let Ok(mut plans) = kept.try_lock()
        && let Some(at) = plans.iter().position(|(length, _)| *length == n)
    {
        let found = plans.remove(at);
        let plan = Arc::clone(&found.1);
        plans.push(found);
        return plan;
    }
    let plan = make(&mut RealFftPlanner::<f64>::new());
    if n <= KEPT
        && let Ok(mut plans) = kept.try_lock()
    {
        if plans.len() == PLANS {
            plans.remove(0);
        }
        plans.push((n, Arc::clone(&plan)));
    }
    plan
}

fn forward(n: usize) -> Arc<dyn RealToComplex<f64>> {
    planned(&FORWARD, n, |planner| planner.plan_fft_forward(n))
}

fn inverse(n: usize) -> Arc<dyn ComplexToReal<f64>> {
    planned(&INVERSE, n, |planner| planner.plan_fft_inverse(n))
}

/// Gives the plans back.
pub fn release() {
    if let Ok(mut plans) = FORWARD.try_lock() {
        plans.clear();
    }
    if let Ok(mut plans) = INVERSE.try_lock() {
        plans.clear();
    }
}

/// e^{−iπj/2n} for j = 0…len−1, exact to rounding at every j.
fn half_turns(n: usize) -> impl Fn(usize) -> (f64, f64) {
    let step = PI / (2.0 * n as f64);
    move |j| {
        let (sin, cos) = (step * j as f64).sin_cos();
        (cos, -sin)
    }
}

/// Orthonormal DCT-II with c_0 set to zero. The mean is subtracted first, so that an offset costs no digits.
pub fn cosine_transform(samples: &[f64], stop: &AtomicBool) -> Result<Vec<f64>> {
    let n = samples.len();
    if n < 2 {
        return Err(Error::TooShort(format!("a spectrum needs at least 2 samples, found {n}")));
    }
    let origin = samples[0];
    let mean = samples.iter().map(|x| x - origin).sum::<f64>() / n as f64;
    let mut folded = vec![0.0; n];
    for (k, &x) in samples.iter().enumerate() {
        let place = if k % 2 == 0 { k / 2 } else { n - 1 - k / 2 };
        folded[place] = (x - origin) - mean;
    }
    check(stop)?;
    let fft = forward(n);
    let mut spectrum = fft.make_output_vec();
    fft.process(&mut folded, &mut spectrum)
        .map_err(|error| Error::Input(format!("transform of {n} samples: {error}")))?;
    check(stop)?;
    let turn = half_turns(n);
    let scale = (2.0 / n as f64).sqrt();
    let mut ordinates = folded;
    ordinates[0] = 0.0;
    for (j, value) in spectrum.iter().enumerate().skip(1) {
        let (cos, sin) = turn(j);
        ordinates[j] = scale * (value.re * cos - value.im * sin);
        ordinates[n - j] = -scale * (value.re * sin + value.im * cos);
    }
    Ok(ordinates)
}

/// The inverse of [`cosine_transform`] up to the mean: samples with the given ordinates and mean zero.
pub fn inverse_cosine_transform(ordinates: &[f64], stop: &AtomicBool) -> Result<Vec<f64>> {
    let n = ordinates.len();
    if n < 2 {
        return Err(Error::TooShort(format!("a spectrum needs at least 2 ordinates, found {n}")));
    }
    let fft = inverse(n);
    let mut spectrum = fft.make_input_vec();
    let turn = half_turns(n);
    let scale = (n as f64 / 2.0).sqrt();
    for (j, value) in spectrum.iter_mut().enumerate().skip(1) {
        let (cos, sin) = turn(j);
        let (a, b) = (scale * ordinates[j], -scale * ordinates[n - j]);
        // (re, im)·e^{−iπj/2n} = a + ib, undone by the conjugate turn.
        value.re = a * cos + b * sin;
        value.im = b * cos - a * sin;
    }
    // The middle ordinate of an even length is real.
    if n.is_multiple_of(2) {
        spectrum[n / 2].im = 0.0;
    }
    check(stop)?;
    let mut folded = vec![0.0; n];
    fft.process(&mut spectrum, &mut folded)
        .map_err(|error| Error::Input(format!("inverse transform of {n} ordinates: {error}")))?;
    drop(spectrum);
    let mut samples = vec![0.0; n];
    for (k, x) in samples.iter_mut().enumerate() {
        let place = if k % 2 == 0 { k / 2 } else { n - 1 - k / 2 };
        *x = folded[place] / n as f64;
    }
    Ok(samples)
}

/// |Σ z_k e^{−2πi f k}|²/n at f = j/2n, j = 0…n: the periodogram on a grid twice as fine as the natural
/// one, so that a line between two grid points loses at most 10 % of its power.
pub fn padded_periodogram(samples: &[f64], stop: &AtomicBool) -> Result<Vec<f64>> {
    let n = samples.len();
    let mut padded = vec![0.0; 2 * n];
    padded[..n].copy_from_slice(samples);
    let fft = forward(2 * n);
    let mut spectrum = fft.make_output_vec();
    check(stop)?;
    fft.process(&mut padded, &mut spectrum)
        .map_err(|error| Error::Input(format!("transform of {} samples: {error}", 2 * n)))?;
    drop(padded);
    check(stop)?;
    Ok(spectrum.iter().map(|value| value.norm_sqr() / n as f64).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn naive(samples: &[f64]) -> Vec<f64> {
        let n = samples.len() as f64;
        (0..samples.len())
            .map(|j| {
                let sum: f64 = samples
                    .iter()
                    .enumerate()
                    .map(|(k, x)| x * (PI * j as f64 * (k as f64 + 0.5) / n).cos())
                    .sum();
                if j == 0 { 0.0 } else { (2.0 / n).sqrt() * sum }
            })
            .collect()
    }

    proptest! {
        #[test]
        fn transform_equals_its_definition(samples in prop::collection::vec(-1e3_f64..1e3, 2..200)) {
            let fast = cosine_transform(&samples, &AtomicBool::new(false)).unwrap();
            // 200 terms of 1e3, rounding 1e-16 each, twice over: 1e-10 is a hundred times that.
            for (a, b) in fast.iter().zip(naive(&samples)) {
                prop_assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
        }

        #[test]
        fn inverse_returns_the_samples_without_mean(samples in prop::collection::vec(-1e3_f64..1e3, 2..200)) {
            let stop = AtomicBool::new(false);
            let back = inverse_cosine_transform(&cosine_transform(&samples, &stop).unwrap(), &stop).unwrap();
            let mean = samples.iter().sum::<f64>() / samples.len() as f64;
            for (a, b) in back.iter().zip(&samples) {
                prop_assert!((a - (b - mean)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn periodogram_of_white_noise_keeps_the_energy() {
        let samples: Vec<f64> = (0..64_u32).map(|k| f64::from(k.wrapping_mul(2_654_435_761) % 97)).collect();
        let power = padded_periodogram(&samples, &AtomicBool::new(false)).unwrap();
        let energy: f64 = samples.iter().map(|x| x * x).sum();
        let ends = power[0] + power[64];
        let total = (ends + 2.0 * power[1..64].iter().sum::<f64>()) / 2.0;
        assert!((total / energy - 1.0).abs() < 1e-12);
    }
}
