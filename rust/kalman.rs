//! Kalman filter and fixed-interval smoother of a scalar series with missing samples.
//!
//! s(k+1) = F s(k) + w(k), y(k) = H s(k) + v(k), cov w = Q, var v = R, s(0) ~ (0, P0). Once the gain has settled it
//! is reused until a sample is missing. The smoother is the disturbance smoother (Koopman 1993; Durbin & Koopman 2012
//! §4.6). It stores one filter per segment and filters each segment a second time, so that it needs little more
//! memory than the series.

#[cfg(test)]
mod dense;
pub(crate) mod stamped;
mod system;

use std::sync::atomic::AtomicBool;

use crate::parallel::check;
use crate::{Error, Result};
pub(crate) use system::System;

/// Number of samples between two checks of the stop flag, and of a segment that the smoother filters again. The
/// smoother stores one filter per segment and two vectors per sample of one segment. Its memory is smallest near the
/// square root of the length, which is 4096 for 1.7e7 samples.
const SEGMENT: usize = 4096;
/// The gain has settled when its relative change per sample is below this value. Chosen by judgment; not measured.
const GAIN_TOLERANCE: f64 = 1e-12;

/// Prediction error of one sample (NaN if the sample is missing) and its variance.
#[derive(Debug, Clone, Copy)]
struct Innovation {
    value: f64,
    variance: f64,
}

/// State of the filter before a sample: mean and covariance of the predicted state.
#[derive(Debug, Clone)]
struct Filter<'a> {
    system: &'a System,
    mean: Vec<f64>,
    covariance: Vec<f64>,
    /// P H' at the last sample, and the gain P H'/(H P H' + R).
    spread: Vec<f64>,
    gain: Vec<f64>,
    variance: f64,
    settled: bool,
    /// True if the last sample was present. A gain that stays constant over missing samples has not settled.
    observed: bool,
    scratch: Vec<f64>,
}

impl<'a> Filter<'a> {
    /// Filter in the initial state of a system.
    fn new(system: &'a System) -> Self {
        let d = system.states();
        Self {
            system,
            mean: vec![0.0; d],
            covariance: system.initial().to_vec(),
            spread: vec![0.0; d],
            gain: vec![0.0; d],
            variance: 0.0,
            settled: false,
            observed: false,
            scratch: vec![0.0; d * d],
        }
    }

    /// Updates the state with one sample (NaN: missing) and predicts the state at the next sample.
    fn step(&mut self, sample: f64) -> Result<Innovation> {
        let missing = sample.is_nan();
        if missing {
            self.settled = false;
        }
        if !self.settled {
            self.system.spread(&self.covariance, &mut self.spread);
            let variance = self.system.observe(&self.spread) + self.system.noise();
            if !(variance > 0.0) {
                return Err(Error::Input(format!(
                    "the variance of an innovation is {variance}: the model has no noise"
                )));
            }
            let mut change: f64 = 0.0;
            for (gain, spread) in self.gain.iter_mut().zip(&self.spread) {
                let new = spread / variance;
                change = change.max((new - *gain).abs() / (new.abs() + f64::MIN_POSITIVE));
                *gain = new;
            }
            change = change.max((variance - self.variance).abs() / variance);
            self.variance = variance;
            self.settled = !missing && self.observed && change < GAIN_TOLERANCE;
            self.observed = !missing;
        }
        let value = sample - self.system.observe(&self.mean);
        if !missing {
            for (mean, gain) in self.mean.iter_mut().zip(&self.gain) {
                *mean += gain * value;
            }
        }
        self.system.advance(&mut self.mean, &mut self.scratch);
        if !self.settled {
            let weight = if missing { 0.0 } else { 1.0 / self.variance };
            self.system.propagate(&mut self.covariance, &self.spread, weight, &mut self.scratch);
        }
        Ok(Innovation { value, variance: self.variance })
    }
}

/// Innovations (prediction errors) of `samples` (NaN: missing) and their variances.
pub(crate) fn filter(system: &System, samples: &[f64], stop: &AtomicBool) -> Result<(Vec<f64>, Vec<f64>)> {
    let mut filter = Filter::new(system);
    let (mut values, mut variances) = (Vec::with_capacity(samples.len()), Vec::with_capacity(samples.len()));
    for segment in samples.chunks(SEGMENT) {
        check(stop)?;
        for &sample in segment {
            let found = filter.step(sample)?;
            values.push(found.value);
            variances.push(found.variance);
        }
    }
    Ok((values, variances))
}

/// Smoothed signal E(H s(k) | all samples) at every k, missing samples included.
pub(crate) fn smooth(system: &System, samples: &[f64], stop: &AtomicBool) -> Result<Vec<f64>> {
    let d = system.states();
    let mut filter = Filter::new(system);
    let mut starts = Vec::with_capacity(samples.len() / SEGMENT + 1);
    for segment in samples.chunks(SEGMENT) {
        check(stop)?;
        starts.push(filter.clone());
        for &sample in segment {
            filter.step(sample)?;
        }
    }
    let mut out = vec![0.0; samples.len()];
    let mut adjoint = vec![0.0; d];
    let mut adjoints = vec![0.0; SEGMENT * d];
    let mut gains = vec![0.0; SEGMENT * d];
    let mut found = Vec::with_capacity(SEGMENT);
    let mut scratch = vec![0.0; d];
    for (number, segment) in samples.chunks(SEGMENT).enumerate().rev() {
        check(stop)?;
        let mut filter = starts.pop().unwrap_or_else(|| Filter::new(system));
        let (mut state, covariance) = (filter.mean.clone(), filter.covariance.clone());
        found.clear();
        for (&sample, gain) in segment.iter().zip(gains.chunks_mut(d)) {
            found.push(filter.step(sample)?);
            gain.copy_from_slice(&filter.gain);
        }
        for k in (0..segment.len()).rev() {
            adjoints[k * d..(k + 1) * d].copy_from_slice(&adjoint);
            system.retreat(&mut adjoint, &mut scratch);
            if !found[k].value.is_nan() {
                let gain = &gains[k * d..(k + 1) * d];
                let seen: f64 = gain.iter().zip(&adjoint).map(|(g, u)| g * u).sum();
                system.add_observed(&mut adjoint, found[k].value / found[k].variance - seen);
            }
        }
        // Smoothed state at the first sample of the segment. The smoothed disturbances give the following states.
        for (i, row) in covariance.chunks(d).enumerate() {
            state[i] += row.iter().zip(&adjoint).map(|(p, r)| p * r).sum::<f64>();
        }
        let first = number * SEGMENT;
        for (k, value) in out[first..first + segment.len()].iter_mut().enumerate() {
            *value = system.observe(&state);
            system.advance(&mut state, &mut scratch);
            system.disturb(&mut state, &adjoints[k * d..(k + 1) * d]);
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn filter_and_smoother_equal_the_joint_distribution(
            f in prop::collection::vec(-0.6..0.6_f64, 9), g in prop::collection::vec(-1.0..1.0_f64, 9),
            h in prop::collection::vec(-1.0..1.0_f64, 3), d in 1_usize..4, diagonal in any::<bool>(), r in 0.1..2.0_f64,
            samples in prop::collection::vec(prop_oneof![4 => -3.0..3.0_f64, 1 => Just(f64::NAN)], 1..30)
        ) {
            let f = Mat::from_fn(d, d, |i, j| if i == j || !diagonal { f[3 * i + j] } else { 0.0 });
            let g = Mat::from_fn(d, d, |i, j| g[3 * i + j]);
            let q = &g * g.transpose();
            let p0 = Mat::from_fn(d, d, |i, j| if i == j { 1.0 + i as f64 } else { 0.0 });
            let flat = |m: &Mat<f64>| -> Vec<f64> {
                (0..d * d).map(|place| m[(place / d, place % d)]).collect()
            };
            let system = System::new(&flat(&f), &flat(&q), &h[..d], r, &flat(&p0)).unwrap();
            // cov(s_k, s_l) = F^(k−l) P_l for k ≥ l.
            let n = samples.len();
            let h = Mat::from_fn(1, d, |_, j| h[j]);
            let mut signal = Mat::<f64>::zeros(n, n);
            let mut p = p0;
            for l in 0..n {
                let mut across = p.clone();
                for k in l..n {
                    let value = (&h * &across * h.transpose())[(0, 0)];
                    (signal[(k, l)], signal[(l, k)]) = (value, value);
                    across = &f * &across;
                }
                p = &f * &p * f.transpose() + &q;
            }
            let (values, variances) = filter(&system, &samples, &never_stopped()).unwrap();
            // The gain is reused once it changes by less than 1e-12 a sample; the conditions of the matrices are below
            // 1e4.
            for (k, (value, variance)) in dense::innovations(&signal, r, &samples).into_iter().enumerate() {
                prop_assert!((variances[k] / variance - 1.0).abs() < 1e-8, "{k}: {} {variance}", variances[k]);
                prop_assert!(value.is_nan() || (values[k] - value).abs() < 1e-8, "{k}: {} {value}", values[k]);
            }
            let found = smooth(&system, &samples, &never_stopped()).unwrap();
            for (found, expected) in found.iter().zip(dense::smoothed(&signal, r, &samples)) {
                prop_assert!((found - expected).abs() < 1e-8, "{found} {expected}");
            }
        }
    }

    fn never_stopped() -> AtomicBool {
        AtomicBool::new(false)
    }

    #[test]
    fn local_level_settles_at_the_root_of_its_riccati_equation() {
        // P² − qP − qr = 0 for the predicted variance of a random walk in white noise.
        let (q, r) = (0.01, 2.0_f64);
        let system = System::new(&[1.0], &[q], &[1.0], r, &[1e6]).unwrap();
        let samples: Vec<f64> = (0..2000).map(|k| f64::from(k % 7)).collect();
        let (_, variances) = filter(&system, &samples, &never_stopped()).unwrap();
        let p = 0.5 * (q + (q * q + 4.0 * q * r).sqrt());
        assert!((variances[1999] / (p + r) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_line_through_two_samples() {
        // Without measurement noise the mean of a random walk between two samples lies on their straight line, also
        // across the ends of segments.
        let n = 2 * SEGMENT + 100;
        let mut samples = vec![f64::NAN; n];
        samples[0] = 1.0;
        samples[n - 1] = 3.0;
        let system = System::new(&[1.0], &[1.0], &[1.0], 0.0, &[1e4]).unwrap();
        let mean = smooth(&system, &samples, &never_stopped()).unwrap();
        for (k, value) in mean.iter().enumerate() {
            let line = 1.0 + 2.0 * k as f64 / (n - 1) as f64;
            assert!((value - line).abs() < 1e-9, "{k}: {value} {line}");
        }
    }

    #[test]
    fn a_model_without_noise_is_refused() {
        let system = System::new(&[1.0], &[0.0], &[1.0], 0.0, &[0.0]).unwrap();
        assert!(filter(&system, &[1.0], &never_stopped()).is_err());
    }
}
