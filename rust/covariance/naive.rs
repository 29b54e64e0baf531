//! Expectations and covariances of variance estimates from the covariance of all samples: the definition, as a
//! reference for tests.

use std::sync::atomic::AtomicBool;

use faer::Mat;
use proptest::prelude::*;

use super::{Kind, Term, covariance, variances};

/// Covariance of samples k and l, up to a constant that no difference of phases depends on.
fn of_samples(terms: &[Term], k: usize, l: usize) -> f64 {
    let lag = k.abs_diff(l);
    let one = |term: &Term| match term {
        Term::White { variance } => {
            if lag == 0 {
                *variance
            } else {
                0.0
            }
        }
        Term::Blue { variance } => variance * [2.0, -1.0].get(lag).unwrap_or(&0.0),
        Term::RandomWalk { variance } => variance * k.min(l) as f64,
        Term::Exponential { amplitude, phi } => (amplitude * phi.powu(lag as u32)).re,
        Term::Lags { covariances } => covariances.get(lag).copied().unwrap_or(0.0),
        Term::PowerLaw { .. } => unreachable!("has no covariance in closed form"),
    };
    terms.iter().map(one).sum()
}

/// Weights (n,) of the samples in each difference of factor m.
fn differences(kind: Kind, n: usize, m: usize) -> Vec<Vec<f64>> {
    // Phase point i is the sum of the samples before i; outside the record the phase is reflected.
    let mut all = Vec::new();
    let last = n as isize;
    let add = |to: &mut Vec<f64>, point: isize, weight: f64| {
        let mut straight = |point: isize, weight: f64| {
            to.iter_mut().take(point as usize).for_each(|w| *w += weight);
        };
        match point {
            i if i < 0 => {
                straight(0, 2.0 * weight);
                straight(-i, -weight);
            }
            i if i > last => {
                straight(last, 2.0 * weight);
                straight(2 * last - i, -weight);
            }
            i => straight(i, weight),
        }
    };
    let by = m as isize;
    let (first, end, binomial): (isize, isize, &[f64]) = match kind {
        Kind::Allan => (0, last - 2 * by, &[1.0, -2.0, 1.0]),
        Kind::Modified => (0, last - 3 * by + 1, &[1.0, -2.0, 1.0]),
        Kind::Hadamard => (0, last - 3 * by, &[-1.0, 3.0, -3.0, 1.0]),
        Kind::Total => (1 - by, last - 1 - by, &[1.0, -2.0, 1.0]),
    };
    for k in first..=end {
        let mut weights = vec![0.0; n];
        for within in 0..if kind == Kind::Modified { by } else { 1 } {
            for (step, weight) in (0..).zip(binomial) {
                add(&mut weights, k + within + step * by, *weight);
            }
        }
        all.push(weights);
    }
    all
}

/// Expected variances and their covariance.
fn naive(terms: &[Term], n: usize, factors: &[usize], kind: Kind) -> (Vec<f64>, Mat<f64>) {
    let samples = Mat::from_fn(n, n, |k, l| of_samples(terms, k, l));
    let weights: Vec<Mat<f64>> = factors
        .iter()
        .map(|m| {
            let rows = differences(kind, n, *m);
            Mat::from_fn(rows.len(), n, |i, j| rows[i][j])
        })
        .collect();
    let between = |a: usize, b: usize| &weights[a] * &samples * weights[b].transpose();
    let scale = |a: usize| kind.scale(factors[a]) * weights[a].nrows() as f64;
    let expected = (0..factors.len()).map(|a| {
        let own = between(a, a);
        (0..own.nrows()).map(|i| own[(i, i)]).sum::<f64>() / scale(a)
    });
    let matrix = Mat::from_fn(factors.len(), factors.len(), |a, b| {
        2.0 * between(a, b).squared_norm_l2() / (scale(a) * scale(b))
    });
    (expected.collect(), matrix)
}

proptest! {
    #[test]
    fn variances_and_covariances_equal_the_double_sum(
        white in 0.1..2.0_f64, blue in 0.0..1.0_f64, walk in 0.0..0.5_f64, rate in 0.01..2.0_f64,
        angle in 0.0..2.0_f64, lags in prop::collection::vec(-0.1..0.1_f64, 1..6), n in 13_usize..40
    ) {
        let phi = faer::c64::new(-rate, angle).exp();
        let mut terms = vec![
            Term::White { variance: white + 1.0 },
            Term::RandomWalk { variance: walk },
            Term::Exponential { amplitude: faer::c64::new(0.7, 0.0), phi },
            Term::Lags { covariances: lags },
        ];
        for kind in [Kind::Total, Kind::Allan, Kind::Modified, Kind::Hadamard] {
            let factors = [1, 2, 3, n / 4];
            let (expected, matrix) = naive(&terms, n, &factors, kind);
            let never = AtomicBool::new(false);
            let (own, spread) = variances(&terms, n, &factors, kind, &never).unwrap();
            let (again, found) = covariance(&terms, n, &factors, kind, &never).unwrap();
            for a in 0..factors.len() {
                prop_assert!((own[a] / expected[a] - 1.0).abs() < 1e-9, "{kind:?} {a}: {} {}", own[a], expected[a]);
                prop_assert!((again[a] / expected[a] - 1.0).abs() < 1e-9);
                // The sum over lags is a quadrature of this accuracy (see `lags`).
                prop_assert!((spread[a] / matrix[(a, a)] - 1.0).abs() < 1e-3, "{kind:?} {a}: {} {}", spread[a], matrix[(a, a)]);
                for b in 0..factors.len() {
                    let (found, expected) = (found[a * factors.len() + b], matrix[(a, b)]);
                    prop_assert!((found / expected - 1.0).abs() < 1e-3, "{kind:?} {a} {b}: {found} {expected}");
                }
            }
            if kind == Kind::Total {
                // The total variance treats white phase noise apart.
                terms.push(Term::Blue { variance: blue });
            }
        }
    }
}
