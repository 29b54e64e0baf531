use std::sync::atomic::AtomicBool;

use proptest::prelude::*;

use super::gamma::{nodes, norm};
use super::*;

/// Marginal logL and weights of the bins at discrepancy δ, from the definition, cell by cell and node by node.
fn naive(count: &[f64], first: &[usize], power: &[f64], spectrum: &[f64], scale: f64) -> (f64, Vec<f64>) {
    let (mut log_likelihood, mut weight) = (0.0, Vec::new());
    for (cell, &from) in first.iter().enumerate() {
        let own = from..first.get(cell + 1).copied().unwrap_or(count.len());
        let total: f64 = count[own.clone()].iter().sum();
        let mean = own.clone().map(|b| count[b] * power[b] / spectrum[b]).sum::<f64>() / total;
        let half = total / 2.0;
        let likelihoods = nodes().map(|(w, probability)| {
            let shape = half / (1.0 + half * scale * scale * w);
            let density = norm(shape) - norm(half) + shape * (mean.ln() - mean) - half * (mean.ln() - mean);
            (shape, probability * density.exp())
        });
        let sum: f64 = likelihoods.iter().map(|(_, value)| value).sum();
        let shape = likelihoods.iter().map(|(shape, value)| shape * value).sum::<f64>() / sum;
        log_likelihood += sum.ln() - half * mean;
        for b in own {
            log_likelihood -= 0.5 * count[b] * spectrum[b].ln();
            weight.push(count[b] * 2.0 * shape / total);
        }
    }
    (log_likelihood, weight)
}

proptest! {
    #[test]
    fn the_marginal_likelihood_equals_its_definition(
        bins in prop::collection::vec((1.0..300.0_f64, 0.5..2.0_f64, 0.5..2.0_f64, any::<bool>()), 1..40),
        scale in 1e-3..0.5_f64
    ) {
        let count: Vec<f64> = bins.iter().map(|bin| bin.0).collect();
        let power: Vec<f64> = bins.iter().map(|bin| bin.1).collect();
        let spectrum: Vec<f64> = bins.iter().map(|bin| bin.2).collect();
        let first: Vec<usize> = (0..bins.len()).filter(|&b| b == 0 || bins[b].3).collect();
        let law = Likelihood::new(count.clone(), vec![scale], first.clone()).unwrap();
        let found = law.evaluate(&power, &spectrum, Some(0)).unwrap();
        let (expected, weight) = naive(&count, &first, &power, &spectrum, scale);
        let size: f64 = count.iter().sum();
        // Exponents of up to 1e4, which lose four of sixteen digits.
        prop_assert!((found.log_likelihood - expected).abs() < 1e-11 * size, "{} {expected}", found.log_likelihood);
        for (found, expected) in found.weight.iter().zip(weight) {
            prop_assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }
}

fn scales() -> Vec<f64> {
    (0..57).map(|i| 1e-3 * 3000f64.powf(f64::from(i) / 56.0)).collect()
}

/// Eleven bins: one whole block and a partial one.
fn bins() -> (Vec<f64>, Vec<f64>) {
    let count: Vec<f64> = (0..11).map(|i| 3f64.powi(i)).collect();
    let power = (0..11).map(|i| 1.0 + 0.4 * (f64::from(i) * 2.3).sin()).collect();
    (count, power)
}

#[test]
fn exp_equals_the_library() {
    for i in 0..70_000 {
        let x = -f64::from(i) / 100.0;
        for found in [exponents::exp::<false>(x), exponents::exp::<true>(x)] {
            assert!((found / x.exp() - 1.0).abs() < 1e-15, "{x}: {found}");
        }
    }
    assert!(exponents::exp::<false>(f64::NEG_INFINITY) < 1e-300);
}

#[test]
fn norms_equal_factorials_and_halves() {
    let mut factorial = 1.0f64;
    for k in 1..60 {
        let k = f64::from(k);
        let want = k * k.ln() - factorial.ln();
        assert!((norm(k) - want).abs() < 1e-14 * want.abs() + 1e-13, "{k}");
        factorial *= k;
    }
    let half = 0.5 * 0.5f64.ln() - 0.5 * std::f64::consts::PI.ln();
    assert!((norm(0.5) - half).abs() < 1e-13);
    assert!((norm(1e-6) - 1e-6 * 1e-6f64.ln() - 1e-6f64.ln()).abs() < 1e-6);
}

#[test]
fn a_negligible_scale_gives_the_whittle_likelihood() {
    let (count, power) = bins();
    let law = Likelihood::new(count.clone(), vec![1e-12], (0..count.len()).collect()).unwrap();
    let spectrum = vec![1.1; count.len()];
    let plain = law.evaluate(&power, &spectrum, None).unwrap();
    let found = law.evaluate(&power, &spectrum, Some(0)).unwrap();
    let whittle: f64 = count.iter().zip(&power).map(|(n, p)| -0.5 * n * (1.1f64.ln() + p / 1.1)).sum();
    assert!((plain.log_likelihood / whittle - 1.0).abs() < 1e-12);
    assert!((found.log_likelihood / whittle - 1.0).abs() < 1e-9);
    assert!(found.weight.iter().zip(&count).all(|(w, n)| (w / n - 1.0).abs() < 1e-9));
    assert_eq!(plain.weight, count);
}

#[test]
fn climbs_to_an_exact_mixture_alone_and_among_many() {
    let count = vec![50.0; 30];
    let f: Vec<f64> = (1..=30).map(|i| f64::from(i) / 60.0).collect();
    let columns: Vec<f64> = f
        .iter()
        .map(|_| 1.0)
        .chain(f.iter().map(|f| 1e-9 / f))
        .chain(f.iter().map(|f| 1e9 / f.powi(2)))
        .collect();
    let want = [2.0, 3e8, 1e-11];
    let power: Vec<f64> = (0..30).map(|b| (0..3).map(|c| want[c] * columns[c * 30 + b]).sum()).collect();
    let law = Likelihood::new(count.clone(), scales(), (0..count.len()).collect()).unwrap();
    let problem = Problem { likelihood: &law, power: &power, columns: &columns, offset: None };
    let start = problem.first(3).unwrap();
    for scale in [None, Some(30)] {
        let one = problem.climb(&start, scale, 80).unwrap();
        for (found, want) in one.theta.iter().zip(want) {
            assert!((found / want - 1.0).abs() < 1e-6, "{:?}", one.theta);
        }
        // Perfect data have the smallest discrepancy.
        assert_eq!(one.scale, scale.map(|_| 0));
        let stop = AtomicBool::new(false);
        let two = climb_many(
            &law,
            &power,
            &[&columns[..], &columns[..]].concat(),
            &[&start[..], &[1.0, 0.0, 0.0]].concat(),
            3,
            scale,
            80,
            &stop,
        )
        .unwrap();
        assert_eq!(two[0].theta, one.theta);
        assert!(two[1].theta.iter().all(|t| *t >= 0.0));
    }
}

#[test]
fn wrong_sizes_are_refused_and_nan_terminates() {
    let (count, power) = bins();
    let law = Likelihood::new(count.clone(), scales(), (0..count.len()).collect()).unwrap();
    assert!(Likelihood::new(vec![0.0], scales(), vec![0]).is_err());
    assert!(law.evaluate(&power, &power[1..], None).is_err());
    assert!(law.evaluate(&power, &power, Some(57)).is_err());
    let columns = power.clone();
    let problem = Problem { likelihood: &law, power: &power, columns: &columns, offset: None };
    assert!(problem.climb(&[1.0, 1.0], None, 80).is_err());
    let mut broken = power.clone();
    broken[3] = f64::NAN;
    let found = Problem { power: &broken, ..problem }.climb(&[1.0], Some(3), 80).unwrap();
    assert!(found.evaluation.log_likelihood.is_nan());
}

#[test]
fn ln_equals_the_library() {
    for i in 0..200_000 {
        let x = 10f64.powf(f64::from(i) / 333.0 - 300.0);
        for found in [exponents::ln::<false>(x), exponents::ln::<true>(x)] {
            assert!((found - x.ln()).abs() <= 3e-16 * x.ln().abs().max(1.0), "{x:e}: {found}");
        }
    }
    assert_eq!(exponents::ln::<true>(1.0), 0.0);
}
