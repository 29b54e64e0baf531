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
const NARROW: usize = 20;

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
}

impl Nodes {
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
        let centre = start as f64 + (width as f64 - 1.0) / 2.0;
        let half = width as f64 / 2.0;
        let parity = if width % 2 == 0 { 0.5 } else { 0.0 };
        let at = GAUSS.map(|z| (z * half - parity).round() + parity);
        let weights = weights(at.map(|y| y / half), half);
        self.at.extend(at.iter().rev().map(|y| centre - y));
        self.at.extend(at.iter().map(|y| centre + y));
        self.weights.extend(weights.iter().rev().chain(&weights));
        self.panels.push((2 * GAUSS.len(), width));
    }
}

/// Nodes and weights whose sum stands for the sum over the integers 0 ≤ u < `end`. Breaks outside are ignored.
pub fn nodes(breaks: &[usize], end: usize, waves: &[Wave]) -> Nodes {
    let mut inside: Vec<usize> = breaks.iter().copied().filter(|b| *b < end).collect();
    inside.push(0);
    inside.sort_unstable();
    inside.dedup();
    let mut out =
        Nodes { at: Vec::with_capacity(1024), weights: Vec::with_capacity(1024), panels: Vec::new() };
    for (k, &start) in inside.iter().enumerate() {
        out.every(start, 1);
        let next = inside.get(k + 1).copied();
        let (first, stop) = (start + 1, next.unwrap_or(end));
        let length = stop.saturating_sub(first);
        // Up to the middle panels grow from the left break, after it from the right one.
        let left = if next.is_some() { length.div_ceil(2) } else { length };
        graded(left, waves, |offset, width| out.panel(first + offset, width));
        graded(length - left, waves, |offset, width| out.panel(stop - offset - width, width));
    }
    out
}

fn graded(length: usize, waves: &[Wave], mut emit: impl FnMut(usize, usize)) {
    let mut offset = 0;
    while offset < length {
        let cap = waves.iter().map(|wave| wave.widest(offset)).min().unwrap_or(usize::MAX);
        let width = if offset == 0 { SINGLE } else { (2 * offset).min(cap).max(1) };
        let width = width.min(length - offset);
        emit(offset, width);
        offset += width;
    }
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
    fn weights_of_wide_panels_are_positive() {
        for width in NARROW..200 {
            let mut out = Nodes { at: Vec::new(), weights: Vec::new(), panels: Vec::new() };
            out.panel(0, width);
            let inside = |u: &f64| u.fract() == 0.0 && *u >= 0.0 && *u < width as f64;
            assert!(out.at.is_sorted() && out.at.iter().all(inside), "{width}: {:?}", out.at);
            assert!(out.weights.iter().all(|w| *w > 0.0), "{width}: {:?}", out.weights);
        }
    }
}
