//! Primitive processes whose sum is a model of the samples.
//!
//! The bindings turn pairs (name, values) into terms once; all other code matches on the enum.

use faer::c64;

use crate::{Error, Result};

/// A primitive process with its parameters, in units of one sample.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Term {
    /// White noise of this variance.
    White { variance: f64 },
    /// First difference of white noise of this variance.
    Blue { variance: f64 },
    /// Random walk whose steps have this variance.
    RandomWalk { variance: f64 },
    /// Spectrum `level` · (2 sin(w/2))^`exponent`. `end_ratios` are the ratios of E c_j² to this spectrum at j = 1, 2,
    /// …; only expectations of ordinates need them.
    PowerLaw { exponent: f64, level: f64, end_ratios: Vec<f64> },
    /// Autocovariance Re(`amplitude` φ^|h|).
    Exponential { amplitude: c64, phi: c64 },
    /// Autocovariances at lags 0, 1, …; zero beyond.
    Lags { covariances: Vec<f64> },
}

impl Term {
    /// The term with this name and these values.
    pub(crate) fn new(name: &str, values: Vec<f64>) -> Result<Self> {
        Ok(match (name, values.as_slice()) {
            ("white", &[variance]) => Self::White { variance },
            ("blue", &[variance]) => Self::Blue { variance },
            ("random_walk", &[variance]) => Self::RandomWalk { variance },
            ("flicker", [level, ends @ ..]) => {
                Self::PowerLaw { exponent: -1.0, level: *level, end_ratios: ends.to_vec() }
            }
            ("power_law", [exponent, level, ends @ ..]) => {
                Self::PowerLaw { exponent: *exponent, level: *level, end_ratios: ends.to_vec() }
            }
            ("exponential", &[re, im, phi_re, phi_im]) => {
                Self::Exponential { amplitude: c64::new(re, im), phi: c64::new(phi_re, phi_im) }
            }
            ("lags", [_, ..]) => Self::Lags { covariances: values },
            _ => {
                return Err(Error::Input(format!(
                    "term {name:?} with {} values is unknown; known are white 1, blue 1, random_walk 1, flicker 1 or \
                     more, power_law 2 or more, exponential 4, lags 1 or more",
                    values.len()
                )));
            }
        })
    }

    /// Name of the term in the Python package.
    fn name(&self) -> &'static str {
        match self {
            Self::White { .. } => "white",
            Self::Blue { .. } => "blue",
            Self::RandomWalk { .. } => "random_walk",
            Self::PowerLaw { .. } => "power_law",
            Self::Exponential { .. } => "exponential",
            Self::Lags { .. } => "lags",
        }
    }

    /// Error if a value is infinite or NaN.
    pub(crate) fn check_finite(&self) -> Result<()> {
        let complex = |a: &c64, b: &c64| [a.re, a.im, b.re, b.im].into_iter().find(|v| !v.is_finite());
        let bad = match self {
            Self::White { variance } | Self::Blue { variance } | Self::RandomWalk { variance } => {
                Some(*variance).filter(|v| !v.is_finite())
            }
            Self::PowerLaw { exponent, level, .. } => {
                [*exponent, *level].into_iter().find(|v| !v.is_finite())
            }
            Self::Exponential { amplitude, phi } => complex(amplitude, phi),
            Self::Lags { covariances } => covariances.iter().copied().find(|v| !v.is_finite()),
        };
        match bad {
            Some(bad) => Err(Error::Input(format!("term {}: value {bad} is not finite", self.name()))),
            None => Ok(()),
        }
    }
}

/// Terms without white phase noise, which has one degree of freedom per sample and so contributes only its mean to a
/// few differences.
pub(super) fn without_white_phase(terms: &[Term]) -> Vec<Term> {
    terms.iter().filter(|term| !matches!(term, Term::Blue { .. })).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_a_wrong_number_of_values_are_refused() {
        for (name, values) in [
            ("white", 2),
            ("blue", 0),
            ("flicker", 0),
            ("power_law", 1),
            ("exponential", 3),
            ("lags", 0),
            ("red", 1),
        ] {
            assert!(Term::new(name, vec![0.5; values]).is_err(), "{name}");
        }
    }

    #[test]
    fn values_that_are_not_finite_are_named() {
        for (name, values) in
            [("white", 1), ("flicker", 1), ("power_law", 2), ("exponential", 4), ("lags", 3)]
        {
            for bad in 0..values {
                let mut values = vec![0.5; values];
                values[bad] = f64::NAN;
                let said = Term::new(name, values).unwrap().check_finite().unwrap_err().to_string();
                assert!(said.ends_with("value NaN is not finite"), "{said}");
            }
        }
    }
}
