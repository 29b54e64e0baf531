//! White noise through a filter that ends after a number of samples.

use super::Process;
use crate::rng::Stream;

/// x_t = Σ_j c_j w_{t−j}, every sum in the order of j.
pub struct Finite {
    coefficients: Vec<f64>,
    /// The normals before the next sample, as many as the filter looks back, then those at hand.
    normals: Vec<f64>,
}

impl Finite {
    /// At least one coefficient.
    pub fn new(coefficients: &[f64], start: &mut Stream) -> Self {
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
