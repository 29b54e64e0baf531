//! Covariance of the estimators that use differences at every place of a record: all except the total variance.

use std::sync::atomic::AtomicBool;

use faer::{Mat, Side};
use rayon::prelude::*;

use super::distribution;
use super::process::{Kind, Process, Spaced};
use super::term::{Term, without_white_phase};
use crate::parallel::{check, pooled};
use crate::{Error, Result};

/// Number of differences per averaging time in the eigenvalue problem, and bounds on their total number. Chosen by
/// judgment; not measured.
const DIFFERENCES_PER_FACTOR: usize = 16;
const MIN_DIFFERENCES: usize = 96;
const MAX_DIFFERENCES: usize = 400;

/// The differences of the process at every factor, and the number of differences of each factor in the record.
fn prepared<'a>(
    process: &'a Process,
    n: usize,
    factors: &[usize],
    kind: Kind,
) -> Result<(Vec<Spaced<'a>>, Vec<usize>)> {
    let counts: Vec<usize> = factors.iter().map(|m| kind.count(n, *m)).collect();
    if let Some(k) = counts.iter().zip(factors).position(|(count, m)| *count == 0 || *m == 0) {
        return Err(Error::TooShort(format!(
            "factor {} of {n} samples has no complete difference: use factors from 1 to {}",
            factors[k],
            (n + kind.level() - 1) / kind.order()
        )));
    }
    Ok((factors.iter().map(|m| process.spaced(*m, kind.order())).collect(), counts))
}

/// Expected variance (k,) and variance of the estimates (k,) at `factors` for records of `n` samples.
pub(super) fn variances(
    terms: &[Term],
    n: usize,
    factors: &[usize],
    kind: Kind,
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let process = Process::new(terms, n, kind)?;
    let (spaced, counts) = prepared(&process, n, factors, kind)?;
    let waves = process.waves();
    let of_one = |(s, count): (&Spaced, &usize)| {
        check(stop)?;
        let scale = kind.scale(s.i);
        let square = s.mean_square(s, (*count, *count), &process.kinks, &waves);
        Ok((s.with(s.i)(0.0) / scale, 2.0 * square / (scale * scale)))
    };
    let found = pooled(|| spaced.par_iter().zip(&counts).map(of_one).collect::<Result<Vec<_>>>())??;
    Ok(found.into_iter().unzip())
}

/// Expected variance (k,) and covariance of the estimates (k, k), row by row, at `factors` for records of `n` samples.
pub(super) fn covariance(
    terms: &[Term],
    n: usize,
    factors: &[usize],
    kind: Kind,
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let process = Process::new(terms, n, kind)?;
    let (spaced, counts) = prepared(&process, n, factors, kind)?;
    let expected: Vec<f64> = spaced.iter().map(|s| s.with(s.i)(0.0) / kind.scale(s.i)).collect();
    let waves = process.waves();
    let k = factors.len();
    let pairs: Vec<(usize, usize)> = (0..k).flat_map(|a| (a..k).map(move |b| (a, b))).collect();
    let of_two = |&(a, b): &(usize, usize)| {
        check(stop)?;
        let (low, high) = if factors[a] <= factors[b] { (a, b) } else { (b, a) };
        let sum = spaced[low].mean_square(&spaced[high], (counts[low], counts[high]), &process.kinks, &waves);
        Ok(2.0 * sum / (kind.scale(factors[a]) * kind.scale(factors[b])))
    };
    let values = pooled(|| pairs.par_iter().map(of_two).collect::<Result<Vec<f64>>>())??;
    let mut matrix = vec![0.0; k * k];
    for (&(a, b), value) in pairs.iter().zip(values) {
        matrix[a * k + b] = value;
        matrix[b * k + a] = value;
    }
    Ok((expected, matrix))
}

/// Quantiles of σ̂²/σ² at `probabilities` for the estimate at `factor` of records of `n` samples.
pub(super) fn quantiles(
    terms: &[Term],
    n: usize,
    factor: usize,
    probabilities: &[f64],
    kind: Kind,
    stop: &AtomicBool,
) -> Result<Vec<f64>> {
    let (expected, variance) = variances(terms, n, &[factor], kind, stop)?;
    let relative = variance[0] / (expected[0] * expected[0]);
    let slow = without_white_phase(terms);
    let eigenvalues = if slow.is_empty() { Vec::new() } else { weights(&slow, n, factor, kind)? };
    if eigenvalues.is_empty() {
        return Err(Error::Input(
            "the distribution of a variance needs a process slower than quantization".into(),
        ));
    }
    Ok(distribution::scaled_quantiles(&eigenvalues, relative, probabilities))
}

/// Eigenvalues, scaled to sum 1, of the covariance of evenly chosen differences.
fn weights(terms: &[Term], n: usize, factor: usize, kind: Kind) -> Result<Vec<f64>> {
    let process = Process::new(terms, n, kind)?;
    let spaced = process.spaced(factor, kind.order());
    let count = kind.count(n, factor);
    let wanted = (DIFFERENCES_PER_FACTOR * count / factor).clamp(MIN_DIFFERENCES, MAX_DIFFERENCES).min(count);
    let stride = count.div_ceil(wanted);
    let size = count.div_ceil(stride);
    let covariance = spaced.with(factor);
    let row: Vec<f64> = (0..size).map(|k| covariance((k * stride) as f64)).collect();
    let matrix = Mat::from_fn(size, size, |a, b| row[a.abs_diff(b)] / (row[0] * size as f64));
    let mut found = matrix
        .self_adjoint_eigenvalues(Side::Lower)
        .map_err(|_| Error::Input("the eigenvalues of the model's covariance did not converge".into()))?;
    distribution::normalize(&mut found);
    Ok(found)
}

#[cfg(test)]
mod tests {
    use faer::c64;

    use super::*;

    #[test]
    fn narrow_lines_are_summed_as_lag_by_lag() {
        let n = 6000;
        let line = |rms: f64, angle: f64, damping: f64| {
            let phi = (-damping * angle).exp();
            let phi = c64::new(phi * angle.cos(), phi * angle.sin());
            Term::Exponential { amplitude: c64::new(rms * rms, 0.0), phi }
        };
        let smooth = [
            Term::White { variance: 1.0 },
            Term::PowerLaw { exponent: -1.0, level: 0.01, end_ratios: Vec::new() },
            Term::RandomWalk { variance: 1e-6 },
        ];
        let lines = [
            line(1.0, 0.0355, 0.002),
            line(0.5, 0.106, 0.001),
            line(0.7, 0.63, 0.05),
            line(0.2, 0.111, 0.002),
        ];
        let factors = [1, 3, 7, 10, 32, 75, 133, 422, 1000, 1900];
        for some in [&lines[..1], &lines[1..2], &lines[..]] {
            let terms = [&smooth[..], some].concat();
            let (_, found) = variances(&terms, n, &factors, Kind::Allan, &AtomicBool::new(false)).unwrap();
            let process = Process::new(&terms, n, Kind::Allan).unwrap();
            for (&m, found) in factors.iter().zip(found) {
                let (spaced, count) = (process.spaced(m, 2), Kind::Allan.count(n, m));
                let square = |t: usize| spaced.with(m)(t as f64).powi(2);
                let beyond: f64 = (1..count).map(|t| (count - t) as f64 * square(t)).sum();
                let sum = (count as f64 * square(0) + 2.0 * beyond) / (count as f64).powi(2);
                let exact = 2.0 * sum / Kind::Allan.scale(m).powi(2);
                assert!((found / exact - 1.0).abs() < 1e-3, "{} lines, m = {m}: {found} {exact}", some.len());
            }
        }
    }
}
