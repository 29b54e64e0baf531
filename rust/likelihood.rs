//! The likelihood of a spectrum whose model is not perfect, and its maximum over non-negative coefficients.
//!
//! In each bin the power over the spectrum is a gamma variable of shape k(w) = ν/(1 + ν δ²w), ν half the bin's degrees of
//! freedom, w inverse-gamma (1, 1): a scale mixture of normals for the discrepancy of scale δ (Andrews & Mallows 1974). The
//! marginal likelihood is a sum over nodes of w; δ = 0 is the Whittle likelihood. The reasons are in
//! `allanite.fit.discrepancy`.

mod climb;
mod gamma;
mod nonnegative;
mod sum;

use std::sync::OnceLock;

use crate::{Error, Result};
pub use climb::{Maximum, Problem, climb_many};
use gamma::{NODES, WIDTH};

/// Every fourth scale is tried where nothing is known of it.
const STRIDE: usize = 4;

/// `WIDTH` bins at one scale, node by node.
struct Block {
    /// k of each gamma law.
    shape: [[f64; WIDTH]; NODES],
    /// ln of its weight and norm less the norm at δ = 0.
    norm: [[f64; WIDTH]; NODES],
}

/// The law of bins with these degrees of freedom.
pub struct Likelihood {
    count: Vec<f64>,
    scales: Vec<f64>,
    /// Of each scale, made when it is first asked for.
    tables: Vec<OnceLock<Vec<Block>>>,
}

/// A spectrum at one scale: its marginal logL and the degrees of freedom left to each bin.
#[derive(Debug, Clone, Default)]
pub struct Judged {
    pub log_likelihood: f64,
    /// Shape (bins,).
    pub weight: Vec<f64>,
}

impl Likelihood {
    /// `count`: degrees of freedom of each bin; `scales`: the values of δ.
    pub fn new(count: Vec<f64>, scales: Vec<f64>) -> Result<Self> {
        if let Some(bad) = count.iter().find(|n| !(**n > 0.0 && n.is_finite())) {
            return Err(Error::Input(format!("likelihood: {bad} degrees of freedom: give positive numbers")));
        }
        let tables = scales.iter().map(|_| OnceLock::new()).collect();
        Ok(Self { count, scales, tables })
    }

    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.count.len()
    }

    fn table(&self, scale: usize) -> &[Block] {
        self.tables[scale].get_or_init(|| gamma::table(&self.count, self.scales[scale]))
    }

    /// Σ ½ n ln I, by which marginal and Whittle likelihoods of this power differ from `judge_at`.
    fn constant(&self, power: &[f64]) -> f64 {
        self.count.iter().zip(power).map(|(n, p)| 0.5 * n * p.ln()).sum()
    }

    /// ln(I/S) − I/S of each bin, zeros up to whole blocks.
    fn fill(&self, power: &[f64], spectrum: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend(power.iter().zip(spectrum).map(|(p, s)| {
            let ratio = p / s;
            ratio.ln() - ratio
        }));
        out.resize(self.bins().next_multiple_of(WIDTH), 0.0);
    }

    /// logL but for the constant, from what `fill` made.
    fn judge_at(&self, y: &[f64], scale: Option<usize>, out: &mut Judged) {
        out.weight.resize(y.len(), 0.0);
        if let Some(scale) = scale {
            out.log_likelihood = sum::marginal(self.table(scale), y, &mut out.weight);
        } else {
            out.weight[..self.bins()].copy_from_slice(&self.count);
            out.log_likelihood = self.count.iter().zip(y).map(|(n, y)| 0.5 * n * y).sum();
        }
    }

    /// Goes to the neighbour of a scale while that is better.
    fn better_at(&self, y: &[f64], scale: &mut usize, best: &mut Judged, spare: &mut Judged) {
        for up in [true, false] {
            while let Some(next) =
                if up { Some(*scale + 1).filter(|s| *s < self.scales.len()) } else { scale.checked_sub(1) }
            {
                self.judge_at(y, Some(next), spare);
                if !(spare.log_likelihood > best.log_likelihood) {
                    break;
                }
                *scale = next;
                std::mem::swap(best, spare);
            }
        }
    }

    /// Marginal logL and weights of a spectrum at a scale (`None`: δ = 0).
    pub fn judge(&self, power: &[f64], spectrum: &[f64], scale: Option<usize>) -> Result<Judged> {
        self.check(power, spectrum, scale)?;
        let (mut y, mut out) = (Vec::new(), Judged::default());
        self.fill(power, spectrum, &mut y);
        self.judge_at(&y, scale, &mut out);
        Ok(self.finished(power, out))
    }

    fn finished(&self, power: &[f64], mut judged: Judged) -> Judged {
        judged.log_likelihood -= self.constant(power);
        judged.weight.truncate(self.bins());
        judged
    }

    /// Marginal logL of spectra, shape (m, bins) row by row, at each of the scales; shape (scales, m).
    pub fn profile(&self, power: &[f64], spectra: &[f64], scales: &[usize]) -> Result<Vec<f64>> {
        let m = spectra.len() / self.bins().max(1);
        for scale in scales {
            self.check(power, &spectra[..self.bins().min(spectra.len())], Some(*scale))?;
        }
        let mut out = vec![0.0; scales.len() * m];
        let (mut y, mut found, constant) = (Vec::new(), Judged::default(), self.constant(power));
        for (column, spectrum) in spectra.chunks_exact(self.bins().max(1)).enumerate() {
            self.fill(power, spectrum, &mut y);
            for (row, scale) in scales.iter().enumerate() {
                self.judge_at(&y, Some(*scale), &mut found);
                out[row * m + column] = found.log_likelihood - constant;
            }
        }
        Ok(out)
    }

    /// The scale at which a spectrum is most likely: the best of all, or uphill of a given one.
    pub fn best_scale(
        &self,
        power: &[f64],
        spectrum: &[f64],
        start: Option<usize>,
    ) -> Result<(usize, Judged)> {
        self.check(power, spectrum, Some(start.unwrap_or(0)))?;
        let (mut y, mut best, mut spare) = (Vec::new(), Judged::default(), Judged::default());
        self.fill(power, spectrum, &mut y);
        let mut scale = start.unwrap_or(0);
        self.judge_at(&y, Some(scale), &mut best);
        if start.is_none() {
            for next in (0..self.scales.len()).step_by(STRIDE).skip(1) {
                self.judge_at(&y, Some(next), &mut spare);
                if spare.log_likelihood > best.log_likelihood {
                    scale = next;
                    std::mem::swap(&mut best, &mut spare);
                }
            }
        }
        self.better_at(&y, &mut scale, &mut best, &mut spare);
        Ok((scale, self.finished(power, best)))
    }

    fn check(&self, power: &[f64], spectrum: &[f64], scale: Option<usize>) -> Result<()> {
        let (bins, scales) = (self.bins(), self.scales.len());
        if power.len() != bins || spectrum.len() != bins {
            return Err(Error::Input(format!(
                "likelihood: {} powers and {} values of the spectrum for {bins} bins",
                power.len(),
                spectrum.len()
            )));
        }
        if let Some(scale) = scale.filter(|s| *s >= scales) {
            return Err(Error::Input(format!("likelihood: scale {scale} of {scales}: they count from 0")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
