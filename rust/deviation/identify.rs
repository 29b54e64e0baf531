//! The power law that dominates at an averaging time, from the lag-1 autocorrelation.
//!
//! Riley and Greenhall, "Power law noise identification using the lag 1 autocorrelation" (2004); NIST SP 1065 §5.5.6.
//! The phase at every m-th point is detrended. Then it is differenced until its lag-1 autocorrelation r indicates a
//! stationary series, δ = r/(1+r) < ¼. After d differences `S_y` ∝ f^α with α = 2 − 2(δ + d).

use crate::machine::processor::{Width, compiled_for_each_width};
use crate::phase::{Quantity, Record, Sample, plain_sum};

/// Maximum number of points per factor: enough to identify the noise, at a negligible cost compared with the
/// deviation.
const MAX_POINTS: usize = 8192;
/// Number of points computed if there is no global phase: enough for `MIN_POINTS` at the largest factor without one.
const LOCAL_POINTS: usize = 1 << 18;
/// Independent partial sums.
const LANES: usize = 8;
/// Minimum number of points. Chosen by judgment; not measured.
const MIN_POINTS: usize = 90;

/// Borders between the estimates of α for averaged noise with α = −2 … 2. Averages of flicker and random-walk FM give
/// −1.45 and −2.40 (second differences of h² ln h and h³ at lag 1 over lag 0); single samples give −1 and −2. The
/// border towards white PM is shifted towards red noise, because mistaking white FM for white PM would make the
/// interval five times too narrow.
const BORDERS: [f64; 4] = [-1.75, -0.55, 0.65, 1.8];

/// α used for longer factors if the last identified noise is white FM: halfway to flicker FM. Noise becomes redder at
/// long τ; there, at a quarter of the record, the interval for white FM would cover only 91 %. For white FM itself
/// the interval with this α covers 97 %.
const ALPHA_BEYOND_WHITE_FM: f64 = -0.5;

/// α of the nearest power law at every factor, estimated once per half octave. If the record is too short, constant,
/// or full of gaps, α of the next shorter factor is used (white FM becomes `ALPHA_BEYOND_WHITE_FM`). The shortest
/// factors use the first known α, and white FM is used if none is known.
///
/// `theta` is the global phase. If it is empty, a segment of the phase is computed from the record.
pub fn laws<T: Sample>(record: &Record<'_, T>, theta: &[f64], factors: &[usize]) -> Vec<f64> {
    let run = record.runs().iter().max_by_key(|run| run.1 - run.0).copied().unwrap_or((0, 0));
    let extra = usize::from(record.quantity() == Quantity::Rate);
    let (mut start, mut points) = (run.0, run.1 - run.0 + extra);
    let mut segment = Vec::new();
    if theta.is_empty() {
        start += points.saturating_sub(LOCAL_POINTS) / 2;
        points = points.min(LOCAL_POINTS);
        segment.resize(points, 0.0);
        record.local(start, &mut segment);
    }
    let phase = if theta.is_empty() { segment.as_slice() } else { &theta[start..start + points] };
    let (mut last, mut known, mut first) = (0, f64::NAN, f64::NAN);
    let mut found = Vec::with_capacity(factors.len());
    let mut thinned = Vec::with_capacity(MAX_POINTS.min(points));
    for &m in factors {
        if 2 * m >= 3 * last {
            last = m;
            copy_every_mth(phase, m, &mut thinned);
            let law = exponent(Width::best(), &mut thinned);
            if !law.is_nan() {
                known = BORDERS.iter().filter(|border| **border <= law).count() as f64 - 2.0;
                first = if first.is_nan() { known } else { first };
            } else if known == 0.0 {
                known = ALPHA_BEYOND_WHITE_FM;
            }
        }
        found.push(known);
    }
    let unknown = if first.is_nan() { 0.0 } else { first };
    found.iter_mut().filter(|law| law.is_nan()).for_each(|law| *law = unknown);
    found
}

/// Replaces `to` by every m-th point of the phase, at most `MAX_POINTS` from the middle.
fn copy_every_mth(phase: &[f64], m: usize, to: &mut Vec<f64>) {
    let all = phase.len().div_ceil(m);
    let count = all.min(MAX_POINTS);
    to.clear();
    to.extend(phase[(all - count) / 2 * m..].iter().step_by(m).take(count));
}

compiled_for_each_width! {
    /// Estimate of α, not rounded; overwrites `z`.
    fn exponent(z: &mut [f64]) -> f64 = exponent_inline
}

/// Body of [`exponent`].
#[expect(clippy::inline_always, reason = "compiled with the instructions of its caller")]
#[inline(always)]
fn exponent_inline(mut z: &mut [f64]) -> f64 {
    if z.len() < MIN_POINTS {
        return f64::NAN;
    }
    detrend(z);
    let mut d = 0.0;
    loop {
        let (power, lagged) = moments(z);
        let r = lagged / power;
        let delta = r / (1.0 + r);
        if !delta.is_finite() || delta < 0.25 || d >= 2.0 {
            return (2.0 - 2.0 * (delta + d)).clamp(-4.0, 2.5);
        }
        for i in 1..z.len() {
            z[i - 1] = z[i] - z[i - 1];
        }
        let less = z.len() - 1;
        z = &mut z[..less];
        d += 1.0;
    }
}

/// Removes the mean from `z`; returns Σ z[i]² and Σ z[i]·z[i+1].
#[expect(clippy::inline_always, reason = "part of `exponent_inline`")]
#[inline(always)]
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

/// Removes the least-squares parabola, by orthogonal polynomials on an even grid.
#[expect(clippy::inline_always, reason = "part of `exponent_inline`")]
#[inline(always)]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_registers_change_no_bit() {
        for n in 90..200_usize {
            let values: Vec<f64> = (0..n).map(|i| ((i * i * 7919) % 1000) as f64 / 7.0).collect();
            let plain = exponent_inline(&mut values.clone());
            for width in Width::available() {
                assert_eq!(exponent(width, &mut values.clone()).to_bits(), plain.to_bits(), "{n} points");
            }
        }
    }
}
