//! Covariance of overlapping variance estimates across averaging factors, for a sum of primitive processes.
//!
//! The estimate at factor i is the mean square of the difference Δ_i^o y. Here y is the phase (oadev o = 2, hdev o =
//! 3) or the running sum of the phase (mdev o = 3, because the mean of i second differences is a third difference
//! over i). For Gaussian noise cov(σ̂²_i, σ̂²_j) = 2/(c_i c_j M_i M_j) Σ_t count(t) R_ij(t)² (Greenhall and Riley
//! 2003, eq. 7). R_ij(t) is the covariance of two differences whose centers are t apart: Δ_i^o Δ_j^o of the
//! generalized covariance of y.

#![expect(clippy::doc_markdown, reason = "formulas read better plain")]

mod differences;
mod distribution;
mod exponential;
mod lags;
#[cfg(test)]
mod naive;
pub(crate) mod ordinates;
mod plain;
mod powers;
mod process;
mod runs;
mod term;
mod total;

use std::sync::atomic::AtomicBool;

use crate::{Error, Result};
pub(crate) use process::Kind;
pub(crate) use term::Term;

/// Expected variance (k,) and variance of the estimates (k,), at `factors`, for records of `n` samples.
pub(crate) fn variances(
    terms: &[Term],
    n: usize,
    factors: &[usize],
    kind: Kind,
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    match kind {
        Kind::Total => total::variances(terms, n, factors, stop),
        _ => plain::variances(terms, n, factors, kind, stop),
    }
}

/// Expected variance (k,) and covariance of the estimates (k, k), row by row, at `factors` for records of `n` samples.
pub(crate) fn covariance(
    terms: &[Term],
    n: usize,
    factors: &[usize],
    kind: Kind,
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    match kind {
        Kind::Total => total::covariance(terms, n, factors, stop),
        _ => plain::covariance(terms, n, factors, kind, stop),
    }
}

/// Quantiles of σ̂²/σ² at `probabilities` for the estimate at `factor` of records of `n` samples.
pub(crate) fn quantiles(
    terms: &[Term],
    n: usize,
    factor: usize,
    probabilities: &[f64],
    kind: Kind,
    stop: &AtomicBool,
) -> Result<Vec<f64>> {
    if let Some(bad) = probabilities.iter().find(|p| !(**p > 0.0 && **p < 1.0)) {
        return Err(Error::Input(format!("probability {bad} is not between 0 and 1")));
    }
    match kind {
        Kind::Total => total::quantiles(terms, n, factor, probabilities, stop),
        _ => plain::quantiles(terms, n, factor, probabilities, kind, stop),
    }
}
