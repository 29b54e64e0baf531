//! Innovations and smoothed values from the joint covariance of all samples: the definition, as a reference for tests.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

/// Mean and variance of signal k given the samples at `given`. The signal has this covariance; the samples are the
/// signal plus white noise of variance `white`.
fn conditional(covariance: &Mat<f64>, white: f64, samples: &[f64], given: &[usize], k: usize) -> (f64, f64) {
    let size = given.len();
    let gram =
        Mat::from_fn(size, size, |a, b| covariance[(given[a], given[b])] + if a == b { white } else { 0.0 });
    let right =
        Mat::from_fn(size, 2, |a, b| if b == 0 { samples[given[a]] } else { covariance[(given[a], k)] });
    let solved = gram.llt(Side::Lower).unwrap().solve(&right);
    let explained = |column: usize| -> f64 {
        given.iter().enumerate().map(|(a, &i)| covariance[(k, i)] * solved[(a, column)]).sum()
    };
    (explained(0), covariance[(k, k)] - explained(1))
}

/// Prediction errors of the samples and their variances; NaN samples are missing.
pub(super) fn innovations(covariance: &Mat<f64>, white: f64, samples: &[f64]) -> Vec<(f64, f64)> {
    let at = |k: usize| {
        let before: Vec<usize> = (0..k).filter(|&i| !samples[i].is_nan()).collect();
        let (mean, variance) = conditional(covariance, white, samples, &before, k);
        (samples[k] - mean, variance + white)
    };
    (0..samples.len()).map(at).collect()
}

/// Expectation of the signal given all samples; NaN samples are missing.
pub(super) fn smoothed(covariance: &Mat<f64>, white: f64, samples: &[f64]) -> Vec<f64> {
    let present: Vec<usize> = (0..samples.len()).filter(|&i| !samples[i].is_nan()).collect();
    (0..samples.len()).map(|k| conditional(covariance, white, samples, &present, k).0).collect()
}
