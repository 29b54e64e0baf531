//! Total variance: second differences about every inner point of the record reflected at its ends.
//!
//! NIST SP 1065 eq. 25: the reflection is odd about the first and the last point, θ*(−j) = 2θ(0) − θ(j), so that all
//! N − 2 centres serve every m up to N − 1.

/// Σ (θ*[i−m] − 2θ[i] + θ*[i+m])² over the centres i in `span`; those whose stretch of samples holds a gap are left
/// out, and those that are NaN. `runs` are (first, last) points without a gap between them.
pub fn reflected(theta: &[f64], runs: &[(usize, usize)], span: (usize, usize), m: usize) -> (f64, u64) {
    let last = theta.len() - 1;
    let (mut sum, mut count) = (0.0, 0);
    let mut run = 0;
    for i in span.0.max(1)..span.1.min(last) {
        let (lowest, left) =
            if i >= m { (i - m, theta[i.saturating_sub(m)]) } else { (0, 2.0 * theta[0] - theta[m - i]) };
        let over = (i + m).saturating_sub(last);
        let (highest, right) =
            if over == 0 { (i + m, theta[i + m]) } else { (last, 2.0 * theta[last] - theta[last - over]) };
        let lowest = if over == 0 { lowest } else { lowest.min(last - over) };
        let highest = if i >= m { highest } else { highest.max(m - i) };
        if runs.len() != 1 || runs[0] != (0, last) {
            while run < runs.len() && runs[run].1 < i {
                run += 1;
            }
            if run == runs.len() || runs[run].0 > lowest || runs[run].1 < highest {
                continue;
            }
        }
        let d = (left + right) - 2.0 * theta[i];
        if !d.is_nan() {
            sum += d * d;
            count += 1;
        }
    }
    (sum, count)
}
