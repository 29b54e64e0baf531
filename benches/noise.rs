//! Timings of the noise generator: deviates, each process, and a typical sum.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;

use allanite::testing::noise::{Generator, Primitive};
use allanite::testing::rng::{Stream, StreamKey};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const N: usize = 1 << 20;

fn processes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("noise");
    group.sample_size(10).throughput(Throughput::Elements(N as u64));
    let mut samples = vec![0.0; N];
    let key = StreamKey { seed: 1, replicate: 0, effect: 0, axis: 0 };
    group.bench_function("normals", |bencher| {
        bencher.iter(|| {
            for (block, part) in samples.chunks_mut(4096).enumerate() {
                Stream::new(key, block as u64).normals(part);
            }
            black_box(&samples);
        });
    });
    let white = Primitive::White { sd: 1.0 };
    let flicker = Primitive::Flicker { level: 1.0 };
    let walk = Primitive::RandomWalk { step: 1.0 };
    let markov = Primitive::GaussMarkov { sigma: 1.0, phi: 0.99 };
    let lists = [
        ("white", vec![white.clone()]),
        ("flicker", vec![flicker.clone()]),
        ("random_walk", vec![walk.clone()]),
        ("gauss_markov", vec![markov.clone()]),
        ("telegraph", vec![Primitive::Telegraph { amplitude: 1.0, probability: 0.01 }]),
        ("filtered", vec![Primitive::Filtered { sd: 1.0, sections: vec![[0.02, 0.04, 0.02, -1.56, 0.64]] }]),
        ("white+flicker+walk+markov", vec![white, flicker, walk, markov]),
    ];
    for (name, list) in lists {
        for threads in [1, 2] {
            let stop = AtomicBool::new(false);
            let mut generator = Generator::new(&list, 10_000_000, 1, 0, 0, threads).unwrap();
            group.bench_function(format!("{name}, {threads} threads"), |bencher| {
                bencher.iter(|| generator.fill(&mut samples[..], &stop).unwrap());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, processes);
criterion_main!(benches);
