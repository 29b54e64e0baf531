//! Ordinates of the cosine transform of a record.
//!
//! Spectra are computed from the orthonormal DCT-II of n samples, c_j = √(2/n) Σ x_k cos(πj(k+½)/n), j = 1…n−1,
//! instead of a tapered periodogram. For white noise and for a random walk the ordinates at f_j = j/(2nτ0) are
//! *exactly* uncorrelated with variance S(f_j). For all processes in between and for lags this holds almost exactly,
//! because the even extension has no jump and low frequencies do not leak. The frequency resolution is twice that of
//! a Fourier transform. No taper is needed, and omitting c_0 removes the mean.
//!
//! The transform takes one real FFT of length n (Makhoul 1980, IEEE TASSP 28, 27–34).

pub(crate) mod chirps;
pub(crate) mod courses;
mod fold;
pub(crate) mod halving;
pub(crate) mod lapped;
pub(crate) mod spans;

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;

use crate::machine::buffer_pool::{Buffer, zeroed};
use crate::parallel::check;
use crate::{Error, Result};

/// Maximum total length, in samples, of the cached plans of one direction. The tables of a plan take ten bytes per
/// sample. A record and its halves fit.
const MAX_CACHED_SAMPLES: usize = 3 << 23;
/// Maximum number of cached plans of one direction.
const MAX_CACHED_PLANS: usize = 16;

/// Cached plans of the most recent lengths. Planning a length with a large prime factor takes as long as twenty
/// transforms.
static FORWARD: Mutex<Vec<(usize, Arc<dyn RealToComplex<f64>>)>> = Mutex::new(Vec::new());
static INVERSE: Mutex<Vec<(usize, Arc<dyn ComplexToReal<f64>>)>> = Mutex::new(Vec::new());

/// The plan of length `n`, from the cache or new. If the cache is locked, a new plan is made: a forked process may
/// inherit a locked cache whose owner does not exist in it.
fn planned<T: ?Sized>(
    cache: &Mutex<Vec<(usize, Arc<T>)>>,
    n: usize,
    make: impl FnOnce(&mut RealFftPlanner<f64>) -> Arc<T>,
) -> Arc<T> {
    if let Ok(mut plans) = cache.try_lock()
        && let Some(at) = plans.iter().position(|(length, _)| *length == n)
    {
        let found = plans.remove(at);
        let plan = Arc::clone(&found.1);
        plans.push(found);
        return plan;
    }
    let plan = make(&mut RealFftPlanner::<f64>::new());
    if n <= MAX_CACHED_SAMPLES
        && let Ok(mut plans) = cache.try_lock()
    {
        plans.push((n, Arc::clone(&plan)));
        let mut all: usize = plans.iter().map(|(length, _)| length).sum();
        while all > MAX_CACHED_SAMPLES || plans.len() > MAX_CACHED_PLANS {
            all -= plans.remove(0).0;
        }
    }
    plan
}

/// Cached plan of the Fourier transform of n real samples.
fn forward(n: usize) -> Arc<dyn RealToComplex<f64>> {
    planned(&FORWARD, n, |planner| planner.plan_fft_forward(n))
}

/// Cached plan of the inverse transform.
fn inverse(n: usize) -> Arc<dyn ComplexToReal<f64>> {
    planned(&INVERSE, n, |planner| planner.plan_fft_inverse(n))
}

/// Frees all cached plans.
pub(crate) fn release() {
    if let Ok(mut plans) = FORWARD.try_lock() {
        plans.clear();
    }
    if let Ok(mut plans) = INVERSE.try_lock() {
        plans.clear();
    }
}

/// Block length of the rotation factors: e^{−iπj/2n} is the factor of the first j of the block times one of `TURNS`
/// shared factors.
const TURNS: usize = 1 << 10;

/// Rotation factors e^{−iπj/2n}, block by block, accurate to two roundings.
struct HalfTurns {
    step: f64,
    within: Vec<(f64, f64)>,
}

impl HalfTurns {
    /// Rotation factors for records of `n` samples.
    fn new(n: usize) -> Self {
        let step = PI / (2.0 * n as f64);
        let within = (0..TURNS.min(n)).map(|k| Self::at(step * k as f64)).collect();
        Self { step, within }
    }

    /// Real and imaginary part of e^{−i·angle}.
    fn at(angle: f64) -> (f64, f64) {
        let (sin, cos) = angle.sin_cos();
        (cos, -sin)
    }

    /// Rotation factors (real and imaginary part) of one block of ordinates from `first` on.
    fn from(&self, first: usize) -> impl Iterator<Item = (f64, f64)> {
        let (re, im) = Self::at(self.step * first as f64);
        self.within.iter().map(move |&(c, s)| (re * c - im * s, re * s + im * c))
    }
}

/// The doubles as complex numbers.
fn complex(doubles: &mut [f64]) -> &mut [Complex<f64>] {
    let len = doubles.len() / 2;
    // SAFETY: a complex number consists of two doubles, real and imaginary part (`repr(C)`), with the same alignment.
    // The slice ends within the doubles and borrows them.
    unsafe { std::slice::from_raw_parts_mut(doubles.as_mut_ptr().cast(), len) }
}

/// Output of a Fourier transform, `len` doubles, computed with a work array of `scratch` complex numbers.
fn transformed<T, E: std::fmt::Display>(
    len: usize,
    scratch: usize,
    transform: impl FnOnce(&mut [f64], &mut [Complex<f64>]) -> std::result::Result<T, E>,
) -> Result<Buffer> {
    let (output, _) = Buffer::written(len, |output| {
        Buffer::written(2 * scratch, |scratch| {
            // SAFETY: `realfft` writes the whole output and each used part of the work array before it reads it.
            let (output, scratch) = unsafe { (output.overwritten(), scratch.overwritten()) };
            transform(output, complex(scratch))
                .map_err(|error| Error::Input(format!("a Fourier transform of {len} numbers: {error}")))
        })
    })?;
    Ok(output)
}

/// Fourier transform of real samples, n/2 + 1 complex numbers as doubles; overwrites the samples.
fn spectrum_of(samples: &mut [f64], stop: &AtomicBool) -> Result<Buffer> {
    let n = samples.len();
    let fft = forward(n);
    check(stop)?;
    let spectrum = transformed(2 * (n / 2 + 1), fft.get_scratch_len(), |spectrum, scratch| {
        fft.process_with_scratch(samples, complex(spectrum), scratch)
    })?;
    check(stop)?;
    Ok(spectrum)
}

/// Sum of the values minus `origin`.
fn sum_from(origin: f64, values: &[f64]) -> f64 {
    let mut parts = [0.0; 8];
    let (whole, rest) = values.as_chunks::<8>();
    for chunk in whole {
        for (part, x) in parts.iter_mut().zip(chunk) {
            *part += x - origin;
        }
    }
    parts.iter().sum::<f64>() + rest.iter().map(|x| x - origin).sum::<f64>()
}

/// Orthonormal DCT-II with c_0 set to zero. The mean is subtracted first, so that an offset does not cost digits.
pub(crate) fn cosine_transform(samples: &[f64], stop: &AtomicBool) -> Result<Vec<f64>> {
    let n = samples.len();
    if n < 2 {
        return Err(Error::TooShort(format!("a spectrum needs at least 2 samples, found {n}")));
    }
    let origin = samples[0];
    let mean = sum_from(origin, samples) / n as f64;
    let mut folded = zeroed(n);
    let (even, odd) = folded.split_at_mut(n.div_ceil(2));
    let (pairs, last) = samples.as_chunks::<2>();
    for (([x, y], up), down) in pairs.iter().zip(even.iter_mut()).zip(odd.iter_mut().rev()) {
        *up = (x - origin) - mean;
        *down = (y - origin) - mean;
    }
    if let ([x], Some(up)) = (last, even.last_mut()) {
        *up = (x - origin) - mean;
    }
    let mut spectrum = spectrum_of(&mut folded, stop)?;
    let turns = HalfTurns::new(n);
    let scale = (2.0 / n as f64).sqrt();
    let mut ordinates = folded;
    for (block, values) in complex(&mut spectrum).chunks(TURNS).enumerate() {
        let first = block * TURNS;
        for ((j, value), (cos, sin)) in (first..).zip(values).zip(turns.from(first)) {
            if j > 0 {
                ordinates[j] = scale * (value.re * cos - value.im * sin);
                ordinates[n - j] = -scale * (value.re * sin + value.im * cos);
            }
        }
    }
    ordinates[0] = 0.0;
    Ok(ordinates)
}

/// Inverse of [`cosine_transform`] up to the mean: samples with these ordinates and mean zero.
pub(crate) fn inverse_cosine_transform(ordinates: &[f64], stop: &AtomicBool) -> Result<Vec<f64>> {
    let n = ordinates.len();
    if n < 2 {
        return Err(Error::TooShort(format!("a spectrum needs at least 2 ordinates, found {n}")));
    }
    let turns = HalfTurns::new(n);
    let scale = (n as f64 / 2.0).sqrt();
    let (mut spectrum, ()) = Buffer::written(2 * (n / 2 + 1), |spectrum| {
        for (block, values) in spectrum.chunks(2 * TURNS).enumerate() {
            let first = block * TURNS;
            for ((j, value), (cos, sin)) in (first..).zip(complex(values.zeroed())).zip(turns.from(first)) {
                // (re, im)·e^{−iπj/2n} = a + ib, undone by the conjugate turn.
                let (a, b) =
                    if j == 0 { (0.0, 0.0) } else { (scale * ordinates[j], -scale * ordinates[n - j]) };
                *value = Complex::new(a * cos + b * sin, b * cos - a * sin);
            }
        }
        Ok(())
    })?;
    // The middle ordinate of an even length is real.
    if n.is_multiple_of(2) {
        spectrum[n + 1] = 0.0;
    }
    let fft = inverse(n);
    check(stop)?;
    let folded = transformed(n, fft.get_scratch_len(), |folded, scratch| {
        fft.process_with_scratch(complex(&mut spectrum), folded, scratch)
    })?;
    let mut samples = zeroed(n);
    let scale = 1.0 / n as f64;
    let (even, odd) = folded.split_at(n.div_ceil(2));
    let (pairs, last) = samples.as_chunks_mut::<2>();
    for (([x, y], up), down) in pairs.iter_mut().zip(even).zip(odd.iter().rev()) {
        *x = up * scale;
        *y = down * scale;
    }
    if let ([x], Some(up)) = (last, even.last()) {
        *x = up * scale;
    }
    Ok(samples)
}

/// |Σ z_k e^{−2πi f k}|²/n at f = j/2n, j = 0…n: the periodogram on a grid twice as fine as the natural
/// one, so that a line between two grid points loses at most 10 % of its power.
pub(crate) fn padded_periodogram(samples: &[f64], stop: &AtomicBool) -> Result<Vec<f64>> {
    let n = samples.len();
    let (mut padded, ()) = Buffer::written(2 * n, |padded| {
        let (own, zeros) = padded.split_at(n);
        own.copy_from(samples);
        zeros.zeroed();
        Ok(())
    })?;
    let mut spectrum = spectrum_of(&mut padded, stop)?;
    drop(padded);
    let mut power = zeroed(n + 1);
    for (found, value) in power.iter_mut().zip(&*complex(&mut spectrum)) {
        *found = value.norm_sqr() / n as f64;
    }
    Ok(power)
}

/// Sum of squares of the ordinates edges[b] … edges[b+1]−1 of each bin b.
pub(crate) fn squares(ordinates: &[f64], edges: &[i64]) -> Result<Vec<f64>> {
    edges
        .windows(2)
        .map(|ends| {
            let own = usize::try_from(ends[0])
                .ok()
                .zip(usize::try_from(ends[1]).ok())
                .and_then(|(first, last)| ordinates.get(first..last));
            let Some(own) = own else {
                return Err(Error::Input(format!(
                    "bins: {} … {} is none of {} ordinates",
                    ends[0],
                    ends[1],
                    ordinates.len()
                )));
            };
            let mut parts = [0.0; 16];
            let (whole, rest) = own.as_chunks::<16>();
            for chunk in whole {
                for (part, c) in parts.iter_mut().zip(chunk) {
                    *part += c * c;
                }
            }
            Ok(parts.iter().sum::<f64>() + rest.iter().map(|c| c * c).sum::<f64>())
        })
        .collect()
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
        fn periodogram_equals_its_definition(samples in prop::collection::vec(-1e3_f64..1e3, 1..100)) {
            let n = samples.len();
            let found = padded_periodogram(&samples, &AtomicBool::new(false)).unwrap();
            prop_assert_eq!(found.len(), n + 1);
            for (j, found) in found.iter().enumerate() {
                let turn = |(k, x): (usize, &f64)| Complex::from_polar(*x, -PI * (j * k) as f64 / n as f64);
                let expected = samples.iter().enumerate().map(turn).sum::<Complex<f64>>().norm_sqr() / n as f64;
                // 100 terms of 1e3, rounding 1e-16 each, in amplitudes of up to 1e5 over √n.
                prop_assert!((found - expected).abs() < 1e-6, "{j}: {found} {expected}");
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

        #[test]
        fn squares_of_bins_are_those_of_their_ordinates(
            ordinates in prop::collection::vec(-1e3_f64..1e3, 1..200),
            cuts in prop::collection::vec(0_usize..200, 2..9),
        ) {
            let mut edges: Vec<i64> = cuts.iter().map(|&c| c.min(ordinates.len()) as i64).collect();
            edges.sort_unstable();
            let fast = squares(&ordinates, &edges).unwrap();
            for (found, ends) in fast.iter().zip(edges.windows(2)) {
                let own: f64 = ordinates[ends[0] as usize..ends[1] as usize].iter().map(|c| c * c).sum();
                // 200 squares of 1e6, rounding 1e-16 each.
                prop_assert!((found - own).abs() <= 1e-13 * own);
            }
        }
    }

    #[test]
    fn turns_are_right_in_every_block() {
        let n = 5 * TURNS + 7;
        let turns = HalfTurns::new(n);
        for first in (0..n).step_by(TURNS) {
            for (j, (cos, sin)) in (first..n).zip(turns.from(first)) {
                let angle = PI / (2.0 * n as f64) * j as f64;
                // Two roundings of each part, whose magnitude is at most one.
                assert!((cos - angle.cos()).abs() < 4e-16 && (sin + angle.sin()).abs() < 4e-16);
            }
        }
    }

    #[test]
    fn bins_beyond_the_ordinates_are_refused() {
        assert!(squares(&[1.0, 2.0], &[0, 3]).is_err());
        assert!(squares(&[1.0, 2.0], &[-1, 2]).is_err());
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
