//! Differences of exponentials on panels one after the other, each a step from the one before.

use faer::c64;

use super::exponential::{Crossed, Exponential};

/// e-foldings after which nothing is left of an exponential.
const DEAD: f64 = 45.0;

/// Where the differences of a kernel are one formula: each is done at once for all nodes of a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Piece {
    Far,
    Inner,
    Outer,
}

/// Values of exponentials, summed, on panels one after the other.
pub struct Runs<'a> {
    runs: Vec<Run<'a>>,
    /// Coefficient of |h| beside all of them.
    beside: f64,
}

impl<'a> Runs<'a> {
    /// Of exponentials at the same two spacings.
    pub fn of(crossed: &'a [Crossed<'a>]) -> Self {
        let line = |one: &Crossed<'_>| if one.inner.reduced { 0.0 } else { one.inner.kernel.beside[0].re };
        Self { runs: crossed.iter().map(Run::of).collect(), beside: crossed.iter().map(line).sum() }
    }

    /// Adds the values at ascending places of a panel between two breaks that look alike from either end.
    pub fn add(&mut self, at: &[f64], width: usize, out: &mut [f64]) {
        let Some(Crossed { inner, j, reach, .. }) = self.runs.first().map(|run| run.crossed) else { return };
        let (first, last, m) = (at[0], at[at.len() - 1], inner.i);
        let piece = if first >= *reach {
            Piece::Far
        } else if inner.order == 2 && *j == m && last <= m {
            Piece::Inner
        } else if inner.order == 2 && *j == m && first >= m && last <= 2.0 * m {
            Piece::Outer
        } else {
            for (slot, t) in out.iter_mut().zip(at) {
                *slot += self.runs.iter().map(|run| run.crossed.at(*t)).sum::<f64>();
            }
            return;
        };
        // From the break before these places and from the one behind them.
        let (before, behind, line) = match piece {
            Piece::Far => (first - reach, f64::INFINITY, [0.0, 0.0]),
            Piece::Inner => (first, m - last, [-4.0 * m, 6.0]),
            Piece::Outer => (first - m, 2.0 * m - last, [4.0 * m, -2.0]),
        };
        for (slot, t) in out.iter_mut().zip(at) {
            *slot += self.beside * (line[0] + line[1] * t);
        }
        for run in &mut self.runs {
            if piece != Piece::Far && run.crossed.inner.reduced {
                run.crossed.inner.kernel.short(at, m, out);
            } else {
                run.add(piece, at, width, [before, behind], out);
            }
        }
    }
}

/// One of them: of panels as wide the nodes lie alike, and of two side by side each exponential is a step from the other.
struct Run<'a> {
    crossed: &'a Crossed<'a>,
    /// Of each piece: times φ to the distance from the break before a panel, and from the one behind it.
    amounts: [[c64; 2]; 3],
    width: usize,
    /// φ to the distances of the nodes from the first of them, real and imaginary parts, and to the width.
    turns: [Vec<f64>; 2],
    step: c64,
    /// First place of the panel before, and the exponentials forth and back there, where they live.
    before: Option<(Piece, f64, [Option<c64>; 2])>,
}

impl<'a> Run<'a> {
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

    fn turn(&mut self, at: &[f64], width: usize) {
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

    /// Adds what lives so far from the breaks on either side.
    fn add(&mut self, piece: Piece, at: &[f64], width: usize, distances: [f64; 2], out: &mut [f64]) {
        let lambda = self.crossed.inner.kernel.lambda;
        let lives = |distance: f64| -lambda.re * distance < DEAD;
        if !distances.iter().any(|distance| lives(*distance)) {
            return;
        }
        self.turn(at, width);
        // One step further from a break than the panel before, or nearer to it.
        let known = self.before.filter(|(own, ..)| *own == piece && lives(width as f64));
        let mut found = [None; 2];
        for (which, (slot, distance)) in found.iter_mut().zip(distances).enumerate() {
            if !lives(distance) {
                continue;
            }
            let moved = known.and_then(|(_, place, values)| {
                let value = values[which].filter(|_| (place - at[0]).abs() == width as f64)?;
                Some(if (place > at[0]) == (which == 0) { value / self.step } else { value * self.step })
            });
            let amount = self.amounts[piece as usize][which];
            *slot = Some(moved.unwrap_or_else(|| amount * (lambda * distance).exp()));
        }
        self.before = Some((piece, at[0], found));
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
                    // Rounding of terms that cancel, up to a/(S^2), and of a thousand steps.
                    let terms: f64 = kernels.iter().map(|e| e.c.norm() + (e.beside[0] * 4.0 * m as f64).norm()).sum();
                    prop_assert!((value - expected).abs() < 1e-12 * (size + terms), "{t}: {value} {expected}");
                }
            }
        }
    }
}
