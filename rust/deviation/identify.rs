//! Which power law dominates at an averaging time: lag-1 autocorrelation.
//!
//! Riley and Greenhall, "Power law noise identification using the lag 1 autocorrelation" (2004); NIST SP 1065
//! §5.5.6. The phase taken every m points is detrended and differenced until its lag-1 autocorrelation r says
//! stationary, δ = r/(1+r) < ¼ after d differences; then `S_y` ∝ f^α with α = 2 − 2(δ + d).

#[cfg(target_arch = "x86_64")]
use crate::machine::processor::Width;
use crate::phase::{Quantity, Record, Sample, plain_sum};

/// Points used per factor: enough for the noise type, few enough to cost nothing beside the deviation.
const POINTS: usize = 8192;
/// Points made where there is no global phase: enough for `FEWEST` at the largest factor without one.
const STRETCH: usize = 1 << 18;
/// Independent partial sums.
const LANES: usize = 8;
/// Fewer points than this say too little.
const FEWEST: usize = 90;

/// Between the values that the lag-1 estimate takes for averaged α = −2 … 2. Averages of flicker and random-walk FM read
/// −1.45 and −2.40 (second differences of h² ln h and h³ at lag 1 over lag 0), single samples −1 and −2. Towards white
/// PM a little towards red: mistaking white FM for it would narrow the interval fivefold.
const BORDERS: [f64; 4] = [-1.75, -0.55, 0.65, 1.8];

/// What white FM is carried on as where nothing more can be identified: halfway to flicker FM. Noise becomes redder, and there
/// the interval of white FM covers 91 % at a quarter of the record; of white FM itself this one covers 97 %.
const UNSURE: f64 = -0.5;

/// α of the nearest power law at every factor, taken anew every half octave. Where the record is too short, constant or
/// full of gaps that of the next shorter factor (white FM as `UNSURE`), of the first known one, or white FM where none is known.
///
/// `theta` is the global phase, or empty: then a stretch of it is made from the record.
pub fn laws<T: Sample>(record: &Record<'_, T>, theta: &[f64], factors: &[usize]) -> Vec<f64> {
    let run = record.runs().iter().max_by_key(|run| run.1 - run.0).copied().unwrap_or((0, 0));
    let extra = usize::from(record.quantity() == Quantity::Rate);
    let (mut start, mut points) = (run.0, run.1 - run.0 + extra);
    let mut stretch = Vec::new();
    if theta.is_empty() {
        start += points.saturating_sub(STRETCH) / 2;
        points = points.min(STRETCH);
        stretch.resize(points, 0.0);
        record.local(start, &mut stretch);
    }
    let phase = if theta.is_empty() { stretch.as_slice() } else { &theta[start..start + points] };
    let (mut last, mut known, mut first) = (0, f64::NAN, f64::NAN);
    let mut found = Vec::with_capacity(factors.len());
    let mut thinned = Vec::with_capacity(POINTS.min(points));
    for &m in factors {
        if 2 * m >= 3 * last {
            last = m;
            thin(phase, m, &mut thinned);
            let law = exponent(&mut thinned);
            if !law.is_nan() {
                known = BORDERS.iter().filter(|border| **border <= law).count() as f64 - 2.0;
                first = if first.is_nan() { known } else { first };
            } else if known == 0.0 {
                known = UNSURE;
            }
        }
        found.push(known);
    }
    let unknown = if first.is_nan() { 0.0 } else { first };
    found.iter_mut().filter(|law| law.is_nan()).for_each(|law| *law = unknown);
    found
}

/// The phase every m points; of many of them those in the middle.
fn thin(phase: &[f64], m: usize, to: &mut Vec<f64>) {
    let all = phase.len().div_ceil(m);
    let count = all.min(POINTS);
    to.clear();
    to.extend(phase[(all - count) / 2 * m..].iter().step_by(m).take(count));
}

/// α, not rounded; what it takes is changed. On wide registers where there are any: the same operations, the same bits.
fn exponent(z: &mut [f64]) -> f64 {
    #[cfg(target_arch = "x86_64")]
    if Width::best().is_wide() {
        // SAFETY: a wide `Width` is only made on a processor with AVX2.
        return unsafe { exponent_wide(z) };
    }
    exponent_by(z)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn exponent_wide(z: &mut [f64]) -> f64 {
    exponent_by(z)
}

#[expect(clippy::inline_always, reason = "compiled again inside `exponent_wide` with its registers")]
#[inline(always)]
fn exponent_by(mut z: &mut [f64]) -> f64 {
    if z.len() < FEWEST {
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

/// Removes the mean; the sums of squares and of products of neighbours that are left.
#[expect(clippy::inline_always, reason = "part of `exponent_by`")]
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

/// Removes the least-squares parabola (orthogonal polynomials on an even grid).
#[expect(clippy::inline_always, reason = "part of `exponent_by`")]
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
            let (found, plain) = (exponent(&mut values.clone()), exponent_by(&mut values.clone()));
            assert_eq!(found.to_bits(), plain.to_bits(), "{n} points");
        }
    }
}
