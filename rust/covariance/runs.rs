//! Differences of exponentials on consecutive panels, each computed from the panel before.

use faer::c64;

use super::exponential::{Crossed, Exponential};

/// An exponential that has decayed by this many e-foldings is neglected (e^−45 = 3e-20).
const MAX_DECAY: f64 = 45.0;

/// Interval in which the differences of a kernel follow a single formula, which is evaluated at all nodes of a panel
/// at once: beyond their reach, between 0 and m, or between m and 2m.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Zone {
    Far,
    Inner,
    Outer,
}

/// Sum of the differences of several exponentials, panel by panel.
pub(super) struct Runs<'a> {
    runs: Vec<Run<'a>>,
    /// Sum of the coefficients of |h|.
    linear: f64,
}

impl<'a> Runs<'a> {
    /// Sum of exponentials whose differences have the same two spacings.
    pub(super) fn of(crossed: &'a [Crossed<'a>]) -> Self {
        let line =
            |one: &Crossed<'_>| if one.inner.reduced { 0.0 } else { one.inner.kernel.polynomial[0].re };
        Self { runs: crossed.iter().map(Run::of).collect(), linear: crossed.iter().map(line).sum() }
    }

    /// Adds the sum at the nodes `at` of a panel to `out`. The panel lies between two breaks; its nodes ascend and are
    /// symmetric about the middle.
    pub(super) fn add(&mut self, at: &[f64], width: usize, out: &mut [f64]) {
        let Some(Crossed { inner, j, reach, .. }) = self.runs.first().map(|run| run.crossed) else { return };
        let (first, last, m) = (at[0], at[at.len() - 1], inner.i);
        let zone = if first >= *reach {
            Zone::Far
        } else if inner.order == 2 && *j == m && last <= m {
            Zone::Inner
        } else if inner.order == 2 && *j == m && first >= m && last <= 2.0 * m {
            Zone::Outer
        } else {
            for (slot, t) in out.iter_mut().zip(at) {
                *slot += self.runs.iter().map(|run| run.crossed.at(*t)).sum::<f64>();
            }
            return;
        };
        // Distances from the break below the panel and from the break above it.
        let (before, behind, line) = match zone {
            Zone::Far => (first - reach, f64::INFINITY, [0.0, 0.0]),
            Zone::Inner => (first, m - last, [-4.0 * m, 6.0]),
            Zone::Outer => (first - m, 2.0 * m - last, [4.0 * m, -2.0]),
        };
        for (slot, t) in out.iter_mut().zip(at) {
            *slot += self.linear * (line[0] + line[1] * t);
        }
        for run in &mut self.runs {
            if zone != Zone::Far && run.crossed.inner.reduced {
                run.crossed.inner.kernel.add_short(at, m, out);
            } else {
                run.add(zone, at, width, [before, behind], out);
            }
        }
    }
}

/// Values of one exponential. On panels of equal width the nodes have equal offsets, so that each value is that of
/// the previous panel times a constant.
struct Run<'a> {
    crossed: &'a Crossed<'a>,
    /// For each zone: factors of φ to the distance from the break below a panel, and from the break above it.
    amounts: [[c64; 2]; 3],
    width: usize,
    /// Powers of φ at the offsets of the nodes from the first node (real and imaginary parts), and over the panel
    /// width.
    turns: [Vec<f64>; 2],
    step: c64,
    /// Zone and first node of the previous panel, and its forward and backward exponentials unless they have decayed.
    before: Option<(Zone, f64, [Option<c64>; 2])>,
}

impl<'a> Run<'a> {
    /// Exponential before its first panel.
    fn of(crossed: &'a Crossed<'a>) -> Self {
        let Exponential { lambda, c, .. } = *crossed.inner.kernel;
        let by = (lambda * crossed.inner.i).exp();
        let amounts = [
            [crossed.far, c64::new(0.0, 0.0)],
            [c * (by * (by - 4.0) + 6.0), c * (by - 4.0)],
            [c * (by * (by * (by - 4.0) + 6.0) - 4.0), c],
        ];
        let turns = [Vec::new(), Vec::new()];
        Self { crossed, amounts, width: 0, turns, step: c64::new(1.0, 0.0), before: None }
    }

    /// Computes the powers of φ at the nodes of a panel, unless the panel has the width of the previous one.
    fn update_powers(&mut self, at: &[f64], width: usize) {
        if width == self.width {
            return;
        }
        let lambda = self.crossed.inner.kernel.lambda;
        (self.width, self.step, self.before) = (width, (lambda * width as f64).exp(), None);
        let [re, im] = &mut self.turns;
        re.clear();
        im.clear();
        for t in at {
            let turn = (lambda * (t - at[0])).exp();
            re.push(turn.re);
            im.push(turn.im);
        }
    }

    /// Adds the exponentials that begin at the breaks on either side to `out`, unless they decay over these distances.
    fn add(&mut self, zone: Zone, at: &[f64], width: usize, distances: [f64; 2], out: &mut [f64]) {
        let lambda = self.crossed.inner.kernel.lambda;
        let has_not_decayed = |distance: f64| -lambda.re * distance < MAX_DECAY;
        if !distances.iter().any(|distance| has_not_decayed(*distance)) {
            return;
        }
        self.update_powers(at, width);
        // The panel is one step farther from a break than the previous panel, or one step closer.
        let known = self.before.filter(|(own, ..)| *own == zone && has_not_decayed(width as f64));
        let mut found = [None; 2];
        for (which, (slot, distance)) in found.iter_mut().zip(distances).enumerate() {
            if !has_not_decayed(distance) {
                continue;
            }
            let stepped = known.and_then(|(_, place, values)| {
                let value = values[which].filter(|_| (place - at[0]).abs() == width as f64)?;
                Some(if (place > at[0]) == (which == 0) { value / self.step } else { value * self.step })
            });
            let amount = self.amounts[zone as usize][which];
            *slot = Some(stepped.unwrap_or_else(|| amount * (lambda * distance).exp()));
        }
        self.before = Some((zone, at[0], found));
        let [re, im] = &self.turns;
        if let Some(forth) = found[0] {
            for ((slot, re), im) in out.iter_mut().zip(re).zip(im) {
                *slot += forth.re * re - forth.im * im;
            }
        }
        if let Some(back) = found[1] {
            for ((slot, re), im) in out.iter_mut().zip(re.iter().rev()).zip(im.iter().rev()) {
                *slot += back.re * re - back.im * im;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::exponential::Spaced;
    use super::super::lags::{Wave, nodes};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn panels_have_the_value_at_each_place(
            decays in prop::collection::vec(-6.0..0.5_f64, 1..4), angles in prop::collection::vec(0.0..3.0_f64, 4),
            m in 1_usize..400, beyond in 1_usize..3000
        ) {
            let kernels: Vec<_> = decays
                .iter()
                .zip(&angles)
                .map(|(decay, angle)| {
                    let phi = c64::new(-10_f64.powf(*decay), *angle).exp();
                    Exponential::new(c64::new(1.0, 0.2 * angle), phi, 1)
                })
                .collect();
            let spaced: Vec<_> = kernels.iter().map(|kernel| Spaced::new(kernel, m, 2)).collect();
            let crossed: Vec<_> = spaced.iter().map(|one| one.with(m)).collect();
            let waves: Vec<_> =
                kernels.iter().map(|e| Wave { decay: -e.lambda.re, angle: e.lambda.im.abs() }).collect();
            let found = nodes(&[0, m, 2 * m], 2 * m + beyond, &waves);
            let mut runs = Runs::of(&crossed);
            let (mut first, size) = (0, crossed.iter().map(|one| one.at(0.0).abs()).fold(0.0, f64::max));
            for &(count, width) in &found.panels {
                let at = &found.at[first..first + count];
                first += count;
                let mut values = vec![0.0; count];
                runs.add(at, width, &mut values);
                for (t, value) in at.iter().zip(values) {
                    let expected: f64 = crossed.iter().map(|one| one.at(*t)).sum();
                    // Rounding of canceling terms, up to a/(S^2), and of a thousand steps.
                    let terms: f64 = kernels.iter().map(|e| e.c.norm() + (e.polynomial[0] * 4.0 * m as f64).norm()).sum();
                    prop_assert!((value - expected).abs() < 1e-12 * (size + terms), "{t}: {value} {expected}");
                }
            }
        }
    }
}
