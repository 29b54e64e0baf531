//! Largest relative error of the Allan variance on five difficult records of 10⁸ samples, compared with exact
//! arithmetic.
//!
//! This is not a timing. It prints one line per record; the required accuracy is 10⁻¹⁰. Other lengths: `-- 1e7`.

#![expect(clippy::print_stdout, reason = "the program prints its results")]

#[path = "../tests/common/exact.rs"]
mod exact;

use allanite::testing::phase::Sample;
use exact::{Noise, exact, ours};

fn report<T: Sample>(name: &str, samples: &[T]) {
    let doubles: Vec<f64> = samples.iter().map(|x| x.value()).collect();
    let factors: Vec<usize> =
        (0..).step_by(3).map(|i| 1_usize << i).take_while(|m| *m <= samples.len() / 2).collect();
    let relative = |(m, sum): (&usize, f64)| (sum / exact(&doubles, *m) - 1.0).abs();
    let found = ours(samples, &factors, 2);
    let worst = factors.iter().zip(found).map(relative).fold(0.0, f64::max);
    let verdict = if worst < 1e-10 { "holds" } else { "MISSED" };
    println!("{name:24} {worst:9.1e} of 1e-10  {verdict}");
}

fn main() {
    let asked = std::env::args().find_map(|word| word.parse::<f64>().ok());
    let n = asked.unwrap_or(1e8) as usize;
    println!("largest relative error of the Allan variance, {n} samples, every third octave");
    let mut noise = Noise(1);
    let mut make = |f: &mut dyn FnMut(f64, f64) -> f64| -> Vec<f64> {
        (0..n).map(|i| f(i as f64 / n as f64, noise.normal())).collect()
    };
    report("white, sd 1", &make(&mut |_, e| e));
    report("9.81 + 1e-4 white", &make(&mut |_, e| 9.81 + 1e-4 * e));
    report("1e6 + 1e-3 white", &make(&mut |_, e| 1e6 + 1e-3 * e));
    report("ramp ±500 + 1e-3 white", &make(&mut |t, e| -500.0 + 1e3 * t + 1e-3 * e));
    let counts: Vec<i16> = make(&mut |_, e| 8200.0 + 20.0 * e).into_iter().map(|v| v as i16).collect();
    report("int16 counts", &counts);
}
