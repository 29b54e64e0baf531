//! Straight courses through a spectrogram, which find lines with a large drift (a Hough transform).
//!
//! Single precision suffices to find candidates for a closer search, and halves the memory traffic.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::parallel::check;
use crate::{Error, Result};

/// Number of independent partial maxima.
const LANES: usize = 8;

/// Straight courses through the sections of a series of (re, im) pairs.
///
/// A frequency step is half a cycle per section. Course i = −most … most drifts by i frequency steps over the record.
/// Before the transform, the drift within each section is removed, rounded to multiples of `step` cycles per squared
/// section.
pub(crate) struct Courses<'a> {
    pub series: &'a [f64],
    pub sections: usize,
    pub step: f64,
    pub most: usize,
}

impl Courses<'_> {
    /// For each course, the frequency in the middle of the record at which the summed power is highest, and that
    /// power.
    pub(crate) fn best(&self, stop: &AtomicBool) -> Result<(Vec<i64>, Vec<f64>)> {
        let length = self.series.len() / 2 / self.sections.max(1);
        if self.series.len() % 2 == 1 || length < 2 {
            return Err(Error::Input(format!(
                "courses: {} parts of complex numbers in {} sections: two or more numbers a section",
                self.series.len(),
                self.sections
            )));
        }
        let (width, most) = (2 * length, self.most as i64);
        let mut planner = FftPlanner::<f32>::new();
        let fft = planner.plan_fft_forward(width);
        let mut scratch = vec![Complex::new(0.0_f32, 0.0); fft.get_inplace_scratch_len()];
        let mut turned = vec![Complex::new(0.0_f32, 0.0); width];
        let mut power = vec![0.0_f32; width * self.sections];
        let mut total = vec![0.0_f32; width];
        let (mut places, mut heights) = (Vec::new(), Vec::new());
        let mut before = None;
        for course in -most..=most {
            check(stop)?;
            let own = (course as f64 / (self.step * self.sections as f64)).round_ties_even();
            if before.replace(own) != Some(own) {
                let turns: Vec<_> = (0..length).map(|k| self.turn(own, k, length)).collect();
                for (row, section) in power.chunks_exact_mut(width).zip(self.series.chunks_exact(width)) {
                    turned.fill(Complex::new(0.0, 0.0));
                    for ((value, pair), turn) in turned.iter_mut().zip(section.chunks_exact(2)).zip(&turns) {
                        *value = Complex::new(pair[0] as f32, pair[1] as f32) * turn;
                    }
                    fft.process_with_scratch(&mut turned, &mut scratch);
                    row.iter_mut().zip(&turned).for_each(|(power, z)| *power = z.norm_sqr());
                }
            }
            total.fill(0.0);
            for (m, row) in power.chunks_exact(width).enumerate() {
                add_moved(&mut total, row, self.offset(course, m));
            }
            let (place, height) = highest(&total);
            places.push(place as i64);
            heights.push(f64::from(height));
        }
        Ok((places, heights))
    }

    /// Rotation factor that removes the drift from sample k of a section.
    fn turn(&self, own: f64, k: usize, length: usize) -> Complex<f32> {
        let u = k as f64 / length as f64 - 0.5;
        let turn = Complex::from_polar(1.0, -PI * self.step * own * u * u);
        Complex::new(turn.re as f32, turn.im as f32)
    }

    /// Offset, in frequency steps, of a course in section m from its frequency in the middle of the record.
    fn offset(&self, course: i64, m: usize) -> i64 {
        let middle = (m as f64 + 0.5) / self.sections as f64 - 0.5;
        (2.0 * course as f64 * middle).round_ties_even() as i64
    }
}

/// Adds `row`[f + offset] to `total`[f]; outside its ends the row counts as zero.
fn add_moved(total: &mut [f32], row: &[f32], offset: i64) {
    let by = usize::try_from(offset.unsigned_abs()).unwrap_or(usize::MAX).min(row.len());
    let kept = row.len() - by;
    let (into, from) =
        if offset < 0 { (&mut total[by..], &row[..kept]) } else { (&mut total[..kept], &row[by..]) };
    into.iter_mut().zip(from).for_each(|(sum, power)| *sum += power);
}

/// Index of the highest value (the first of equal ones), and the value.
fn highest(values: &[f32]) -> (usize, f32) {
    let mut tops = [0.0_f32; LANES];
    let chunks = values.chunks_exact(LANES);
    for (top, &value) in tops.iter_mut().zip(chunks.remainder()) {
        *top = value;
    }
    for chunk in chunks {
        for (top, &value) in tops.iter_mut().zip(chunk) {
            *top = if value > *top { value } else { *top };
        }
    }
    let height = tops.into_iter().fold(0.0, f32::max);
    (values.iter().position(|&value| value == height).unwrap_or(0), height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn phase(angle: f64) -> Complex<f64> {
        Complex::from_polar(1.0, angle)
    }

    /// Power of section m with its drift removed, at half cycle f, computed from the definition in double precision.
    fn naive_power(courses: &Courses<'_>, course: i64, m: usize, f: i64) -> f64 {
        let length = courses.series.len() / 2 / courses.sections;
        if f < 0 || f >= 2 * length as i64 {
            return 0.0;
        }
        let own = (course as f64 / courses.sections as f64 / courses.step).round_ties_even();
        (0..length)
            .map(|k| {
                let at = 2 * (m * length + k);
                let u = k as f64 / length as f64 - 0.5;
                let angle = -PI * courses.step * own * u * u - PI * f as f64 * k as f64 / length as f64;
                Complex::new(courses.series[at], courses.series[at + 1]) * phase(angle)
            })
            .sum::<Complex<f64>>()
            .norm_sqr()
    }

    proptest! {
        #[test]
        fn heights_are_those_of_the_sums(
            series in prop::collection::vec(-1.0..1.0_f64, 32..120), sections in 1_usize..5, most in 0_usize..9,
        ) {
            let series = &series[..series.len() / 2 * 2];
            let courses = Courses { series, sections, step: 2.0, most };
            let (places, heights) = courses.best(&AtomicBool::new(false)).unwrap();
            prop_assert_eq!(places.len(), 2 * most + 1);
            let width = series.len() / sections / 2 * 2;
            let length = width / 2;
            let whole = Courses { series: &series[..sections * width], ..courses };
            for (i, (&place, &height)) in places.iter().zip(&heights).enumerate() {
                let course = i as i64 - most as i64;
                let sum = |f: i64| -> f64 {
                    (0..sections)
                        .map(|m| {
                            let middle = (m as f64 + 0.5) / sections as f64 - 0.5;
                            let offset = (2.0 * course as f64 * middle).round_ties_even() as i64;
                            naive_power(&whole, course, m, f + offset)
                        })
                        .sum()
                };
                let expected = (0..2 * length as i64).map(sum).fold(0.0, f64::max);
                // Rounding errors of log₂ n butterflies and the sum over sections, 6e-8 each.
                prop_assert!((height - expected).abs() <= 3e-5 * expected.max(1.0), "{height} {expected}");
                prop_assert!((sum(place) - expected).abs() <= 3e-5 * expected.max(1.0));
            }
        }
    }

    #[test]
    fn a_line_that_drifts_far_is_on_the_best_course() {
        // From 400 to 560 cycles over the record: 40 half cycles per section of 256 numbers, 240 in the middle.
        let (n, sections) = (2048, 8);
        let series: Vec<f64> = (0..n)
            .flat_map(|k| {
                let u = f64::from(k) / f64::from(n);
                let z = phase(2.0 * PI * (400.0 * u + 80.0 * u * u));
                [z.re, z.im]
            })
            .collect();
        let courses = Courses { series: &series, sections, step: 2.0, most: 60 };
        let (places, heights) = courses.best(&AtomicBool::new(false)).unwrap();
        let top = heights.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
        assert!((top as i64 - 60 - 20).abs() <= 1, "{top}");
        assert!((places[top] - 120).abs() <= 1, "{}", places[top]);
    }

    #[test]
    fn sections_of_one_number_are_refused() {
        let refused = |series: &[f64], sections| {
            let courses = Courses { series, sections, step: 2.0, most: 1 };
            courses.best(&AtomicBool::new(false)).is_err()
        };
        assert!(refused(&[1.0; 7], 1));
        assert!(refused(&[1.0; 8], 3));
        assert!(refused(&[], 0));
    }
}
