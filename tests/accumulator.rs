//! A stream gives the same sums as a batch with the same strides, whatever the chunks and the order of merging.

use allanite::testing::accumulator::{Accumulator, Grid};
use proptest::prelude::*;

fn integers(n: usize, seed: u64) -> Vec<f64> {
    let mut state = seed | 1;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f64 % 1001.0 - 300.0
    };
    (0..n).map(|_| next()).collect()
}

/// Batch reference at every `stride`-th sample, in whole numbers: Σ d², number of terms, number of terms lost to
/// gaps.
fn batch(samples: &[f64], m: usize, stride: usize) -> (i128, u64, u64) {
    let mut theta = vec![0_i128];
    for x in samples {
        theta.push(theta[theta.len() - 1] + if x.is_nan() { 0 } else { *x as i128 });
    }
    let (mut sum, mut count, mut lost) = (0, 0, 0);
    for k in (0..(samples.len() + 1).saturating_sub(2 * m)).step_by(stride) {
        if samples[k..k + 2 * m].iter().all(|x| !x.is_nan()) {
            sum += (theta[k + 2 * m] - 2 * theta[k + m] + theta[k]).pow(2);
            count += 1;
        } else {
            lost += 1;
        }
    }
    (sum, count, lost)
}

fn check(samples: &[f64], accumulator: &Accumulator) {
    let reading = accumulator.reading();
    assert_eq!(accumulator.len() as usize, samples.len());
    for (m, stride, sum, count, lost) in reading {
        assert_eq!(
            (sum as i128, count, lost),
            batch(samples, m as usize, stride as usize),
            "m = {m}, stride {stride}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(50) })]

    #[test]
    fn any_chunks_and_any_merge_tree(
        n in 0_usize..9000,
        seed in any::<u64>(),
        each in 1_usize..9,
        cuts in prop::collection::vec((0_usize..9000, any::<bool>(), any::<usize>()), 0..14),
        holes in prop::collection::vec(0_usize..9000, 0..3),
    ) {
        let mut x = integers(n, seed);
        holes.iter().filter(|h| **h < n).for_each(|h| x[*h] = f64::NAN);
        let mut cuts: Vec<_> = cuts.into_iter().map(|(at, new, pick)| (at.min(n), new, pick)).collect();
        cuts.sort_unstable();
        let mut parts = vec![Accumulator::new(Grid::per_octave(each).unwrap(), 0)];
        let mut from = 0;
        for (at, new, _) in cuts.iter().chain([&(n, false, 0)]) {
            parts.last_mut().unwrap().update(&x[from..*at]).unwrap();
            from = *at;
            if *new {
                parts.push(Accumulator::new(Grid::per_octave(each).unwrap(), from as u64));
            }
        }
        for pick in cuts.iter().map(|c| c.2).cycle() {
            if parts.len() < 2 {
                break;
            }
            let right = 1 + pick % (parts.len() - 1);
            let other = parts.remove(right);
            parts[right - 1].merge(&other, 0.0).unwrap();
        }
        check(&x, &parts[0]);
    }
}

#[test]
fn a_merged_segment_can_be_continued() {
    let x = integers(30_000, 5);
    let grid = || Grid::per_octave(1).unwrap();
    let mut first = Accumulator::new(grid(), 0);
    first.update(&x[..5]).unwrap();
    let mut second = Accumulator::new(grid(), 5);
    second.update(&x[5..20_003]).unwrap();
    first.merge(&second, 0.0).unwrap();
    first.update(&x[20_003..]).unwrap();
    check(&x, &first);
    assert!(first.reading().iter().any(|r| r.0 == 8192));
}

#[test]
fn segments_with_different_bases_can_be_merged() {
    let x = integers(5_000, 9);
    let grid = || Grid::per_octave(2).unwrap();
    let (mut first, mut second) = (Accumulator::new(grid(), 0), Accumulator::new(grid(), 1_001));
    first.update(&x[..1_001]).unwrap();
    second.update(&x[1_001..].iter().map(|v| v - 70.0).collect::<Vec<_>>()).unwrap();
    let mut none = Accumulator::new(grid(), 0);
    none.merge(&first, 0.0).unwrap();
    none.merge(&second, 70.0).unwrap();
    check(&x, &none);
}

#[test]
fn incompatible_accumulators_are_refused() {
    let mut first = Accumulator::new(Grid::per_octave(1).unwrap(), 0);
    first.update(&[1.0, 2.0]).unwrap();
    assert!(first.merge(&Accumulator::new(Grid::per_octave(1).unwrap(), 3), 0.0).is_err());
    assert!(first.merge(&Accumulator::new(Grid::per_octave(2).unwrap(), 2), 0.0).is_err());
    assert!(first.update(&[f64::INFINITY]).is_err());
    assert!(Grid::per_octave(0).is_err());
}
