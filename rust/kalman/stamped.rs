//! Kalman filter of several columns at the same, arbitrary times.
//!
//! The noise is y(t) = x(t) + Σ u(t) + v. Here u are first-order Gauss-Markov processes (lags) of variance a and rate
//! λ. x is the integral of such lags plus a random walk, and is 0 at the first time. v is white. Lags are exact at
//! any time step (Uhlenbeck & Ornstein 1930). All columns share one gain, so that a series and its regressors are
//! whitened together: generalized least squares in linear time.

use std::sync::atomic::AtomicBool;

use super::SEGMENT;
use crate::parallel::check;
use crate::{Error, Result};

/// A first-order Gauss-Markov process with a stationary variance and a rate λ in 1/s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lag {
    pub variance: f64,
    pub rate: f64,
    /// True if the integral of the process is observed, false if the process itself is.
    pub integrated: bool,
}

/// Parameters of the noise.
#[derive(Debug, Clone)]
pub(crate) struct Noise {
    pub lags: Vec<Lag>,
    /// Variance that the random walk gains in 1 s.
    pub walk: f64,
    /// Variance of the white part.
    pub white: f64,
}

/// Transition of the states over one time step.
#[derive(Debug, Clone)]
struct Transition {
    time: f64,
    /// Decay φ = e^(−λt) of each lag; gain (1 − φ)/λ of integrated lags, 0 for others.
    decay: Vec<f64>,
    gain: Vec<f64>,
    /// Variance gained by each lag, its covariance with x, and the variance gained by x.
    own: Vec<f64>,
    across: Vec<f64>,
    sum: f64,
}

impl Transition {
    /// Transition over `time`.
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
                // 2s − 3 + 4e^(−s) − e^(−2s), whose terms cancel up to s³, so that small s needs the series.
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

/// Innovations of `columns` (concatenated, each of `times.len()` values) and the variances that all columns share.
///
/// Rows where `observed` is false are not observed: they do not update the filter, but their prediction errors are
/// returned.
pub(crate) fn filter(
    noise: &Noise,
    times: &[f64],
    observed: &[bool],
    columns: &[f64],
    stop: &AtomicBool,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let n = times.len();
    if observed.len() != n || n == 0 || columns.is_empty() || columns.len() % n != 0 {
        return Err(Error::Input(format!(
            "{n} times, {} marks and {} values: columns of the length of the times are needed",
            observed.len(),
            columns.len()
        )));
    }
    let good = noise.lags.iter().all(|l| l.variance >= 0.0 && l.rate > 0.0 && l.rate.is_finite());
    if !(good && noise.walk >= 0.0 && noise.white >= 0.0) {
        return Err(Error::Input("variances and rates of the noise must be positive numbers".into()));
    }
    let k = columns.len() / n;
    let mut filter = Filter::new(noise, k);
    let mut transitions: Vec<Transition> = Vec::with_capacity(MAX_TRANSITIONS);
    let mut found = vec![0.0; k];
    let (mut innovations, mut variances) = (vec![0.0; k * n], vec![0.0; n]);
    for at in 0..n {
        if at % SEGMENT == 0 {
            check(stop)?;
        }
        if at > 0 {
            let time = times[at] - times[at - 1];
            if !(time >= 0.0 && time.is_finite()) {
                return Err(Error::Input(format!("the time of row {at} is before that of the last")));
            }
            let place = transitions.iter().position(|p| (p.time - time).abs() <= 1e-12 * time);
            let place = place.unwrap_or_else(|| {
                if transitions.len() == MAX_TRANSITIONS {
                    transitions.remove(0);
                }
                transitions.push(Transition::new(noise, time));
                transitions.len() - 1
            });
            filter.advance(&transitions[place]);
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
        if observed[at] {
            filter.observe(&found, variance);
        }
    }
    Ok((innovations, variances))
}

/// Number of time steps whose transitions are cached. Most logs have few distinct steps.
const MAX_TRANSITIONS: usize = 8;

/// State of the filter: means of all columns, one row per state, and the covariance of the states. State 0 is x; the
/// lags follow.
///
/// Sums run over rows, so that the values of a row are independent sums.
struct Filter {
    states: usize,
    columns: usize,
    means: Vec<f64>,
    covariance: Vec<f64>,
    /// P H'.
    gain_numerator: Vec<f64>,
    is_observed: Vec<bool>,
    scratch: Vec<f64>,
}

impl Filter {
    /// Filter of this number of columns in the stationary state.
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
            gain_numerator: vec![0.0; states],
            is_observed: std::iter::once(true).chain(noise.lags.iter().map(|l| !l.integrated)).collect(),
            scratch: vec![0.0; states.max(columns)],
        }
    }

    /// Computes P H' and returns the variance of the next innovation.
    fn variance(&mut self, white: f64) -> f64 {
        self.gain_numerator.fill(0.0);
        for (row, &is_observed) in self.covariance.chunks_exact(self.states).zip(&self.is_observed) {
            if is_observed {
                self.gain_numerator.iter_mut().zip(row).for_each(|(s, p)| *s += p);
            }
        }
        white
            + self
                .gain_numerator
                .iter()
                .zip(&self.is_observed)
                .filter(|(_, is_observed)| **is_observed)
                .map(|(s, _)| s)
                .sum::<f64>()
    }

    /// Predicted values of all columns.
    fn predict(&self, out: &mut [f64]) {
        out.fill(0.0);
        for (row, &is_observed) in self.means.chunks_exact(self.columns).zip(&self.is_observed) {
            if is_observed {
                out.iter_mut().zip(row).for_each(|(o, m)| *o += m);
            }
        }
    }

    /// Updates the state with the innovations of one row.
    fn observe(&mut self, found: &[f64], variance: f64) {
        for (row, own) in self.means.chunks_exact_mut(self.columns).zip(&self.gain_numerator) {
            let weight = own / variance;
            row.iter_mut().zip(found).for_each(|(m, v)| *m += weight * v);
        }
        for (row, own) in self.covariance.chunks_exact_mut(self.states).zip(&self.gain_numerator) {
            let weight = own / variance;
            row.iter_mut().zip(&self.gain_numerator).for_each(|(p, s)| *p -= weight * s);
        }
    }

    /// Predicts the state after one time step.
    fn advance(&mut self, transition: &Transition) {
        let (d, k) = (self.states, self.columns);
        if transition.gain.iter().any(|&g| g != 0.0) {
            // x ← x + Σ g u: its row, then its column.
            self.scratch[..k].fill(0.0);
            for (row, gain) in self.means[k..].chunks_exact(k).zip(&transition.gain) {
                self.scratch.iter_mut().zip(row).for_each(|(r, m)| *r += gain * m);
            }
            self.means[..k].iter_mut().zip(&self.scratch).for_each(|(m, r)| *m += r);
            let (first, rest) = self.covariance.split_at_mut(d);
            for (row, gain) in rest.chunks_exact(d).zip(&transition.gain) {
                first.iter_mut().zip(row).for_each(|(x, p)| *x += gain * p);
            }
            let moved: f64 = first[1..].iter().zip(&transition.gain).map(|(p, g)| p * g).sum();
            first[0] += moved;
        }
        for (row, decay) in self.means[k..].chunks_exact_mut(k).zip(&transition.decay) {
            row.iter_mut().for_each(|m| *m *= decay);
        }
        self.covariance[0] += transition.sum;
        for i in 1..d {
            let value = self.covariance[i] * transition.decay[i - 1] + transition.across[i - 1];
            self.covariance[i] = value;
            self.covariance[i * d] = value;
            let own = transition.decay[i - 1];
            let row = &mut self.covariance[i * d + 1..(i + 1) * d];
            row.iter_mut().zip(&transition.decay).for_each(|(p, f)| *p *= own * f);
            row[i - 1] += transition.own[i - 1];
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use proptest::prelude::*;

    use super::super::dense;
    use super::*;

    /// Covariance of the signal at times s and t after the first time: the definition.
    fn covariance(noise: &Noise, s: f64, t: f64) -> f64 {
        let lag = |lag: &Lag| {
            let decay = |time: f64| (-lag.rate * time).exp();
            if lag.integrated {
                let shape = 2.0 * lag.rate * s.min(t) - 1.0 + decay(s) + decay(t) - decay((t - s).abs());
                lag.variance * shape / (lag.rate * lag.rate)
            } else {
                lag.variance * decay((t - s).abs())
            }
        };
        noise.walk * s.min(t) + noise.lags.iter().map(lag).sum::<f64>()
    }

    proptest! {
        #[test]
        fn innovations_equal_the_joint_distribution(
            lags in prop::collection::vec((0.1..3.0_f64, 0.05..2.0_f64, any::<bool>()), 0..4), walk in 0.0..1.0_f64,
            white in 0.2..2.0_f64, rows in prop::collection::vec((0.0..2.0_f64, -3.0..3.0_f64, any::<bool>()), 1..25)
        ) {
            let lags = lags.into_iter().map(|(variance, rate, integrated)| Lag { variance, rate, integrated });
            let noise = Noise { lags: lags.collect(), walk, white };
            let mut now = 0.0;
            let times: Vec<f64> = rows.iter().map(|row| { now += row.0; now }).collect();
            let values: Vec<f64> = rows.iter().map(|row| row.1).collect();
            let observed: Vec<bool> = rows.iter().map(|row| row.2).collect();
            let n = times.len();
            let signal = Mat::from_fn(n, n, |i, j| covariance(&noise, times[i] - times[0], times[j] - times[0]));
            let samples: Vec<f64> =
                values.iter().zip(&observed).map(|(x, observed)| if *observed { *x } else { f64::NAN }).collect();
            let (found, variances) = filter(&noise, &times, &observed, &values, &never_stopped()).unwrap();
            for (k, (value, variance)) in dense::innovations(&signal, white, &samples).into_iter().enumerate() {
                // The definition of an integrated lag cancels up to (rate · time)²: 1e-12 of 1/rate² = 400 at most.
                prop_assert!((variances[k] / variance - 1.0).abs() < 1e-7, "{k}: {} {variance}", variances[k]);
                prop_assert!(value.is_nan() || (found[k] - value).abs() < 1e-7, "{k}: {} {value}", found[k]);
            }
        }
    }

    fn never_stopped() -> AtomicBool {
        AtomicBool::new(false)
    }

    #[test]
    fn a_random_walk_at_uneven_times() {
        // For a random walk at uneven times, each innovation is the increment, and its variance is proportional to
        // the time step.
        let noise = Noise { lags: vec![], walk: 2.0, white: 1e-12 };
        let (times, values) = ([0.0, 1.0, 1.5, 4.0], [0.0, 1.0, 3.0, 2.0]);
        let (found, variance) = filter(&noise, &times, &[true; 4], &values, &never_stopped()).unwrap();
        for at in 1..4 {
            assert!((found[at] - (values[at] - values[at - 1])).abs() < 1e-9);
            assert!((variance[at] - 2.0 * (times[at] - times[at - 1])).abs() < 1e-9);
        }
    }

    #[test]
    fn missing_rows_are_skipped() {
        // Skipping a missing row equals one longer time step, exactly, for observed and integrated lags.
        let noise = Noise {
            lags: vec![
                Lag { variance: 3.0, rate: 0.3, integrated: true },
                Lag { variance: 2.0, rate: 0.7, integrated: false },
                Lag { variance: 2.0, rate: 1e-3, integrated: true },
            ],
            walk: 0.1,
            white: 0.5,
        };
        let (a, va) =
            filter(&noise, &[0.0, 1.0, 4.0], &[true; 3], &[1.0, 2.0, 3.0], &never_stopped()).unwrap();
        let observed = [true, true, false, true];
        let (b, vb) =
            filter(&noise, &[0.0, 1.0, 2.5, 4.0], &observed, &[1.0, 2.0, 9.0, 3.0], &never_stopped())
                .unwrap();
        assert!((a[2] - b[3]).abs() < 1e-12);
        assert!((va[2] / vb[3] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn columns_share_the_gain() {
        let lags = vec![Lag { variance: 1.0, rate: 0.1, integrated: false }];
        let noise = Noise { lags, walk: 0.0, white: 1.0 };
        let times = [0.0, 1.0, 2.0];
        let both = [1.0, 2.0, 4.0, 2.0, 4.0, 8.0];
        let (found, _) = filter(&noise, &times, &[true; 3], &both, &never_stopped()).unwrap();
        for at in 0..3 {
            assert!((2.0 * found[at] - found[3 + at]).abs() < 1e-12);
        }
    }

    #[test]
    fn wrong_input_is_refused() {
        let noise = Noise { lags: vec![], walk: 1.0, white: 1.0 };
        assert!(filter(&noise, &[1.0, 0.0], &[true; 2], &[0.0; 2], &never_stopped()).is_err());
        assert!(filter(&noise, &[0.0, 1.0], &[true; 2], &[0.0; 3], &never_stopped()).is_err());
        let none = Noise { lags: vec![], walk: 0.0, white: 0.0 };
        assert!(filter(&none, &[0.0], &[true], &[0.0], &never_stopped()).is_err());
    }
}
