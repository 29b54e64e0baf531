//! Covariance of the total variance: second differences about every inner point of the record reflected at its ends.
//!
//! NIST SP 1065 eq. 25. The reflection is odd about the first and the last point. So a difference is a sum over up to
//! five points of the record, and a straight line does not change it. Its covariance with another difference follows
//! from the generalized covariance of the phase, but depends on both positions. Sums over centers are replaced by
//! means over evenly chosen centers, which hardly changes the result at long averaging times. If the record is longer
//! than `MAX_REFLECTED_LENGTH` averaging times, reflection affects only its two ends, and the variance of the overlapping Allan
//! estimate is used.

use std::sync::atomic::AtomicBool;

use faer::{Mat, Side};
use rayon::prelude::*;

use super::process::{Kind, Process};
use super::term::{Term, without_white_phase};
use super::{distribution, plain};
use crate::parallel::{check, pooled};
use crate::{Error, Result};

/// Records longer than this many averaging times are treated like the overlapping Allan variance. Chosen by judgment;
/// not measured.
const MAX_REFLECTED_LENGTH: usize = 50;
/// Number of centers for the variance at one factor. Chosen by judgment; not measured.
const CENTERS: usize = 400;
/// Number of centers for the covariance between two factors. Chosen by judgment; not measured.
const CENTERS_OF_PAIRS: usize = 128;

/// A difference as a list of points and weights.
type Points = Vec<(f64, f64)>;

/// Reflected differences of one factor about at most `most` evenly chosen centers.
fn differences(n: usize, m: usize, most: usize) -> Vec<Points> {
    let count = n - 1;
    let size = most.min(count);
    (0..size)
        .map(|c| {
            let k = 1 + ((2 * c + 1) * count / (2 * size)).min(count - 1);
            let mut points = vec![(k as f64, -2.0)];
            let mut side = |inside: bool, end: f64, at: f64| {
                if inside {
                    points.push((at, 1.0));
                } else {
                    points.push((end, 2.0));
                    points.push((2.0 * end - at, -1.0));
                }
            };
            let (k, m, last) = (k as f64, m as f64, n as f64);
            side(k >= m, 0.0, k - m);
            side(k + m <= last, last, k + m);
            points
        })
        .collect()
}

impl Process {
    /// Generalized covariance of the phase at distance `h`, up to even powers below the fourth.
    fn phase(&self, h: f64, n: usize) -> f64 {
        let plain: f64 = self.powers.iter().map(|p| p.at(h)).sum();
        let waves = self.exponentials.iter().map(|e| e.at(h, e.lambda().norm() * (n as f64) < 1.0).re);
        plain + waves.sum::<f64>()
    }

    /// Covariance of the two differences `a` and `b` of a record of `n` samples.
    fn between(&self, a: &Points, b: &Points, n: usize) -> f64 {
        a.iter().flat_map(|(p, u)| b.iter().map(move |(q, v)| u * v * self.phase(p - q, n))).sum()
    }
}

/// Error if a factor is too long for the record.
fn require_differences(n: usize, factors: &[usize]) -> Result<()> {
    match factors.iter().find(|m| **m == 0 || **m + 1 > n) {
        Some(m) => Err(Error::TooShort(format!(
            "factor {m} of {n} samples has no total difference: use factors from 1 to {}",
            n.saturating_sub(1)
        ))),
        None => Ok(()),
    }
}

/// Expectation of the estimate, including its bias.
fn expected(process: &Process, n: usize, m: usize) -> f64 {
    let centers = differences(n, m, CENTERS);
    let sum: f64 = centers.iter().map(|p| process.between(p, p, n)).sum();
    sum / (centers.len() as f64 * Kind::Total.scale(m))
}

/// True if reflection matters: the record holds at most `MAX_REFLECTED_LENGTH` averaging times.
fn reflection_matters(n: usize, m: usize) -> bool {
    n <= MAX_REFLECTED_LENGTH * m
}

/// Expected estimates (k,) and their variances (k,).
pub(super) fn variances(
    terms: &[Term],
    n: usize,
    factors: &[usize],
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    require_differences(n, factors)?;
    let whole = Process::new(terms, n, Kind::Total)?;
    let rest = without_white_phase(terms);
    let process = Process::new(&rest, n, Kind::Total)?;
    let of_one = |&m: &usize| {
        check(stop)?;
        let mean = expected(&whole, n, m);
        if !reflection_matters(n, m) || rest.is_empty() {
            let m2 = m.min(n / 2);
            let (_, own) = plain::variances(terms, n, &[m2], Kind::Allan, stop)?;
            // Reflection adds differences, which reduces the variance in proportion.
            return Ok((mean, own[0] * Kind::Allan.count(n, m2) as f64 / (n - 1) as f64));
        }
        let centers = differences(n, m, CENTERS);
        let mut sum = 0.0;
        for (a, p) in centers.iter().enumerate() {
            sum += process.between(p, p, n).powi(2);
            sum += 2.0 * centers[..a].iter().map(|q| process.between(p, q, n).powi(2)).sum::<f64>();
        }
        let scale = centers.len() as f64 * Kind::Total.scale(m);
        Ok((mean, 2.0 * sum / (scale * scale)))
    };
    let found = pooled(|| factors.par_iter().map(of_one).collect::<Result<Vec<_>>>())??;
    Ok(found.into_iter().unzip())
}

/// Expected estimates (k,) and their covariance (k, k), row by row.
pub(super) fn covariance(
    terms: &[Term],
    n: usize,
    factors: &[usize],
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let (means, own) = variances(terms, n, factors, stop)?;
    let k = factors.len();
    // Correlations are those of the overlapping variance, except for pairs of factors for which reflection matters.
    let inside: Vec<usize> = factors.iter().map(|m| (*m).min(n / 2)).collect();
    let (_, mut matrix) = plain::covariance(terms, n, &inside, Kind::Allan, stop)?;
    let spread: Vec<f64> = (0..k).map(|a| (own[a] / matrix[a * k + a]).sqrt()).collect();
    for a in 0..k {
        for b in 0..k {
            matrix[a * k + b] *= spread[a] * spread[b];
        }
    }
    let rest = without_white_phase(terms);
    if rest.is_empty() {
        return Ok((means, matrix));
    }
    let process = Process::new(&rest, n, Kind::Total)?;
    let ends: Vec<usize> = (0..k).filter(|a| reflection_matters(n, factors[*a])).collect();
    let centers: Vec<Vec<Points>> =
        ends.iter().map(|a| differences(n, factors[*a], CENTERS_OF_PAIRS)).collect();
    let mean_square = |a: usize, b: usize| -> Result<f64> {
        check(stop)?;
        let sum: f64 = centers[a]
            .iter()
            .map(|p| centers[b].iter().map(|q| process.between(p, q, n).powi(2)).sum::<f64>())
            .sum();
        Ok(sum / (centers[a].len() * centers[b].len()) as f64)
    };
    let alone =
        pooled(|| (0..ends.len()).into_par_iter().map(|a| mean_square(a, a)).collect::<Result<Vec<f64>>>())??;
    let pairs: Vec<(usize, usize)> = (0..ends.len()).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
    let of_two = |&(a, b): &(usize, usize)| {
        let correlation = mean_square(a, b)? / (alone[a] * alone[b]).sqrt();
        Ok(correlation * (own[ends[a]] * own[ends[b]]).sqrt())
    };
    let found = pooled(|| pairs.par_iter().map(of_two).collect::<Result<Vec<f64>>>())??;
    for (&(a, b), value) in pairs.iter().zip(found) {
        matrix[ends[a] * k + ends[b]] = value;
        matrix[ends[b] * k + ends[a]] = value;
    }
    Ok((means, matrix))
}

/// Quantiles of the estimate over its mean, at one factor.
pub(super) fn quantiles(
    terms: &[Term],
    n: usize,
    factor: usize,
    probabilities: &[f64],
    stop: &AtomicBool,
) -> Result<Vec<f64>> {
    let (mean, variance) = variances(terms, n, &[factor], stop)?;
    if !reflection_matters(n, factor) {
        return plain::quantiles(terms, n, factor, probabilities, Kind::Allan, stop);
    }
    let rest = without_white_phase(terms);
    if rest.is_empty() {
        return Err(Error::Input(
            "the distribution of a variance needs a process slower than quantization".into(),
        ));
    }
    let process = Process::new(&rest, n, Kind::Total)?;
    let centers = differences(n, factor, CENTERS);
    let size = centers.len();
    let matrix = Mat::from_fn(size, size, |a, b| {
        if a < b { 0.0 } else { process.between(&centers[a], &centers[b], n) / size as f64 }
    });
    let mut eigenvalues = matrix
        .self_adjoint_eigenvalues(Side::Lower)
        .map_err(|_| Error::Input("the eigenvalues of the model's covariance did not converge".into()))?;
    distribution::normalize(&mut eigenvalues);
    Ok(distribution::scaled_quantiles(&eigenvalues, variance[0] / (mean[0] * mean[0]), probabilities))
}
