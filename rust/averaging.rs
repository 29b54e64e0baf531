//! Averaging factors m of a τ grid, τ = m τ₀.

use crate::{Error, Result};

/// Choice of averaging factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// 1, 2, 4, 8, …
    Octave,
    /// 1, 2, 4, 10, 20, 40, 100, …
    Decade,
    /// Every factor.
    All,
    /// About this many factors per decade, evenly spaced in log τ.
    PerDecade(u32),
}

/// Averaging factors of `grid` up to `most`, in ascending order and without repetition.
pub fn factors(grid: Grid, most: usize) -> Result<Vec<usize>> {
    if most == 0 {
        return Err(Error::TooShort("at least 3 samples are needed for one averaging time".into()));
    }
    let mut out: Vec<usize> = match grid {
        Grid::Octave => {
            std::iter::successors(Some(1_usize), |m| m.checked_mul(2)).take_while(|m| *m <= most).collect()
        }
        Grid::Decade => {
            let decades =
                std::iter::successors(Some(1_usize), |m| m.checked_mul(10)).take_while(|m| *m <= most);
            decades.flat_map(|m| [m, 2 * m, 4 * m]).filter(|m| *m <= most).collect()
        }
        Grid::All => (1..=most).collect(),
        Grid::PerDecade(0) => {
            return Err(Error::Input("0 averaging times per decade: give at least 1".into()));
        }
        Grid::PerDecade(each) => {
            let steps = (f64::from(each) * (most as f64).log10() + 1e-9).floor() as usize;
            (0..=steps).map(|i| 10_f64.powf(i as f64 / f64::from(each)).round() as usize).collect()
        }
    };
    out.dedup();
    out.retain(|m| *m <= most);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn grids_equal_their_definition(most in 1_usize..20_000, each in 1_u32..40) {
            let powers = |base: usize| std::iter::successors(Some(1), move |m| Some(base * m)).take(20);
            let decades = powers(10).take(6).flat_map(|m| [m, 2 * m, 4 * m]);
            let logarithmic = (0..).map(|i| 10_f64.powf(f64::from(i) / f64::from(each)).round() as usize);
            let definitions: [(Grid, Vec<usize>); 4] = [
                (Grid::Octave, powers(2).collect()),
                (Grid::Decade, decades.collect()),
                (Grid::All, (1..=most).collect()),
                (Grid::PerDecade(each), logarithmic.take_while(|m| *m <= most).collect()),
            ];
            for (grid, mut expected) in definitions {
                expected.retain(|m| *m <= most);
                expected.dedup();
                prop_assert_eq!(factors(grid, most).unwrap(), expected, "{:?}", grid);
            }
        }
    }
}
