//! The likelihood of a spectrum whose model is not perfect, and its maximum over non-negative coefficients.
//!
//! Bins are sorted into cells that share one discrepancy, so that a feature narrower than a cell has its whole vote. In each
//! cell the mean of power over spectrum is a gamma variable of shape k(w) = ν/(1 + ν δ²w), ν half the cell's degrees of
//! freedom, w inverse-gamma (1, 1): a scale mixture of normals for the discrepancy of scale δ (Andrews & Mallows 1974). The
//! marginal likelihood is a sum over nodes of w; δ = 0 is the Whittle likelihood. The reasons are in
//! `allanite.fit.likelihood.discrepancy`.

// Compiled with the instructions of the caller.
#![allow(clippy::inline_always)]

mod climb;
mod exponents;
mod gamma;
mod nonnegative;
mod sum;

use std::sync::OnceLock;

#[cfg(target_arch = "x86_64")]
use crate::machine::processor::{Unit, Width};
use crate::{Error, Result};
pub use climb::{Maximum, Problem, climb_many};
use exponents::ln;
use gamma::{NODES, WIDTH};

/// Every fourth scale is tried where nothing is known of it.
const STRIDE: usize = 4;

/// `WIDTH` bins at one scale, node by node.
struct Block {
    /// k of each gamma distribution.
    shape: [[f64; WIDTH]; NODES],
    /// ln of its weight and norm less the norm at δ = 0.
    norm: [[f64; WIDTH]; NODES],
}

/// Distribution of bins with these degrees of freedom.
pub struct Likelihood {
    count: Vec<f64>,
    /// First bin of each cell, and the end of the last.
    cells: Vec<usize>,
    /// Degrees of freedom of each cell.
    total: Vec<f64>,
    /// Cell of each bin.
    owner: Vec<usize>,
    /// √ of the degrees of freedom of each bin.
    root: Vec<f64>,
    scales: Vec<f64>,
    /// Of each scale, made when it is first asked for.
    tables: Vec<OnceLock<Vec<Block>>>,
}

/// A spectrum at one scale: its marginal logL and the degrees of freedom left to each cell, then (finished) to each bin.
#[derive(Debug, Clone, Default)]
pub struct Judged {
    pub log_likelihood: f64,
    /// Shape (cells,) in whole blocks; finished: (bins,).
    pub weight: Vec<f64>,
}

/// A power over a spectrum.
#[derive(Default)]
pub(crate) struct Ratio {
    /// 1/S of each bin.
    inverse: Vec<f64>,
    /// I/S of each bin.
    bins: Vec<f64>,
    /// n ln S of each bin.
    logs: Vec<f64>,
    /// Its mean R over each cell.
    cells: Vec<f64>,
    /// ln R − R, zeros up to whole blocks.
    y: Vec<f64>,
    /// −½ Σ n ln S − ½ Σ n ln R.
    extra: f64,
}

impl Likelihood {
    /// `count`: degrees of freedom of each bin; `scales`: the values of δ.
    ///
    /// `first`: first bin of each cell.
    pub fn new(count: Vec<f64>, scales: Vec<f64>, first: Vec<usize>) -> Result<Self> {
        if let Some(bad) = count.iter().find(|n| !(**n > 0.0 && n.is_finite())) {
            return Err(Error::Input(format!("likelihood: {bad} degrees of freedom: give positive numbers")));
        }
        let mut cells = first;
        cells.push(count.len());
        if cells[0] != 0 || cells.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(Error::Input("likelihood: cells must begin at bin 0 and rise".into()));
        }
        let total = cells.windows(2).map(|pair| count[pair[0]..pair[1]].iter().sum()).collect();
        let sizes = cells.windows(2).enumerate();
        let owner = sizes.flat_map(|(cell, pair)| std::iter::repeat_n(cell, pair[1] - pair[0])).collect();
        let root = count.iter().map(|n| n.sqrt()).collect();
        let tables = scales.iter().map(|_| OnceLock::new()).collect();
        Ok(Self { count, cells, total, owner, root, scales, tables })
    }

    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.count.len()
    }

    fn table(&self, scale: usize) -> &[Block] {
        self.tables[scale].get_or_init(|| gamma::table(&self.total, self.scales[scale]))
    }

    /// First bin and end of each cell.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        self.cells.windows(2).map(|pair| pair[0]..pair[1])
    }

    /// The mean over each cell of a value of its bins, each with its degrees of freedom.
    #[inline(always)]
    fn cell_means(&self, values: &[f64], out: &mut [f64]) {
        for ((range, total), mean) in self.ranges().zip(&self.total).zip(out) {
            let sum: f64 = self.count[range.clone()].iter().zip(&values[range]).map(|(n, v)| n * v).sum();
            *mean = sum / total;
        }
    }

    fn fill(&self, power: &[f64], spectrum: &[f64], out: &mut Ratio) {
        #[cfg(target_arch = "x86_64")]
        if Width::best().is_wide() {
            // SAFETY: a `Width` is only made of units that the processor has.
            return unsafe { self.fill_wide(power, spectrum, out) };
        }
        self.fill_body::<false>(power, spectrum, out);
    }

    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn fill_wide(&self, power: &[f64], spectrum: &[f64], out: &mut Ratio) {
        self.fill_body::<true>(power, spectrum, out);
    }

    #[inline(always)]
    fn fill_body<const FUSED: bool>(&self, power: &[f64], spectrum: &[f64], out: &mut Ratio) {
        let (bins, cells) = (self.bins(), self.total.len());
        for values in [&mut out.inverse, &mut out.bins, &mut out.logs] {
            values.resize(bins, 0.0);
        }
        out.cells.resize(cells, 0.0);
        out.y.resize(cells.next_multiple_of(WIDTH), 0.0);
        let (inverse, ratio, logs) = (&mut out.inverse[..bins], &mut out.bins[..bins], &mut out.logs[..bins]);
        let (power, spectrum, count) = (&power[..bins], &spectrum[..bins], &self.count[..bins]);
        for b in 0..bins {
            inverse[b] = 1.0 / spectrum[b];
            ratio[b] = power[b] * inverse[b];
            logs[b] = count[b] * ln::<FUSED>(spectrum[b]);
        }
        self.cell_means(ratio, &mut out.cells);
        let mut extra = logs.iter().sum::<f64>();
        for ((y, mean), total) in out.y.iter_mut().zip(&out.cells).zip(&self.total) {
            let log = ln::<FUSED>(*mean);
            *y = log - mean;
            extra += total * log;
        }
        out.extra = -0.5 * extra;
    }

    /// logL and weights of cells, from what `fill` made.
    fn judge_at(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Judged) {
        #[cfg(target_arch = "x86_64")]
        match Width::best().unit() {
            Unit::Portable => {}
            // SAFETY: a `Width` is only made of units that the processor has.
            Unit::Avx2 => return unsafe { self.judge_wide(ratio, scale, out) },
            // SAFETY: as above.
            Unit::Avx512 => return unsafe { self.judge_512(ratio, scale, out) },
        }
        self.judge_body::<false>(ratio, scale, out);
    }

    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn judge_wide(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Judged) {
        self.judge_body::<true>(ratio, scale, out);
    }

    /// # Safety
    /// The processor has AVX-512F and VL, AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma")]
    unsafe fn judge_512(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Judged) {
        self.judge_body::<true>(ratio, scale, out);
    }

    #[inline(always)]
    fn judge_body<const FUSED: bool>(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Judged) {
        out.weight.resize(ratio.y.len(), 0.0);
        if let Some(scale) = scale {
            out.log_likelihood = sum::marginal::<FUSED>(self.table(scale), &ratio.y, &mut out.weight);
        } else {
            out.weight[..self.total.len()].copy_from_slice(&self.total);
            out.log_likelihood = self.total.iter().zip(&ratio.y).map(|(n, y)| 0.5 * n * y).sum();
        }
        out.log_likelihood += ratio.extra;
    }

    /// Goes to the neighbour of a scale while that is better.
    fn better_at(&self, y: &Ratio, scale: &mut usize, best: &mut Judged, spare: &mut Judged) {
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
        let (mut y, mut out) = (Ratio::default(), Judged::default());
        self.fill(power, spectrum, &mut y);
        self.judge_at(&y, scale, &mut out);
        Ok(self.finished(&out))
    }

    /// With the weight of each cell shared by its bins.
    fn finished(&self, judged: &Judged) -> Judged {
        let mut weight = vec![0.0; self.bins()];
        for ((range, total), cell) in self.ranges().zip(&self.total).zip(&judged.weight) {
            for bin in range {
                weight[bin] = self.count[bin] * (cell / total);
            }
        }
        Judged { log_likelihood: judged.log_likelihood, weight }
    }

    /// Marginal logL of spectra, shape (m, bins) row by row, at each of the scales; shape (scales, m).
    pub fn profile(&self, power: &[f64], spectra: &[f64], scales: &[usize]) -> Result<Vec<f64>> {
        let m = spectra.len() / self.bins().max(1);
        for scale in scales {
            self.check(power, &spectra[..self.bins().min(spectra.len())], Some(*scale))?;
        }
        let mut out = vec![0.0; scales.len() * m];
        let (mut y, mut found) = (Ratio::default(), Judged::default());
        for (column, spectrum) in spectra.chunks_exact(self.bins().max(1)).enumerate() {
            self.fill(power, spectrum, &mut y);
            for (row, scale) in scales.iter().enumerate() {
                self.judge_at(&y, Some(*scale), &mut found);
                out[row * m + column] = found.log_likelihood;
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
        let (mut y, mut best, mut spare) = (Ratio::default(), Judged::default(), Judged::default());
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
        Ok((scale, self.finished(&best)))
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
