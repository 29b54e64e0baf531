//! Non-negative least squares for many problems in a row with almost the same columns.
//!
//! The columns are reduced to a triangle by Householder reflections, which keeps digits that normal equations would
//! lose. The active-set search of Lawson and Hanson (Solving Least Squares Problems, 1974, ch. 23) runs on the
//! triangle and starts from the previous active set.

// Functions are inlined so that they are compiled with the instructions of their caller.
#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

/// A column counts as linearly dependent if its component orthogonal to the others is below this fraction of its
/// length.
const DEPENDENCE_TOLERANCE: f64 = 1e-13;

/// Solver for systems of one size, with its work arrays.
pub(super) struct Nonnegative {
    bins: usize,
    p: usize,
    /// Weighted columns and target, shape (p + 1, bins); the triangle overwrites their first rows.
    system: Vec<f64>,
    /// Length of each column.
    length: Vec<f64>,
    /// Columns with positive coefficients, in the order in which they became active.
    active: Vec<usize>,
    /// Columns that cannot become active at present.
    is_refused: Vec<bool>,
    /// Active columns of the triangle and its target, reduced to a triangle again.
    inner: Vec<f64>,
    trial: Vec<f64>,
    rest: Vec<f64>,
}

impl Nonnegative {
    /// Solver for `p` columns of `bins` rows.
    pub(super) fn new(bins: usize, p: usize) -> Self {
        Self {
            bins,
            p,
            system: vec![0.0; (p + 1) * bins],
            length: vec![0.0; p],
            active: Vec::with_capacity(p),
            is_refused: vec![false; p],
            inner: vec![0.0; p * (p + 1)],
            trial: vec![0.0; p],
            rest: vec![0.0; p],
        }
    }

    /// Computes x ≥ 0 that minimizes Σ weight² (target − columns·x)². Without weights they are 1. `columns` has shape
    /// (p, bins).
    #[inline(always)]
    pub(super) fn solve(&mut self, columns: &[f64], weight: Option<&[f64]>, target: &[f64], x: &mut [f64]) {
        let (bins, p) = (self.bins, self.p);
        let sources = columns.chunks_exact(bins).chain(std::iter::once(target));
        for (to, from) in self.system.chunks_exact_mut(bins).zip(sources) {
            to.copy_from_slice(from);
            if let Some(weight) = weight {
                to.iter_mut().zip(weight).for_each(|(to, w)| *to *= w);
            }
        }
        let goal = dot(&self.system[p * bins..], &self.system[p * bins..]).sqrt();
        for c in 0..p {
            let column = &self.system[c * bins..(c + 1) * bins];
            self.length[c] = dot(column, column).sqrt();
        }
        triangle(&mut self.system, bins, p);
        x.fill(0.0);
        if !(self.try_active() && self.trial[..self.active.len()].iter().all(|v| *v > 0.0)) {
            self.active.clear();
        }
        self.step_towards_solution(x, 1.0);
        self.search(x, goal);
    }

    /// Activates columns while one of them would reduce the sum of squares.
    #[inline(always)]
    fn search(&mut self, x: &mut [f64], goal: f64) {
        let (bins, p) = (self.bins, self.p);
        let size = bins.min(p);
        // A slope below this is indistinguishable from zero.
        let tolerance = 10.0 * p as f64 * f64::EPSILON * goal;
        self.is_refused.fill(false);
        // Lawson and Hanson prove termination; the bound protects only against rounding.
        for _ in 0..10 * p + 10 {
            self.rest[..size].copy_from_slice(&self.system[p * bins..p * bins + size]);
            for c in self.active.iter().copied() {
                let head = &self.system[c * bins..c * bins + size];
                self.rest[..size].iter_mut().zip(head).for_each(|(r, v)| *r -= v * x[c]);
            }
            let slope = |c: usize| dot(&self.system[c * bins..c * bins + size], &self.rest[..size]);
            let enter = (0..p)
                .filter(|c| !self.is_refused[*c] && !self.active.contains(c))
                .map(|c| (c, slope(c) / self.length[c]))
                .filter(|(_, slope)| *slope > tolerance)
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((enter, _)) = enter else { return };
            self.active.push(enter);
            if !(self.try_active() && self.trial[self.active.len() - 1] > 0.0) {
                self.active.pop();
                self.is_refused[enter] = true;
                continue;
            }
            self.is_refused.fill(false);
            self.retreat(x);
        }
    }

    /// Moves `x` to the solution of the active columns. Columns whose coefficients would become negative are
    /// deactivated.
    #[inline(always)]
    fn retreat(&mut self, x: &mut [f64]) {
        while !self.active.is_empty() {
            let blocking = (0..self.active.len())
                .filter(|i| !(self.trial[*i] > 0.0))
                .map(|i| (i, x[self.active[i]] / (x[self.active[i]] - self.trial[i])))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((first, step)) = blocking else {
                self.step_towards_solution(x, 1.0);
                return;
            };
            self.step_towards_solution(x, step);
            x[self.active[first]] = 0.0;
            self.active.retain(|c| {
                let stays = x[*c] > 0.0;
                if !stays {
                    x[*c] = 0.0;
                }
                stays
            });
            // This cannot fail: a subset of independent columns is independent.
            self.try_active();
        }
    }

    /// Moves `x` by the fraction `step` towards the solution of the active columns.
    #[inline(always)]
    fn step_towards_solution(&mut self, x: &mut [f64], step: f64) {
        for (c, trial) in self.active.iter().zip(&self.trial) {
            x[*c] = if step < 1.0 { x[*c] + step * (trial - x[*c]) } else { *trial };
        }
    }

    /// Solves the least-squares problem of the active columns into `trial`; false if the last of them depends on the
    /// others.
    #[inline(always)]
    fn try_active(&mut self) -> bool {
        let (bins, p, k) = (self.bins, self.p, self.active.len());
        let size = bins.min(p);
        if k > size {
            return false;
        }
        for (slot, c) in self.active.iter().copied().chain(std::iter::once(p)).enumerate() {
            self.inner[slot * size..(slot + 1) * size]
                .copy_from_slice(&self.system[c * bins..c * bins + size]);
        }
        triangle(&mut self.inner[..(k + 1) * size], size, k);
        for row in (0..k).rev() {
            let pivot = self.inner[row * size + row];
            if !(pivot.abs() > DEPENDENCE_TOLERANCE * self.length[self.active[row]]) {
                return false;
            }
            let known: f64 = (row + 1..k).map(|c| self.inner[c * size + row] * self.trial[c]).sum();
            self.trial[row] = (self.inner[k * size + row] - known) / pivot;
        }
        true
    }
}

/// Reduces p columns to a triangle by reflections, which are also applied to the column after them.
#[inline(always)]
fn triangle(columns: &mut [f64], length: usize, p: usize) {
    for c in 0..p.min(length) {
        let (left, right) = columns.split_at_mut((c + 1) * length);
        let head = &mut left[c * length + c..];
        let norm = dot(head, head).sqrt();
        if !(norm > 0.0) {
            continue;
        }
        let pivot = if head[0] > 0.0 { -norm } else { norm };
        // v = head − pivot e₁, and vᵀv/2 = −pivot v₁.
        head[0] -= pivot;
        let half = -pivot * head[0];
        for other in right.chunks_exact_mut(length) {
            let tail = &mut other[c..];
            let factor = dot(head, tail) / half;
            tail.iter_mut().zip(head.iter()).for_each(|(t, v)| *t -= factor * v);
        }
        head.fill(0.0);
        head[0] = pivot;
    }
}

/// Σ a b in eight independent partial sums.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Sum of squares that x leaves.
    fn rest(columns: &[f64], weight: &[f64], target: &[f64], x: &[f64]) -> f64 {
        let bins = target.len();
        let fitted = |b: usize| x.iter().enumerate().map(|(c, x)| x * columns[c * bins + b]).sum::<f64>();
        (0..bins).map(|b| (weight[b] * (target[b] - fitted(b))).powi(2)).sum()
    }

    proptest! {
        #[test]
        fn the_optimality_conditions_hold(
            columns in prop::collection::vec(0.0..1.0_f64, 40), weight in prop::collection::vec(0.1..3.0_f64, 8),
            targets in prop::collection::vec(-1.0..1.0_f64, 24), p in 1_usize..6
        ) {
            let columns = &columns[..8 * p];
            let mut solver = Nonnegative::new(8, p);
            // Each system starts from the active set of the one before.
            for target in targets.chunks_exact(8) {
                let mut x = vec![0.0; p];
                solver.solve(columns, Some(&weight), target, &mut x);
                prop_assert!(x.iter().all(|x| *x >= 0.0));
                let best = rest(columns, &weight, target, &x);
                for c in 0..p {
                    // The problem is convex, so that a point is best if no coefficient improves it alone.
                    for step in [-1e-3, 1e-3_f64] {
                        let mut other = x.clone();
                        other[c] = (x[c] + step).max(0.0);
                        prop_assert!(rest(columns, &weight, target, &other) >= best - 1e-10, "{c} {step}: {x:?}");
                    }
                }
            }
        }
    }

    fn solve(columns: &[&[f64]], target: &[f64]) -> Vec<f64> {
        let (bins, p) = (target.len(), columns.len());
        let mut x = vec![0.0; p];
        let weight = vec![1.0; bins];
        let mut solver = Nonnegative::new(bins, p);
        solver.solve(&columns.concat(), Some(&weight), target, &mut x);
        let first = x.clone();
        solver.solve(&columns.concat(), Some(&weight), target, &mut x);
        assert!(first.iter().zip(&x).all(|(a, b)| (a - b).abs() <= 1e-12 * a.abs()), "{first:?} {x:?}");
        x
    }

    #[test]
    fn keeps_the_digits_of_columns_that_are_nearly_the_same() {
        // Condition 1e6: normal equations would keep four digits.
        let a: Vec<f64> = (0..40).map(|i| 1.0 + f64::from(i) / 40.0).collect();
        let b: Vec<f64> = a.iter().map(|v| v + 1e-6 * (9.0 * v).sin()).collect();
        let target: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 2.0 * a + 3.0 * b).collect();
        let x = solve(&[&a, &b], &target);
        assert!((x[0] - 2.0).abs() < 1e-8 && (x[1] - 3.0).abs() < 1e-8, "{x:?}");
    }

    #[test]
    fn negative_coefficients_are_dropped_and_copies_or_zeros_stay_inactive() {
        let (one, line) = ([1.0; 5], [0.0, 1.0, 2.0, 3.0, 4.0]);
        let target = line.map(|v| 2.0 * v - 1.0);
        let x = solve(&[&one, &line, &line, &[0.0; 5]], &target);
        assert_eq!((x[0], x[3]), (0.0, 0.0));
        assert!((x[1] + x[2] - (2.0 - 10.0 / 30.0)).abs() < 1e-12, "{x:?}");
        assert!(x[1] == 0.0 || x[2] == 0.0);
        assert_eq!(solve(&[&one, &line], &[-1.0; 5]), [0.0, 0.0]);
    }

    #[test]
    fn more_columns_than_bins_and_nan_terminate() {
        let x = solve(&[&[1.0, 0.0], &[0.0, 1.0], &[1.0, 1.0]], &[3.0, 2.0]);
        assert!((x[0] + x[2] - 3.0).abs() < 1e-12 && (x[1] + x[2] - 2.0).abs() < 1e-12, "{x:?}");
        let mut solver = Nonnegative::new(2, 1);
        solver.solve(&[f64::NAN, 1.0], None, &[1.0, 1.0], &mut [0.0]);
    }
}
