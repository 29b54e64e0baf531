//! Generalized covariance of a sum of primitive processes, and of its differences.

use faer::c64;

use super::differences;
use super::exponential::{self, Exponential};
use super::lags::{self, Smooth, Wave};
use super::powers::{self, Powers};
use super::runs::Runs;
use super::term::Term;
use crate::{Error, Result};

/// The variance estimator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Overlapping Allan.
    Allan,
    /// Modified Allan.
    Modified,
    /// Overlapping Hadamard.
    Hadamard,
    /// Total, of the record reflected at its ends.
    Total,
}

impl Kind {
    /// Estimator with this name in the Python package.
    pub(crate) fn from_name(name: &str) -> Result<Self> {
        match name {
            "oadev" => Ok(Self::Allan),
            "mdev" => Ok(Self::Modified),
            "ohdev" | "hdev" => Ok(Self::Hadamard),
            "totdev" => Ok(Self::Total),
            _ => Err(Error::Input(format!(
                "covariance of {name:?} is not known; known are oadev, mdev, hdev, totdev"
            ))),
        }
    }

    /// Order of the difference that the estimator squares.
    pub(crate) fn order(self) -> usize {
        if matches!(self, Self::Allan | Self::Total) { 2 } else { 3 }
    }

    /// Number of summations of the samples before the difference is taken: 1 or 2.
    pub(crate) fn level(self) -> usize {
        if self == Self::Modified { 2 } else { 1 }
    }

    /// Number of squared differences in the estimate at factor m of n samples.
    pub(crate) fn count(self, n: usize, m: usize) -> usize {
        (n + self.level()).saturating_sub(self.order() * m)
    }

    /// Ratio of the mean square difference to the variance.
    pub(crate) fn scale(self, m: usize) -> f64 {
        let m = m as f64;
        match self {
            Self::Allan | Self::Total => 2.0 * m * m,
            Self::Modified => 2.0 * m.powi(4),
            Self::Hadamard => 6.0 * m * m,
        }
    }
}

/// A smooth function is interpolated on segments with at least this many panels.
const MIN_INTERPOLATED_PANELS: usize = 3;
/// Distance in lags of the breaks within an autocovariance of finitely many lags: every lag near a break is summed.
const KINK_DISTANCE: usize = 20;

/// Generalized covariance of a sum of processes.
pub(super) struct Process {
    pub powers: Vec<Powers>,
    pub exponentials: Vec<Exponential>,
    /// Lags other than 0 at which the covariance is not smooth.
    pub kinks: Vec<usize>,
}

impl Process {
    /// Generalized covariance of `terms` summed as `kind` needs, for records of `n` samples.
    pub(super) fn new(terms: &[Term], n: usize, kind: Kind) -> Result<Self> {
        let mut out = Self { powers: Vec::new(), exponentials: Vec::new(), kinks: Vec::new() };
        for term in terms {
            out.add(term, n, kind)?;
        }
        Ok(out)
    }

    /// Adds one term.
    fn add(&mut self, term: &Term, n: usize, kind: Kind) -> Result<()> {
        term.check_finite()?;
        let level = kind.level();
        let mut fractional = |exponent: f64, scale: f64| {
            if scale != 0.0 {
                self.powers.extend(powers::fractional(exponent - 2.0 * level as f64, scale));
            }
        };
        match term {
            Term::White { variance } => fractional(0.0, *variance),
            Term::Blue { variance } => fractional(2.0, *variance),
            Term::RandomWalk { variance } => fractional(-2.0, *variance),
            Term::PowerLaw { exponent, level, .. } => {
                let lowest = if kind == Kind::Hadamard { -5.0 } else { -3.0 };
                if *exponent <= lowest || *exponent > 2.0 {
                    return Err(Error::Input(format!(
                        "term power_law: exponent {exponent} is outside {lowest} … 2, where the variance exists"
                    )));
                }
                fractional(*exponent, *level);
            }
            Term::Exponential { amplitude, phi } => {
                let epsilon = (1.0 - phi).norm();
                if phi.norm() > 1.0 || epsilon == 0.0 {
                    return Err(Error::Input(format!(
                        "term exponential: φ = {} + {}i is not inside the unit circle",
                        phi.re, phi.im
                    )));
                }
                if phi.norm() < 1e-12 {
                    fractional(0.0, amplitude.re);
                } else if epsilon * (n as f64) < 1e-6 {
                    fractional(-2.0, 2.0 * (amplitude * (1.0 - phi)).re);
                } else if *amplitude != c64::new(0.0, 0.0) {
                    self.exponentials.push(Exponential::new(*amplitude, *phi, level));
                }
            }
            Term::Lags { covariances } => {
                self.powers.push(powers::finite(covariances, level));
                // These breaks make every lag a node, because the autocovariance is not smooth between its lags.
                self.kinks.extend((KINK_DISTANCE..covariances.len()).step_by(KINK_DISTANCE));
                self.kinks.push(covariances.len());
            }
        }
        Ok(())
    }

    /// Decay rate and angular frequency (per sample) of every exponential.
    pub(super) fn waves(&self) -> Vec<Wave> {
        self.exponentials.iter().map(|e| Wave { decay: -e.lambda().re, angle: e.lambda().im.abs() }).collect()
    }

    /// Differences of the process at spacing `i`.
    pub(super) fn spaced(&self, i: usize, order: usize) -> Spaced<'_> {
        Spaced {
            i,
            order,
            powers: self.powers.iter().map(|p| differences::Spaced::new(p, i, order)).collect(),
            exponentials: self.exponentials.iter().map(|e| exponential::Spaced::new(e, i, order)).collect(),
        }
    }
}

/// Differences of a process at one spacing.
pub(super) struct Spaced<'a> {
    pub i: usize,
    order: usize,
    powers: Vec<differences::Spaced<'a>>,
    exponentials: Vec<exponential::Spaced<'a>>,
}

impl Spaced<'_> {
    /// The cross-covariance R_ij(t) of differences at spacings i and j ≥ i, as a function of t ≥ 0.
    pub(super) fn with(&self, j: usize) -> impl Fn(f64) -> f64 {
        let powers: Vec<_> = self.powers.iter().map(|p| p.with(j)).collect();
        let exponentials: Vec<_> = self.exponentials.iter().map(|e| e.with(j)).collect();
        move |t| {
            powers.iter().map(|p| p.at(t)).sum::<f64>() + exponentials.iter().map(|e| e.at(t)).sum::<f64>()
        }
    }

    /// Distances between centers at which two points of the differences coincide or are a kink apart.
    fn breaks(&self, j: usize, kinks: &[usize]) -> Vec<f64> {
        let half = self.order as f64 / 2.0;
        let mut out = Vec::new();
        for a in 0..=self.order {
            for b in 0..=self.order {
                let t = (a as f64 - half) * self.i as f64 + (b as f64 - half) * j as f64;
                out.push(t.abs());
                out.extend(kinks.iter().flat_map(|l| [(t + *l as f64).abs(), (t - *l as f64).abs()]));
            }
        }
        out
    }

    /// Σ_t count(t) R_ij(t)² / (M_i M_j) over all pairs of centers.
    pub(super) fn mean_square(
        &self,
        other: &Self,
        counts: (usize, usize),
        kinks: &[usize],
        waves: &[Wave],
    ) -> f64 {
        let (order, i, j) = (self.order, self.i, other.i);
        // Distances of centers are whole numbers, or whole numbers plus one half.
        let base = if order * (i + j) % 2 == 1 { 0.5 } else { 0.0 };
        let flat = order as f64 * (j - i) as f64 / 2.0;
        let end = (flat + counts.1 as f64 - base).ceil() as usize;
        let breaks: Vec<usize> = self.breaks(j, kinks).iter().map(|t| (t - base).max(0.0) as usize).collect();
        let powers: Vec<_> = self.powers.iter().map(|p| p.with(j)).collect();
        let exponentials: Vec<_> = self.exponentials.iter().map(|e| e.with(j)).collect();
        let nodes = lags::nodes(&breaks, end, waves);
        let slow = |t: f64| powers.iter().map(|p| p.at(t)).sum::<f64>();
        let mut runs = Runs::of(&exponentials);
        let (mut first, mut total) = (0, 0.0);
        let (mut at, mut covariance) = (Vec::new(), Vec::new());
        let mut panels = nodes.panels.iter();
        for &(count, start, width) in &nodes.segments {
            let smooth = (count >= MIN_INTERPOLATED_PANELS && width >= lags::NARROW)
                .then(|| Smooth::of(start, width, |u| slow(u + base)));
            for &(size, width) in panels.by_ref().take(count) {
                let own = first..first + size;
                first += size;
                at.clear();
                at.extend(nodes.at[own.clone()].iter().map(|u| u + base));
                covariance.clear();
                match &smooth {
                    Some(smooth) => covariance.extend(nodes.at[own.clone()].iter().map(|u| smooth.at(*u))),
                    None => covariance.extend(at.iter().map(|t| slow(*t))),
                }
                runs.add(&at, width, &mut covariance);
                for ((t, weight), value) in at.iter().zip(&nodes.weights[own]).zip(&covariance) {
                    let count = counts.1 as f64 - (t - flat).max(0.0);
                    let both = if *t == 0.0 { 1.0 } else { 2.0 };
                    total += weight * both * count * value.powi(2);
                }
            }
        }
        total / (counts.0 as f64 * counts.1 as f64)
    }
}
