//! Total variances over all segments at once, in O(1) per segment.
//!
//! Let G be the running sum of a segment of 3m points without its trend, continued oddly about both ends. The second
//! differences of m-point sums of the reflected segment are D(i) = G(i+3m) − 3G(i+2m) + 3G(i+m) − G(i), with D(i) =
//! D(−3m−i). Expressed by the running sum C of the record, with i = ±s, each quarter of the period has the form
//!
//! `D = U[k−s] + V[k+s] + α_k + β_k s + γ_k s²`
//!
//! Here k is the start of the segment, U and V are sums of a few values of C, and α, β, γ come from the trend. The
//! sum of D² over all k and s splits into running sums. One kind are running sums of U², V² and of moments of U and V
//! over s. The other is the sum of U[k−s]·V[k+s] over pairs (u, v) of equal parity, which for each u is a running sum
//! of every other V. So m segments cost O(m) instead of O(m²).
//!
//! Cancellation is bounded by working on blocks of about m segments and removing a parabola from the running sum of
//! each block. The parabola does not change the detrended, centered segments.

use std::sync::atomic::{AtomicBool, Ordering};

/// One quarter of the period: U[u] = Σ a·C[u + 3m + o·m] and V[v] = Σ a·C[v + o·m], summed over pairs (o, a).
struct Quarter {
    back: &'static [(isize, f64)],
    forth: &'static [(isize, f64)],
    /// α, β, γ from C[k], m, and the trend of a segment.
    polynomial: fn(f64, f64, Trend) -> [f64; 3],
    /// First and last s in units of m.
    span: (usize, usize),
}

/// Trend of a segment: x ≈ tilt + bend·(2i + 1).
#[derive(Clone, Copy)]
struct Trend {
    bend: f64,
    tilt: f64,
}

const QUARTERS: [Quarter; 4] = [
    Quarter {
        back: &[(0, 1.0), (-1, -3.0), (-2, 3.0)],
        forth: &[(0, 1.0)],
        polynomial: |c, _, t| [-2.0 * c, 0.0, -2.0 * t.bend],
        span: (0, 1),
    },
    Quarter {
        back: &[(0, 1.0), (-1, -3.0)],
        forth: &[(0, 1.0), (-1, -3.0)],
        polynomial: |c, m, t| [4.0 * c + 6.0 * m * m * t.bend, -12.0 * m * t.bend, 4.0 * t.bend],
        span: (1, 2),
    },
    Quarter {
        back: &[(0, -1.0)],
        forth: &[(0, -1.0), (1, 3.0), (2, -3.0)],
        polynomial: |c, m, t| [2.0 * c + 18.0 * m * m * t.bend + 6.0 * m * t.tilt, 0.0, 2.0 * t.bend],
        span: (0, 1),
    },
    Quarter {
        back: &[(0, -1.0), (1, 3.0)],
        forth: &[(0, -1.0), (1, 3.0)],
        polynomial: |c, m, t| {
            [-4.0 * c - 42.0 * m * m * t.bend - 12.0 * m * t.tilt, 12.0 * m * t.bend, -4.0 * t.bend]
        },
        span: (1, 2),
    },
];

/// Sum of the 6m squares D² of each of the `n` segments of 3m points, whose running sums start at `running[0..n]`.
///
/// D are the second differences of m-point sums of a detrended and reflected segment. The result is unspecified if
/// `stop` is set.
pub(crate) fn sum(running: &[f64], n: usize, m: usize, stop: &AtomicBool) -> f64 {
    let block = m.max(64);
    let starts = (0..n).step_by(block).take_while(|_| !stop.load(Ordering::Relaxed));
    starts.map(|from| sum_of_block(&running[from..n.min(from + block) + 3 * m], m, stop)).sum()
}

/// Sum as of [`sum`] over all segments of one block.
fn sum_of_block(running: &[f64], m: usize, stop: &AtomicBool) -> f64 {
    let c = flattened(running);
    let n = c.len() - 3 * m;
    let trends: Vec<Trend> = (0..n).map(|k| trend(&c[k..=k + 3 * m])).collect();
    let mut total = 0.0;
    for quarter in QUARTERS.iter().take_while(|_| !stop.load(Ordering::Relaxed)) {
        let polynomials: Vec<[f64; 3]> =
            (0..n).map(|k| (quarter.polynomial)(c[k], m as f64, trends[k])).collect();
        let (first, last) = (quarter.span.0 * m, quarter.span.1 * m);
        if first == 0 {
            // This quarter also represents its mirror image, for which s = 1 … m instead of 0 … m − 1.
            let [inner, start, end] = [(1, m), (0, 1), (m, m + 1)]
                .map(|(from, to)| squares(quarter, &c, m, from, to, &polynomials));
            total += 2.0 * inner + start + end;
        } else {
            total += squares(quarter, &c, m, first, last, &polynomials);
        }
    }
    total
}

/// The running sum without the parabola through its first, middle and last value.
fn flattened(running: &[f64]) -> Vec<f64> {
    let last = running.len() - 1;
    let middle = last / 2;
    let slope = |i: usize, j: usize| (running[j] - running[i]) / (j - i) as f64;
    let (first, second) = (slope(0, middle), slope(middle, last));
    let bend = (second - first) / last as f64;
    let parabola = |j: f64| j * (first + bend * (j - middle as f64));
    running.iter().enumerate().map(|(j, v)| (v - running[0]) - parabola(f64::from(j as u32))).collect()
}

/// Trend of a segment from the means of its halves; the detrended running sum ends at its initial value.
fn trend(c: &[f64]) -> Trend {
    let length = c.len() - 1;
    let (half, other) = (length / 2, length.div_ceil(2));
    let (low, high) = (c[half] - c[0], c[length] - c[other]);
    let slope = (high - low) / (half * other) as f64;
    let mean = ((c[length] - c[0]) - slope * (length * (length - 1) / 2) as f64) / length as f64;
    Trend { bend: slope / 2.0, tilt: mean - slope / 2.0 }
}

/// Σ D² over all segments k and s = `from`..`to`.
fn squares(q: &Quarter, c: &[f64], m: usize, from: usize, to: usize, polynomials: &[[f64; 3]]) -> f64 {
    let (n, width) = (polynomials.len(), to - from);
    let length = n + width - 1;
    // Array index i corresponds to u = i − to + 1 in U, and to v = i + from in V.
    let back = combined(c, q.back, (3 * m + 1 - to) as isize, m, length);
    let forth = combined(c, q.forth, from as isize, m, length);
    if width == 1 {
        let s = from as f64;
        let term = |k: usize| {
            back[k] + forth[k] + polynomials[k][0] + s * (polynomials[k][1] + s * polynomials[k][2])
        };
        return (0..n).map(|k| term(k).powi(2)).sum();
    }
    let powers = powers(from, to);
    let (u, v) = (Moments::new(&back), Moments::new(&forth));
    let mut sum = 0.0;
    for (k, &[a, b, g]) in polynomials.iter().enumerate() {
        let (u, v) = (u.window(k, width), v.window(k, width));
        // At index i, s = far − i in U and s = i + near in V.
        let far = k as f64 + to as f64 - 1.0;
        let near = from as f64 - k as f64;
        let first = (far * u[0] - u[1]) + (near * v[0] + v[1]);
        let second = (far * (far * u[0] - 2.0 * u[1]) + u[2]) + (near * (near * v[0] + 2.0 * v[1]) + v[2]);
        sum += u[3] + v[3] + 2.0 * (a * (u[0] + v[0]) + b * first + g * second);
        sum += a * a * powers[0]
            + 2.0 * a * b * powers[1]
            + (b * b + 2.0 * a * g) * powers[2]
            + 2.0 * b * g * powers[3]
            + g * g * powers[4];
    }
    sum + 2.0 * products(&back, &forth, n, from, to)
}

/// Σ a·C[start + i + o·m] for i = 0..length.
fn combined(c: &[f64], parts: &[(isize, f64)], start: isize, m: usize, length: usize) -> Vec<f64> {
    let mut out = vec![0.0; length];
    for &(offset, factor) in parts {
        let first = (start + offset * m as isize) as usize;
        out.iter_mut().zip(&c[first..first + length]).for_each(|(to, v)| *to += factor * v);
    }
    out
}

/// Σ s^j over s = from..to, j = 0 … 4.
fn powers(from: usize, to: usize) -> [f64; 5] {
    let below = |n: f64| {
        let (a, b) = (n - 1.0, 2.0 * n - 1.0);
        let triangle = n * a / 2.0;
        let squares = n * a * b / 6.0;
        [n, triangle, squares, triangle * triangle, squares * (3.0 * n * a - 1.0) / 5.0]
    };
    let (low, high) = (below(from as f64), below(to as f64));
    std::array::from_fn(|j| high[j] - low[j])
}

/// Running sums of x, i·x, i²·x and x², with a leading zero.
struct Moments(Vec<[f64; 4]>);

impl Moments {
    /// Running sums of the moments of `values`.
    fn new(values: &[f64]) -> Self {
        let mut sums = Vec::with_capacity(values.len() + 1);
        let mut at = [0.0; 4];
        sums.push(at);
        for (i, x) in values.iter().enumerate() {
            let i = f64::from(i as u32);
            at = [at[0] + x, at[1] + i * x, at[2] + i * (i * x), at[3] + x * x];
            sums.push(at);
        }
        Self(sums)
    }

    /// Sums over `width` values from index `from` on.
    fn window(&self, from: usize, width: usize) -> [f64; 4] {
        let (low, high) = (&self.0[from], &self.0[from + width]);
        std::array::from_fn(|j| high[j] - low[j])
    }
}

/// Σ U[k−s]·V[k+s] over all segments and s = from..to.
fn products(back: &[f64], forth: &[f64], n: usize, from: usize, to: usize) -> f64 {
    // Running sums of every other V, with two leading zeros.
    let mut every_other = vec![0.0; forth.len() + 2];
    for (i, v) in forth.iter().enumerate() {
        every_other[i + 2] = every_other[i] + v;
    }
    let term = |(i, u): (usize, &f64)| {
        let low = from.max((to - 1).saturating_sub(i));
        let high = (to - 1).min(to + n - 2 - i);
        // Index of V[u + 2s].
        let at = |s: usize| i + 1 + 2 * s - to - from;
        u * (every_other[at(high) + 2] - every_other[at(low)])
    };
    back.iter().enumerate().map(term).sum()
}
