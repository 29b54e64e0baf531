//! A sum over many integer lags of a function that is smooth between a few known points, from few of its values.
//!
//! Near every break each lag is taken; away from it panels grow with the distance, each with eight nodes on
//! integers whose weights sum every polynomial of degree seven exactly. The nodes lie next to those of
//! Gauss-Legendre, so that wide panels gain nearly its degree fifteen.

/// Lags taken one by one on either side of a break.
const SINGLE: usize = 12;
/// Positive Gauss-Legendre nodes of order eight.
const GAUSS: [f64; 4] =
    [0.183_434_642_495_65, 0.525_532_409_916_33, 0.796_666_477_413_63, 0.960_289_856_497_54];
/// e-foldings after which a wave no longer asks for narrow panels, and the angle by which it turns in one: sums of squares
/// of narrow lines are right to 5e-4, of which degrees of freedom are made.
const LIVES: f64 = 6.0;
const TURN: f64 = 6.0;
/// Panels narrower than this are summed lag by lag.
pub const NARROW: usize = 20;

/// A fast wave that dies with the distance from a break: panels must resolve it while it lives.
#[derive(Debug, Clone, Copy)]
pub struct Wave {
    /// Decay and angle per lag.
    pub decay: f64,
    pub angle: f64,
}

impl Wave {
    fn widest(self, distance: usize) -> usize {
        if self.decay * distance as f64 > LIVES || self.angle < 0.2 * self.decay {
            return usize::MAX;
        }
        (TURN / self.angle.max(1e-300)) as usize
    }
}

/// Nodes and weights, panel by panel: ascending, and alike seen from either end of a panel.
pub struct Nodes {
    pub at: Vec<f64>,
    pub weights: Vec<f64>,
    /// Number of nodes and width of each panel; of panels as wide the nodes lie alike.
    pub panels: Vec<(usize, usize)>,
    /// How many panels one after the other share what one would have been without waves, its first lag and width.
    pub stretches: Vec<(usize, usize, usize)>,
}

impl Nodes {
    fn empty() -> Self {
        Self { at: Vec::new(), weights: Vec::new(), panels: Vec::new(), stretches: Vec::new() }
    }

    /// A stretch of panels that waves, from `offset` lags behind a break on, ask for: forth from it, or back.
    fn stretch(&mut self, start: usize, width: usize, offset: usize, waves: &[Wave], forth: bool) {
        let before = self.panels.len();
        let mut done = 0;
        while done < width {
            let cap = waves.iter().map(|wave| wave.widest(offset + done)).min().unwrap_or(usize::MAX);
            let own = cap.max(1).min(width - done);
            self.panel(start + if forth { done } else { width - done - own }, own);
            done += own;
        }
        self.stretches.push((self.panels.len() - before, start, width));
    }

    fn every(&mut self, start: usize, width: usize) {
        self.at.extend((start..start + width).map(|u| u as f64));
        self.weights.extend(std::iter::repeat_n(1.0, width));
        self.panels.push((width, width));
    }

    fn panel(&mut self, start: usize, width: usize) {
        if width < NARROW {
            self.every(start, width);
            return;
        }
        let half = width as f64 / 2.0;
        let (centre, at) = places(start, width);
        let weights = weights(at.map(|y| y / half), half);
        self.at.extend(at.iter().rev().map(|y| centre - y));
        self.at.extend(at.iter().map(|y| centre + y));
        self.weights.extend(weights.iter().rev().chain(&weights));
        self.panels.push((2 * GAUSS.len(), width));
    }
}

/// Middle of a panel, and how far its nodes are from there on either side.
fn places(start: usize, width: usize) -> (f64, [f64; 4]) {
    let centre = start as f64 + (width as f64 - 1.0) / 2.0;
    let parity = if width % 2 == 0 { 0.5 } else { 0.0 };
    (centre, GAUSS.map(|z| (z * width as f64 / 2.0 - parity).round() + parity))
}

/// A smooth function on a stretch of at least `NARROW` lags, by the polynomial through its values at the nodes of one panel.
/// Beside a break half as far away as the stretch is wide the error is some 3.7⁻⁸ of its size; steep functions lose a digit.
pub struct Smooth {
    centre: f64,
    half: f64,
    z: [f64; 8],
    /// Divided differences.
    newton: [f64; 8],
}

impl Smooth {
    pub fn of(start: usize, width: usize, f: impl Fn(f64) -> f64) -> Self {
        let (centre, apart) = places(start, width);
        let half = width as f64 / 2.0;
        let mut z = [0.0; 8];
        for (k, y) in apart.iter().enumerate() {
            (z[3 - k], z[4 + k]) = (-y / half, y / half);
        }
        let mut newton = z.map(|z| f(centre + z * half));
        for order in 1..8 {
            for k in (order..8).rev() {
                newton[k] = (newton[k] - newton[k - 1]) / (z[k] - z[k - order]);
            }
        }
        Self { centre, half, z, newton }
    }

    pub fn at(&self, u: f64) -> f64 {
        let z = (u - self.centre) / self.half;
        (0..7).rev().fold(self.newton[7], |sum, k| sum * (z - self.z[k]) + self.newton[k])
    }
}

/// Nodes and weights whose sum stands for the sum over the integers 0 ≤ u < `end`. Breaks outside are ignored.
pub fn nodes(breaks: &[usize], end: usize, waves: &[Wave]) -> Nodes {
    let mut inside: Vec<usize> = breaks.iter().copied().filter(|b| *b < end).collect();
    inside.push(0);
    inside.sort_unstable();
    inside.dedup();
    let mut out = Nodes::empty();
    for (k, &start) in inside.iter().enumerate() {
        out.stretch(start, 1, 0, &[], true);
        let next = inside.get(k + 1).copied();
        let (first, stop) = (start + 1, next.unwrap_or(end));
        let length = stop.saturating_sub(first);
        // Up to the middle panels grow from the left break, after it from the right one.
        let left = if next.is_some() { length.div_ceil(2) } else { length };
        for (offset, width) in graded(left) {
            out.stretch(first + offset, width, offset, waves, true);
        }
        for (offset, width) in graded(length - left) {
            out.stretch(stop - offset - width, width, offset, waves, false);
        }
    }
    out
}

/// Offsets and widths that grow with the distance from a break, to a length.
fn graded(length: usize) -> impl Iterator<Item = (usize, usize)> {
    let mut offset = 0;
    std::iter::from_fn(move || {
        let width = if offset == 0 { SINGLE } else { 2 * offset }.min(length - offset);
        let own = (offset, width);
        offset += width;
        (width > 0).then_some(own)
    })
}

/// Weights of symmetric nodes ±z·half that sum even powers up to the sixth over the panel's integers exactly.
fn weights(z: [f64; 4], half: f64) -> [f64; 4] {
    // Euler-Maclaurin over midpoints ends after four terms for a polynomial of degree six.
    let s = 1.0 / (half * half);
    let mut target = [0.0; 4];
    for (k, slot) in target.iter_mut().enumerate() {
        let n = 2.0 * k as f64;
        *slot = half
            * (1.0 / (n + 1.0) - n * s / 24.0 + n * (n - 1.0) * (n - 2.0) * s * s * 7.0 / 5760.0
                - n * (n - 1.0) * (n - 2.0) * (n - 3.0) * (n - 4.0) * s.powi(3) * 31.0 / 967_680.0);
    }
    // Lagrange basis in z²: no system to solve.
    let q = z.map(|v| v * v);
    let mut out = [0.0; 4];
    for k in 0..4 {
        let mut poly = [1.0, 0.0, 0.0, 0.0];
        let mut scale = 1.0;
        for (l, root) in q.iter().enumerate() {
            if l != k {
                for d in (1..4).rev() {
                    poly[d] = poly[d - 1] - root * poly[d];
                }
                poly[0] *= -root;
                scale *= q[k] - root;
            }
        }
        out[k] = poly.iter().zip(target).map(|(c, t)| c * t).sum::<f64>() / scale;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(breaks: &[usize], end: usize, f: impl Fn(f64) -> f64) -> f64 {
        let found = nodes(breaks, end, &[]);
        found.at.iter().zip(&found.weights).map(|(u, w)| w * f(*u)).sum()
    }

    #[test]
    fn counts_every_lag_once() {
        for end in [1, 2, 13, 40, 100, 1000, 123_457] {
            for breaks in [vec![], vec![5, 6, 30], vec![17, 500, 501, 90_000]] {
                let total = sum(&breaks, end, |_| 1.0);
                assert!((total / end as f64 - 1.0).abs() < 1e-12, "{end} {breaks:?}: {total}");
            }
        }
    }

    #[test]
    fn kinks_and_tails() {
        let f =
            |u: f64| (u - 700.0).abs() * (u + 1.0).ln() / (1.0 + u).powi(2) + (0.01 * (u - 3000.0)).atan();
        let exact: f64 = (0..50_000).map(|u| f(f64::from(u))).sum();
        let found = sum(&[700, 3000], 50_000, f);
        assert!((found / exact - 1.0).abs() < 1e-7, "{found} {exact}");
    }

    #[test]
    fn what_is_smooth_is_interpolated() {
        for (start, width) in [(12, 24), (36, 72), (1000, 2000), (50_000, 100_000)] {
            for f in [f64::sqrt, |u: f64| u * u.ln(), |u: f64| u.powf(-1.5)] {
                let smooth = Smooth::of(start, width, f);
                let size = f(start as f64).abs().max(f((start + width) as f64).abs());
                for u in (start..start + width).map(|u| u as f64) {
                    let (found, expected) = (smooth.at(u), f(u));
                    // What sums of squares of narrow lines are right to.
                    assert!((found - expected).abs() < 5e-4 * size, "{start} {u}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn panels_of_waves_count_every_lag_once() {
        let waves = [Wave { decay: 1e-4, angle: 0.1 }, Wave { decay: 0.01, angle: 0.7 }];
        for (breaks, end) in [(vec![], 100), (vec![300, 600], 5000), (vec![7, 14], 123_457)] {
            let found = nodes(&breaks, end, &waves);
            let total: f64 = found.weights.iter().sum();
            assert!((total / end as f64 - 1.0).abs() < 1e-12, "{breaks:?} {end}: {total}");
            assert_eq!(found.stretches.iter().map(|(count, ..)| count).sum::<usize>(), found.panels.len());
            assert_eq!(found.stretches.iter().map(|(_, _, width)| width).sum::<usize>(), end);
        }
    }

    #[test]
    fn weights_of_wide_panels_are_positive() {
        for width in NARROW..200 {
            let mut out = Nodes::empty();
            out.panel(0, width);
            let inside = |u: &f64| u.fract() == 0.0 && *u >= 0.0 && *u < width as f64;
            assert!(out.at.is_sorted() && out.at.iter().all(inside), "{width}: {:?}", out.at);
            assert!(out.weights.iter().all(|w| *w > 0.0), "{width}: {:?}", out.weights);
        }
    }
}
