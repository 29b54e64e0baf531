//! Which power law dominates at an averaging time: lag-1 autocorrelation.
//!
//! Riley and Greenhall, "Power law noise identification using the lag 1 autocorrelation" (2004); NIST SP 1065
//! §5.5.6. The phase taken every m points is detrended and differenced until its lag-1 autocorrelation r says
//! stationary, δ = r/(1+r) < ¼ after d differences; then `S_y` ∝ f^α with α = 2 − 2(δ + d).

use crate::phase::{Quantity, Record, Sample};

/// Points used per factor: enough for the noise type, few enough to cost nothing beside the deviation.
const POINTS: usize = 8192;
/// Fewer points than this say too little; the caller keeps the type of the next shorter time.
const FEWEST: usize = 90;

/// α (not rounded) for every factor, taken anew every half octave; NaN where the record is too short, constant, or full of gaps.
///
/// `theta` is the global phase, or empty: then it is made, thinned, from the record.
pub fn exponents<T: Sample>(record: &Record<'_, T>, theta: &[f64], factors: &[usize]) -> Vec<f64> {
    let (mut last, mut known) = (0, f64::NAN);
    let each = factors.iter().map(|&m| {
        if 2 * m >= 3 * last {
            (last, known) = (m, exponent(&thinned(record, theta, m)));
        }
        known
    });
    each.collect()
}

/// Phase every m points, from the longest run without gaps; of long records a stretch in the middle.
fn thinned<T: Sample>(record: &Record<'_, T>, theta: &[f64], m: usize) -> Vec<f64> {
    let longest = record.runs().iter().max_by_key(|run| run.1 - run.0).copied().unwrap_or((0, 0));
    let extra = usize::from(record.quantity() == Quantity::Rate);
    let (start, points) = (longest.0, longest.1 - longest.0 + extra);
    let count = points.div_ceil(m).min(POINTS);
    let from = start + (points.div_ceil(m) - count) / 2 * m;
    if !theta.is_empty() {
        return (0..count).map(|i| theta[from + i * m]).collect();
    }
    let mut phase = vec![0.0; (count.saturating_sub(1)) * m + 1];
    record.local(from, &mut phase);
    phase.iter().step_by(m).copied().take(count).collect()
}

fn exponent(phase: &[f64]) -> f64 {
    let mut z = phase.to_vec();
    if z.len() < FEWEST {
        return f64::NAN;
    }
    detrend(&mut z);
    let mut d = 0.0;
    loop {
        let mean = z.iter().sum::<f64>() / z.len() as f64;
        for v in &mut z {
            *v -= mean;
        }
        let power: f64 = z.iter().map(|v| v * v).sum();
        let lagged: f64 = z.windows(2).map(|w| w[0] * w[1]).sum();
        let r = lagged / power;
        let delta = r / (1.0 + r);
        if !delta.is_finite() || delta < 0.25 || d >= 2.0 {
            return (2.0 - 2.0 * (delta + d)).clamp(-4.0, 2.5);
        }
        z = z.windows(2).map(|w| w[1] - w[0]).collect();
        d += 1.0;
    }
}

/// Removes the least-squares parabola (orthogonal polynomials on an even grid).
fn detrend(z: &mut [f64]) {
    let n = z.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let square = (n * n - 1.0) / 12.0;
    for order in 0..3 {
        let basis = |i: usize| {
            let t = i as f64 - middle;
            match order {
                0 => 1.0,
                1 => t,
                _ => t * t - square,
            }
        };
        let norm: f64 = (0..z.len()).map(|i| basis(i) * basis(i)).sum();
        let along = z.iter().enumerate().map(|(i, v)| v * basis(i)).sum::<f64>() / norm;
        z.iter_mut().enumerate().for_each(|(i, v)| *v -= along * basis(i));
    }
}
