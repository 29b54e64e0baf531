//! Banks of log-spaced first-order sections that approximate fractional powers of frequency.
//!
//! With s = 1 − z⁻¹ the fractional integral is a positive mixture of first-order lags: the Stieltjes integral s^−d =
//! (sin πd/π) ∫ u^−d/(u+s) du for 0 < d < 1, and the same in x = |s|² for spectra. The trapezoidal rule in ln u with
//! two poles per decade has a ripple of 4e^(−π²/ln √10)/2 = 0.04 %. Least squares against the discrete target over
//! the band of the record corrects the ends of the band.

use std::f64::consts::PI;

use super::least_squares::Problem;
use crate::{Error, Result};

/// Poles per decade of frequency.
const PER_DECADE: f64 = 2.0;
/// The fitted band starts at 1/(BAND_FACTOR·n) cycles per sample. Lower frequencies change the Allan deviation at n/4 by
/// less than 0.1 %.
const BAND_FACTOR: f64 = 20.0;
/// Weight of the fit below 1/(4n) cycles per sample. Chosen by judgment; not measured.
const LOW_WEIGHT: f64 = 0.1;
/// Fitted frequencies per decade. Chosen by judgment; not measured.
const FITTED_PER_DECADE: f64 = 16.0;

/// Frequencies of the fit, in cycles per sample, and their weights.
fn band(n: usize) -> Vec<(f64, f64)> {
    let n = n.max(16) as f64;
    let low = 1.0 / (BAND_FACTOR * n);
    let count = (FITTED_PER_DECADE * (0.5 / low).log10()).ceil() as usize;
    (0..=count)
        .map(|i| {
            let f = low * (0.5 / low).powf(i as f64 / count as f64);
            (f, if f < 0.25 / n { LOW_WEIGHT } else { 1.0 })
        })
        .collect()
}

/// Log-spaced values, at least `per_decade` per decade, from `low` to `high`. The range is extended by `beyond` steps
/// at either end.
fn log_spaced(low: f64, high: f64, per_decade: f64, beyond: (f64, f64)) -> Vec<f64> {
    let step = 1.0 / per_decade;
    let (low, high) = (low.log10() - beyond.0 * step, high.log10() + beyond.1 * step);
    let count = ((high - low) * per_decade).ceil() as usize;
    (0..=count).map(|i| 10.0_f64.powf(low + (high - low) * i as f64 / count as f64)).collect()
}

/// Approximation of (1 − z⁻¹)^−d by `direct` + Σ `weight`/(1 − φ z⁻¹), φ = 1 − `gap`.
#[derive(Debug, Clone)]
pub(super) struct PoleBank {
    /// 1 − φ of each section, in ascending order.
    pub gaps: Vec<f64>,
    /// Weight of each section.
    pub weights: Vec<f64>,
    /// Weight of the undelayed input.
    pub direct: f64,
}

impl PoleBank {
    /// Approximation for 0 < d < 1, fitted for records of `n` samples.
    pub(super) fn new(d: f64, n: usize) -> Self {
        let band = band(n);
        let poles = log_spaced(2.0 * PI * band[0].0, 2.0, PER_DECADE, (2.0, 1.0));
        // 1/(u+s) of every pole and the constant, each divided by the target s^−d.
        let mut columns = vec![vec![0.0; 2 * band.len()]; poles.len() + 1];
        let mut target = vec![0.0; 2 * band.len()];
        for (i, &(f, weight)) in band.iter().enumerate() {
            let (re, im) = (2.0 * (PI * f).sin().powi(2), (2.0 * PI * f).sin());
            let (size, angle) = (re.hypot(im).powf(d) * weight, im.atan2(re) * d);
            let (tre, tim) = (size * angle.cos(), size * angle.sin());
            for (column, &u) in columns.iter_mut().zip(&poles) {
                let scale = u.powf(1.0 - d) / ((u + re).powi(2) + im * im);
                let (a, b) = ((u + re) * scale, -im * scale);
                column[2 * i] = a * tre - b * tim;
                column[2 * i + 1] = a * tim + b * tre;
            }
            columns[poles.len()][2 * i] = tre;
            columns[poles.len()][2 * i + 1] = tim;
            target[2 * i] = weight;
        }
        let mut weights = Problem { columns, target }.solve();
        let direct = weights.pop().unwrap_or(0.0);
        // 1/(u+s) = φ/(1 − φ z⁻¹), φ = 1/(1+u).
        for (weight, u) in weights.iter_mut().zip(&poles) {
            *weight *= u.powf(1.0 - d) / (1.0 + u);
        }
        Self { gaps: poles.iter().map(|u| u / (1.0 + u)).collect(), weights, direct }
    }
}

/// Independent stationary first-order autoregressions whose sum has the spectrum (2 sin(w/2))^`exponent`, w = 2πf,
/// within 0.1 % over [1/(4n), ½] cycles per sample.
///
/// Returns pairs (φ, variance), variances ≥ 0; φ = 0 is the white remainder. The exponent must lie in [−2, 0].
pub(crate) fn power_law_bank(exponent: f64, n: usize) -> Result<Vec<(f64, f64)>> {
    if !(-2.0..=0.0).contains(&exponent) {
        return Err(Error::Input(format!(
            "a sum of independent lags has an exponent from -2 to 0, found {exponent}"
        )));
    }
    if exponent == 0.0 {
        return Ok(vec![(0.0, 1.0)]);
    }
    let d = -0.5 * exponent;
    let band = band(n);
    let squares: Vec<f64> = band.iter().map(|(f, _)| (2.0 * (PI * f).sin()).powi(2)).collect();
    // With t = (1−φ)²/φ the spectrum of variance v is v(1−φ²)/φ / (x+t), x = 4 sin²(w/2).
    let poles = log_spaced(squares[0], 4.0, PER_DECADE / 2.0, (3.0, 1.0));
    let relative = |column: &dyn Fn(f64) -> f64| -> Vec<f64> {
        squares.iter().zip(&band).map(|(&x, &(_, weight))| column(x) * x.powf(d) * weight).collect()
    };
    let mut columns: Vec<_> = poles.iter().map(|&t| relative(&|x| t.powf(1.0 - d) / (x + t))).collect();
    columns.push(relative(&|_| 1.0));
    let target = band.iter().map(|&(_, weight)| weight).collect();
    let mut weights = Problem { columns, target }.solve_nonnegative();
    let white = weights.pop().unwrap_or(0.0);
    let lags = poles.iter().zip(weights).map(|(&t, weight)| {
        let gap = 0.5 * ((t * t + 4.0 * t).sqrt() - t);
        let phi = 1.0 - gap;
        (phi, weight * t.powf(1.0 - d) * phi / (gap * (1.0 + phi)))
    });
    Ok(lags.chain([(0.0, white)]).filter(|&(_, variance)| variance > 0.0).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frequencies(n: usize) -> Vec<f64> {
        let low = 0.25 / n as f64;
        (0..=500).map(|i| low * (0.5 / low).powf(f64::from(i) / 500.0)).collect()
    }

    /// Power gain |H|² at `f` cycles per sample.
    fn gain(bank: &PoleBank, f: f64) -> f64 {
        let sin = (2.0 * PI * f).sin();
        let versine = 2.0 * (PI * f).sin().powi(2);
        let mut sum = (bank.direct, 0.0);
        for (gap, weight) in bank.gaps.iter().zip(&bank.weights) {
            let phi = 1.0 - gap;
            // 1 − φ(cos w − i sin w), with 1 − φ cos w written without cancellation.
            let (re, im) = (gap + phi * versine, phi * sin);
            let square = re * re + im * im;
            sum.0 += weight * re / square;
            sum.1 -= weight * im / square;
        }
        sum.0 * sum.0 + sum.1 * sum.1
    }

    #[test]
    fn ladder_has_the_declared_gain() {
        for n in [16, 1000, 100_000, 100_000_000] {
            for d in [0.01, 0.25, 0.5, 0.75, 0.99] {
                let bank = PoleBank::new(d, n);
                for f in frequencies(n) {
                    let ratio = gain(&bank, f) * (2.0 * (PI * f).sin()).powf(2.0 * d);
                    assert!((ratio - 1.0).abs() < 1.5e-3, "n {n} d {d} f {f}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn independent_lags_have_the_declared_spectrum() {
        for n in [16, 1000, 1_000_000] {
            for exponent in [-2.0, -1.99, -1.5, -1.0, -0.5, -0.01, 0.0] {
                let bank = power_law_bank(exponent, n).unwrap();
                for f in frequencies(n) {
                    let x = (2.0 * (PI * f).sin()).powi(2);
                    let sum: f64 = bank
                        .iter()
                        .map(|&(phi, v)| v * (1.0 - phi * phi) / ((1.0 - phi).powi(2) + phi * x))
                        .sum();
                    let ratio = sum / x.powf(0.5 * exponent);
                    assert!((ratio - 1.0).abs() < 1.2e-3, "n {n} exponent {exponent} f {f}: {ratio}");
                }
            }
        }
        assert!(power_law_bank(0.5, 100).is_err());
    }
}
