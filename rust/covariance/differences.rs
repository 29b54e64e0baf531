//! Differences of a power-like kernel at a given spacing, free of cancellation far from the kink of the kernel.
//!
//! Δ_i^o f(x) = Σ_a (−1)^{o−a} C(o,a) f(x + (a − o/2) i) = (2 sinh(iD/2))^o f. Near x = 0 the sum is evaluated
//! directly; far from 0 a series in i/x is used.

use super::powers::{Powers, TERMS, power_series};

/// Number of terms of the series. For x ≥ 4 o i each term is at least 64 times smaller than the previous one.
const SERIES: usize = 8;

/// The function x^p Σ_n (α_n + β_n ln x) x^{−2n}.
#[derive(Debug, Clone)]
struct Series {
    p: f64,
    terms: [(f64, f64); SERIES],
    /// True if all coefficients are zero, as after enough derivatives of a polynomial.
    is_zero: bool,
}

impl Series {
    /// Value of the series at x > 0.
    fn at(&self, x: f64) -> f64 {
        if self.is_zero {
            return 0.0;
        }
        power_series(self.p, &self.terms, x)
    }

    /// The operator Σ_k g_k D^{first + 2k} applied to the tail series of a kernel.
    fn of(kernel: &Powers, first: usize, g: &[f64; SERIES]) -> Self {
        let mut terms = [(0.0, 0.0); SERIES];
        for q in 0..TERMS {
            let mut r = kernel.p - 2.0 * q as f64;
            let (mut a, mut b) = kernel.tail[q];
            let mut differentiate = || {
                (a, b) = (r * a + b, r * b);
                r -= 1.0;
                (a, b)
            };
            let mut current = (0.0, 0.0);
            for _ in 0..first {
                current = differentiate();
            }
            for k in 0..SERIES - q {
                terms[k + q].0 += g[k] * current.0;
                terms[k + q].1 += g[k] * current.1;
                differentiate();
                current = differentiate();
            }
        }
        let is_zero = terms.iter().all(|term| *term == (0.0, 0.0));
        Self { p: kernel.p - first as f64, terms, is_zero }
    }
}

/// Coefficients, in powers of D², of (2 sinh(iD/2))^order / D^order.
fn hyperbolic(i: f64, order: usize) -> [f64; SERIES] {
    let mut base = [0.0; SERIES];
    let mut value = i;
    for (k, slot) in base.iter_mut().enumerate() {
        *slot = value;
        value *= (i / 2.0).powi(2) / ((2 * k + 2) * (2 * k + 3)) as f64;
    }
    (1..order).fold(base, |power, _| product(&power, &base))
}

/// Product of two truncated power series.
pub(super) fn product<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [f64; N] {
    let mut out = [0.0; N];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().take(N - i).enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// Weights of the points of a difference: signed binomial coefficients.
pub(super) fn binomial(order: usize) -> &'static [f64] {
    if order == 2 { &[1.0, -2.0, 1.0] } else { &[-1.0, 3.0, -3.0, 1.0] }
}

/// Differences of one kernel at one spacing.
pub(super) struct Spaced<'a> {
    kernel: &'a Powers,
    /// Spacing of the difference.
    i: f64,
    order: usize,
    /// Distance from which the series replaces the direct sum.
    far: f64,
    /// Coefficients of the difference operator; see [`hyperbolic`].
    g: [f64; SERIES],
    series: Series,
}

impl<'a> Spaced<'a> {
    /// Differences of order `order` of `kernel` at spacing `i`.
    pub(super) fn new(kernel: &'a Powers, i: usize, order: usize) -> Self {
        let i = i as f64;
        let reach = i * order as f64 / 2.0;
        let exact = kernel.table.len() as f64 + reach;
        let far = if kernel.polynomial { exact } else { exact.max(8.0 * reach) };
        let g = hyperbolic(i, order);
        Self { kernel, i, order, far, g, series: Series::of(kernel, order, &g) }
    }

    /// Difference (of the order and spacing of `self`) of the kernel, centered at `x`.
    pub(super) fn at(&self, x: f64) -> f64 {
        let sign = if x < 0.0 && self.order == 3 { -1.0 } else { 1.0 };
        let x = x.abs();
        if x >= self.far {
            return sign * self.series.at(x);
        }
        let start = x - self.i * self.order as f64 / 2.0;
        let sum: f64 = binomial(self.order)
            .iter()
            .enumerate()
            .map(|(a, c)| c * self.kernel.at(start + a as f64 * self.i))
            .sum();
        sign * sum
    }

    /// Cross-covariance of differences at spacings i and j ≥ i, as a function of the distance of their centers.
    pub(super) fn with(&self, j: usize) -> Crossed<'_> {
        let j = j as f64;
        let reach = j * self.order as f64 / 2.0;
        let far = if self.kernel.polynomial { self.far + reach } else { (self.far + reach).max(8.0 * reach) };
        let series = Series::of(self.kernel, 2 * self.order, &product(&self.g, &hyperbolic(j, self.order)));
        Crossed { inner: self, j, far, series }
    }
}

/// Cross-covariance of differences at two spacings.
pub(super) struct Crossed<'a> {
    inner: &'a Spaced<'a>,
    j: f64,
    far: f64,
    series: Series,
}

impl Crossed<'_> {
    /// Cross-covariance at distance `t` ≥ 0 of the centers.
    pub(super) fn at(&self, t: f64) -> f64 {
        let order = self.inner.order;
        let sign = if order == 3 { -1.0 } else { 1.0 };
        if t >= self.far {
            return sign * self.series.at(t);
        }
        let m = self.inner.i;
        if order == 2 && self.j == m && t + m < self.inner.far {
            // Both differences are combined into one sum over five distinct points.
            let kernel = |x: f64| self.inner.kernel.at(x);
            let (ends, middle) = (kernel(t + 2.0 * m) + kernel(t - 2.0 * m), kernel(t + m) + kernel(t - m));
            return ends - 4.0 * middle + 6.0 * kernel(t);
        }
        let start = t - self.j * order as f64 / 2.0;
        let sum: f64 = binomial(order)
            .iter()
            .enumerate()
            .map(|(b, c)| c * self.inner.at(start + b as f64 * self.j))
            .sum();
        sign * sum
    }
}
