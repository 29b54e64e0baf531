//! The properties that the fuzzer checks, for the seed inputs and the inputs it has found. On request, also for many
//! random inputs on a stable compiler: `INPUTS=10000000 cargo test --release --test logs -- --ignored`.

#[path = "common/logs.rs"]
mod logs;

use std::path::Path;

use allanite::testing::parallel::pooled;

fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let mut found: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| (path.display().to_string(), std::fs::read(&path).unwrap()))
        .collect();
    found.sort();
    assert!(found.len() > 20, "{} inputs", found.len());
    found
}

/// Checks all inputs of a target; a failure names the input.
fn over(target: &str, judge: fn(&[u8])) {
    for (name, bytes) in corpus(target) {
        let judged = std::panic::catch_unwind(|| judge(&bytes));
        assert!(judged.is_ok(), "{name}");
    }
}

#[test]
fn text() {
    over("text", logs::text);
}

#[test]
fn dialect() {
    over("dialect", logs::dialect);
}

#[test]
fn pipes() {
    over("pipes", logs::pipes);
}

/// Random numbers from a seed.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end.max(1) as u64) as usize
    }
}

const TOKENS: [&[u8]; 28] = [
    b"nan",
    b"inf",
    b"-inf",
    b"1e999",
    b"-0",
    b"1e-320",
    b"0x1p-3",
    b"1,5",
    b"1;2",
    b"#N/A",
    b"# ",
    b"//",
    b"%",
    b"\"",
    b"'",
    b"\t",
    b"\r",
    b"\r\n",
    b"\n\n",
    b" ",
    b",",
    b";",
    b"|",
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"2026-01-01T00:00:00.5Z",
    b"12:00:00",
];

fn damaged(random: &mut Random, seeds: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut data = seeds[random.below(seeds.len())].1.clone();
    for _ in 0..=random.below(4) {
        let at = random.below(data.len() + 1);
        let end = (at + random.below(24)).min(data.len());
        match random.below(7) {
            0 if at < data.len() => data[at] ^= 1 << random.below(8),
            1 => data.truncate(at),
            2 => drop(data.drain(at..end)),
            3 => {
                let piece = data[at..end].repeat(1 + random.below(4));
                data.splice(at..at, piece);
            }
            4 => {
                let other = &seeds[random.below(seeds.len())].1;
                data.splice(at.., other[random.below(other.len() + 1)..].iter().copied());
            }
            _ => {
                let token = TOKENS[random.below(TOKENS.len())];
                data.splice(at..if random.below(2) == 0 { at } else { end }, token.iter().copied());
            }
        }
    }
    data.truncate(4096);
    data
}

#[test]
#[ignore = "as many inputs as INPUTS says: minutes"]
#[expect(clippy::disallowed_methods, reason = "cargo hands a test no argument of its own")]
fn many() {
    let count: u64 = std::env::var("INPUTS").map_or(100_000, |text| text.parse().unwrap());
    let seeds = corpus("text");
    // Within the pool's own thread, a log is read without waking another for each.
    pooled(|| {
        let mut random = Random(0x9E37_79B9_7F4A_7C15);
        for number in 0..count {
            let input = damaged(&mut random, &seeds);
            let judged = std::panic::catch_unwind(|| logs::text(&input));
            assert!(judged.is_ok(), "input {number}: {:?}", String::from_utf8_lossy(&input));
        }
    })
    .unwrap();
}
