//! Likelihood of a spectrum with a model discrepancy, and its maximum over non-negative coefficients.
//!
//! Bins are grouped into cells that share one discrepancy, so that a feature narrower than a cell keeps its full
//! weight. In each cell the mean of power over spectrum is a gamma variable of shape k(w) = ν/(1 + ν δ²w). Here ν is
//! half the cell's degrees of freedom, and w is inverse-gamma (1, 1): a scale mixture of normals for the discrepancy
//! of scale δ (Andrews & Mallows 1974). The marginal likelihood is a sum over nodes of w. δ = 0 gives the Whittle
//! likelihood. `allanite.fit.likelihood.discrepancy` explains these choices.

// Functions are inlined so that they are compiled with the instructions of their caller.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

mod climb;
mod exponents;
mod gamma;
mod nonnegative;
mod sum;

use std::sync::OnceLock;

#[cfg(target_arch = "x86_64")]
use crate::machine::processor::{Unit, Width};
use crate::{Error, Result};
pub(crate) use climb::{Problem, climb_many};
use exponents::ln;
use gamma::{NODES, WIDTH};

/// Without a starting value, every `STRIDE`-th scale is tried first.
const STRIDE: usize = 4;

/// Constants of `WIDTH` cells at one scale, node by node.
struct Block {
    /// Shape k of each gamma distribution.
    shape: [[f64; WIDTH]; NODES],
    /// Logarithm of the weight and norm of the distribution, minus that of the norm at δ = 0.
    norm: [[f64; WIDTH]; NODES],
}

/// Likelihood of bins with given degrees of freedom.
pub(crate) struct Likelihood {
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
    /// Constants of each scale, computed on first use.
    tables: Vec<OnceLock<Vec<Block>>>,
}

/// Marginal logL of a spectrum at one scale, and the effective degrees of freedom: of each cell during the
/// computation, of each bin in results.
#[derive(Debug, Clone, Default)]
pub(crate) struct Evaluation {
    pub log_likelihood: f64,
    /// Shape (cells,), padded to whole blocks; in results (bins,).
    pub weight: Vec<f64>,
}

/// Ratio of a measured power I and a model spectrum S, with derived quantities.
#[derive(Default)]
pub(crate) struct Ratio {
    /// 1/S of each bin.
    inverse: Vec<f64>,
    /// I/S of each bin.
    bins: Vec<f64>,
    /// n ln S of each bin.
    logs: Vec<f64>,
    /// Mean R of I/S over each cell.
    cells: Vec<f64>,
    /// ln R − R, padded with zeros to whole blocks.
    y: Vec<f64>,
    /// −½ Σ n ln S − ½ Σ n ln R.
    extra: f64,
}

impl Likelihood {
    /// Likelihood for bins with `count` degrees of freedom and discrepancy scales δ `scales`. `first` is the first
    /// bin of each cell.
    pub(crate) fn new(count: Vec<f64>, scales: Vec<f64>, first: Vec<usize>) -> Result<Self> {
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
    pub(crate) fn bins(&self) -> usize {
        self.count.len()
    }

    /// Constants of a scale.
    fn table(&self, scale: usize) -> &[Block] {
        self.tables[scale].get_or_init(|| gamma::table(&self.total, self.scales[scale]))
    }

    /// Half-open range of the bins of each cell.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
        self.cells.windows(2).map(|pair| pair[0]..pair[1])
    }

    /// Writes the mean over each cell of the values of its bins, weighted by the degrees of freedom, to `out`.
    #[inline(always)]
    fn cell_means(&self, values: &[f64], out: &mut [f64]) {
        for ((range, total), mean) in self.ranges().zip(&self.total).zip(out) {
            let sum: f64 = self.count[range.clone()].iter().zip(&values[range]).map(|(n, v)| n * v).sum();
            *mean = sum / total;
        }
    }

    /// Writes all quantities of `Ratio`, the power relative to the spectrum, to `out`.
    fn fill(&self, power: &[f64], spectrum: &[f64], out: &mut Ratio) {
        #[cfg(target_arch = "x86_64")]
        if Width::best().is_wide() {
            // SAFETY: a `Width` is only made of units that the processor has.
            return unsafe { self.fill_wide(power, spectrum, out) };
        }
        self.fill_body::<false>(power, spectrum, out);
    }

    /// Like [`Self::fill`], compiled for AVX2 and FMA.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn fill_wide(&self, power: &[f64], spectrum: &[f64], out: &mut Ratio) {
        self.fill_body::<true>(power, spectrum, out);
    }

    /// Body of [`Self::fill`]; `FUSED` allows fused multiply-add.
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

    /// Writes logL and the weights of the cells to `out`, from the result of [`Self::fill`].
    fn evaluate_at(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Evaluation) {
        #[cfg(target_arch = "x86_64")]
        match Width::best().unit() {
            Unit::Portable => {}
            // SAFETY: a `Width` is only made of units that the processor has.
            Unit::Avx2 => return unsafe { self.evaluate_wide(ratio, scale, out) },
            // SAFETY: as above.
            Unit::Avx512 => return unsafe { self.evaluate_512(ratio, scale, out) },
        }
        self.evaluate_body::<false>(ratio, scale, out);
    }

    /// Like [`Self::evaluate_at`], compiled for AVX2 and FMA.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn evaluate_wide(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Evaluation) {
        self.evaluate_body::<true>(ratio, scale, out);
    }

    /// Like [`Self::evaluate_at`], compiled for AVX-512.
    ///
    /// # Safety
    /// The processor has AVX-512F and VL, AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma")]
    unsafe fn evaluate_512(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Evaluation) {
        self.evaluate_body::<true>(ratio, scale, out);
    }

    /// Body of [`Self::evaluate_at`]; `FUSED` allows fused multiply-add.
    #[inline(always)]
    fn evaluate_body<const FUSED: bool>(&self, ratio: &Ratio, scale: Option<usize>, out: &mut Evaluation) {
        out.weight.resize(ratio.y.len(), 0.0);
        if let Some(scale) = scale {
            out.log_likelihood = sum::marginal::<FUSED>(self.table(scale), &ratio.y, &mut out.weight);
        } else {
            out.weight[..self.total.len()].copy_from_slice(&self.total);
            out.log_likelihood = self.total.iter().zip(&ratio.y).map(|(n, y)| 0.5 * n * y).sum();
        }
        out.log_likelihood += ratio.extra;
    }

    /// Moves to the next scale, up or down, as long as logL rises.
    fn climb_scale(&self, y: &Ratio, scale: &mut usize, best: &mut Evaluation, spare: &mut Evaluation) {
        for up in [true, false] {
            while let Some(next) =
                if up { Some(*scale + 1).filter(|s| *s < self.scales.len()) } else { scale.checked_sub(1) }
            {
                self.evaluate_at(y, Some(next), spare);
                if !(spare.log_likelihood > best.log_likelihood) {
                    break;
                }
                *scale = next;
                std::mem::swap(best, spare);
            }
        }
    }

    /// Marginal logL and weights (bins,) of a spectrum at a scale; `None` means δ = 0.
    pub(crate) fn evaluate(
        &self,
        power: &[f64],
        spectrum: &[f64],
        scale: Option<usize>,
    ) -> Result<Evaluation> {
        self.check(power, spectrum, scale)?;
        let (mut y, mut out) = (Ratio::default(), Evaluation::default());
        self.fill(power, spectrum, &mut y);
        self.evaluate_at(&y, scale, &mut out);
        Ok(self.per_bin(&out))
    }

    /// The result with the weight of each cell distributed to its bins.
    fn per_bin(&self, evaluation: &Evaluation) -> Evaluation {
        let mut weight = vec![0.0; self.bins()];
        for ((range, total), cell) in self.ranges().zip(&self.total).zip(&evaluation.weight) {
            for bin in range {
                weight[bin] = self.count[bin] * (cell / total);
            }
        }
        Evaluation { log_likelihood: evaluation.log_likelihood, weight }
    }

    /// Marginal logL (scales, m) of spectra (m, bins), row by row, at the given scales.
    pub(crate) fn profile(&self, power: &[f64], spectra: &[f64], scales: &[usize]) -> Result<Vec<f64>> {
        let m = spectra.len() / self.bins().max(1);
        for scale in scales {
            self.check(power, &spectra[..self.bins().min(spectra.len())], Some(*scale))?;
        }
        let mut out = vec![0.0; scales.len() * m];
        let (mut y, mut found) = (Ratio::default(), Evaluation::default());
        for (column, spectrum) in spectra.chunks_exact(self.bins().max(1)).enumerate() {
            self.fill(power, spectrum, &mut y);
            for (row, scale) in scales.iter().enumerate() {
                self.evaluate_at(&y, Some(*scale), &mut found);
                out[row * m + column] = found.log_likelihood;
            }
        }
        Ok(out)
    }

    /// The scale with the highest marginal logL, and the result there: the best of all scales, or the nearest maximum
    /// uphill of `start`.
    pub(crate) fn best_scale(
        &self,
        power: &[f64],
        spectrum: &[f64],
        start: Option<usize>,
    ) -> Result<(usize, Evaluation)> {
        self.check(power, spectrum, Some(start.unwrap_or(0)))?;
        let (mut y, mut best, mut spare) = (Ratio::default(), Evaluation::default(), Evaluation::default());
        self.fill(power, spectrum, &mut y);
        let mut scale = start.unwrap_or(0);
        self.evaluate_at(&y, Some(scale), &mut best);
        if start.is_none() {
            for next in (0..self.scales.len()).step_by(STRIDE).skip(1) {
                self.evaluate_at(&y, Some(next), &mut spare);
                if spare.log_likelihood > best.log_likelihood {
                    scale = next;
                    std::mem::swap(&mut best, &mut spare);
                }
            }
        }
        self.climb_scale(&y, &mut scale, &mut best, &mut spare);
        Ok((scale, self.per_bin(&best)))
    }

    /// Error if sizes do not match or the scale does not exist.
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
