"""Damage with structure: what breaks parsers is lengths, counts, types and ends, not noise alone."""

EDGES = [0, 1, 2, 3, 7, 8, 14, 15, 127, 128, 255, 256, 32767, 65535, 65536]
EDGES += [2**24, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1]
WORDS = "nan inf -inf 1e999 -0 1e-320 0x1p-3 1,5 1;2 # // % [ { } null true - + $x$ <b> \\ ../ N( GM(T= ! inf! e ."
TOKENS = [*WORDS.encode().split(), b"time [s]", b"gx [deg/s]", b"1" * 400, b"9" * 30]
TOKENS += [b"\t", b"\r", b"\r\n", b"\n\n", b'"', b"'", b"\x00", b"\xff"]
TOKENS += [b"\xef\xbb\xbf", b"\xe2\x80\xae", b"\x1b[2J"]


def damaged(rng, seeds, text=False):
    """One of the seeds with one to six changes."""
    data = bytearray(seeds[rng.integers(len(seeds))])
    # A single change reaches furthest: more of them, and a reader stops at the first.
    for _ in range(int(rng.choice([1, 1, 1, 2, 3, 6]))):
        _change(rng, data, seeds, text)
    return bytes(data[: 1 << 20])


def _change(rng, data, seeds, text):
    at = int(rng.integers(len(data) + 1))
    # Heads hold the lengths and types: half of the changes are there.
    if rng.random() < 0.5:
        at = min(at, int(rng.integers(1, 400)))
    size = int(min(rng.integers(1, 64), len(data) - at))
    match int(rng.integers(9)):
        case 0 if size:
            data[at] ^= 1 << int(rng.integers(8))
        case 1:
            width = int(rng.choice([1, 2, 4, 8]))
            edge = EDGES[rng.integers(len(EDGES))] % 256**width
            data[at : at + width] = edge.to_bytes(width, "big" if rng.random() < 0.2 else "little")
        case 2:
            del data[at:]
        case 3:
            del data[at : at + size]
        case 4:
            data[at:at] = data[at : at + size] * int(rng.integers(1, 5))
        case 5:
            other = seeds[rng.integers(len(seeds))]
            cut = int(rng.integers(len(other) + 1))
            data[at:] = other[cut:]
        case 6:
            data[at : at + (size if rng.random() < 0.5 else 0)] = TOKENS[rng.integers(len(TOKENS))]
        case 7 if not text:
            data[at : at + size] = rng.bytes(size)
        case _:
            data[at : at + size] = TOKENS[rng.integers(len(TOKENS))] * int(rng.integers(1, 4))
