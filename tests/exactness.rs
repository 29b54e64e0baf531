//! Accuracy on difficult records, compared with exact arithmetic: offsets, ramps and steps that a running sum of
//! doubles does not survive.
//!
//! The reference is a running sum of 128-bit integers in units of 2⁻⁹⁰ of the largest sample. Only its final sum of
//! squares uses doubles.

mod common;

use allanite::testing::phase::Sample;
use common::exact::{Noise, exact, ours};

fn worst<T: Sample>(samples: &[T], factors: &[usize]) -> f64 {
    let doubles: Vec<f64> = samples.iter().map(|x| x.value()).collect();
    let found = ours(samples, factors, 2);
    assert_eq!(found, ours(samples, factors, 3), "the number of threads must not change a bit");
    let relative = |(m, sum): (&usize, f64)| (sum / exact(&doubles, *m) - 1.0).abs();
    factors.iter().zip(found).map(relative).fold(0.0, f64::max)
}

fn factors(n: usize) -> Vec<usize> {
    let every_other = (0..).map(|i| 1_usize << (2 * i)).take_while(|m| *m <= n / 2);
    let mut all: Vec<usize> = every_other.chain([3, 1000, 2048, 2049, 5000]).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// Every third octave.
fn sparse(n: usize) -> Vec<usize> {
    (0..).step_by(3).map(|i| 1_usize << i).take_while(|m| *m <= n / 2).collect()
}

#[test]
fn white() {
    let mut noise = Noise(1);
    let x: Vec<f64> = (0..10_000_000).map(|_| noise.normal()).collect();
    assert!(worst(&x, &sparse(x.len())) < 1e-11);
    let x = &x[..1_000_000];
    assert!(worst(x, &factors(x.len())) < 1e-11);
}

#[test]
fn gravity() {
    let mut noise = Noise(2);
    let x: Vec<f64> = (0..10_000_000).map(|_| 9.81 + 1e-4 * noise.normal()).collect();
    assert!(worst(&x, &sparse(x.len())) < 1e-10);
    let x = &x[..1_000_000];
    assert!(worst(x, &factors(x.len())) < 1e-10);
}

#[test]
fn large_offset() {
    let mut noise = Noise(3);
    let x: Vec<f64> = (0..10_000_000).map(|_| 1e6 + 1e-3 * noise.normal()).collect();
    let all: Vec<usize> = (0..23).step_by(3).map(|i| 1 << i).collect();
    assert!(worst(&x, &all) < 1e-10);
}

#[test]
fn ramp() {
    for n in [1_000_000, 10_000_000] {
        let mut noise = Noise(4);
        let x: Vec<f64> =
            (0..n).map(|i| -500.0 + 1e3 * f64::from(i) / f64::from(n) + 1e-3 * noise.normal()).collect();
        let all: Vec<usize> = (0..19).step_by(3).map(|i| 1 << i).collect();
        assert!(worst(&x, &all) < 1e-10);
    }
}

#[test]
fn counts() {
    let mut noise = Noise(5);
    let x: Vec<i16> = (0..10_000_000).map(|_| (8200.0 + 20.0 * noise.normal()) as i16).collect();
    // The phase is exact; the remaining error is the rounding of the sum of squares.
    assert!(worst(&x, &sparse(x.len())) < 1e-14);
    let x = x[..1_000_000].to_vec();
    assert!(worst(&x, &factors(x.len())) < 1e-14);
    let same: Vec<i64> = x.iter().map(|v| i64::from(*v) + (1 << 61)).collect();
    let shifted: Vec<f64> = ours(&same, &factors(x.len()), 2);
    assert_eq!(shifted, ours(&x, &factors(x.len()), 2), "an offset of integers changes nothing");
}

#[test]
fn sine_and_step() {
    let mut noise = Noise(6);
    let step = |i: usize| if i > 500_000 { 700.0 } else { 0.0 };
    let x: Vec<f64> =
        (0..1_000_000).map(|i| 1e3 * (i as f64 * 1e-4).sin() + step(i) + 1e-3 * noise.normal()).collect();
    assert!(worst(&x, &factors(x.len())) < 1e-10);
}

#[test]
fn random_walk() {
    let mut noise = Noise(7);
    let mut rate = 0.0;
    let x: Vec<f64> = (0..1_000_000)
        .map(|_| {
            rate += noise.normal();
            rate
        })
        .collect();
    assert!(worst(&x, &factors(x.len())) < 1e-10);
}

#[test]
fn drifting_counts() {
    let mut noise = Noise(8);
    let x: Vec<i16> =
        (0..1_000_000).map(|i| (3e3 * f64::from(i) / 1e6 + 20.0 * noise.normal()) as i16).collect();
    assert!(worst(&x, &factors(x.len())) < 1e-12);
}
