//! Maximum of the likelihood over coefficients θ ≥ 0, by Fisher scoring.

// Functions are inlined so that they are compiled with the instructions of their caller.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

use std::sync::atomic::AtomicBool;

use super::nonnegative::Nonnegative;
use super::{Evaluation, Likelihood, Ratio};
#[cfg(target_arch = "x86_64")]
use crate::machine::processor::{Unit, Width};
use crate::parallel;
use crate::{Error, Result};

/// Fractions of a step that are tried in this order until logL rises.
const STEPS: [f64; 6] = [1.0, 0.5, 0.25, 0.1, 0.03, 0.01];
/// The iteration ends when a round raises logL by less than this. Chosen by judgment; not measured.
const MIN_DELTA_LOGL: f64 = 1e-6;
/// Minimum number of maximizations per thread. Chosen by judgment; not measured.
const MIN_STARTS_PER_THREAD: usize = 8;

/// A spectrum S = offset + Gθ to be fitted to a measured power.
#[derive(Clone, Copy)]
pub(crate) struct Problem<'a> {
    pub likelihood: &'a Likelihood,
    /// Measured power, shape (bins,).
    pub power: &'a [f64],
    /// Expected power of each effect at coefficient 1, shape (p, bins).
    pub columns: &'a [f64],
    /// Power that does not depend on θ, shape (bins,) or `None`.
    pub offset: Option<&'a [f64]>,
}

/// Local maximum of the likelihood.
#[derive(Debug, Clone)]
pub(crate) struct Maximum {
    /// Shape (p,).
    pub theta: Vec<f64>,
    /// Shape (bins,).
    pub spectrum: Vec<f64>,
    /// Index of the scale; `None` at δ = 0.
    pub scale: Option<usize>,
    pub evaluation: Evaluation,
}

impl Problem<'_> {
    /// Error if the sizes of the arrays do not match.
    fn check(&self, p: usize, scale: Option<usize>) -> Result<()> {
        let bins = self.power.len();
        self.likelihood.check(self.power, self.offset.unwrap_or(self.power), scale)?;
        if self.columns.len() != p * bins {
            let found = self.columns.len();
            return Err(Error::Input(format!(
                "likelihood: columns of {found} numbers for {p} coefficients and {bins} bins"
            )));
        }
        Ok(())
    }

    /// Columns scaled to a maximum of 1 relative to the measured power, and the unit of each column.
    fn scaled(&self, p: usize) -> (Vec<f64>, Vec<f64>) {
        let bins = self.power.len();
        let unit = |c: usize| {
            let column = &self.columns[c * bins..(c + 1) * bins];
            let most = column.iter().zip(self.power).map(|(g, i)| (g / i).abs()).fold(0.0, f64::max);
            if most > 0.0 && most.is_finite() { most.recip().min(f64::MAX) } else { 1.0 }
        };
        let units: Vec<f64> = (0..p).map(unit).collect();
        let columns = (0..p * bins).map(|i| self.columns[i] * units[i / bins]).collect();
        (columns, units)
    }

    /// Starting point (p,): non-negative least squares, relative to the measured power.
    pub(crate) fn first(&self, p: usize) -> Result<Vec<f64>> {
        self.check(p, None)?;
        let (columns, units) = self.scaled(p);
        let counted = self.likelihood.count.iter().zip(self.power);
        let weight: Vec<f64> = counted.map(|(n, i)| n.sqrt() / i).collect();
        let target: Vec<f64> =
            (0..weight.len()).map(|b| (self.power[b] - self.offset.map_or(0.0, |o| o[b])).max(0.0)).collect();
        let mut theta = vec![0.0; p];
        Nonnegative::new(weight.len(), p).solve(&columns, Some(&weight), &target, &mut theta);
        if self.offset.is_none() && theta.iter().all(|t| *t == 0.0) {
            theta.fill(1.0 / p as f64);
        }
        Ok(theta.iter().zip(units).map(|(t, unit)| t * unit).collect())
    }

    /// The local maximum uphill of `start`. The scale of the discrepancy is fitted too unless it is `None`. Each
    /// round is a non-negative least-squares step with the effective degrees of freedom, shortened until logL rises.
    pub(crate) fn climb(&self, start: &[f64], scale: Option<usize>, rounds: usize) -> Result<Maximum> {
        self.check(start.len(), scale)?;
        #[cfg(target_arch = "x86_64")]
        match Width::best().unit() {
            Unit::Portable => {}
            // SAFETY: a `Width` is only made of units that the processor has.
            Unit::Avx2 => return Ok(unsafe { self.climb_wide(start, scale, rounds) }),
            // SAFETY: as above.
            Unit::Avx512 => return Ok(unsafe { self.climb_512(start, scale, rounds) }),
        }
        Ok(self.climb_body::<false>(start, scale, rounds))
    }

    /// Like [`Self::climb`], compiled for AVX2 and FMA.
    ///
    /// # Safety
    /// The processor has AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn climb_wide(&self, start: &[f64], scale: Option<usize>, rounds: usize) -> Maximum {
        self.climb_body::<true>(start, scale, rounds)
    }

    /// Like [`Self::climb`], compiled for AVX-512.
    ///
    /// # Safety
    /// The processor has AVX-512F and VL, AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma")]
    unsafe fn climb_512(&self, start: &[f64], scale: Option<usize>, rounds: usize) -> Maximum {
        self.climb_body::<true>(start, scale, rounds)
    }

    /// Body of [`Self::climb`]; `FUSED` allows fused multiply-add.
    #[inline(always)]
    fn climb_body<const FUSED: bool>(&self, start: &[f64], scale: Option<usize>, rounds: usize) -> Maximum {
        let p = start.len();
        let law = self.likelihood;
        let bins = law.bins();
        let (columns, units) = self.scaled(p);
        let mut theta: Vec<f64> = start.iter().zip(&units).map(|(t, unit)| t / unit).collect();
        let mut scale = scale;
        let rows = bins + law.total.len();
        let (mut goal, mut tried) = (theta.clone(), theta.clone());
        let (mut design, mut target) = (vec![0.0; p * rows], vec![0.0; rows]);
        let (mut spectrum, mut moved) = (vec![0.0; bins], vec![0.0; bins]);
        let (mut y, mut moved_y) = (Ratio::default(), Ratio::default());
        let (mut best, mut spare) = (Evaluation::default(), Evaluation::default());
        let mut solver = Nonnegative::new(rows, p);
        let floor = self.floor();
        self.fill(&columns, &theta, floor, &mut spectrum);
        law.fill_body::<FUSED>(self.power, &spectrum, &mut y);
        law.evaluate_body::<FUSED>(&y, scale, &mut best);
        // Without a column there is nothing to fit, and the scale is kept.
        for _ in 0..if p > 0 { rounds } else { 0 } {
            self.linearize(&columns, &spectrum, &y, &best.weight, &mut design, &mut target);
            solver.solve(&design, None, &target, &mut goal);
            let before = best.log_likelihood;
            for step in STEPS {
                for ((tried, theta), goal) in tried.iter_mut().zip(&theta).zip(&goal) {
                    *tried = theta + step * (goal - theta);
                }
                self.fill(&columns, &tried, floor, &mut moved);
                law.fill_body::<FUSED>(self.power, &moved, &mut moved_y);
                law.evaluate_body::<FUSED>(&moved_y, scale, &mut spare);
                if spare.log_likelihood > before {
                    std::mem::swap(&mut theta, &mut tried);
                    std::mem::swap(&mut spectrum, &mut moved);
                    std::mem::swap(&mut y, &mut moved_y);
                    std::mem::swap(&mut best, &mut spare);
                    break;
                }
            }
            if let Some(scale) = &mut scale {
                law.climb_scale(&y, scale, &mut best, &mut spare);
            }
            if !(best.log_likelihood - before >= MIN_DELTA_LOGL) {
                break;
            }
        }
        let theta = theta.iter().zip(units).map(|(t, unit)| t * unit).collect();
        Maximum { theta, spectrum, scale, evaluation: law.per_bin(&best) }
    }

    /// The least-squares problem for θ, linearized about a spectrum. Its first rows compare bins with the mean of
    /// their cell, with all their degrees of freedom. Its last rows are the means of cells, with the degrees of
    /// freedom that the discrepancy leaves.
    ///
    /// ∂logL/∂ln S of a bin is ½n[q(r/R − 1) + (w/N)(R − 1)] with q = 1 + (w/N)(R − 1). Here r = I/S, R is its mean
    /// over the cell, and w and N are the weight and the degrees of freedom of the cell.
    #[inline(always)]
    fn linearize(
        &self,
        columns: &[f64],
        spectrum: &[f64],
        ratio: &Ratio,
        weight: &[f64],
        design: &mut [f64],
        target: &mut [f64],
    ) {
        let law = self.likelihood;
        let (bins, cells, rows) = (law.bins(), law.total.len(), target.len());
        let (inverse, owner, root) = (&ratio.inverse[..bins], &law.owner[..bins], &law.root[..bins]);
        let (inner, outer) = target.split_at_mut(bins);
        match self.offset {
            Some(offset) => {
                for b in 0..bins {
                    inner[b] = offset[b] / spectrum[b];
                }
                law.cell_means(inner, outer);
            }
            None => target.fill(0.0),
        }
        let (inner, outer) = target.split_at_mut(bins);
        for cell in 0..cells {
            let (w, total, mean) = (weight[cell], law.total[cell], ratio.cells[cell]);
            let steep = 1.0 + (w / total) * (mean - 1.0);
            for b in law.cells[cell]..law.cells[cell + 1] {
                inner[b] = root[b] * (steep * (ratio.bins[b] / mean - 1.0) - inner[b] + outer[cell]);
            }
            outer[cell] = w.sqrt() * (mean - outer[cell]);
        }
        for (column, design) in columns.chunks_exact(bins).zip(design.chunks_exact_mut(rows)) {
            let (inner, outer) = design.split_at_mut(bins);
            for b in 0..bins {
                inner[b] = column[b] * inverse[b];
            }
            law.cell_means(inner, outer);
            for b in 0..bins {
                inner[b] = root[b] * (inner[b] - outer[owner[b]]);
            }
            for (value, w) in outer.iter_mut().zip(weight) {
                *value *= w.sqrt();
            }
        }
    }

    /// Lower bound of the fitted spectrum, which keeps it positive.
    fn floor(&self) -> f64 {
        1e-24 * self.power.iter().copied().fold(f64::NEG_INFINITY, f64::max) + 1e-300
    }

    /// Writes the spectrum S at coefficients `theta`, not below `floor`, to `out`.
    #[inline(always)]
    fn fill(&self, columns: &[f64], theta: &[f64], floor: f64, out: &mut [f64]) {
        match self.offset {
            Some(offset) => out.copy_from_slice(offset),
            None => out.fill(0.0),
        }
        for (column, theta) in columns.chunks_exact(out.len().max(1)).zip(theta) {
            out.iter_mut().zip(column).for_each(|(s, g)| *s += theta * g);
        }
        out.iter_mut().for_each(|s| *s = if *s < floor { floor } else { *s });
    }
}

/// Local maxima from many starts, without an offset. Each start has its own columns: `columns` has shape (m, p,
/// bins), `starts` (m, p).
#[expect(clippy::too_many_arguments, reason = "they define the problem")]
pub(crate) fn climb_many(
    likelihood: &Likelihood,
    power: &[f64],
    columns: &[f64],
    starts: &[f64],
    p: usize,
    scale: Option<usize>,
    rounds: usize,
    stop: &AtomicBool,
) -> Result<Vec<Maximum>> {
    let (size, m) = (p * power.len(), starts.len().checked_div(p).unwrap_or(0));
    if columns.len() != m * size || starts.len() != m * p {
        return Err(Error::Input(format!(
            "likelihood: columns of {} numbers for {m} starts, {p} coefficients and {} bins",
            columns.len(),
            power.len()
        )));
    }
    let work = |(): &mut (), i: usize| {
        let columns = &columns[i * size..(i + 1) * size];
        let problem = Problem { likelihood, power, columns, offset: None };
        problem.climb(&starts[i * p..(i + 1) * p], scale, rounds)
    };
    let threads = parallel::default_threads().min(m.div_ceil(MIN_STARTS_PER_THREAD));
    parallel::for_each(threads, 0..m, stop, || (), work)?.into_iter().collect()
}
