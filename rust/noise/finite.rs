//! White noise through a filter with a finite impulse response.

use super::Process;
use crate::rng::Stream;

/// The process x_t = Σ_j c_j w_{t−j}, always summed in the order of j.
pub(super) struct Finite {
    coefficients: Vec<f64>,
    /// The normals of the past that the filter needs, followed by the current ones.
    normals: Vec<f64>,
}

impl Finite {
    /// Process from at least one coefficient.
    pub(super) fn new(coefficients: &[f64], start: &mut Stream) -> Self {
        let mut normals = vec![0.0; coefficients.len() - 1];
        start.normals(&mut normals);
        Self { coefficients: coefficients.to_vec(), normals }
    }
}

impl Process for Finite {
    fn run(&mut self, samples: &mut [f64]) {
        let before = self.normals.len();
        self.normals.extend_from_slice(samples);
        samples.fill(0.0);
        for (j, c) in self.coefficients.iter().enumerate() {
            let normals = &self.normals[before - j..];
            for (x, w) in samples.iter_mut().zip(normals) {
                *x += c * w;
            }
        }
        self.normals.drain(..samples.len());
    }
}
