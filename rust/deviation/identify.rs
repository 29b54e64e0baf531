//! Which power law dominates at an averaging time: lag-1 autocorrelation.
//!
//! Riley and Greenhall, "Power law noise identification using the lag 1 autocorrelation" (2004); NIST SP 1065
//! §5.5.6. The phase taken every m points is detrended and differenced until its lag-1 autocorrelation r says
//! stationary, δ = r/(1+r) < ¼ after d differences; then `S_y` ∝ f^α with α = 2 − 2(δ + d).

use crate::phase::{Quantity, Record, Sample, plain_sum};

/// Points used per factor: enough for the noise type, few enough to cost nothing beside the deviation.
const POINTS: usize = 8192;
/// Samples summed for one factor where there is no global phase.
const STRETCH: usize = 1 << 18;
/// Independent partial sums.
const LANES: usize = 8;
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
    // Without the global phase what is needed of it has to be summed: a short stretch.
    let most = if theta.is_empty() { (STRETCH / m).clamp(FEWEST, POINTS) } else { POINTS };
    let count = points.div_ceil(m).min(most);
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
        let (power, lagged) = moments(&mut z);
        let r = lagged / power;
        let delta = r / (1.0 + r);
        if !delta.is_finite() || delta < 0.25 || d >= 2.0 {
            return (2.0 - 2.0 * (delta + d)).clamp(-4.0, 2.5);
        }
        for i in 1..z.len() {
            z[i - 1] = z[i] - z[i - 1];
        }
        z.pop();
        d += 1.0;
    }
}

/// Removes the mean; the sums of squares and of products of neighbours that are left.
fn moments(z: &mut [f64]) -> (f64, f64) {
    let mean = plain_sum(z) / z.len() as f64;
    z.iter_mut().for_each(|v| *v -= mean);
    let mut power = [0.0; LANES];
    let mut lagged = [0.0; LANES];
    let next = &z[1..];
    let (here, there) = (z.chunks_exact(LANES), next.chunks_exact(LANES));
    let whole = next.len() / LANES * LANES;
    for (a, b) in here.zip(there) {
        for i in 0..LANES {
            power[i] += a[i] * a[i];
            lagged[i] += a[i] * b[i];
        }
    }
    let rest = |f: fn(&[f64]) -> f64| z[whole..].windows(2).map(f).sum::<f64>();
    let last = z[z.len() - 1];
    let power = power.iter().sum::<f64>() + rest(|w| w[0] * w[0]) + last * last;
    (power, lagged.iter().sum::<f64>() + rest(|w| w[0] * w[1]))
}

/// Removes the least-squares parabola (orthogonal polynomials on an even grid).
fn detrend(z: &mut [f64]) {
    let n = z.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let square = (n * n - 1.0) / 12.0;
    let (mut level, mut tilt, mut bend) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    let mut t: [f64; LANES] = std::array::from_fn(|i| i as f64 - middle);
    let chunks = z.chunks_exact(LANES);
    let rest = chunks.remainder();
    let mut add = |chunk: &[f64]| {
        for (i, v) in chunk.iter().enumerate() {
            level[i] += v;
            tilt[i] += v * t[i];
            bend[i] += v * (t[i] * t[i] - square);
            t[i] += LANES as f64;
        }
    };
    chunks.for_each(&mut add);
    add(rest);
    let sum = |lanes: [f64; LANES]| lanes.iter().sum::<f64>();
    let level = sum(level) / n;
    let tilt = sum(tilt) / (n * square);
    let bend = sum(bend) / (n * (n * n - 1.0) * (n * n - 4.0) / 180.0);
    for (i, v) in z.iter_mut().enumerate() {
        let t = f64::from(i as u32) - middle;
        *v -= level + t * tilt + (t * t - square) * bend;
    }
}
