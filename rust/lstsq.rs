//! Generalized least squares with non-negative coefficients.
//!
//! The system is whitened by the Cholesky factor of the covariance and solved by the active-set method of Lawson
//! and Hanson (Solving Least Squares Problems, 1974, ch. 23).
//!
//! SciPy's Cholesky factorization and `nnls` give the same numbers in 81 and 99 µs for 20 × 4 and 40 × 5 (24 and 26
//! µs here, 2026-11-22). The intervals of a classical fit solve hundreds of such systems.
//!
//! Unlike `likelihood/nonnegative.rs`, the active-set search uses the normal equations. Each system is new, so there
//! is no previous active set to start from, and the covariance of the coefficients needs the inverse of the Gram
//! matrix anyway.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use crate::{Error, Result};

/// Relative jitter added to the unit diagonal of the correlation matrix. Estimates at adjacent averaging times are
/// almost equal. Without jitter their differences would get weights beyond the accuracy of the covariance.
pub(crate) const JITTER: f64 = 1e-9;

/// Solution of a least-squares problem.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    /// Coefficients (p,).
    pub coefficients: Vec<f64>,
    /// Covariance (p, p) of the coefficients, row by row. Rows and columns of coefficients held at 0 are those of the
    /// unconstrained system, so that an upper limit can be derived from them.
    pub covariance: Vec<f64>,
    /// (target − design·coefficients)ᵀ covariance⁻¹ (…).
    pub chi2: f64,
}

/// Coefficients ≥ 0 that minimize χ². `design` has shape (k, p), `covariance` (k, k), both row by row.
pub(crate) fn gls_nonnegative(design: &[f64], target: &[f64], covariance: &[f64]) -> Result<Solution> {
    let k = target.len();
    let p = design.len().checked_div(k).unwrap_or(0);
    if p == 0 || p > k || design.len() != k * p || covariance.len() != k * k {
        return Err(Error::Input(format!(
            "least squares: {k} values, {} design numbers and {} covariances do not fit together \
             (needed k ≥ p, k·p and k·k)",
            design.len(),
            covariance.len()
        )));
    }
    if let Some(bad) = design.iter().chain(target).chain(covariance).find(|v| !v.is_finite()) {
        return Err(Error::Input(format!("least squares: {bad} among the input numbers")));
    }
    let scale: Vec<f64> = (0..k).map(|i| covariance[i * k + i].sqrt()).collect();
    if let Some(i) = scale.iter().position(|s| !(*s > 0.0)) {
        return Err(Error::Input(format!(
            "least squares: variance {} of value {i} is not positive",
            covariance[i * k + i]
        )));
    }
    let correlation = Mat::from_fn(k, k, |a, b| {
        covariance[a * k + b] / (scale[a] * scale[b]) + if a == b { JITTER } else { 0.0 }
    });
    let factor = correlation.llt(Side::Lower).map_err(|_| {
        Error::Input(
            "least squares: the covariance is not positive definite: use fewer averaging factors".into(),
        )
    })?;
    let norms: Vec<f64> =
        (0..p).map(|c| (0..k).map(|r| (design[r * p + c] / scale[r]).powi(2)).sum::<f64>().sqrt()).collect();
    if let Some(c) = norms.iter().position(|n| !(*n > 0.0)) {
        return Err(Error::Input(format!("least squares: column {c} of the design is zero")));
    }
    let mut system = Mat::from_fn(k, p + 1, |r, c| {
        if c < p { design[r * p + c] / (scale[r] * norms[c]) } else { target[r] / scale[r] }
    });
    faer::linalg::triangular_solve::solve_lower_triangular_in_place(
        factor.L(),
        system.as_mut(),
        faer::Par::Seq,
    );
    let normal = system.transpose() * &system;
    let active = active_set(&normal, p);
    let x = solve_active(&normal, p, &active)?;
    let chi2 =
        (0..k).map(|r| (system[(r, p)] - (0..p).map(|c| system[(r, c)] * x[c]).sum::<f64>()).powi(2)).sum();
    let gram = normal.submatrix(0, 0, p, p).to_owned();
    let inverse = inverse(&gram)?;
    // Coefficients at the bound do not affect the covariance of the others.
    let kept: Vec<usize> = (0..p).filter(|c| active[*c]).collect();
    let small = Mat::from_fn(kept.len(), kept.len(), |a, b| gram[(kept[a], kept[b])]);
    let inner = if kept.is_empty() { small } else { self::inverse(&small)? };
    let mut out = vec![0.0; p * p];
    for a in 0..p {
        for b in 0..p {
            let place = (kept.iter().position(|c| *c == a), kept.iter().position(|c| *c == b));
            let value = match place {
                (Some(i), Some(j)) => inner[(i, j)],
                _ => inverse[(a, b)],
            };
            out[a * p + b] = value / (norms[a] * norms[b]);
        }
    }
    let coefficients = x.iter().zip(&norms).map(|(v, n)| v / n).collect();
    Ok(Solution { coefficients, covariance: out, chi2 })
}

/// Inverse of a Gram matrix.
fn inverse(gram: &Mat<f64>) -> Result<Mat<f64>> {
    let size = gram.nrows();
    let factor = gram.llt(Side::Lower).map_err(|_| {
        Error::Input("least squares: two effects have the same curve on these averaging factors".into())
    })?;
    Ok(factor.solve(Mat::<f64>::identity(size, size)))
}

/// Least-squares coefficients of the active columns, with zeros for the others.
fn solve_active(normal: &Mat<f64>, p: usize, active: &[bool]) -> Result<Vec<f64>> {
    let kept: Vec<usize> = (0..p).filter(|c| active[*c]).collect();
    let mut out = vec![0.0; p];
    if kept.is_empty() {
        return Ok(out);
    }
    let gram = Mat::from_fn(kept.len(), kept.len(), |a, b| normal[(kept[a], kept[b])]);
    let right = Mat::from_fn(kept.len(), 1, |a, _| normal[(kept[a], p)]);
    let factor = gram.llt(Side::Lower).map_err(|_| {
        Error::Input("least squares: two effects have the same curve on these averaging factors".into())
    })?;
    let found = factor.solve(right);
    for (slot, c) in kept.iter().enumerate() {
        out[*c] = found[(slot, 0)];
    }
    Ok(out)
}

/// Mask of the columns with positive coefficients at the optimum.
fn active_set(normal: &Mat<f64>, p: usize) -> Vec<bool> {
    let mut active = vec![false; p];
    let mut x = vec![0.0; p];
    // Lawson and Hanson prove termination; the bound protects only against rounding.
    for _ in 0..10 * p + 10 {
        let gradient = |c: usize| normal[(c, p)] - (0..p).map(|d| normal[(c, d)] * x[d]).sum::<f64>();
        let tolerance = 1e-12 * normal[(p, p)].sqrt();
        let enter = (0..p)
            .filter(|c| !active[*c] && gradient(*c) > tolerance * normal[(*c, *c)].sqrt())
            .max_by(|a, b| gradient(*a).total_cmp(&gradient(*b)));
        let Some(enter) = enter else { break };
        active[enter] = true;
        loop {
            let Ok(trial) = solve_active(normal, p, &active) else {
                active[enter] = false;
                return active;
            };
            let step = (0..p)
                .filter(|c| active[*c] && trial[*c] <= 0.0)
                .map(|c| x[c] / (x[c] - trial[c]))
                .fold(1.0, f64::min);
            for c in 0..p {
                x[c] += step * (trial[c] - x[c]);
            }
            if step >= 1.0 {
                break;
            }
            let mut left = false;
            for c in 0..p {
                if active[c] && trial[c] <= 0.0 && x[c] <= 1e-15 * trial[c].abs().max(1e-300) + 1e-300 {
                    (active[c], x[c], left) = (false, 0.0, true);
                }
            }
            if !left {
                // Rounding kept the blocking coefficient slightly above zero.
                let worst =
                    (0..p).filter(|c| active[*c] && trial[*c] <= 0.0).min_by(|a, b| x[*a].total_cmp(&x[*b]));
                if let Some(c) = worst {
                    (active[c], x[c]) = (false, 0.0);
                }
            }
            if active.iter().all(|a| !a) {
                break;
            }
        }
    }
    active
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Smallest χ² of all subsets of columns whose least-squares coefficients are not negative: the definition.
    fn naive(design: &Mat<f64>, target: &Mat<f64>, inverse: &Mat<f64>) -> f64 {
        let chi2 = |rest: &Mat<f64>| (rest.transpose() * inverse * rest)[(0, 0)];
        let p = design.ncols();
        let mut best = chi2(target);
        for subset in 1..1_usize << p {
            let kept: Vec<usize> = (0..p).filter(|c| subset >> c & 1 == 1).collect();
            let own = Mat::from_fn(design.nrows(), kept.len(), |r, c| design[(r, kept[c])]);
            let gram = own.transpose() * inverse * &own;
            let Ok(factor) = gram.llt(Side::Lower) else { continue };
            let x = factor.solve(own.transpose() * inverse * target);
            if (0..kept.len()).all(|c| x[(c, 0)] >= 0.0) {
                best = best.min(chi2(&(target - &own * &x)));
            }
        }
        best
    }

    proptest! {
        #[test]
        fn no_subset_of_columns_fits_better(
            design in prop::collection::vec(0.0..1.0_f64, 32), target in prop::collection::vec(-1.0..1.0_f64, 8),
            p in 1_usize..5, correlation in 0.0..0.9_f64
        ) {
            let k = target.len();
            let covariance = Mat::from_fn(k, k, |a, b| correlation.powi(a.abs_diff(b) as i32));
            let flat = |m: &Mat<f64>| -> Vec<f64> {
                (0..m.nrows() * m.ncols()).map(|place| m[(place / m.ncols(), place % m.ncols())]).collect()
            };
            let design = Mat::from_fn(k, p, |r, c| design[4 * r + c]);
            let found = gls_nonnegative(&flat(&design), &target, &flat(&covariance)).unwrap();
            let inverse = covariance.llt(Side::Lower).unwrap().solve(Mat::<f64>::identity(k, k));
            let best = naive(&design, &Mat::from_fn(k, 1, |r, _| target[r]), &inverse);
            prop_assert!(found.coefficients.iter().all(|x| *x >= 0.0));
            // The jitter of 1e-9 changes the covariance by at most 1e-9 of its smallest eigenvalue, 0.05.
            prop_assert!((found.chi2 / best - 1.0).abs() < 1e-6, "{} {best}", found.chi2);
        }
    }

    #[test]
    fn recovers_an_exact_mixture_and_drops_negative_coefficients() {
        let k = 12;
        let tau: Vec<f64> = (0..k).map(|r| 2f64.powi(r)).collect();
        let design: Vec<f64> = tau.iter().flat_map(|t| [1.0 / t, 1.0, *t]).collect();
        let k = k as usize;
        let covariance: Vec<f64> = (0..k * k)
            .map(|e| {
                let (a, b) = (e / k, e % k);
                0.6f64.powi(a.abs_diff(b) as i32) / (tau[a] * tau[b]).sqrt()
            })
            .collect();
        let exact: Vec<f64> = tau.iter().map(|t| 2.0 / t + 0.3 + 0.01 * t).collect();
        let found = gls_nonnegative(&design, &exact, &covariance).unwrap();
        for (x, want) in found.coefficients.iter().zip([2.0, 0.3, 0.01]) {
            assert!((x / want - 1.0).abs() < 1e-6, "{x} {want}");
        }
        assert!(found.chi2 < 1e-12);
        let below: Vec<f64> = tau.iter().map(|t| 2.0 / t - 0.3 + 0.1 * t).collect();
        let found = gls_nonnegative(&design, &below, &covariance).unwrap();
        assert_eq!(found.coefficients[1], 0.0);
        assert!(found.coefficients[0] > 0.0 && found.chi2 > 0.0);
    }
}
