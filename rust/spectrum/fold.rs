//! Operations before and after the Fourier transform of a lapped segment, on separate arrays of even and odd samples.
//!
//! The loops are plain and run over slices of equal length, so that the compiler can vectorize them.

#![expect(clippy::inline_always, reason = "compiled with the instructions of the caller")]

use realfft::num_complex::Complex;

use super::halving::split;

/// Window after and before the border of two segments (even places ascending, odd places descending), and the real
/// and imaginary parts of the rotation factors.
pub(super) struct Weights {
    even: [Vec<f64>; 2],
    odd: [Vec<f64>; 2],
    turns: [Vec<f64>; 2],
}

impl Weights {
    /// Weights from the window after and before a border and from the rotation factors.
    pub(super) fn new(after: &[f64], before: &[f64], turns: &[Complex<f64>]) -> Self {
        let [mut even, mut odd] = [(); 2].map(|()| [(); 2].map(|()| vec![0.0; after.len() / 2]));
        for (i, window) in [after, before].into_iter().enumerate() {
            split(window, &mut even[i], &mut odd[i]);
            odd[i].reverse();
        }
        let turns = [turns.iter().map(|turn| turn.re).collect(), turns.iter().map(|turn| turn.im).collect()];
        Self { even, odd, turns }
    }

    /// Writes the input of the Fourier transform of a segment to `out`.
    ///
    /// The zones around both borders are folded into the segment, and the result is rotated. The first border lies
    /// before index `at` of the even and odd samples.
    #[inline(always)]
    pub(super) fn fold(&self, even: &[f64], odd: &[f64], at: usize, mean: f64, out: &mut [Complex<f64>]) {
        let (half, quarter) = (out.len(), out.len() / 2);
        let end = at + half;
        let (re, im) = (&self.turns[0][..half], &self.turns[1][..half]);
        let (first, second) = out.split_at_mut(quarter);
        {
            let [after, before] = [&self.even[0][..quarter], &self.even[1][..quarter]];
            let (a, b) = (&odd[at - quarter..at], &even[at..at + quarter]);
            let (c, d) = (&odd[end - quarter..end], &even[end..end + quarter]);
            for k in 0..quarter {
                let back = quarter - 1 - k;
                let x = after[k] * (b[k] - mean) + before[k] * (a[back] - mean);
                let y = after[k] * (c[back] - mean) - before[k] * (d[k] - mean);
                first[k] = Complex::new(x * re[k] - y * im[k], x * im[k] + y * re[k]);
            }
        }
        let [after, before] = [&self.odd[0][..quarter], &self.odd[1][..quarter]];
        let (a, b) = (&even[at - quarter..at], &odd[at..at + quarter]);
        let (c, d) = (&even[end - quarter..end], &odd[end..end + quarter]);
        let (re, im) = (&re[quarter..], &im[quarter..]);
        for k in 0..quarter {
            let back = quarter - 1 - k;
            let x = after[k] * (c[k] - mean) - before[k] * (d[back] - mean);
            let y = after[k] * (b[back] - mean) + before[k] * (a[k] - mean);
            second[k] = Complex::new(x * re[k] - y * im[k], x * im[k] + y * re[k]);
        }
    }

    /// Combines the power of the coefficients 0, 2, 4, … and n − 1, n − 3, … of a transformed segment with `power`.
    ///
    /// `put` returns the new value from the previous one and the power. The coefficients start at index `from`.
    #[inline(always)]
    pub(super) fn power(
        &self,
        turned: &[Complex<f64>],
        from: usize,
        power: &mut [Vec<f64>; 2],
        put: impl Fn(f64, f64) -> f64,
    ) {
        let [even, odd] = power;
        let count = even.len();
        let (turned, odd) = (&turned[from..from + count], &mut odd[..count]);
        let (re, im) = (&self.turns[0][from..from + count], &self.turns[1][from..from + count]);
        for k in 0..count {
            let x = turned[k].re * re[k] - turned[k].im * im[k];
            let y = turned[k].re * im[k] + turned[k].im * re[k];
            even[k] = put(even[k], x * x);
            odd[k] = put(odd[k], y * y);
        }
    }

    /// Multiplies the result of the transform by the rotation factors, in place.
    pub(super) fn turn(&self, turned: &mut [Complex<f64>]) {
        for ((value, re), im) in turned.iter_mut().zip(&self.turns[0]).zip(&self.turns[1]) {
            *value *= Complex::new(*re, *im);
        }
    }
}
