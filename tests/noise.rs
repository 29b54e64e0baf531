//! The samples have the same bits for any chunk lengths and any number of threads.

use std::sync::atomic::AtomicBool;

use allanite::testing::noise::{Generator, Primitive};
use proptest::prelude::*;

const PROCESSES: [(&str, &[f64]); 11] = [
    ("white", &[1.0]),
    ("blue", &[0.3]),
    ("random_walk", &[0.1]),
    ("flicker", &[2.0]),
    ("power_law", &[-2.4, 0.01]),
    ("gauss_markov", &[1.0, 0.999]),
    ("filtered", &[1.0, 0.02, 0.04, 0.02, -1.56, 0.64]),
    ("filtered", &[1.0, 1.0, 0.0, 0.0, -0.9, 0.0, 0.02, 0.04, 0.02, -1.56, 0.64]),
    ("finite", &[0.2, 0.5, 0.2, -0.1]),
    ("moving_average", &[1.0, 5000.0]),
    ("telegraph", &[1.0, 0.01]),
];

fn primitives(list: &[(&str, &[f64])]) -> Vec<Primitive> {
    list.iter().map(|(name, values)| Primitive::new(name, values.to_vec()).unwrap()).collect()
}

fn generator(chosen: &[usize], threads: usize) -> Generator {
    let list: Vec<_> = chosen.iter().map(|&i| PROCESSES[i]).collect();
    Generator::new(&primitives(&list), 1 << 20, 7, 1, 2, threads).unwrap()
}

fn bits(samples: &[f64]) -> Vec<u64> {
    samples.iter().map(|x| x.to_bits()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn chunks_and_threads_change_nothing(
        chosen in prop::collection::vec(0..PROCESSES.len(), 0..5),
        sizes in prop::collection::vec(0..200_000_usize, 1..5),
        threads in prop::sample::select(vec![0, 1, 2, 7]),
    ) {
        let stop = AtomicBool::new(false);
        let n = sizes.iter().sum();
        let mut whole = vec![0.0; n];
        generator(&chosen, 1).fill(&mut whole[..], &stop).unwrap();
        let mut stream = generator(&chosen, threads);
        let mut pieces = Vec::new();
        for size in sizes {
            let mut piece = vec![0.0; size];
            stream.fill(&mut piece[..], &stop).unwrap();
            pieces.extend(piece);
        }
        prop_assert_eq!(bits(&whole), bits(&pieces));
    }
}

#[test]
fn a_sum_equals_the_sum_of_its_parts() {
    // The position of the effect in the list is part of its stream; effects of size zero before it keep the position.
    let stop = AtomicBool::new(false);
    let n = 10_000;
    let run = |list: &[(&str, &[f64])]| {
        let mut samples = vec![0.0; n];
        Generator::new(&primitives(list), n, 1, 0, 0, 1).unwrap().fill(&mut samples[..], &stop).unwrap();
        samples
    };
    let both = run(&[PROCESSES[3], PROCESSES[5]]);
    let first = run(&[PROCESSES[3]]);
    let second = run(&[("white", &[0.0]), PROCESSES[5]]);
    for ((both, first), second) in both.iter().zip(first).zip(second) {
        assert!((both - (first + second)).abs() <= 1e-12 * both.abs().max(1.0));
    }
}

#[test]
fn an_effect_of_size_zero_adds_nothing() {
    let mut samples = vec![1.0; 10_000];
    for (name, values) in
        [("flicker", &[0.0][..]), ("power_law", &[-1.5, 0.0]), ("gauss_markov", &[0.0, 0.9])]
    {
        let mut stream = Generator::new(&primitives(&[(name, values)]), 1 << 30, 1, 0, 0, 1).unwrap();
        stream.fill(&mut samples[..], &AtomicBool::new(false)).unwrap();
        assert!(samples.iter().all(|x| *x == 0.0), "{name}");
    }
}

#[test]
fn the_stop_flag_interrupts() {
    let mut samples = vec![0.0; 1 << 20];
    for threads in [1, 2] {
        let mut stream = generator(&[0, 3], threads);
        let result = stream.fill(&mut samples[..], &AtomicBool::new(true));
        assert_eq!(result, Err(allanite::testing::Error::Interrupted));
        let again = stream.fill(&mut samples[..], &AtomicBool::new(false)).unwrap_err();
        assert!(again.to_string().contains("begin a new one"), "{again}");
    }
}
