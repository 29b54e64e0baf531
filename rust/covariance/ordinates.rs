//! Expectation of the squared cosine ordinates c_j of n samples of a sum of primitive processes.
//!
//! Let w = πj/n and s = 4 sin²(w/2). For white noise and random walks the expectation equals the spectrum. For all
//! other processes the ends of the record add a small term: an autocovariance contributes r(0) + (2/n) Σ_h r(h)[(n −
//! h) cos hw − sin hw/sin w], h = 1 … n − 1. For r(h) = φ^h these are geometric sums in z = φe^{±iw}, which add up to
//!
//! (1 − φ)/q · [1 + φ − (φ/n)(1 − (−1)^j φ^n)(1 − φ)(4 − s)/q], q = (1 − φ)² + φs = (1 − φe^{iw})(1 − φe^{−iw}).
//!
//! This form keeps its digits for φ → 1 and w → 0, and depends on the ordinate only through s and the parity of j.

use std::f64::consts::PI;

use faer::c64;

use super::term::Term;
use crate::machine::processor::{Width, compiled_for_each_width};
use crate::{Error, Result};

/// Number of ordinates that one recurrence handles at a time.
const LANES: usize = 8;
/// Number of successive ordinates whose sines follow from one sine.
const BLOCK: i64 = 64;

/// The ordinates at which expectations are computed, with the quantities that depend on them alone.
pub(crate) struct Ordinates {
    n: f64,
    j: Vec<f64>,
    /// 4 sin²(w/2), the power gain of a first difference.
    s: Vec<f64>,
    /// (−1)^j.
    sign: Vec<f64>,
}

impl Ordinates {
    /// Ordinates j in 1 … n−1 of `n` samples.
    pub(crate) fn new(j: impl Iterator<Item = i64>, n: usize) -> Self {
        let mut out = Self { n: n as f64, j: Vec::new(), s: Vec::new(), sign: Vec::new() };
        // sin(a + b) of a block and a place in it, since sines take most of the time. All terms are positive up to π/2.
        let half = PI / (2.0 * out.n);
        let fine: Vec<_> = (0..BLOCK).map(|place| (half * place as f64).sin_cos()).collect();
        let (mut block, mut coarse) = (0, (0.0, 1.0));
        for j in j {
            if j / BLOCK != block {
                block = j / BLOCK;
                coarse = (half * (block * BLOCK) as f64).sin_cos();
            }
            let (sine, cosine) = fine[(j % BLOCK) as usize];
            let step = 2.0 * (coarse.0 * cosine + coarse.1 * sine);
            out.j.push(j as f64);
            out.s.push(step * step);
            out.sign.push(if j % 2 == 0 { 1.0 } else { -1.0 });
        }
        out
    }

    /// E c_j² (k,) of the sum of `terms`. Power laws need their end ratios.
    pub(crate) fn variance(&self, terms: &[Term]) -> Result<Vec<f64>> {
        let mut total = vec![0.0; self.j.len()];
        for term in terms {
            match term {
                Term::White { variance } => total.iter_mut().for_each(|sum| *sum += variance),
                Term::Blue { variance } => self.add(&mut total, |s| variance * (s + (4.0 - s) / self.n)),
                Term::RandomWalk { variance } => self.add(&mut total, |s| variance / s),
                Term::PowerLaw { end_ratios, .. } if end_ratios.is_empty() => {
                    return Err(Error::Input("term power_law: ordinates need its end ratios".into()));
                }
                Term::PowerLaw { exponent, level, end_ratios } => {
                    self.power_law(&mut total, *exponent, *level, end_ratios);
                }
                Term::Exponential { amplitude, phi } => self.exponential(&mut total, *amplitude, *phi),
                Term::Lags { covariances } => self.lags(&mut total, covariances),
            }
        }
        Ok(total)
    }

    /// Means of E c_j² over bins. `owner` (k,) names the bin of each ordinate; ordinates of a bin must be adjacent.
    pub(crate) fn means(&self, terms: &[Term], owner: &[i64]) -> Result<Vec<f64>> {
        let values = self.variance(terms)?;
        if owner.len() != values.len() {
            return Err(Error::Input(format!("{} ordinates have {} owners", values.len(), owner.len())));
        }
        let mut rest = values.as_slice();
        let mean = |bin: &[i64]| {
            let (own, after) = rest.split_at(bin.len());
            rest = after;
            own.iter().sum::<f64>() / own.len() as f64
        };
        Ok(owner.chunk_by(|a, b| a == b).map(mean).collect())
    }

    /// Adds a spectrum to `total`. `spectrum` is a function of s = 4 sin²(w/2).
    fn add(&self, total: &mut [f64], spectrum: impl Fn(f64) -> f64) {
        for (sum, s) in total.iter_mut().zip(&self.s) {
            *sum += spectrum(*s);
        }
    }

    /// Adds the expectation of a power law to `total`: its spectrum times the leakage ratios `ends`.
    ///
    /// Beyond the tabulated ordinates, the excess of the ratio over 1 falls as 1/j.
    fn power_law(&self, total: &mut [f64], exponent: f64, level: f64, ends: &[f64]) {
        let (known, last) = (ends.len() as f64, ends[ends.len() - 1]);
        for ((sum, s), j) in total.iter_mut().zip(&self.s).zip(&self.j) {
            let ratio =
                ends.get((*j as usize).wrapping_sub(1)).copied().unwrap_or(1.0 + (last - 1.0) * known / j);
            *sum += level * s.powf(0.5 * exponent) * ratio;
        }
    }

    /// Adds the expectation for the autocovariance r(h) = Re(a φ^h) to `total`.
    fn exponential(&self, total: &mut [f64], a: c64, phi: c64) {
        let rest = 1.0 - phi;
        let last = if phi.norm() > 0.0 { (phi.ln() * self.n).exp() } else { c64::new(0.0, 0.0) };
        let (square, main, ends) = (rest * rest, a * rest * (1.0 + phi), a * rest * rest * phi / self.n);
        let odd = ends * last;
        let numbers = [square, phi, main, ends, odd];
        if phi.im == 0.0 {
            add_real_exponential(Width::best(), total, &self.s, &self.sign, &numbers.map(|z| z.re));
        } else {
            add_complex_exponential(Width::best(), total, &self.s, &self.sign, &numbers);
        }
    }

    /// Adds the expectation for an autocovariance with finitely many lags to `total`.
    ///
    /// Its sums over cos hw and sin(hw)/sin(w) use Clenshaw's recurrence in Reinsch's form, whose differences keep the
    /// digits at small w.
    fn lags(&self, total: &mut [f64], lags: &[f64]) {
        let lags = &lags[..lags.len().min(self.n as usize)];
        add_finite_lags(Width::best(), total, &self.s, lags, self.n);
    }
}

compiled_for_each_width! {
    /// Adds the expectation of an exponential with real φ. `numbers` are (1 − φ)², φ, the numerator over q, and the
    /// numerators over q² for even and odd ordinates.
    fn add_real_exponential(total: &mut [f64], s: &[f64], sign: &[f64], numbers: &[f64; 5]) = real_exponential
}

compiled_for_each_width! {
    /// Like [`add_real_exponential`], for complex φ.
    fn add_complex_exponential(total: &mut [f64], s: &[f64], sign: &[f64], numbers: &[c64; 5]) = complex_exponential
}

compiled_for_each_width! {
    /// Adds the expectation of an autocovariance with finitely many lags, for n samples.
    fn add_finite_lags(total: &mut [f64], s: &[f64], lags: &[f64], n: f64) = finite_lags
}

/// Body of [`add_real_exponential`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn real_exponential(total: &mut [f64], s: &[f64], sign: &[f64], &[square, phi, main, ends, odd]: &[f64; 5]) {
    for ((sum, s), sign) in total.iter_mut().zip(s).zip(sign) {
        let inverse = 1.0 / (square + phi * s);
        *sum += inverse * (main - (ends - sign * odd) * (4.0 - s) * inverse);
    }
}

/// Body of [`add_complex_exponential`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn complex_exponential(
    total: &mut [f64],
    s: &[f64],
    sign: &[f64],
    &[square, phi, main, ends, odd]: &[c64; 5],
) {
    for ((sum, s), sign) in total.iter_mut().zip(s).zip(sign) {
        let (re, im) = (square.re + phi.re * s, square.im + phi.im * s);
        let norm = 1.0 / (re * re + im * im);
        let inverse = (re * norm, -im * norm);
        let end = ((ends.re - sign * odd.re) * (4.0 - s), (ends.im - sign * odd.im) * (4.0 - s));
        let re = main.re - (end.0 * inverse.0 - end.1 * inverse.1);
        let im = main.im - (end.0 * inverse.1 + end.1 * inverse.0);
        *sum += re * inverse.0 - im * inverse.1;
    }
}

/// Body of [`add_finite_lags`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn finite_lags(total: &mut [f64], s: &[f64], lags: &[f64], n: f64) {
    for (total, nodes) in total.chunks_mut(LANES).zip(s.chunks(LANES)) {
        let mut s = [0.0; LANES];
        s[..nodes.len()].copy_from_slice(nodes);
        let [mut cosines, mut rise, mut sines, mut slope] = [[0.0; LANES]; 4];
        for (h, r) in lags.iter().enumerate().skip(1).rev() {
            let twice = 2.0 * r * (1.0 - h as f64 / n);
            for k in 0..LANES {
                rise[k] += twice - s[k] * cosines[k];
                cosines[k] += rise[k];
                slope[k] += r - s[k] * sines[k];
                sines[k] += slope[k];
            }
        }
        for (k, sum) in total.iter_mut().enumerate() {
            *sum += lags[0] + rise[k] - 0.5 * s[k] * cosines[k] - 2.0 / n * sines[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// E c_j² by the definition: the double sum over pairs of samples of r(k, l) cos(w(k+½)) cos(w(l+½)).
    fn naive(r: impl Fn(usize, usize) -> f64, n: usize) -> Vec<f64> {
        let at = |j: usize| {
            let w = PI * j as f64 / n as f64;
            let c = |k: usize| (w * (k as f64 + 0.5)).cos();
            let pairs = (0..n).flat_map(|k| (0..n).map(move |l| (k, l)));
            2.0 / n as f64 * pairs.map(|(k, l)| r(k, l) * c(k) * c(l)).sum::<f64>()
        };
        (1..n).map(at).collect()
    }

    fn found(terms: &[Term], n: usize) -> Vec<f64> {
        Ordinates::new(1..n as i64, n).variance(terms).unwrap()
    }

    fn check(found: &[f64], expected: &[f64], within: f64) {
        let size = expected.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < within * size, "{found} {expected}");
        }
    }

    proptest! {
        #[test]
        fn an_exponential_is_the_double_sum(
            rate in -6.0..0.5_f64, angle in 0.0..3.0_f64, turns in any::<bool>(), tilt in -0.5..0.5_f64, n in 4_usize..40
        ) {
            let radius = (-10_f64.powf(rate)).exp();
            let angle = if turns { angle } else { 0.0 };
            let (a, phi) = (c64::new(1.0, tilt), c64::new(radius * angle.cos(), radius * angle.sin()));
            // The constant is subtracted because no ordinate depends on it.
            let r = |k: usize, l: usize| (a * (phi.powu(k.abs_diff(l) as u32) - 1.0)).re;
            let (found, expected) = (found(&[Term::Exponential { amplitude: a, phi }], n), naive(r, n));
            // phi^n is known to n eps. The term of the ends divides that error by the square of the distance to the
            // pole, so that an undamped line on an ordinate loses digits (observed: 2.7e-9 of 10 at a distance of
            // 2e-6).
            let size = expected.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
            for (j, (found, expected)) in found.iter().zip(&expected).enumerate() {
                let s = (2.0 * (PI * (j + 1) as f64 / (2 * n) as f64).sin()).powi(2);
                let rest = 1.0 - phi;
                let distance = (rest * rest + phi * s).norm();
                let lost = 16.0 * f64::EPSILON * a.norm() * rest.norm().powi(2) * (4.0 - s) / distance.powi(2);
                assert!((found - expected).abs() < 1e-9 * size + lost, "{found} {expected}");
            }
        }

        #[test]
        fn a_sum_is_the_double_sum(
            v in 0.1..3.0_f64, u in 0.1..3.0_f64, walk in 0.0..1.0_f64, n in 4_usize..40,
            lags in prop::collection::vec(-1.0..1.0_f64, 1..12)
        ) {
            let terms = [
                Term::White { variance: v },
                Term::Blue { variance: u },
                Term::RandomWalk { variance: walk },
                Term::Lags { covariances: lags.clone() },
            ];
            let r = |k: usize, l: usize| {
                let h = k.abs_diff(l);
                [v + 2.0 * u, -u].get(h).unwrap_or(&0.0) + walk * k.min(l) as f64 + lags.get(h).unwrap_or(&0.0)
            };
            check(&found(&terms, n), &naive(r, n), 1e-11);
        }
    }

    #[test]
    fn a_power_law_is_its_spectrum_times_the_end_ratios() {
        let ends = [0.5, 0.75];
        let n = 6;
        for exponent in [-1.0, 0.4] {
            let term = Term::PowerLaw { exponent, level: 2.0, end_ratios: ends.to_vec() };
            for (k, found) in found(&[term], n).iter().enumerate() {
                let j = k as f64 + 1.0;
                let ratio = ends.get(k).copied().unwrap_or(1.0 - 0.25 * 2.0 / j);
                let expected = 2.0 * (2.0 * (PI * j / 12.0).sin()).powf(exponent) * ratio;
                assert!((found / expected - 1.0).abs() < 1e-14, "{exponent} {j}: {found} {expected}");
            }
        }
    }

    #[test]
    fn bins_have_the_means_of_their_ordinates() {
        let at = Ordinates::new([1, 2, 3, 7, 9].into_iter(), 20);
        let terms = [Term::RandomWalk { variance: 1.0 }, Term::White { variance: 0.3 }];
        let single = at.variance(&terms).unwrap();
        let expected = [single[0], (single[1] + single[2] + single[3]) / 3.0, single[4]];
        assert_eq!(at.means(&terms, &[0, 1, 1, 1, 2]).unwrap(), expected);
        assert!(at.means(&terms, &[0, 1]).is_err());
    }

    #[test]
    fn power_laws_without_end_ratios_are_refused() {
        let term = Term::PowerLaw { exponent: -1.0, level: 1.0, end_ratios: Vec::new() };
        assert!(Ordinates::new(1..4, 5).variance(&[term]).is_err());
    }
}
