//! Quadrature nodes for a sum over many integer lags of a function that is smooth between a few known breaks.
//!
//! Near every break each lag is a node. Away from the breaks, panels grow with the distance. Each panel has eight
//! nodes on integers, whose weights sum every polynomial of degree seven exactly. The nodes lie next to
//! Gauss-Legendre nodes, so that wide panels almost reach the degree fifteen of Gauss-Legendre quadrature.

/// Number of lags on either side of a break that are summed one by one.
const SINGLE: usize = 12;
/// Positive Gauss-Legendre nodes of order eight.
const GAUSS: [f64; 4] =
    [0.183_434_642_495_65, 0.525_532_409_916_33, 0.796_666_477_413_63, 0.960_289_856_497_54];
/// A wave that has decayed by this many e-foldings no longer limits the width of panels.
const MAX_DECAY: f64 = 6.0;
/// Largest phase, in rad, by which a wave may turn within one panel. With it, sums of squares of narrow lines are
/// accurate to 5e-4, which suffices for degrees of freedom.
const MAX_PHASE: f64 = 6.0;
/// Panels with fewer lags than this are summed lag by lag.
pub(super) const NARROW: usize = 20;

/// An oscillation that decays with the distance from a break. Panels must resolve it until it has decayed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    /// Decay in e-foldings per lag, and phase in rad per lag.
    pub decay: f64,
    pub angle: f64,
}

impl Wave {
    /// Widest panel, in lags, that resolves the wave at this distance from a break.
    fn widest(self, distance: usize) -> usize {
        if self.decay * distance as f64 > MAX_DECAY || self.angle < 0.2 * self.decay {
            return usize::MAX;
        }
        (MAX_PHASE / self.angle.max(1e-300)) as usize
    }
}

/// Quadrature nodes and weights, panel by panel, in ascending order. The nodes of a panel are symmetric about its
/// middle.
pub(super) struct Nodes {
    pub at: Vec<f64>,
    pub weights: Vec<f64>,
    /// Number of nodes and width of each panel. Panels of equal width have nodes at equal offsets.
    pub panels: Vec<(usize, usize)>,
    /// For each segment, which would be one panel without waves: number of panels, first lag, and width.
    pub segments: Vec<(usize, usize, usize)>,
}

impl Nodes {
    /// No nodes.
    fn empty() -> Self {
        Self { at: Vec::new(), weights: Vec::new(), panels: Vec::new(), segments: Vec::new() }
    }

    /// Adds a segment of panels, as narrow as the waves require. The segment starts `offset` lags from a break;
    /// `forth` tells whether the distance from the break grows with the lag.
    fn add_segment(&mut self, start: usize, width: usize, offset: usize, waves: &[Wave], forth: bool) {
        let before = self.panels.len();
        let mut done = 0;
        while done < width {
            let cap = waves.iter().map(|wave| wave.widest(offset + done)).min().unwrap_or(usize::MAX);
            let own = cap.max(1).min(width - done);
            self.add_panel(start + if forth { done } else { width - done - own }, own);
            done += own;
        }
        self.segments.push((self.panels.len() - before, start, width));
    }

    /// Adds a panel whose nodes are all its lags.
    fn add_every_lag(&mut self, start: usize, width: usize) {
        self.at.extend((start..start + width).map(|u| u as f64));
        self.weights.extend(std::iter::repeat_n(1.0, width));
        self.panels.push((width, width));
    }

    /// Adds a panel: with eight nodes, or with all its lags if the panel is narrow.
    fn add_panel(&mut self, start: usize, width: usize) {
        if width < NARROW {
            self.add_every_lag(start, width);
            return;
        }
        let half = width as f64 / 2.0;
        let (center, at) = center_and_offsets(start, width);
        let weights = weights(at.map(|y| y / half), half);
        self.at.extend(at.iter().rev().map(|y| center - y));
        self.at.extend(at.iter().map(|y| center + y));
        self.weights.extend(weights.iter().rev().chain(&weights));
        self.panels.push((2 * GAUSS.len(), width));
    }
}

/// Center of a panel, and the distances of its four pairs of nodes from the center.
fn center_and_offsets(start: usize, width: usize) -> (f64, [f64; 4]) {
    let center = start as f64 + (width as f64 - 1.0) / 2.0;
    let parity = if width % 2 == 0 { 0.5 } else { 0.0 };
    (center, GAUSS.map(|z| (z * width as f64 / 2.0 - parity).round() + parity))
}

/// Interpolation of a smooth function on a segment of at least `NARROW` lags, by the polynomial through its values at
/// the nodes of one panel. If a break is half a segment width away, the relative error is about 3.7⁻⁸; steep
/// functions lose one more digit.
pub(super) struct Smooth {
    center: f64,
    half: f64,
    z: [f64; 8],
    /// Divided differences.
    newton: [f64; 8],
}

impl Smooth {
    /// Interpolation of `f` on the lags `start` to `start + width − 1`.
    pub(super) fn of(start: usize, width: usize, f: impl Fn(f64) -> f64) -> Self {
        let (center, apart) = center_and_offsets(start, width);
        let half = width as f64 / 2.0;
        let mut z = [0.0; 8];
        for (k, y) in apart.iter().enumerate() {
            (z[3 - k], z[4 + k]) = (-y / half, y / half);
        }
        let mut newton = z.map(|z| f(center + z * half));
        for order in 1..8 {
            for k in (order..8).rev() {
                newton[k] = (newton[k] - newton[k - 1]) / (z[k] - z[k - order]);
            }
        }
        Self { center, half, z, newton }
    }

    /// Interpolated value at lag `u`.
    pub(super) fn at(&self, u: f64) -> f64 {
        let z = (u - self.center) / self.half;
        (0..7).rev().fold(self.newton[7], |sum, k| sum * (z - self.z[k]) + self.newton[k])
    }
}

/// Nodes and weights for the sum over the integers 0 ≤ u < `end`. Breaks outside this range are ignored.
pub(super) fn nodes(breaks: &[usize], end: usize, waves: &[Wave]) -> Nodes {
    let mut inside: Vec<usize> = breaks.iter().copied().filter(|b| *b < end).collect();
    inside.push(0);
    inside.sort_unstable();
    inside.dedup();
    let mut out = Nodes::empty();
    for (k, &start) in inside.iter().enumerate() {
        out.add_segment(start, 1, 0, &[], true);
        let next = inside.get(k + 1).copied();
        let (first, stop) = (start + 1, next.unwrap_or(end));
        let length = stop.saturating_sub(first);
        // Panels grow from the left break up to the middle, and from the right break beyond it.
        let left = if next.is_some() { length.div_ceil(2) } else { length };
        for (offset, width) in graded(left) {
            out.add_segment(first + offset, width, offset, waves, true);
        }
        for (offset, width) in graded(length - left) {
            out.add_segment(stop - offset - width, width, offset, waves, false);
        }
    }
    out
}

/// Offsets and widths of segments that grow with the distance from a break, up to a total length.
fn graded(length: usize) -> impl Iterator<Item = (usize, usize)> {
    let mut offset = 0;
    std::iter::from_fn(move || {
        let width = if offset == 0 { SINGLE } else { 2 * offset }.min(length - offset);
        let own = (offset, width);
        offset += width;
        (width > 0).then_some(own)
    })
}

/// Weights of the symmetric nodes ±z·half with which even powers up to the sixth are summed over the panel's integers
/// exactly.
fn weights(z: [f64; 4], half: f64) -> [f64; 4] {
    // For a polynomial of degree six the midpoint Euler-Maclaurin series ends after four terms.
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
    fn smooth_functions_are_interpolated() {
        for (start, width) in [(12, 24), (36, 72), (1000, 2000), (50_000, 100_000)] {
            for f in [f64::sqrt, |u: f64| u * u.ln(), |u: f64| u.powf(-1.5)] {
                let smooth = Smooth::of(start, width, f);
                let size = f(start as f64).abs().max(f((start + width) as f64).abs());
                for u in (start..start + width).map(|u| u as f64) {
                    let (found, expected) = (smooth.at(u), f(u));
                    // The accuracy required of sums of squares of narrow lines.
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
            assert_eq!(found.segments.iter().map(|(count, ..)| count).sum::<usize>(), found.panels.len());
            assert_eq!(found.segments.iter().map(|(_, _, width)| width).sum::<usize>(), end);
        }
    }

    #[test]
    fn weights_of_wide_panels_are_positive() {
        for width in NARROW..200 {
            let mut out = Nodes::empty();
            out.add_panel(0, width);
            let inside = |u: &f64| u.fract() == 0.0 && *u >= 0.0 && *u < width as f64;
            assert!(out.at.is_sorted() && out.at.iter().all(inside), "{width}: {:?}", out.at);
            assert!(out.weights.iter().all(|w| *w > 0.0), "{width}: {:?}", out.weights);
        }
    }
}
