//! Small dense least squares with the same bits on every machine and any number of threads.

/// A least-squares problem: columns whose weighted sum approximates a target.
pub(super) struct Problem {
    /// Columns, each as long as `target`.
    pub columns: Vec<Vec<f64>>,
    pub target: Vec<f64>,
}

impl Problem {
    /// Weights that minimize the sum of squares (Householder triangularization).
    pub(super) fn solve(&self) -> Vec<f64> {
        let mut columns = self.columns.clone();
        let mut target = self.target.clone();
        let count = columns.len();
        let mut diagonal = vec![0.0; count];
        for j in 0..count {
            let norm = columns[j][j..].iter().map(|x| x * x).sum::<f64>().sqrt();
            let (done, rest) = columns.split_at_mut(j + 1);
            let mirror = &mut done[j][j..];
            diagonal[j] = if mirror[0] > 0.0 { -norm } else { norm };
            mirror[0] -= diagonal[j];
            let half = -mirror[0] * diagonal[j];
            for column in rest.iter_mut().map(Vec::as_mut_slice).chain([target.as_mut_slice()]) {
                reflect(mirror, half, &mut column[j..]);
            }
        }
        let mut weights = vec![0.0; count];
        for j in (0..count).rev() {
            let known: f64 = (j + 1..count).map(|k| columns[k][j] * weights[k]).sum();
            weights[j] = (target[j] - known) / diagonal[j];
        }
        weights
    }

    /// Like [`Self::solve`] with non-negative weights: the most negative one is dropped until none is left. This is
    /// not always the optimum, but the banks of poles here lose only poles outside the fitted band.
    pub(super) fn solve_nonnegative(&self) -> Vec<f64> {
        let mut kept: Vec<usize> = (0..self.columns.len()).collect();
        loop {
            let columns = kept.iter().map(|&j| self.columns[j].clone()).collect();
            let found = Self { columns, target: self.target.clone() }.solve();
            let worst = (0..kept.len()).min_by(|&i, &j| found[i].total_cmp(&found[j]));
            match worst {
                Some(i) if found[i] < 0.0 => {
                    kept.remove(i);
                }
                _ => {
                    let mut weights = vec![0.0; self.columns.len()];
                    for (&j, weight) in kept.iter().zip(found) {
                        weights[j] = weight;
                    }
                    return weights;
                }
            }
        }
    }
}

/// Applies a Householder reflection to a column.
fn reflect(mirror: &[f64], half: f64, column: &mut [f64]) {
    let dot: f64 = mirror.iter().zip(&*column).map(|(v, x)| v * x).sum();
    let factor = dot / half;
    for (x, v) in column.iter_mut().zip(mirror) {
        *x -= factor * v;
    }
}
