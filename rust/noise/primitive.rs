//! Names and values of the processes that can be simulated.
//!
//! The bindings turn pairs (name, values) into primitives once; all other code matches on the enum.

use crate::{Error, Result};

/// A process with its parameters, in units of one sample. The table in [`super`] lists the spectra.
#[derive(Debug, Clone, PartialEq)]
pub enum Primitive {
    /// Independent normals.
    White { sd: f64 },
    /// First difference of independent normals.
    Blue { sd: f64 },
    /// Running sum of independent normals.
    RandomWalk { step: f64 },
    /// Power law of exponent −1.
    Flicker { level: f64 },
    /// Power law.
    PowerLaw { exponent: f64, level: f64 },
    /// First-order autoregression.
    GaussMarkov { sigma: f64, phi: f64 },
    /// White noise through sections b0, b1, b2, a1, a2; at least one.
    Filtered { sd: f64, sections: Vec<[f64; 5]> },
    /// Moving average with these coefficients; at least one.
    Finite { coefficients: Vec<f64> },
    /// Mean of the last `length` normals.
    MovingAverage { sd: f64, length: f64 },
    /// Random telegraph with two levels ±`amplitude`, which switches with this probability.
    Telegraph { amplitude: f64, probability: f64 },
}

impl Primitive {
    /// The process with this name and these values.
    pub fn new(name: &str, values: Vec<f64>) -> Result<Self> {
        if let Some(bad) = values.iter().find(|value| !value.is_finite()) {
            return Err(Error::Input(format!("noise process {name}: value {bad} is not finite")));
        }
        Ok(match (name, values.as_slice()) {
            ("white", &[sd]) => Self::White { sd },
            ("blue", &[sd]) => Self::Blue { sd },
            ("random_walk", &[step]) => Self::RandomWalk { step },
            ("flicker", &[level]) => Self::Flicker { level },
            ("power_law", &[exponent, level]) => Self::PowerLaw { exponent, level },
            ("gauss_markov", &[sigma, phi]) => Self::GaussMarkov { sigma, phi },
            ("filtered", [sd, sections @ ..]) if !sections.is_empty() && sections.len() % 5 == 0 => {
                Self::Filtered { sd: *sd, sections: sections.as_chunks().0.to_vec() }
            }
            ("finite", [_, ..]) => Self::Finite { coefficients: values },
            ("moving_average", &[sd, length]) => Self::MovingAverage { sd, length },
            ("telegraph", &[amplitude, probability]) => Self::Telegraph { amplitude, probability },
            _ => return Err(unknown(name, values.len())),
        })
    }

    /// Name of the process in the Python package.
    pub fn name(&self) -> &'static str {
        match self {
            Self::White { .. } => "white",
            Self::Blue { .. } => "blue",
            Self::RandomWalk { .. } => "random_walk",
            Self::Flicker { .. } => "flicker",
            Self::PowerLaw { .. } => "power_law",
            Self::GaussMarkov { .. } => "gauss_markov",
            Self::Filtered { .. } => "filtered",
            Self::Finite { .. } => "finite",
            Self::MovingAverage { .. } => "moving_average",
            Self::Telegraph { .. } => "telegraph",
        }
    }
}

/// Error for an unknown name or a wrong number of values.
fn unknown(name: &str, found: usize) -> Error {
    const COUNTS: [(&str, &str); 10] = [
        ("white", "1"),
        ("blue", "1"),
        ("random_walk", "1"),
        ("flicker", "1"),
        ("power_law", "2"),
        ("gauss_markov", "2"),
        ("filtered", "1, and 5 a section"),
        ("finite", "at least 1"),
        ("moving_average", "2"),
        ("telegraph", "2"),
    ];
    Error::Input(if let Some((_, count)) = COUNTS.iter().find(|(known, _)| *known == name) {
        format!("noise process {name}: found {found} values, needs {count}")
    } else {
        let known: Vec<_> = COUNTS.iter().map(|(known, _)| *known).collect();
        format!("noise process {name:?} is unknown; known are {}", known.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_kept_and_other_numbers_of_values_are_refused() {
        for (name, values) in [
            ("white", 1),
            ("blue", 1),
            ("random_walk", 1),
            ("flicker", 1),
            ("power_law", 2),
            ("gauss_markov", 2),
            ("filtered", 11),
            ("finite", 3),
            ("moving_average", 2),
            ("telegraph", 2),
        ] {
            assert_eq!(Primitive::new(name, vec![0.5; values]).unwrap().name(), name);
            let wrong = if name == "finite" { 0 } else { values + 1 };
            assert!(
                Primitive::new(name, vec![0.5; wrong]).unwrap_err().to_string().contains("needs"),
                "{name}"
            );
            assert!(Primitive::new(name, vec![f64::INFINITY; values]).is_err());
        }
        assert!(Primitive::new("red", vec![1.0]).unwrap_err().to_string().contains("unknown"));
    }
}
