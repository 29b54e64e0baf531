//! Generalised covariance of r(h) = Re(a φ^|h|), summed once or twice, and its differences.
//!
//! Summed once: C φ^|h| + G|h|, C = −a/S², G = −a c/ε, with φ = e^{−ε}, S = 2 sinh(ε/2), c = (ε/2) coth(ε/2). Summed twice:
//! C₂ φ^|h| − G(|h|³−|h|)/6 + H|h|, C₂ = a/S⁴, H = −C c/ε. For ε → 0 these are differences of large numbers; then
//! e^{−εh} goes without its first powers, and what they leave is a series in ε².

use faer::c64;

use super::differences::binomial;

/// Terms in ε²: for |ε| < ½, with the poles at ±2πi, each is some hundred times smaller than the one before, so that twelve
/// reach rounding.
const SERIES: usize = 12;

/// Square of what a term may be beside a sum that it no longer changes.
const ROUNDING: f64 = 1e-34;

/// One exponential, summed `level` times.
pub struct Exponential {
    level: usize,
    pub(super) lambda: c64,
    /// Coefficient of φ^|h|.
    pub(super) c: c64,
    /// Coefficients of |h| and |h|³ beside φ^|h|, and beside φ^|h| without its powers up to 2·level.
    pub(super) beside: [c64; 2],
    reduced: [c64; 2],
}

/// Coefficients in ε² of c = (ε/2) coth(ε/2) and of w = (ε/S)².
fn series() -> ([f64; SERIES], [f64; SERIES]) {
    let mut sinh = [0.0; SERIES];
    let mut cosh = [0.0; SERIES];
    let (mut s, mut c) = (1.0, 1.0);
    for k in 0..SERIES {
        (sinh[k], cosh[k]) = (s, c);
        c *= 0.25 / ((2 * k + 1) * (2 * k + 2)) as f64;
        s *= 0.25 / ((2 * k + 2) * (2 * k + 3)) as f64;
    }
    let inverse = divide(
        &{
            let mut one = [0.0; SERIES];
            one[0] = 1.0;
            one
        },
        &sinh,
    );
    (divide(&cosh, &sinh), multiply(&inverse, &inverse))
}

fn multiply(a: &[f64; SERIES], b: &[f64; SERIES]) -> [f64; SERIES] {
    let mut out = [0.0; SERIES];
    for i in 0..SERIES {
        for j in 0..SERIES - i {
            out[i + j] += a[i] * b[j];
        }
    }
    out
}

fn divide(a: &[f64; SERIES], b: &[f64; SERIES]) -> [f64; SERIES] {
    let mut out = [0.0; SERIES];
    for k in 0..SERIES {
        out[k] = (a[k] - (0..k).map(|j| out[j] * b[k - j]).sum::<f64>()) / b[0];
    }
    out
}

/// Σ_{k ≥ from} s_k ε^{2(k−from)}.
fn evaluate(s: &[f64; SERIES], from: usize, e2: c64) -> c64 {
    s[from..].iter().rev().fold(c64::new(0.0, 0.0), |sum, k| sum * e2 + *k)
}

/// e^z − Σ_{k<count} z^k/k!.
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
        if term.norm_sqr() < ROUNDING * sum.norm_sqr() {
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
    pub fn new(a: c64, phi: c64, level: usize) -> Self {
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
            let mut slope = [0.0; SERIES];
            for k in 0..SERIES {
                slope[k] = cs[k] - ws[k];
            }
            let linear = if small { -a * e * evaluate(&slope, 1, e2) } else { g + c1 * lambda };
            return Self { level, lambda, c: c1, beside: [g, zero], reduced: [linear, zero] };
        }
        let c2 = a / (sinh * sinh * sinh * sinh);
        let h = -c1 * 0.5 * half.cosh() / half.sinh();
        let beside = [h + g / 6.0, -g / 6.0];
        let squared = multiply(&ws, &ws);
        let reduced = if small {
            let product = multiply(&cs, &ws);
            let mut linear = [0.0; SERIES];
            let mut cubic = [0.0; SERIES];
            for k in 0..SERIES {
                linear[k] = product[k] - squared[k] - if k > 0 { cs[k - 1] / 6.0 } else { 0.0 };
                cubic[k] = (cs[k] - squared[k]) / 6.0;
            }
            [a * e * evaluate(&linear, 2, e2), a * e * evaluate(&cubic, 1, e2)]
        } else {
            [beside[0] + c2 * lambda, beside[1] + c2 * lambda * lambda * lambda / 6.0]
        };
        Self { level, lambda, c: c2, beside, reduced }
    }

    /// Rates of decay and of oscillation per sample.
    pub fn lambda(&self) -> c64 {
        self.lambda
    }

    /// Value at |h|; `reduced` leaves out the even powers that differences remove, for h short against the time constant.
    pub fn at(&self, h: f64, reduced: bool) -> c64 {
        let h = h.abs();
        let (wave, [one, three]) = if reduced {
            (exp_without(self.lambda * h, 2 * self.level + 1), self.reduced)
        } else {
            ((self.lambda * h).exp(), self.beside)
        };
        self.c * wave + (one + three * (h * h)) * h
    }

    /// Adds both differences at spacing m, short against the time constant, at some places up to 2m: the kernel 1, −4, 6,
    /// −4, 1 times at five.
    pub fn short(&self, at: &[f64], m: f64, out: &mut [f64]) {
        let kernel = |h: f64| (self.c * exp_without(self.lambda * h, 3) + self.reduced[0] * h).re;
        for (slot, &t) in out.iter_mut().zip(at) {
            let ends = kernel(t + 2.0 * m) + kernel(2.0 * m - t);
            *slot += ends - 4.0 * (kernel(t + m) + kernel((t - m).abs())) + 6.0 * kernel(t);
        }
    }
}

/// The differences of an exponential at one spacing, up to what the second difference removes.
pub struct Spaced<'a> {
    pub(super) kernel: &'a Exponential,
    pub(super) i: f64,
    pub(super) order: usize,
    /// Short against the time constant: work with φ^h without its first powers.
    pub(super) reduced: bool,
    /// For x ≥ reach: amplitude × φ^(x − reach) + constant; reduced, amplitude × (φ^x without its first powers) + slope·x +
    /// constant.
    amplitude: c64,
    slope: c64,
    constant: c64,
}

impl<'a> Spaced<'a> {
    pub fn new(kernel: &'a Exponential, i: usize, order: usize) -> Self {
        let i = i as f64;
        let (zero, lambda) = (c64::new(0.0, 0.0), kernel.lambda);
        let w = lambda * i;
        let reduced = w.norm() < 1.0;
        let mut out = Self { kernel, i, order, reduced, amplitude: zero, slope: zero, constant: zero };
        if !reduced {
            out.amplitude = kernel.c * exp_without(w, 1).powu(order as u32);
            out.constant = kernel.beside[1] * if order == 3 { 6.0 * i.powi(3) } else { 0.0 };
            return out;
        }
        let more = sinhc_power_less_one(w * 0.5, order);
        let plain = kernel.c * w.powu(order as u32);
        out.amplitude = plain * (more + 1.0);
        match (kernel.level, order) {
            // The near sum lacks the constant of h²: so does the far one, up to what is left of it.
            (1, 2) => out.constant = plain * more,
            (1, _) => {}
            _ => {
                // Likewise the line of h⁴; the constant joins with the cube beside φ^h.
                out.slope = plain * more * lambda;
                out.constant = plain * more + kernel.reduced[1] * 6.0 * i.powi(3);
            }
        }
        out
    }

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

    /// Cross-covariance of differences at spacings i and j ≥ i, by the distance t ≥ 0 of their centres.
    pub fn with(&self, j: usize) -> Crossed<'_> {
        let (j, o, lambda) = (j as f64, self.order as f64, self.kernel.lambda);
        let sign = if self.order == 3 { -1.0 } else { 1.0 };
        let reach = o * (self.i + j) / 2.0;
        let both = exp_without(lambda * self.i, 1) * exp_without(lambda * j, 1);
        let far = self.kernel.c * both.powu(self.order as u32) * sign;
        Crossed { inner: self, j, sign, reach, far }
    }
}

/// Two spacings together.
pub struct Crossed<'a> {
    pub(super) inner: &'a Spaced<'a>,
    pub(super) j: f64,
    sign: f64,
    pub(super) reach: f64,
    pub(super) far: c64,
}

impl Crossed<'_> {
    pub fn at(&self, t: f64) -> f64 {
        if t >= self.reach {
            return (self.far * (self.inner.kernel.lambda * (t - self.reach)).exp()).re;
        }
        let order = self.inner.order;
        let start = t - self.j * order as f64 / 2.0;
        let parts = binomial(order).iter().enumerate();
        self.sign * parts.map(|(b, c)| c * self.inner.at(start + b as f64 * self.j).re).sum::<f64>()
    }
}
