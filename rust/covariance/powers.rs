//! Generalized covariance of the spectrum (2 sin(w/2))^b for b ≤ 0: an exact table at small lags, then its power
//! series.
//!
//! With d = −b/2 the covariance is Γ(1−2d) Γ(h+d) / (Γ(d) Γ(1−d) Γ(h+1−d)) (Hosking 1981). The formula is continued
//! beyond d = ½, where only differences of the covariance have a meaning, so even powers of h below the order of the
//! differences may be omitted. At odd b the limit is a polynomial times Σ_{k≤h} 1/(2k−1).

use std::f64::consts::PI;

/// Number of tabulated lags. From here on four terms of the series are exact to 1e-14.
const TABLE: usize = 64;
/// Number of terms of the series.
pub(super) const TERMS: usize = 5;
/// Exponents closer than this to an odd number are interpolated from their neighbors, because Γ(1−2d) has a pole at
/// odd b.
const POLE: f64 = 2e-3;

/// A function of |h|: `table[h]` inside the table, and h^p Σ_q (α_q + β_q ln h) h^{−2q} beyond it.
#[derive(Debug, Clone)]
pub(super) struct Powers {
    pub table: Vec<f64>,
    pub p: f64,
    pub tail: [(f64, f64); TERMS],
    /// True if the tail is a polynomial, so that its differences are finite sums.
    pub polynomial: bool,
}

impl Powers {
    /// Value at integer |h|.
    pub(super) fn at(&self, h: f64) -> f64 {
        let h = h.abs();
        match self.table.get(h as usize) {
            Some(value) => *value,
            None => self.beyond(h),
        }
    }

    /// Value of the series at h > 0.
    fn beyond(&self, h: f64) -> f64 {
        power_series(self.p, &self.tail, h)
    }

    /// The same function with its table computed from the series.
    fn fill_from_tail(mut self) -> Self {
        self.table = (0..TABLE).map(|h| self.beyond(h as f64)).collect();
        self.table[0] = 0.0;
        self
    }
}

/// h^p Σ_q (α_q + β_q ln h) h^(−2q) at h > 0. A whole power p is computed by repeated multiplication.
pub(super) fn power_series(p: f64, terms: &[(f64, f64)], h: f64) -> f64 {
    let inverse = 1.0 / (h * h);
    let (mut plain, mut with_log) = (0.0, 0.0);
    for (a, b) in terms.iter().rev() {
        plain = plain * inverse + a;
        with_log = with_log * inverse + b;
    }
    if with_log != 0.0 {
        plain += with_log * h.ln();
    }
    plain * if p.fract() == 0.0 { h.powi(p as i32) } else { h.powf(p) }
}

/// The function Σ_q c_q h^(p − 2q).
fn polynomial(p: f64, coefficients: &[f64]) -> Powers {
    let mut tail = [(0.0, 0.0); TERMS];
    for (slot, c) in tail.iter_mut().zip(coefficients) {
        slot.0 = *c;
    }
    let mut out = Powers { table: Vec::new(), p, tail, polynomial: true }.fill_from_tail();
    out.table.truncate(1);
    out
}

/// `scale` times the generalized covariance of (2 sin(w/2))^b.
pub(super) fn fractional(b: f64, scale: f64) -> Vec<Powers> {
    let odd = ((b - 1.0) / 2.0).round() * 2.0 + 1.0;
    let from_odd = b - odd;
    if from_odd.abs() >= POLE {
        return vec![even_exponent(b, scale).unwrap_or_else(|| any_exponent(b, scale))];
    }
    let share = from_odd.abs() / POLE;
    let mut out = vec![odd_exponent(odd, scale * (1.0 - share))];
    if share > 1e-6 {
        out.push(any_exponent(odd + POLE.copysign(from_odd), scale * share));
    }
    out
}

/// Covariance for even b, which is a polynomial; `None` for any other b.
fn even_exponent(b: f64, scale: f64) -> Option<Powers> {
    let coefficients: &[f64] = match (b.round() as i64, (b - b.round()).abs() < 1e-12) {
        (0, true) => {
            let nothing = [(0.0, 0.0); TERMS];
            return Some(Powers { table: vec![scale], p: 0.0, tail: nothing, polynomial: true });
        }
        (-2, true) => &[-0.5],
        (-4, true) => &[1.0 / 12.0, -1.0 / 12.0],
        (-6, true) => &[-1.0 / 240.0, 5.0 / 240.0, -4.0 / 240.0],
        _ => return None,
    };
    let scaled: Vec<f64> = coefficients.iter().map(|c| c * scale).collect();
    Some(polynomial(-b - 1.0, &scaled))
}

/// Covariance for odd b = −1 − 2k: C Π_{l=1..k} (h² − (l−½)²) · Σ_{r≤h} 1/(2r−1), without the constant of the sum.
fn odd_exponent(b: f64, scale: f64) -> Powers {
    let k = ((-b - 1.0) / 2.0).round() as usize;
    let mut c = -2.0 / PI * scale;
    for l in 1..=k {
        // Two summations raise h^{2l−2} to h^{2l}/((2l)(2l−1)).
        c *= -1.0 / (2 * l * (2 * l - 1)) as f64;
    }
    let roots: Vec<f64> = (1..=k).map(|l| (l as f64 - 0.5).powi(2)).collect();
    // Σ 1/(2r−1) = ½ ln h + const + 1/(48h²) − 7/(1920h⁴) + 31/(16128h⁶) − …
    let mut tail = [
        (0.0, 0.5 * c),
        (c / 48.0, 0.0),
        (-7.0 * c / 1920.0, 0.0),
        (31.0 * c / 16128.0, 0.0),
        (-127.0 * c / 61440.0, 0.0),
    ];
    for root in &roots {
        for q in (1..TERMS).rev() {
            tail[q].0 -= root * tail[q - 1].0;
            tail[q].1 -= root * tail[q - 1].1;
        }
    }
    // The constant of the sum, ln 2 + γ/2, multiplies only even powers of h, which every difference removes.
    let constant = std::f64::consts::LN_2 + 0.5 * 0.577_215_664_901_532_9;
    let mut sum = 0.0;
    let table = (0..TABLE)
        .map(|h| {
            if h > 0 {
                sum += 1.0 / (2 * h - 1) as f64;
            }
            let square = (h * h) as f64;
            c * roots.iter().map(|root| square - root).product::<f64>() * (sum - constant)
        })
        .collect();
    Powers { table, p: 2.0 * k as f64, tail, polynomial: false }
}

/// Covariance for any b that is not close to an odd number.
fn any_exponent(b: f64, scale: f64) -> Powers {
    let d = -b / 2.0;
    let mu = d - 0.5;
    // ln Γ(h+½+μ)/Γ(h+½−μ) = 2μ ln h − Σ 2 B_{k+1}(½+μ)/(k(k+1) h^k), k = 2, 4, 6, 8.
    let b3 = mu.powi(3) - mu / 4.0;
    let b5 = mu.powi(5) - 5.0 / 6.0 * mu.powi(3) + 7.0 / 48.0 * mu;
    let b7 = mu.powi(7) - 7.0 / 4.0 * mu.powi(5) + 49.0 / 48.0 * mu.powi(3) - 31.0 / 192.0 * mu;
    let b9 = mu.powi(9) - 3.0 * mu.powi(7) + 147.0 / 40.0 * mu.powi(5) - 31.0 / 16.0 * mu.powi(3)
        + 381.0 / 1280.0 * mu;
    let (l1, l2, l3, l4) = (-b3 / 3.0, -b5 / 10.0, -b7 / 21.0, -b9 / 36.0);
    let c = scale / (2.0 * (PI * d).cos() * gamma(2.0 * d));
    let series = [
        1.0,
        l1,
        l2 + l1 * l1 / 2.0,
        l3 + l1 * l2 + l1.powi(3) / 6.0,
        l4 + l1 * l3 + l2 * l2 / 2.0 + l1 * l1 * l2 / 2.0 + l1.powi(4) / 24.0,
    ];
    let tail = series.map(|e| (c * e, 0.0));
    let mut out = Powers { table: Vec::new(), p: 2.0 * mu, tail, polynomial: false };
    let mut table = vec![0.0; TABLE];
    let mut value = out.beyond(TABLE as f64);
    for h in (0..TABLE).rev() {
        // Recurrence of Γ(h+d)/Γ(h+1−d) from h + 1 to h.
        value *= (h as f64 + 1.0 - d) / (h as f64 + d);
        table[h] = value;
    }
    out.table = table;
    out
}

/// Generalized covariance of an autocovariance with finitely many lags r(0), r(1), …, summed `level` times.
pub(super) fn finite(lags: &[f64], level: usize) -> Powers {
    let sum = |power: i32| -> f64 {
        lags.iter().enumerate().skip(1).map(|(h, r)| 2.0 * r * (h as f64).powi(power)).sum()
    };
    let total = lags[0] + sum(0);
    // The polynomial is evaluated at the last lag, which must not be 0.
    let length = lags.len().max(2);
    let lag = |h: usize| lags.get(h).copied().unwrap_or(0.0);
    let once = extended_down(polynomial(1.0, &[-0.5 * total]), length, lag);
    if level == 1 {
        return once;
    }
    let cubic = polynomial(3.0, &[total / 12.0, 0.25 * sum(2) - total / 12.0]);
    extended_down(cubic, length, |h| once.at(h as f64))
}

/// Extends a kernel, whose polynomial holds from `length` − 1 on, to smaller lags: its second difference there is
/// −`less`.
fn extended_down(mut kernel: Powers, length: usize, less: impl Fn(usize) -> f64) -> Powers {
    let mut table = vec![0.0; length];
    let (mut here, mut next) = (kernel.beyond(length as f64 - 1.0), kernel.beyond(length as f64));
    for h in (0..length).rev() {
        table[h] = here;
        (here, next) = (2.0 * here - next - less(h), here);
    }
    kernel.table = table;
    kernel
}

/// Γ(x) for x in (0, 10] by the Lanczos approximation (g = 7, nine terms), accurate to 1e-15.
fn gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        return gamma(x + 1.0) / x;
    }
    let z = x - 1.0;
    let sum = C[0] + (1..9).map(|k| C[k] / (z + k as f64)).sum::<f64>();
    let t = z + 7.5;
    (2.0 * PI).sqrt() * t.powf(z + 0.5) * (-t).exp() * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last table entry equals the value of the series.
    #[test]
    fn table_meets_tail() {
        for b in [-0.3, -0.7, -1.0, -1.7, -2.0, -2.5, -3.0, -3.4, -4.0, -4.7, -5.0, -5.5, -6.0] {
            for kernel in fractional(b, 1.0) {
                let h = kernel.table.len() as f64 - 1.0;
                if h > 2.0 {
                    let (inside, outside) = (kernel.at(h), kernel.beyond(h));
                    assert!((inside / outside - 1.0).abs() < 1e-12, "b {b}: {inside} {outside}");
                }
            }
        }
    }

    /// Second difference of the kernel of b − 2 is minus the kernel of b, up to a constant.
    #[test]
    fn two_sums_lower_the_exponent_by_two() {
        for b in [-0.4, -1.0, -1.5, -2.0, -3.0] {
            let (upper, lower) = (fractional(b - 2.0, 1.0).remove(0), fractional(b, 1.0).remove(0));
            let miss = |h: f64| upper.at(h + 1.0) - 2.0 * upper.at(h) + upper.at(h - 1.0) + lower.at(h);
            // For b = −3 the omitted powers include h².
            let curved = miss(7.0) - 2.0 * miss(4.0) + miss(1.0);
            let again = miss(12.0) - 2.0 * miss(9.0) + miss(6.0);
            assert!((curved - again).abs() < 1e-9, "b {b}: {curved} {again}");
        }
    }

    #[test]
    fn gamma_of_halves() {
        assert!((gamma(0.5) - PI.sqrt()).abs() < 1e-14);
        assert!((gamma(5.0) - 24.0).abs() < 1e-12);
    }
}
