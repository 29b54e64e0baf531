//! Expectation of the squared cosine ordinates of r(h) = Re(a φ^|h|).
//!
//! E c_j² = Re a[1 + (2/n)(C − D/sin w)], w = πj/n, C = Σ_{h=1}^{n−1} (n − h) φ^h cos hw, D = Σ φ^h sin hw: geometric sums of
//! z = φe^{±iw}, whose last power is (−1)^j φ^n.

use std::f64::consts::PI;

use faer::c64;

/// E c_j² at each j in 1…n−1.
pub fn exponential(a: c64, phi: c64, ordinates: &[i64], n: usize) -> Vec<f64> {
    let count = n as f64;
    let last = if phi.norm() > 0.0 { (phi.ln() * count).exp() } else { c64::new(0.0, 0.0) };
    let real = phi.im == 0.0;
    let one = c64::new(1.0, 0.0);
    let sums = |z: c64, end: c64| {
        let inverse = one / (one - z);
        let plain = (z - end) * inverse;
        let weighted = (z - end * count + end * z * (count - 1.0)) * inverse * inverse;
        (plain, weighted)
    };
    let value = |j: &i64| {
        let (sin, cos) = (PI * *j as f64 / count).sin_cos();
        let end = if j % 2 == 0 { last } else { -last };
        let up = sums(phi * c64::new(cos, sin), end);
        // Of a real φ the other is its conjugate.
        let down = if real { (up.0.conj(), up.1.conj()) } else { sums(phi * c64::new(cos, -sin), end) };
        let cosines = (up.0 + down.0) * (0.5 * count) - (up.1 + down.1) * 0.5;
        let sines = (up.0 - down.0) * c64::new(0.0, -0.5);
        (a * (one + (cosines - sines / sin) * (2.0 / count))).re
    };
    ordinates.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The double sum over lags of cos(w(k+½)) cos(w(l+½)).
    fn naive(a: c64, phi: c64, j: usize, n: usize) -> f64 {
        let w = PI * j as f64 / n as f64;
        let c = |k: usize| (w * (k as f64 + 0.5)).cos();
        let pairs = (0..n).flat_map(|k| (0..n).map(move |l| (k, l)));
        let sum: f64 = pairs.map(|(k, l)| (a * phi.powu(k.abs_diff(l) as u32)).re * c(k) * c(l)).sum();
        2.0 / n as f64 * sum
    }

    proptest! {
        #[test]
        fn equals_the_double_sum(radius in 0.0..0.999_f64, angle in 0.0..3.0_f64, tilt in -0.5..0.5_f64, n in 4_usize..40) {
            let (a, phi) = (c64::new(1.0, tilt), c64::new(radius * angle.cos(), radius * angle.sin()));
            let j: Vec<i64> = (1..n as i64).collect();
            for (j, found) in j.iter().zip(exponential(a, phi, &j, n)) {
                let expected = naive(a, phi, *j as usize, n);
                // Differences of sums of up to n terms, over (1 − z)² ≥ 1e-6.
                prop_assert!((found - expected).abs() < 1e-8 * n as f64, "{found} {expected}");
            }
        }
    }
}
