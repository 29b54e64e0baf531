//! Small inputs through every loop that uses `unsafe`, in buffers that end exactly where the loop must stop reading.
//!
//! Intended for Miri, with and without wide instructions (`make miri`), and fast enough to run always.

use std::sync::atomic::AtomicBool;

use allanite::testing::deviation::allan::{Execution, overlapping};
use allanite::testing::deviation::family::variances;
use allanite::testing::deviation::loops::sums;
use allanite::testing::deviation::{naive, statistic};
use allanite::testing::machine::processor::Width;
use allanite::testing::noise::{Primitive, WINDOW, process};
use allanite::testing::phase::{Quantity, Record, Series};
use allanite::testing::rng::{Stream, StreamKey};

fn values(n: usize) -> Vec<f64> {
    (0..n).map(|i| ((i * i * 31 + 7 * i) % 97) as f64).collect()
}

#[test]
fn sums_end_with_their_buffer() {
    for width in Width::available() {
        for set in [&[1_usize][..], &[1, 2], &[3, 5, 7], &[1, 2, 4, 8], &[2, 3, 5, 7], &[1, 2, 4], &[50]] {
            let placed: Vec<_> = set.iter().copied().enumerate().collect();
            let groups = sums::groups(width, &placed);
            let lengths: &[usize] =
                if set[0] == 50 { &[1, 3, 49, 53, 102, 251, 853] } else { &[0, 1, 4, 7, 18] };
            for &n in lengths {
                // The buffer is sized for the largest factor; other factors have as many terms as fit.
                let last = set[set.len() - 1];
                let theta = values(n + 2 * last);
                let points = theta.len();
                let mut found = vec![0.0; set.len()];
                sums::add(width, (&theta, 0), (0, points), &[(0, points - 1)], &groups, &mut found);
                for (m, sum) in set.iter().zip(found) {
                    let expected: f64 = (0..points - 2 * m)
                        .map(|k| theta[k + 2 * m] - 2.0 * theta[k + m] + theta[k])
                        .map(|d| d * d) // Miri gives powi a random rounding
                        .sum();
                    assert_eq!(sum, expected, "whole numbers are summed exactly");
                }
            }
        }
    }
}

#[test]
fn phases_and_estimators_end_with_their_buffer() {
    let stop = AtomicBool::new(false);
    let execution = Execution { threads: 1, width: Width::best(), stop: &stop };
    for n in [3, 4, 9, 20, 37] {
        let x = values(n);
        for quantity in [Quantity::Rate, Quantity::Angle] {
            let record = Record::new(Series::new(&x), quantity, 1, &stop).unwrap();
            let (terms, _) = overlapping(&record, &[1], execution).unwrap();
            assert_eq!(terms.count[0] as usize, record.points() - 2);
            for name in ["ohdev", "mdev", "totdev", "mtotdev", "theo1"] {
                let kind = statistic(name).unwrap();
                let m = if n > 12 { 4 } else { 2 };
                if record.points() <= 3 * m {
                    continue;
                }
                let (found, _, _) = variances(&record, kind, &[m], execution).unwrap();
                let (expected, _) = naive::variance_with_gaps(kind, &x, quantity, m);
                assert!((found[0] / expected - 1.0).abs() < 1e-9, "{name}, n = {n}");
            }
        }
        let data = values(3 * n);
        let strided = Series::strided(&data, 3 * n - 1, -3, n).unwrap();
        let record = Record::new(strided, Quantity::Rate, 2, &stop).unwrap();
        assert_eq!(overlapping(&record, &[1], execution).unwrap().0.count, [n as u64 - 1]);
    }
}

#[test]
fn threads_share_a_phase() {
    // More than one block, so that two threads write parts of one buffer.
    let n = if cfg!(miri) { 40_000 } else { 300_000 };
    let x = values(n);
    let stop = AtomicBool::new(false);
    let record = Record::new(Series::new(&x), Quantity::Rate, 2, &stop).unwrap();
    let factors = [2100, 4200];
    let one =
        overlapping(&record, &factors, Execution { threads: 1, width: Width::best(), stop: &stop }).unwrap();
    let two =
        overlapping(&record, &factors, Execution { threads: 2, width: Width::best(), stop: &stop }).unwrap();
    assert_eq!(one.0, two.0);
}

#[test]
fn every_noise_process_stays_within_its_samples() {
    let key = StreamKey { seed: 1, replicate: 2, effect: 3, axis: 4 };
    let all: [(&str, &[f64]); 11] = [
        ("white", &[1.0]),
        ("blue", &[0.3]),
        ("random_walk", &[0.1]),
        ("flicker", &[2.0]),
        ("power_law", &[-2.4, 0.01]),
        ("gauss_markov", &[1.0, 0.9]),
        ("filtered", &[1.0, 0.02, 0.04, 0.02, -1.56, 0.64]),
        ("filtered", &[1.0, 1.0, 0.0, 0.0, -0.9, 0.0, 0.02, 0.04, 0.02, -1.56, 0.64]),
        ("finite", &[0.2, 0.5, 0.2, -0.1]),
        ("moving_average", &[1.0, 5.0]),
        ("telegraph", &[1.0, 0.01]),
    ];
    for (name, values) in all {
        // A long record has slow sections as well.
        let primitive = Primitive::new(name, values.to_vec()).unwrap();
        let mut process = process(&primitive, 100_000, key).unwrap();
        for windows in [0, 1, 2] {
            let mut samples = vec![0.0; windows * WINDOW];
            Stream::new(key, 7).normals(&mut samples);
            process.run(&mut samples);
            assert!(samples.iter().all(|x| x.is_finite()), "{name}");
        }
    }
    let mut stream = Stream::new(key, 9);
    for n in 0..20 {
        let mut out = vec![f64::NAN; n];
        stream.normals(&mut out);
        stream.uniforms(&mut out);
        assert!(out.iter().all(|x| (0.0..=1.0).contains(x)));
    }
}
