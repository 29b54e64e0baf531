//! Generalized covariance of the autocovariance r(h) = Re(a φ^|h|), summed once or twice, and differences of it.
//!
//! Summed once: C φ^|h| + G|h|, with C = −a/S², G = −a c/ε, φ = e^{−ε}, S = 2 sinh(ε/2), c = (ε/2) coth(ε/2). Summed
//! twice: C₂ φ^|h| − G(|h|³−|h|)/6 + H|h|, with C₂ = a/S⁴, H = −C c/ε. For ε → 0 these are differences of large
//! numbers. There the first powers of e^{−εh} are removed, and the remaining coefficients are evaluated as series in
//! ε².

use faer::c64;

use super::differences::{binomial, product};

/// Number of terms in ε². The poles lie at ±2πi, so for |ε| < ½ each term is some hundred times smaller than the
/// previous one, and twelve terms reach rounding.
const SERIES: usize = 12;

/// A power series ends when the square of a term, relative to that of the sum, is below this value (1e-17 of the
/// sum).
const MAX_TERM_SQUARED: f64 = 1e-34;

/// Generalized covariance of one exponential, summed `level` times.
pub(super) struct Exponential {
    level: usize,
    /// ln φ.
    pub(super) lambda: c64,
    /// Coefficient of φ^|h|.
    pub(super) c: c64,
    /// Coefficients of |h| and |h|³ in the full form.
    pub(super) polynomial: [c64; 2],
    /// Coefficients of |h| and |h|³ in the reduced form, in which φ^|h| lacks its powers up to 2·level.
    reduced: [c64; 2],
}

/// Coefficients, in powers of ε², of c = (ε/2) coth(ε/2) and of w = (ε/S)².
fn series() -> ([f64; SERIES], [f64; SERIES]) {
    let mut sinh = [0.0; SERIES];
    let mut cosh = [0.0; SERIES];
    let (mut s, mut c) = (1.0, 1.0);
    for k in 0..SERIES {
        (sinh[k], cosh[k]) = (s, c);
        c *= 0.25 / ((2 * k + 1) * (2 * k + 2)) as f64;
        s *= 0.25 / ((2 * k + 2) * (2 * k + 3)) as f64;
    }
    let mut one = [0.0; SERIES];
    one[0] = 1.0;
    let inverse = divide(&one, &sinh);
    (divide(&cosh, &sinh), product(&inverse, &inverse))
}

/// Quotient of two truncated power series.
fn divide(a: &[f64; SERIES], b: &[f64; SERIES]) -> [f64; SERIES] {
    let mut out = [0.0; SERIES];
    for k in 0..SERIES {
        out[k] = (a[k] - (0..k).map(|j| out[j] * b[k - j]).sum::<f64>()) / b[0];
    }
    out
}

/// Value of the power series Σ_{k ≥ from} s_k ε^{2(k−from)}.
fn evaluate(s: &[f64; SERIES], from: usize, e2: c64) -> c64 {
    s[from..].iter().rev().fold(c64::new(0.0, 0.0), |sum, k| sum * e2 + *k)
}

/// The exponential e^z without its first `count` powers: e^z − Σ_{k<count} z^k/k!.
fn exp_without(z: c64, count: usize) -> c64 {
    let mut term = c64::new(1.0, 0.0);
    if z.norm() > 1.5 {
        let mut sum = z.exp();
        for k in 0..count {
            sum -= term;
            term = term * z / (k + 1) as f64;
        }
        return sum;
    }
    for k in 0..count {
        term = term * z / (k + 1) as f64;
    }
    let mut sum = term;
    for k in count..count + 20 {
        term = term * z / (k + 1) as f64;
        sum += term;
        if term.norm_sqr() < MAX_TERM_SQUARED * sum.norm_sqr() {
            break;
        }
    }
    sum
}

/// (sinh(u)/u)^order − 1 for |u| ≤ ½.
fn sinhc_power_less_one(u: c64, order: usize) -> c64 {
    let u2 = u * u;
    let mut x = c64::new(0.0, 0.0);
    for k in (1..8).rev() {
        x = (x + 1.0) * u2 / f64::from(2 * k * (2 * k + 1));
    }
    if order == 2 { x * (x + 2.0) } else { x * (x * (x + 3.0) + 3.0) }
}

impl Exponential {
    /// Generalized covariance of r(h) = Re(a φ^|h|), summed `level` = 1 or 2 times.
    pub(super) fn new(a: c64, phi: c64, level: usize) -> Self {
        let lambda = phi.ln();
        let e = -lambda;
        let e2 = e * e;
        let half = e * 0.5;
        let (sinh, small) = (half.sinh() * 2.0, e.norm() < 0.5);
        let (cs, ws) = series();
        let zero = c64::new(0.0, 0.0);
        let g = if small { -a / e * evaluate(&cs, 0, e2) } else { -a * 0.5 * half.cosh() / half.sinh() };
        let c1 = -a / (sinh * sinh);
        if level == 1 {
            let slope: [f64; SERIES] = std::array::from_fn(|k| cs[k] - ws[k]);
            let linear = if small { -a * e * evaluate(&slope, 1, e2) } else { g + c1 * lambda };
            return Self { level, lambda, c: c1, polynomial: [g, zero], reduced: [linear, zero] };
        }
        let c2 = a / (sinh * sinh * sinh * sinh);
        let h = -c1 * 0.5 * half.cosh() / half.sinh();
        let polynomial = [h + g / 6.0, -g / 6.0];
        let squared = product(&ws, &ws);
        let reduced = if small {
            let mixed = product(&cs, &ws);
            let mut linear = [0.0; SERIES];
            let mut cubic = [0.0; SERIES];
            for k in 0..SERIES {
                linear[k] = mixed[k] - squared[k] - if k > 0 { cs[k - 1] / 6.0 } else { 0.0 };
                cubic[k] = (cs[k] - squared[k]) / 6.0;
            }
            [a * e * evaluate(&linear, 2, e2), a * e * evaluate(&cubic, 1, e2)]
        } else {
            [polynomial[0] + c2 * lambda, polynomial[1] + c2 * lambda * lambda * lambda / 6.0]
        };
        Self { level, lambda, c: c2, polynomial, reduced }
    }

    /// ln φ per sample: minus the decay rate, and the angular frequency.
    pub(super) fn lambda(&self) -> c64 {
        self.lambda
    }

    /// Value at |h|. With `reduced`, even powers of h that differences remove are omitted; use it where h is short
    /// against the time constant.
    pub(super) fn at(&self, h: f64, reduced: bool) -> c64 {
        let h = h.abs();
        let (wave, [one, three]) = if reduced {
            (exp_without(self.lambda * h, 2 * self.level + 1), self.reduced)
        } else {
            ((self.lambda * h).exp(), self.polynomial)
        };
        self.c * wave + (one + three * (h * h)) * h
    }

    /// Adds the twofold second difference at spacing m, which is short against the time constant, at places up to 2m.
    /// The five weights are 1, −4, 6, −4, 1.
    pub(super) fn add_short(&self, at: &[f64], m: f64, out: &mut [f64]) {
        let kernel = |h: f64| (self.c * exp_without(self.lambda * h, 3) + self.reduced[0] * h).re;
        for (slot, &t) in out.iter_mut().zip(at) {
            let ends = kernel(t + 2.0 * m) + kernel(2.0 * m - t);
            *slot += ends - 4.0 * (kernel(t + m) + kernel((t - m).abs())) + 6.0 * kernel(t);
        }
    }
}

/// Differences of an exponential at one spacing, up to powers of h that the second difference removes.
pub(super) struct Spaced<'a> {
    pub(super) kernel: &'a Exponential,
    /// Spacing of the difference.
    pub(super) i: f64,
    pub(super) order: usize,
    /// True if the spacing is short against the time constant, so that the reduced form is used.
    pub(super) reduced: bool,
    /// Value for x ≥ reach: amplitude × φ^(x − reach) + constant. In the reduced form: amplitude × (φ^x without its
    /// first powers) + slope·x + constant.
    amplitude: c64,
    slope: c64,
    constant: c64,
}

impl<'a> Spaced<'a> {
    /// Differences of order `order` of `kernel` at spacing `i`.
    pub(super) fn new(kernel: &'a Exponential, i: usize, order: usize) -> Self {
        let i = i as f64;
        let (zero, lambda) = (c64::new(0.0, 0.0), kernel.lambda);
        let w = lambda * i;
        let reduced = w.norm() < 1.0;
        let mut out = Self { kernel, i, order, reduced, amplitude: zero, slope: zero, constant: zero };
        if !reduced {
            out.amplitude = kernel.c * exp_without(w, 1).powu(order as u32);
            out.constant = kernel.polynomial[1] * if order == 3 { 6.0 * i.powi(3) } else { 0.0 };
            return out;
        }
        let more = sinhc_power_less_one(w * 0.5, order);
        let plain = kernel.c * w.powu(order as u32);
        out.amplitude = plain * (more + 1.0);
        match (kernel.level, order) {
            // The near sum omits the constant that h² leaves; the far form must omit it too.
            (1, 2) => out.constant = plain * more,
            (1, _) => {}
            _ => {
                // The same holds for the line that h⁴ leaves. The constant includes that of the cubic term.
                out.slope = plain * more * lambda;
                out.constant = plain * more + kernel.reduced[1] * 6.0 * i.powi(3);
            }
        }
        out
    }

    /// Difference centered at `x`.
    fn at(&self, x: f64) -> c64 {
        let sign = if x < 0.0 && self.order == 3 { -1.0 } else { 1.0 };
        let x = x.abs();
        let reach = self.i * self.order as f64 / 2.0;
        let lambda = self.kernel.lambda;
        let value = if x < reach {
            let parts = binomial(self.order).iter().enumerate();
            parts.map(|(a, c)| self.kernel.at(x - reach + a as f64 * self.i, self.reduced) * *c).sum()
        } else if self.reduced {
            let removed = match (self.kernel.level, self.order) {
                (1, 2) => 1,
                (1, _) => 0,
                _ => 2,
            };
            self.amplitude * exp_without(lambda * x, removed) + self.slope * x + self.constant
        } else {
            self.amplitude * (lambda * (x - reach)).exp() + self.constant
        };
        value * sign
    }

    /// Cross-covariance of differences at spacings i and j ≥ i, as a function of the distance of their centers.
    pub(super) fn with(&self, j: usize) -> Crossed<'_> {
        let (j, o, lambda) = (j as f64, self.order as f64, self.kernel.lambda);
        let sign = if self.order == 3 { -1.0 } else { 1.0 };
        let reach = o * (self.i + j) / 2.0;
        let both = exp_without(lambda * self.i, 1) * exp_without(lambda * j, 1);
        let far = self.kernel.c * both.powu(self.order as u32) * sign;
        Crossed { inner: self, j, sign, reach, far }
    }
}

/// Cross-covariance of differences at two spacings.
pub(super) struct Crossed<'a> {
    pub(super) inner: &'a Spaced<'a>,
    pub(super) j: f64,
    sign: f64,
    /// From this distance on the covariance is a single exponential, `far` × φ^(t − reach).
    pub(super) reach: f64,
    pub(super) far: c64,
}

impl Crossed<'_> {
    /// Cross-covariance at distance `t` ≥ 0 of the centers.
    pub(super) fn at(&self, t: f64) -> f64 {
        if t >= self.reach {
            return (self.far * (self.inner.kernel.lambda * (t - self.reach)).exp()).re;
        }
        let order = self.inner.order;
        let start = t - self.j * order as f64 / 2.0;
        let parts = binomial(order).iter().enumerate();
        self.sign * parts.map(|(b, c)| c * self.inner.at(start + b as f64 * self.j).re).sum::<f64>()
    }
}
