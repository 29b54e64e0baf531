//! Threefry-4×64-20, the counter-based generator that seeds the streams (Salmon et al. 2011).

use super::normals::Lanes;
#[cfg(target_arch = "x86_64")]
use crate::machine::processor::{Unit, Width};

/// Threefry-4×64 with 20 rounds, applied to the counter of every lane.
pub(super) fn threefry(key: [u64; 4], counter: [Lanes; 4]) -> [Lanes; 4] {
    #[cfg(target_arch = "x86_64")]
    if Width::best().unit() == Unit::Avx512 {
        // SAFETY: a `Width` is only made of units that the processor has.
        return unsafe { threefry_wide(key, counter) };
    }
    threefry_body(key, counter)
}

/// Like [`threefry`], compiled for AVX-512.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn threefry_wide(key: [u64; 4], counter: [Lanes; 4]) -> [Lanes; 4] {
    threefry_body(key, counter)
}

/// Body of [`threefry`]; inlined, so that it is compiled again inside `threefry_wide`.
#[inline(always)]
fn threefry_body(key: [u64; 4], counter: [Lanes; 4]) -> [Lanes; 4] {
    const ROTATIONS: [[u32; 2]; 8] =
        [[14, 16], [52, 57], [23, 40], [5, 37], [25, 33], [46, 12], [58, 22], [32, 32]];
    let parity = key.iter().fold(0x1BD1_1BDA_A9FC_1A22, |all, word| all ^ word);
    let extended = [key[0], key[1], key[2], key[3], parity];
    let [mut x0, mut x1, mut x2, mut x3] = counter;
    plus(&mut x0, key[0]);
    plus(&mut x1, key[1]);
    plus(&mut x2, key[2]);
    plus(&mut x3, key[3]);
    for round in 0..20 {
        let [first, second] = ROTATIONS[round % 8];
        if round % 2 == 0 {
            mix(&mut x0, &mut x1, first);
            mix(&mut x2, &mut x3, second);
        } else {
            mix(&mut x0, &mut x3, first);
            mix(&mut x2, &mut x1, second);
        }
        if round % 4 == 3 {
            let injection = round / 4 + 1;
            let word = |i: usize| extended[(injection + i) % 5];
            plus(&mut x0, word(0));
            plus(&mut x1, word(1));
            plus(&mut x2, word(2));
            plus(&mut x3, word(3).wrapping_add(injection as u64));
        }
    }
    [x0, x1, x2, x3]
}

#[expect(clippy::inline_always, reason = "part of `threefry_body`")]
#[inline(always)]
/// Adds a word to every lane, modulo 2^64.
fn plus(x: &mut Lanes, word: u64) {
    for lane in x {
        *lane = lane.wrapping_add(word);
    }
}

#[expect(clippy::inline_always, reason = "part of `threefry_body`")]
#[inline(always)]
/// The MIX function of Threefry.
fn mix(a: &mut Lanes, b: &mut Lanes, bits: u32) {
    for (a, b) in a.iter_mut().zip(b) {
        *a = a.wrapping_add(*b);
        *b = b.rotate_left(bits) ^ *a;
    }
}

#[cfg(test)]
mod tests {
    use super::super::normals::LANES;
    use super::*;

    #[test]
    fn threefry_known_answers() {
        // Random123's kat_vectors, threefry4x64 20.
        let one = |key, counter: [u64; 4]| {
            let all = threefry(key, counter.map(|word| [word; LANES]));
            assert_eq!(all, threefry_body(key, counter.map(|word| [word; LANES])));
            all.map(|lanes| lanes[LANES - 1])
        };
        assert_eq!(
            one([0; 4], [0; 4]),
            [0x09218ebde6c85537, 0x55941f5266d86105, 0x4bd25e16282434dc, 0xee29ec846bd2e40b]
        );
        assert_eq!(
            one([u64::MAX; 4], [u64::MAX; 4]),
            [0x29c24097942bba1b, 0x0371bbfb0f6f4e11, 0x3c231ffa33f83a1c, 0xcd29113fde32d168]
        );
    }
}
