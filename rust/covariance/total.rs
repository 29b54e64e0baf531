//! The total variance: second differences about every inner point of the record reflected at its ends.
//!
//! NIST SP 1065 eq. 25. The reflection is odd about the first and the last point, so that a difference is a sum over up to
//! five points of the record that a straight line does not see; its covariance with another follows from the generalised
//! covariance of the phase, like that of plain differences, but depends on where both are. Sums over centres become means
//! over evenly chosen ones, which the differences of long averaging times hardly notice. Where a record holds more than
//! `LONG` averaging times, reflection changes only its two ends, and the overlapping Allan variance tells the scatter.

use faer::{Mat, Side};
use rayon::prelude::*;

use super::process::{Kind, Process, Term};
use super::{distribution, plain};
use crate::parallel::pooled;
use crate::{Error, Result};

/// Averaging times in a record from which on the ends no longer matter.
const LONG: usize = 50;
/// Centres for the variance at one factor, and for the covariance between two.
const OWN: usize = 400;
const BETWEEN: usize = 128;

/// A difference as points and their weights.
type Points = Vec<(f64, f64)>;

/// Reflected differences of one factor about evenly chosen centres.
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
    /// Generalised covariance of the phase at a distance, up to even powers below the fourth.
    fn phase(&self, h: f64, n: usize) -> f64 {
        let plain: f64 = self.powers.iter().map(|p| p.at(h)).sum();
        let waves = self.exponentials.iter().map(|e| e.at(h, e.lambda().norm() * (n as f64) < 1.0).re);
        plain + waves.sum::<f64>()
    }

    fn between(&self, a: &Points, b: &Points, n: usize) -> f64 {
        a.iter().flat_map(|(p, u)| b.iter().map(move |(q, v)| u * v * self.phase(p - q, n))).sum()
    }
}

/// White phase noise has a degree of freedom for every sample: among few centres it is but its mean.
fn slow(terms: &[Term]) -> Vec<Term> {
    terms.iter().filter(|(name, _)| name != "blue").cloned().collect()
}

fn check(n: usize, factors: &[usize]) -> Result<()> {
    match factors.iter().find(|m| **m == 0 || **m + 1 > n) {
        Some(m) => Err(Error::TooShort(format!(
            "factor {m} of {n} samples has no total difference: use factors from 1 to {}",
            n.saturating_sub(1)
        ))),
        None => Ok(()),
    }
}

/// Mean of the estimate, its bias included.
fn expected(process: &Process, n: usize, m: usize) -> f64 {
    let centres = differences(n, m, OWN);
    let sum: f64 = centres.iter().map(|p| process.between(p, p, n)).sum();
    sum / (centres.len() as f64 * Kind::Total.scale(m))
}

fn short(n: usize, m: usize) -> bool {
    n <= LONG * m
}

/// Expected estimates (k,) and their variances (k,).
pub fn variances(terms: &[Term], n: usize, factors: &[usize]) -> Result<(Vec<f64>, Vec<f64>)> {
    check(n, factors)?;
    let whole = Process::new(terms, n, Kind::Total)?;
    let rest = slow(terms);
    let process = Process::new(&rest, n, Kind::Total)?;
    let of_one = |&m: &usize| {
        let mean = expected(&whole, n, m);
        if !short(n, m) || rest.is_empty() {
            let m2 = m.min(n / 2);
            let (_, own) = plain::variances(terms, n, &[m2], Kind::Allan)?;
            // As many more differences as reflection adds.
            return Ok((mean, own[0] * Kind::Allan.count(n, m2) as f64 / (n - 1) as f64));
        }
        let centres = differences(n, m, OWN);
        let mut sum = 0.0;
        for (a, p) in centres.iter().enumerate() {
            sum += process.between(p, p, n).powi(2);
            sum += 2.0 * centres[..a].iter().map(|q| process.between(p, q, n).powi(2)).sum::<f64>();
        }
        let scale = centres.len() as f64 * Kind::Total.scale(m);
        Ok((mean, 2.0 * sum / (scale * scale)))
    };
    let found: Result<Vec<(f64, f64)>> = pooled(|| factors.par_iter().map(of_one).collect());
    Ok(found?.into_iter().unzip())
}

/// Expected estimates (k,) and their covariance (k, k), row by row.
pub fn covariance(terms: &[Term], n: usize, factors: &[usize]) -> Result<(Vec<f64>, Vec<f64>)> {
    let (means, own) = variances(terms, n, factors)?;
    let k = factors.len();
    // Correlation as of the overlapping variance, but for pairs that both feel the ends.
    let inside: Vec<usize> = factors.iter().map(|m| (*m).min(n / 2)).collect();
    let (_, mut matrix) = plain::covariance(terms, n, &inside, Kind::Allan)?;
    let spread: Vec<f64> = (0..k).map(|a| (own[a] / matrix[a * k + a]).sqrt()).collect();
    for a in 0..k {
        for b in 0..k {
            matrix[a * k + b] *= spread[a] * spread[b];
        }
    }
    let rest = slow(terms);
    if rest.is_empty() {
        return Ok((means, matrix));
    }
    let process = Process::new(&rest, n, Kind::Total)?;
    let ends: Vec<usize> = (0..k).filter(|a| short(n, factors[*a])).collect();
    let centres: Vec<Vec<Points>> = ends.iter().map(|a| differences(n, factors[*a], BETWEEN)).collect();
    let mean_square = |a: usize, b: usize| {
        let sum: f64 = centres[a]
            .iter()
            .map(|p| centres[b].iter().map(|q| process.between(p, q, n).powi(2)).sum::<f64>())
            .sum();
        sum / (centres[a].len() * centres[b].len()) as f64
    };
    let alone: Vec<f64> = pooled(|| (0..ends.len()).into_par_iter().map(|a| mean_square(a, a)).collect());
    let pairs: Vec<(usize, usize)> = (0..ends.len()).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
    let of_two = |&(a, b): &(usize, usize)| {
        mean_square(a, b) / (alone[a] * alone[b]).sqrt() * (own[ends[a]] * own[ends[b]]).sqrt()
    };
    let found: Vec<f64> = pooled(|| pairs.par_iter().map(of_two).collect());
    for (&(a, b), value) in pairs.iter().zip(found) {
        matrix[ends[a] * k + ends[b]] = value;
        matrix[ends[b] * k + ends[a]] = value;
    }
    Ok((means, matrix))
}

/// Quantiles of the estimate over its mean, at one factor.
pub fn quantiles(terms: &[Term], n: usize, factor: usize, probabilities: &[f64]) -> Result<Vec<f64>> {
    let (mean, variance) = variances(terms, n, &[factor])?;
    if !short(n, factor) {
        return plain::quantiles(terms, n, factor, probabilities, Kind::Allan);
    }
    let rest = slow(terms);
    if rest.is_empty() {
        return Err(Error::Input(
            "the distribution of a variance needs a process slower than quantization".into(),
        ));
    }
    let process = Process::new(&rest, n, Kind::Total)?;
    let centres = differences(n, factor, OWN);
    let size = centres.len();
    let matrix = Mat::from_fn(size, size, |a, b| {
        if a < b { 0.0 } else { process.between(&centres[a], &centres[b], n) / size as f64 }
    });
    let mut eigenvalues = matrix
        .self_adjoint_eigenvalues(Side::Lower)
        .map_err(|_| Error::Input("the eigenvalues of the model's covariance did not converge".into()))?;
    distribution::normalise(&mut eigenvalues);
    Ok(distribution::stretched(&eigenvalues, variance[0] / (mean[0] * mean[0]), probabilities))
}
