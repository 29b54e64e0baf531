//! Kalman filter of several columns at the same, arbitrary times.
//!
//! The noise is y(t) = x(t) + Σ u(t) + v: lags u of variance a and rate λ; x the integral of such lags and a random walk,
//! 0 at the first time; v white. Lags are exact at any distance (Uhlenbeck & Ornstein 1930). All columns share one gain, so
//! that a series and its regressors are whitened together: generalised least squares in linear time.

use std::sync::atomic::AtomicBool;

use super::{STRETCH, check};
use crate::{Error, Result};

/// A first-order lag of this stationary variance and rate λ, 1/s.
#[derive(Debug, Clone, Copy)]
pub struct Lag {
    pub variance: f64,
    pub rate: f64,
    /// Whether its integral is seen.
    pub integrated: bool,
}

/// Noise at any time.
#[derive(Debug, Clone)]
pub struct Noise {
    pub lags: Vec<Lag>,
    /// Variance of the random walk in 1 s.
    pub walk: f64,
    /// Variance of the white part.
    pub white: f64,
}

/// What happens to the states over one distance of time.
#[derive(Debug, Clone)]
struct Passage {
    time: f64,
    /// φ = e^(−λt), (1 − φ)/λ of integrated lags and 0 of others.
    decay: Vec<f64>,
    gain: Vec<f64>,
    /// Variance that each lag gains, its covariance with x, and that of x.
    own: Vec<f64>,
    across: Vec<f64>,
    sum: f64,
}

impl Passage {
    fn new(noise: &Noise, time: f64) -> Self {
        let d = noise.lags.len();
        let mut out = Self {
            time,
            decay: Vec::with_capacity(d),
            gain: Vec::with_capacity(d),
            own: Vec::with_capacity(d),
            across: Vec::with_capacity(d),
            sum: noise.walk * time,
        };
        for lag in &noise.lags {
            let (a, s) = (lag.variance, lag.rate * time);
            let less = -(-s).exp_m1();
            out.decay.push((-s).exp());
            out.own.push(-a * (-2.0 * s).exp_m1());
            if lag.integrated {
                out.gain.push(less / lag.rate);
                out.across.push(a * less * less / lag.rate);
                // 2s − 3 + 4e^(−s) − e^(−2s), whose terms cancel up to s³.
                let shape = if s < 0.02 {
                    s.powi(3) * (2.0 / 3.0 - s / 2.0 + 7.0 * s * s / 30.0 - s.powi(3) / 12.0)
                } else {
                    2.0 * s - 2.0 * less - less * less
                };
                out.sum += a * shape / (lag.rate * lag.rate);
            } else {
                out.gain.push(0.0);
                out.across.push(0.0);
            }
        }
        out
    }
}

/// Innovations of `columns` (one after the other, each of `times.len()` values) and the variances that they share.
///
/// Where `there` is false nothing is observed: the value less its prediction from those before is returned all the same.
pub fn filter(
    noise: &Noise,
    times: &[f64],
    there: &[bool],
    columns: &[f64],
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let n = times.len();
    if there.len() != n || n == 0 || columns.is_empty() || columns.len() % n != 0 {
        return Err(Error::Input(format!(
            "{n} times, {} marks and {} values: columns of the length of the times are needed",
            there.len(),
            columns.len()
        )));
    }
    let good = noise.lags.iter().all(|l| l.variance >= 0.0 && l.rate > 0.0 && l.rate.is_finite());
    if !(good && noise.walk >= 0.0 && noise.white >= 0.0) {
        return Err(Error::Input("variances and rates of the noise must be positive numbers".into()));
    }
    let k = columns.len() / n;
    let mut filter = Filter::new(noise, k);
    let mut passages: Vec<Passage> = Vec::with_capacity(PASSAGES);
    let mut found = vec![0.0; k];
    let (mut innovations, mut variances) = (vec![0.0; k * n], vec![0.0; n]);
    for at in 0..n {
        if at % STRETCH == 0 {
            check(stop)?;
        }
        if at > 0 {
            let time = times[at] - times[at - 1];
            if !(time >= 0.0 && time.is_finite()) {
                return Err(Error::Input(format!("the time of row {at} is before that of the last")));
            }
            let place = passages.iter().position(|p| (p.time - time).abs() <= 1e-12 * time);
            let place = place.unwrap_or_else(|| {
                if passages.len() == PASSAGES {
                    passages.remove(0);
                }
                passages.push(Passage::new(noise, time));
                passages.len() - 1
            });
            filter.advance(&passages[place]);
        }
        let variance = filter.variance(noise.white);
        if !(variance > 0.0) {
            return Err(Error::Input(format!(
                "the variance of an innovation is {variance}: the model has no noise"
            )));
        }
        variances[at] = variance;
        filter.predict(&mut found);
        for (column, value) in found.iter_mut().enumerate() {
            *value = columns[column * n + at] - *value;
            innovations[column * n + at] = *value;
        }
        if there[at] {
            filter.observe(&found, variance);
        }
    }
    Ok((innovations, variances))
}

/// Distances of time that are kept: most logs have few.
const PASSAGES: usize = 8;

/// Means of all columns, a row a state, and the covariance of the states. State 0 is x; the lags follow.
///
/// Sums run over rows, so that each is as many independent sums as a row has values.
struct Filter {
    states: usize,
    columns: usize,
    means: Vec<f64>,
    covariance: Vec<f64>,
    /// P H'.
    spread: Vec<f64>,
    seen: Vec<bool>,
    room: Vec<f64>,
}

impl Filter {
    fn new(noise: &Noise, columns: usize) -> Self {
        let states = noise.lags.len() + 1;
        let mut covariance = vec![0.0; states * states];
        for (i, lag) in noise.lags.iter().enumerate() {
            covariance[(i + 1) * (states + 1)] = lag.variance;
        }
        Self {
            states,
            columns,
            means: vec![0.0; states * columns],
            covariance,
            spread: vec![0.0; states],
            seen: std::iter::once(true).chain(noise.lags.iter().map(|l| !l.integrated)).collect(),
            room: vec![0.0; states.max(columns)],
        }
    }

    /// Finds P H', and returns the variance of the next innovation.
    fn variance(&mut self, white: f64) -> f64 {
        self.spread.fill(0.0);
        for (row, &seen) in self.covariance.chunks_exact(self.states).zip(&self.seen) {
            if seen {
                self.spread.iter_mut().zip(row).for_each(|(s, p)| *s += p);
            }
        }
        white + self.spread.iter().zip(&self.seen).filter(|(_, seen)| **seen).map(|(s, _)| s).sum::<f64>()
    }

    fn predict(&self, out: &mut [f64]) {
        out.fill(0.0);
        for (row, &seen) in self.means.chunks_exact(self.columns).zip(&self.seen) {
            if seen {
                out.iter_mut().zip(row).for_each(|(o, m)| *o += m);
            }
        }
    }

    fn observe(&mut self, found: &[f64], variance: f64) {
        for (row, own) in self.means.chunks_exact_mut(self.columns).zip(&self.spread) {
            let weight = own / variance;
            row.iter_mut().zip(found).for_each(|(m, v)| *m += weight * v);
        }
        for (row, own) in self.covariance.chunks_exact_mut(self.states).zip(&self.spread) {
            let weight = own / variance;
            row.iter_mut().zip(&self.spread).for_each(|(p, s)| *p -= weight * s);
        }
    }

    fn advance(&mut self, passage: &Passage) {
        let (d, k) = (self.states, self.columns);
        if passage.gain.iter().any(|&g| g != 0.0) {
            // x ← x + Σ g u: its row, then its column.
            self.room[..k].fill(0.0);
            for (row, gain) in self.means[k..].chunks_exact(k).zip(&passage.gain) {
                self.room.iter_mut().zip(row).for_each(|(r, m)| *r += gain * m);
            }
            self.means[..k].iter_mut().zip(&self.room).for_each(|(m, r)| *m += r);
            let (first, rest) = self.covariance.split_at_mut(d);
            for (row, gain) in rest.chunks_exact(d).zip(&passage.gain) {
                first.iter_mut().zip(row).for_each(|(x, p)| *x += gain * p);
            }
            let moved: f64 = first[1..].iter().zip(&passage.gain).map(|(p, g)| p * g).sum();
            first[0] += moved;
        }
        for (row, decay) in self.means[k..].chunks_exact_mut(k).zip(&passage.decay) {
            row.iter_mut().for_each(|m| *m *= decay);
        }
        self.covariance[0] += passage.sum;
        for i in 1..d {
            let value = self.covariance[i] * passage.decay[i - 1] + passage.across[i - 1];
            self.covariance[i] = value;
            self.covariance[i * d] = value;
            let own = passage.decay[i - 1];
            let row = &mut self.covariance[i * d + 1..(i + 1) * d];
            row.iter_mut().zip(&passage.decay).for_each(|(p, f)| *p *= own * f);
            row[i - 1] += passage.own[i - 1];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn go() -> AtomicBool {
        AtomicBool::new(false)
    }

    #[test]
    fn a_walk_is_seen_at_any_distance() {
        // Differences of a random walk at uneven times: each innovation is the step, its variance the time between.
        let noise = Noise { lags: vec![], walk: 2.0, white: 1e-12 };
        let (times, values) = ([0.0, 1.0, 1.5, 4.0], [0.0, 1.0, 3.0, 2.0]);
        let (found, variance) = filter(&noise, &times, &[true; 4], &values, &go()).unwrap();
        for at in 1..4 {
            assert!((found[at] - (values[at] - values[at - 1])).abs() < 1e-9);
            assert!((variance[at] - 2.0 * (times[at] - times[at - 1])).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_not_there_is_passed_over() {
        // One step over a missing row is as two: lags seen and integrated, exactly.
        let noise = Noise {
            lags: vec![
                Lag { variance: 3.0, rate: 0.3, integrated: true },
                Lag { variance: 2.0, rate: 0.7, integrated: false },
                Lag { variance: 2.0, rate: 1e-3, integrated: true },
            ],
            walk: 0.1,
            white: 0.5,
        };
        let (a, va) = filter(&noise, &[0.0, 1.0, 4.0], &[true; 3], &[1.0, 2.0, 3.0], &go()).unwrap();
        let there = [true, true, false, true];
        let (b, vb) = filter(&noise, &[0.0, 1.0, 2.5, 4.0], &there, &[1.0, 2.0, 9.0, 3.0], &go()).unwrap();
        assert!((a[2] - b[3]).abs() < 1e-12);
        assert!((va[2] / vb[3] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn columns_share_the_gain() {
        let lags = vec![Lag { variance: 1.0, rate: 0.1, integrated: false }];
        let noise = Noise { lags, walk: 0.0, white: 1.0 };
        let times = [0.0, 1.0, 2.0];
        let both = [1.0, 2.0, 4.0, 2.0, 4.0, 8.0];
        let (found, _) = filter(&noise, &times, &[true; 3], &both, &go()).unwrap();
        for at in 0..3 {
            assert!((2.0 * found[at] - found[3 + at]).abs() < 1e-12);
        }
    }

    #[test]
    fn wrong_input_is_refused() {
        let noise = Noise { lags: vec![], walk: 1.0, white: 1.0 };
        assert!(filter(&noise, &[1.0, 0.0], &[true; 2], &[0.0; 2], &go()).is_err());
        assert!(filter(&noise, &[0.0, 1.0], &[true; 2], &[0.0; 3], &go()).is_err());
        let none = Noise { lags: vec![], walk: 0.0, white: 0.0 };
        assert!(filter(&none, &[0.0], &[true], &[0.0], &go()).is_err());
    }
}
