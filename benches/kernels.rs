//! Timings of the deviation kernels on one thread and on all threads, and of a running sum for comparison.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;

use allanite::testing::accumulator::{Accumulator, Grid};
use allanite::testing::averaging;
use allanite::testing::deviation::allan::{Execution, overlapping};
use allanite::testing::deviation::family::variances;
use allanite::testing::deviation::statistic;
use allanite::testing::machine::processor::Width;
use allanite::testing::parallel::default_threads;
use allanite::testing::phase::{Quantity, Record, Series};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn noise(n: usize) -> Vec<f64> {
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / 9007199254740992.0 - 0.5
    };
    (0..n).map(|_| next()).collect()
}

/// 100 log-spaced factors, as in a common example: unique(ceil(logspace(…))).
fn hundred(n: usize) -> Vec<usize> {
    let top = f64::from((n as f64 / 2.0).log2().floor() as i32);
    let mut all: Vec<usize> =
        (0..100).map(|i| 2_f64.powf(top * f64::from(i) / 99.0).ceil() as usize).collect();
    all.dedup();
    all
}

fn allan(c: &mut Criterion) {
    let stop = AtomicBool::new(false);
    for n in [1_000_000, 10_000_000] {
        let x = noise(n);
        let mut group = c.benchmark_group(format!("oadev {n}"));
        group.sample_size(10).throughput(Throughput::Elements(n as u64));
        group.bench_function("running sum", |b| {
            b.iter(|| {
                let mut sum = 0.0;
                black_box(
                    x.iter()
                        .map(|v| {
                            sum += v;
                            sum
                        })
                        .collect::<Vec<f64>>(),
                )
            });
        });
        let octave = averaging::factors(averaging::Grid::Octave, n / 2).unwrap_or_default();
        for (name, factors) in [("octave", octave), ("log100", hundred(n))] {
            for threads in [1, default_threads()] {
                group.bench_function(format!("{name}, {threads} threads"), |b| {
                    b.iter(|| {
                        let record = Record::new(Series::new(&x), Quantity::Rate, threads, &stop);
                        let execution = Execution { threads, width: Width::best(), stop: &stop };
                        record.and_then(|record| overlapping(&record, &factors, execution)).is_ok()
                    });
                });
            }
        }
        group.finish();
    }
}

fn family(c: &mut Criterion) {
    let stop = AtomicBool::new(false);
    let x = noise(20_000);
    let factors = averaging::factors(averaging::Grid::Octave, 5000).unwrap_or_default();
    let even: Vec<usize> = factors.iter().copied().filter(|m| *m > 1).collect();
    let mut group = c.benchmark_group("family 20000");
    group.sample_size(10);
    for name in ["ohdev", "mdev", "totdev", "mtotdev", "htotdev", "theo1"] {
        let Some(kind) = statistic(name) else { continue };
        group.bench_function(name, |b| {
            b.iter(|| {
                let execution = Execution { threads: 1, width: Width::best(), stop: &stop };
                let record = Record::new(Series::new(&x), Quantity::Rate, 1, &stop);
                record.and_then(|record| variances(&record, kind, &even, execution)).is_ok()
            });
        });
    }
    group.finish();
}

fn stream(c: &mut Criterion) {
    let x = noise(1 << 22);
    let mut group = c.benchmark_group("accumulator");
    group.sample_size(10).throughput(Throughput::Elements(x.len() as u64));
    for each in [1, 8] {
        group.bench_function(format!("{each} per octave"), |b| {
            b.iter(|| {
                let grid = Grid::per_octave(each);
                grid.and_then(|grid| {
                    let mut stream = Accumulator::new(grid, 0);
                    x.chunks(1 << 16).try_for_each(|chunk| stream.update(chunk))
                })
                .is_ok()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, allan, family, stream);
criterion_main!(benches);
