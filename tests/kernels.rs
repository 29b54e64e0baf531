//! Every code path of the innermost loops, compared with the definition for every short length and every
//! misalignment.

use std::sync::atomic::AtomicBool;

use allanite::testing::averaging::{Grid, factors};
use allanite::testing::deviation::allan::{Execution, adjacent, overlapping};
use allanite::testing::deviation::family::variances;
use allanite::testing::deviation::loops::sums;
use allanite::testing::deviation::statistic::Statistic;
use allanite::testing::deviation::{STATISTICS, identify, naive, statistic};
use allanite::testing::machine::processor::Width;
use allanite::testing::phase::{Quantity, Record, Series};
use proptest::prelude::*;

fn noise(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(2862933555777941757).wrapping_add(3037000493);
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / 9007199254740992.0 - 0.5
    };
    (0..n).map(|_| next()).collect()
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs()) || (a.is_nan() && b.is_nan())
}

fn definition(theta: &[f64], m: usize, n: usize) -> f64 {
    (0..n).map(|k| (theta[k + 2 * m] - 2.0 * theta[k + m] + theta[k]).powi(2)).sum()
}

#[test]
fn wide_equals_plain_on_every_length_and_misalignment() {
    let theta = noise(1000, 1);
    for offset in 0..8 {
        let theta = &theta[offset..];
        for n in 0..300 {
            for m in [1, 3, 8, 31] {
                let expected = definition(theta, m, n);
                for width in Width::available() {
                    assert!(
                        close(sums::sum_of_factor(width, theta, m, n), expected, 1e-13),
                        "n = {n}, m = {m}"
                    );
                }
            }
        }
    }
}

#[test]
fn groups_equal_single_factors() {
    let theta = noise(2000, 2);
    let sets: [&[usize]; 7] = [
        &[1],
        &[1, 2],
        &[1, 2, 4],
        &[1, 2, 4, 8],
        &[1, 2, 3, 4, 5, 6, 7, 8, 16, 32, 64],
        &[3, 5, 7],
        &[5, 10, 11, 13, 20, 40, 80, 160, 320],
    ];
    for set in sets {
        let placed: Vec<_> = set.iter().copied().enumerate().collect();
        for width in Width::available() {
            let groups = sums::groups(width, &placed);
            for n in (0..300).chain([1000]) {
                let mut found = vec![0.0; set.len()];
                let runs = [(0, n + 2 * set[0])];
                sums::add(width, (&theta, 0), (0, n), &runs, &groups, &mut found);
                for (m, sum) in set.iter().zip(found) {
                    let terms = (n + 2 * set[0] + 1).saturating_sub(2 * m).min(n);
                    assert!(close(sum, definition(&theta, *m, terms), 1e-13), "{set:?} {n} {m}");
                }
            }
        }
    }
}

fn named(name: &str) -> &'static dyn Statistic {
    statistic(name).unwrap()
}

fn execution(stop: &AtomicBool, threads: usize) -> Execution<'_> {
    Execution { threads, width: Width::best(), stop }
}

/// Factors for which a record of n samples has a term.
fn valid_factors(statistic: &dyn Statistic, n: usize) -> Vec<usize> {
    let fits = |m: &usize| statistic.reach(*m) <= n && statistic.is_defined(*m);
    (2..=n / 3).filter(fits).collect()
}

#[test]
fn every_estimator_equals_its_definition() {
    let stop = AtomicBool::new(false);
    for n in [12, 13, 40, 101] {
        let x = noise(n, n as u64);
        let mean = x.iter().sum::<f64>() / n as f64;
        let centered: Vec<f64> = x.iter().map(|v| v - mean).collect();
        let theta = naive::phase(&centered, Quantity::Rate);
        let record = Record::new(Series::new(&x), Quantity::Rate, 1, &stop).unwrap();
        let angles = Record::new(Series::new(&theta), Quantity::Angle, 1, &stop).unwrap();
        for &kind in STATISTICS {
            let name = kind.name();
            let all = valid_factors(kind, n);
            let (found, counts, _) = variances(&record, kind, &all, execution(&stop, 1)).unwrap();
            let (again, _, _) = variances(&angles, kind, &all, execution(&stop, 3)).unwrap();
            for (i, m) in all.iter().enumerate() {
                let (expected, count) = naive::variance(kind, &theta, *m);
                assert!(close(found[i], expected, 1e-9), "{name} n = {n} m = {m}: {} {expected}", found[i]);
                assert!(close(again[i], expected, 1e-9), "{name} of a phase");
                assert_eq!(counts[i], count, "{name} n = {n} m = {m}");
            }
        }
    }
}

#[test]
fn long_segments_equal_their_definition() {
    let stop = AtomicBool::new(false);
    let white = noise(700, 11);
    let walk: Vec<f64> = naive::phase(&white, Quantity::Rate).iter().map(|v| v * v - 30.0 * v).collect();
    let ramp: Vec<f64> = white.iter().enumerate().map(|(i, v)| 1e3 + 5.0 * i as f64 + v).collect();
    let steps: Vec<f64> = white.windows(2).map(|w| w[1] - w[0]).collect();
    for x in [white, walk, ramp, steps] {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let centered: Vec<f64> = x.iter().map(|v| v - mean).collect();
        let theta = naive::phase(&centered, Quantity::Rate);
        let record = Record::new(Series::new(&x), Quantity::Rate, 1, &stop).unwrap();
        let all = [23, 24, 25, 31, 40, 64, 65, 101, 150, 201, 233];
        for kind in ["mtotdev", "htotdev"].map(named) {
            let name = kind.name();
            let (found, _, _) = variances(&record, kind, &all, execution(&stop, 1)).unwrap();
            for (m, value) in all.into_iter().zip(found) {
                let (expected, _) = naive::variance(kind, &theta, m);
                assert!(close(value, expected, 1e-9), "{name} m = {m}: {value} {expected}");
            }
        }
    }
}

#[test]
fn blocks_join_without_a_seam() {
    let stop = AtomicBool::new(false);
    let x: Vec<f64> = noise(40_000, 9).iter().map(|v| v + 100.0).collect();
    let centered: Vec<f64> = x.iter().map(|v| v - 100.0).collect();
    let theta = naive::phase(&centered, Quantity::Rate);
    let record = Record::new(Series::new(&x), Quantity::Rate, 2, &stop).unwrap();
    for kind in ["ohdev", "mdev", "pdev", "totdev"].map(named) {
        let name = kind.name();
        let (found, _, _) = variances(&record, kind, &[3, 300, 5000], execution(&stop, 2)).unwrap();
        for (m, value) in [3, 300, 5000].into_iter().zip(found) {
            assert!(close(value, naive::variance(kind, &theta, m).0, 1e-8), "{name} {m}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn allan_with_gaps_equals_its_definition(
        n in 3_usize..400, seed in any::<u64>(), holes in prop::collection::vec(0_usize..400, 0..12)
    ) {
        let stop = AtomicBool::new(false);
        let mut x = noise(n, seed);
        holes.iter().filter(|h| **h + 1 < n).for_each(|h| x[*h] = f64::NAN);
        prop_assume!(x.iter().any(|v| !v.is_nan()));
        for quantity in [Quantity::Rate, Quantity::Angle] {
            let record = Record::new(Series::new(&x), quantity, 1, &stop).unwrap();
            let all = factors(Grid::All, n / 2).unwrap();
            let (terms, _) = overlapping(&record, &all, execution(&stop, 1)).unwrap();
            for (i, m) in all.iter().enumerate() {
                let (sum, count) = naive::second_differences(&x, quantity, *m);
                prop_assert_eq!(terms.count[i], count);
                prop_assert!(close(terms.sum[i], sum, 1e-10));
            }
            let (terms, _) = adjacent(&record, &all, execution(&stop, 1)).unwrap();
            prop_assert!(terms.count.iter().zip(&all).all(|(c, m)| *c as usize <= n / m));
        }
    }

    #[test]
    fn every_estimator_skips_terms_that_touch_a_gap(
        n in 12_usize..150, seed in any::<u64>(), holes in prop::collection::vec(0_usize..150, 0..5)
    ) {
        let stop = AtomicBool::new(false);
        let mut x = noise(n, seed);
        holes.iter().filter(|h| **h < n).for_each(|h| x[*h] = f64::NAN);
        for quantity in [Quantity::Rate, Quantity::Angle] {
            let record = Record::new(Series::new(&x), quantity, 1, &stop).unwrap();
            for &kind in STATISTICS {
            let name = kind.name();
                let all = valid_factors(kind, n);
                let (found, counts, _) = variances(&record, kind, &all, execution(&stop, 1)).unwrap();
                for (i, m) in all.iter().enumerate() {
                    let (expected, count) = naive::variance_with_gaps(kind, &x, quantity, *m);
                    prop_assert_eq!(counts[i], count, "{} of {:?}, m = {}", name, quantity, m);
                    let same = close(found[i], expected, 1e-8) || (count == 0 && kind.is_maximum());
                    prop_assert!(same, "{name} of {quantity:?}, m = {m}: {} {expected}", found[i]);
                }
            }
        }
    }

    #[test]
    fn strided_arrays_are_read_in_place(len in 1_usize..200, step in 1_isize..7, seed in any::<u64>()) {
        let data = noise(len * step.unsigned_abs(), seed);
        let forward = Series::strided(&data, 0, step, len).unwrap();
        let backward = Series::strided(&data, (len - 1) * step.unsigned_abs(), -step, len).unwrap();
        for i in 0..len {
            prop_assert_eq!(forward.at(i).to_bits(), data[i * step.unsigned_abs()].to_bits());
            prop_assert_eq!(backward.at(len - 1 - i).to_bits(), forward.at(i).to_bits());
        }
        prop_assert!(Series::strided(&data, 0, step, len + 1 + data.len()).is_none());
        prop_assert!(Series::strided(&data, 0, -1, 2).is_none());
    }
}

#[test]
fn noise_types_are_named() {
    let stop = AtomicBool::new(false);
    let white = noise(50_000, 3);
    let walk = naive::phase(&white, Quantity::Rate);
    let steps: Vec<f64> = white.windows(2).map(|w| w[1] - w[0]).collect();
    for (x, expected) in [(steps, 2.0), (white, 0.0), (walk, -2.0)] {
        let record = Record::new(Series::new(&x), Quantity::Rate, 1, &stop).unwrap();
        let (_, theta) = overlapping(&record, &[4, 16, 64], execution(&stop, 1)).unwrap();
        for alpha in identify::laws(&record, &theta, &[4, 16, 64]) {
            assert!((alpha - expected).abs() < 0.4, "{alpha} for {expected}");
        }
    }
}

#[test]
fn the_stop_flag_interrupts() {
    let stop = AtomicBool::new(true);
    let x = noise(100_000, 4);
    assert!(Record::new(Series::new(&x), Quantity::Rate, 2, &stop).is_err());
}

#[test]
fn doubling_runs_of_long_factors_equal_the_definition() {
    // Tiles with all rows, with incomplete last rows, and (the last) with only some of the rows.
    for (n, first) in [(20_001, 2100), (40_000, 2049), (66_000, 4096), (6_000_007, 2049)] {
        let theta = noise(n, n as u64);
        let stop = AtomicBool::new(false);
        let record = Record::new(Series::new(&theta), Quantity::Angle, 1, &stop).unwrap();
        let run: Vec<usize> = (0..24).map(|t| first << t).take_while(|m| 2 * m < n).collect();
        let (found, _) = overlapping(&record, &run, execution(&stop, 1)).unwrap();
        assert_eq!(found, overlapping(&record, &run, execution(&stop, 3)).unwrap().0);
        for ((m, sum), count) in run.iter().zip(found.sum).zip(found.count) {
            assert_eq!(count as usize, n - 2 * m);
            let expected = definition(&theta, *m, n - 2 * m);
            assert!((sum / expected - 1.0).abs() < 1e-11, "n = {n}, m = {m}: {sum} {expected}");
        }
    }
}
