//! The matrices F, Q, H, R, P0 of a linear system, and products with them. F is sparse: blocks of one or two states.

use crate::{Error, Result};

/// A linear system with one output.
#[derive(Debug, Clone)]
pub(crate) struct System {
    states: usize,
    /// Nonzero elements (column, value) of each row of F.
    rows: Vec<Vec<(usize, f64)>>,
    /// Products F_i F_j, if F is diagonal.
    products: Option<Vec<f64>>,
    q: Vec<f64>,
    h: Vec<f64>,
    r: f64,
    p0: Vec<f64>,
}

impl System {
    /// System from its matrices, given row by row. Error if sizes do not match or values are not finite.
    pub(crate) fn new(f: &[f64], q: &[f64], h: &[f64], r: f64, p0: &[f64]) -> Result<Self> {
        let d = h.len();
        for (name, matrix) in [("F", f), ("Q", q), ("P0", p0)] {
            if matrix.len() != d * d {
                return Err(Error::Input(format!(
                    "{name} has {} elements: H has {d} states, which needs {}",
                    matrix.len(),
                    d * d
                )));
            }
            if let Some(bad) = matrix.iter().find(|v| !v.is_finite()) {
                return Err(Error::Input(format!("{name} holds {bad}: finite numbers are needed")));
            }
        }
        if !(r >= 0.0 && r.is_finite() && h.iter().all(|v| v.is_finite())) {
            return Err(Error::Input(format!(
                "R is {r}, or H not finite: R ≥ 0 and finite numbers are needed"
            )));
        }
        let rows: Vec<Vec<_>> = f
            .chunks(d.max(1))
            .map(|row| row.iter().copied().enumerate().filter(|&(_, v)| v != 0.0).collect())
            .collect();
        let diagonal = rows.iter().enumerate().all(|(i, row)| row.iter().all(|&(j, _)| j == i));
        let products =
            diagonal.then(|| (0..d * d).map(|k| f[(k / d) * (d + 1)] * f[(k % d) * (d + 1)]).collect());
        Ok(Self { states: d, rows, products, q: q.to_vec(), h: h.to_vec(), r, p0: p0.to_vec() })
    }

    /// Number of states.
    pub(crate) fn states(&self) -> usize {
        self.states
    }

    /// Initial covariance P0.
    pub(crate) fn initial(&self) -> &[f64] {
        &self.p0
    }

    /// Variance R of the measurement noise.
    pub(crate) fn noise(&self) -> f64 {
        self.r
    }

    /// Observed value H s of a state.
    pub(crate) fn observe(&self, state: &[f64]) -> f64 {
        self.h.iter().zip(state).map(|(h, s)| h * s).sum()
    }

    /// Writes P H' to `out`; P is the `covariance`.
    pub(crate) fn spread(&self, covariance: &[f64], out: &mut [f64]) {
        for (value, row) in out.iter_mut().zip(covariance.chunks(self.states)) {
            *value = self.observe(row);
        }
    }

    /// Predicts the state: s ← F s.
    pub(crate) fn advance(&self, state: &mut [f64], scratch: &mut [f64]) {
        scratch[..self.states].copy_from_slice(state);
        for (value, row) in state.iter_mut().zip(&self.rows) {
            *value = row.iter().map(|&(j, f)| f * scratch[j]).sum();
        }
    }

    /// Moves the adjoint one sample back: u ← F' u.
    pub(crate) fn retreat(&self, adjoint: &mut [f64], scratch: &mut [f64]) {
        scratch[..self.states].copy_from_slice(adjoint);
        adjoint.fill(0.0);
        for (row, &value) in self.rows.iter().zip(scratch.iter()) {
            for &(j, f) in row {
                adjoint[j] += f * value;
            }
        }
    }

    /// Adds an observation to the adjoint: u ← u + H' value.
    pub(crate) fn add_observed(&self, adjoint: &mut [f64], value: f64) {
        for (u, h) in adjoint.iter_mut().zip(&self.h) {
            *u += h * value;
        }
    }

    /// Adds the smoothed disturbance to the state: s ← s + Q r.
    pub(crate) fn disturb(&self, state: &mut [f64], adjoint: &[f64]) {
        for (value, row) in state.iter_mut().zip(self.q.chunks(self.states)) {
            *value += row.iter().zip(adjoint).map(|(q, r)| q * r).sum::<f64>();
        }
    }

    /// Updates and predicts the covariance: P ← F (P − weight · spread spread') F' + Q.
    pub(crate) fn propagate(&self, covariance: &mut [f64], spread: &[f64], weight: f64, scratch: &mut [f64]) {
        let d = self.states;
        if let Some(products) = &self.products {
            for (i, row) in covariance.chunks_mut(d).enumerate() {
                let own = weight * spread[i];
                let (products, q) = (&products[i * d..(i + 1) * d], &self.q[i * d..(i + 1) * d]);
                for (((p, s), f), q) in row.iter_mut().zip(spread).zip(products).zip(q) {
                    *p = (*p - own * s) * f + q;
                }
            }
            return;
        }
        for (i, row) in covariance.chunks_mut(d).enumerate() {
            let own = weight * spread[i];
            for (p, s) in row.iter_mut().zip(spread) {
                *p -= own * s;
            }
        }
        // First (F P)' = P F', then F P F'.
        for (i, row) in self.rows.iter().enumerate() {
            for k in 0..d {
                scratch[k * d + i] = row.iter().map(|&(j, f)| f * covariance[j * d + k]).sum();
            }
        }
        covariance.copy_from_slice(&self.q);
        for (row, out) in self.rows.iter().zip(covariance.chunks_mut(d)) {
            for &(j, f) in row {
                for (p, m) in out.iter_mut().zip(&scratch[j * d..(j + 1) * d]) {
                    *p += f * m;
                }
            }
        }
    }
}
