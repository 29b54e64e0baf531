"""Small set of records of the search, searched in about two CPU minutes: sets of three, single effects, nulls, hard cases.

    python benches/decisions/small_set.py RESULT.json [--against OLD.json] [--part sets|effects|nulls|cases]
        [--records FOLDER]

It searches each record once and writes the names of the final effects and the CPU time. `--against` prints the rows that
differ and the sums of both results. `--records` keeps the sets of three, whose strengths take longer than their search.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from scipy import signal

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "claims"))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

#: Records of each start with three hidden effects, and their rate, Hz.
SETS, SET_RATE = 5, 5.0
#: Records of each null.
NULLS = 2
N = 0.01


@dataclass(frozen=True)
class Case:
    """One record: name, model to start from, the models that are right, and the recording."""

    name: str
    start: str
    right: tuple[str, ...]
    recording: al.Recording


def cases(part: str, folder: Path | None = None) -> Iterator[Case]:
    """Yield the records of a part."""
    yield from {"sets": _sets, "effects": _effects, "nulls": _nulls, "cases": _hard}[part](folder)


def _sets(folder: Path | None) -> Iterator[Case]:
    import hidden_sets

    for start in ("N", "N+B+K"):
        for seed in range(SETS):
            name = f"{seed}-{start}"
            kept = None if folder is None else folder / f"{name}.npz"
            if kept is not None and kept.exists():
                saved = np.load(kept)
                columns = {"temperature": saved["temperature"]}
                log = al.Recording(saved["x"], rate=SET_RATE, unit="rad/s", covariates=columns)
                truth = str(saved["truth"])
            else:
                _, log, truth = hidden_sets.record(seed, 3, start, SET_RATE)
                if kept is not None:
                    samples = np.asarray(log.samples).ravel()
                    np.savez(kept, x=samples, truth=truth, **log.covariates)
            yield Case(f"set {name}", start, (truth,), log)


def _effects(_: Path | None) -> Iterator[Case]:
    from records import HIDDEN, record

    for kind, hidden in HIDDEN.items():
        yield Case(kind, hidden.start, (f"{hidden.start}+{kind}",), record(kind, 0))


def _nulls(_: Path | None) -> Iterator[Case]:
    from records import NULLS as STARTS

    for name, (start, make) in STARTS.items():
        for seed in range(NULLS):
            yield Case(f"null {name} {seed}", start, (start,), make(seed))


def _hard(_: Path | None) -> Iterator[Case]:
    """Yield records of the kinds on which a search went wrong once."""
    rate, n = 10.0, 20_000
    t = np.arange(n) / rate

    def log(x: np.ndarray, rate: float = rate) -> al.Recording:
        return al.Recording(x, rate=rate, unit="deg/s")

    for seed in range(3):
        rng = np.random.default_rng([seed, 21])
        x = g.white(rng, 20_000, 20.0, N) + g.gauss_markov(rng, n, 20.0, 2e-3, 10.0)
        yield Case(f"GM and ramp {seed}", "N", ("N+GM+R",), log(x + 1.8e-5 * t / 2, 20.0))
    for seed in range(2):
        for start in ("N", "N+B+K"):
            rng = np.random.default_rng([seed, 9])
            x = g.gauss_markov(rng, n, rate, 1.5e-2, 1.0) + g.gauss_markov(rng, n, rate, 5e-3, 30.0)
            case = f"two lags from {start} {seed}"
            yield Case(case, start, ("N+GM+GM",), log(x + g.white(rng, n, rate, N)))
    for seed, (cutoff, size) in enumerate(((2.5, 1e-3), (1.5, 5e-4))):
        rng = np.random.default_rng([seed, 7])
        x = signal.lfilter(*signal.butter(2, cutoff / 5), g.white(rng, n + 500, rate, N))[500:]
        x += g.flicker(rng, n, rate, 3e-3) + g.quantization(rng, n, rate, size)
        yield Case(f"quantized filter {seed}", "N+B", ("N+B+Q+BW",), log(x))
    for name, on in (("cycle", (t / 37.3 + 0.21) % 1 < 0.37), ("level", (t > 600) & (t < 900))):
        x = g.white(np.random.default_rng([1, 3]), n, rate, N) * np.where(on, 1.5, 1.0)
        yield Case(f"noise {name}", "N", ("N+CYCLE" if name == "cycle" else "N+LEVEL",), log(x))
    for size in (0.008, 0.03):
        rng = np.random.default_rng([1, 4])
        x = g.white(rng, n, rate, N) + size * np.sin(14.7341 * t) * ((t > 500) & (t < 900))
        yield Case(f"tone burst {size}", "N", ("N+TONE",), log(x))
    rng = np.random.default_rng(0)
    x = np.convolve(rng.normal(0, 0.04, 10309 + 49), np.ones(50) / 50, "valid")
    yield Case("mean of 50", "N+B+K", ("N+BW",), log(np.round(x / 2e-4) * 2e-4, 100.0))
    days, rng = np.arange(6236), np.random.default_rng(1)
    x = g.flicker(rng, days.size, 1.0, 4e-3) + rng.normal(0, 3.5e-3, days.size)
    x += 2.3e-3 * np.cos(2 * np.pi * days / 365.25 + 1)
    yield Case("annual line", "N+B", ("N+B+SIN",), log(x, 1 / 86400))
    for spacing, first in ((1.56, 1.37), (2.0, 2.0)):
        rng, s = np.random.default_rng(0), np.arange(20_000) / 100.0
        x = rng.normal(0, 1.5e-3, s.size)
        for k in range(12):
            x += 2.4e-4 * np.cos(2 * np.pi * (first + spacing * k) * s + rng.uniform(0, 6.28))
        yield Case(f"comb from {first}", "N", ("N+SIN",), log(x, 100.0))
    rng, s = np.random.default_rng(0), np.arange(43_200.0)
    x = rng.normal(0, 1.57e-3, s.size) + np.cumsum(rng.normal(0, 4e-7, s.size))
    x += 6e-4 * np.clip((s - 26e3) / 3400, 0, 1) + 2e-3 * np.clip((s - 29.2e3) / 1600, 0, 1)
    yield Case("slow rise", "N+B+K", ("N+K+RISE",), log(np.round(x / 5.3e-4) * 5.3e-4, 1.0))
    rng = np.random.default_rng([3, 3])
    x = g.white(rng, n, rate, N) + g.resonance(rng, n, rate, 2.0, 0.05, 0.02)
    x += g.resonance(rng, n, rate, 3.1, 0.02, 0.02)
    yield Case("start with a resonance", "N+RES(frequency=2)", ("N+RES+RES",), log(x))
    x = g.white(rng, n, rate, N) + g.resonance(rng, n, rate, 1.0, 0.05, 0.01)
    x += g.moving_band(rng, n, rate, 2.5 + 1.5 * t / t[-1], 0.1, 1.5e-2)
    yield Case("moving beside a given band", "N+RES(frequency=1)", ("N+RES+DRES",), log(x))
    x = g.white(rng, n, rate, N) + 0.004 * np.sin(2 * np.pi * 1.7 * t)
    for left in (300.0, 800.0, 1500.0):
        x += 0.02 * ((t > left) & (t < left + 60.0))
    yield Case("three excursions and a line", "N", ("N+SIN+EXCS",), log(x))


def search(case: Case) -> dict[str, Any]:
    """Search one record. Returns the names of the final effects, the steps and the CPU time."""
    began = process_time()
    study = al.improve(case.recording, case.start)
    spent = process_time() - began
    kinds = Counter(e.kind for e in study.fit.model)
    return {
        "name": case.name,
        "model": study.fit.model.name,
        "exact": any(Counter(_kinds(model)) == kinds for model in case.right),
        "verdict": study.verdict,
        "steps": len(study.ladder),
        "seconds": round(spent, 2),
    }


def _kinds(model: str) -> list[str]:
    """Return the kinds of a model string, whose terms may also be kinds."""
    known = {cls.kind for cls in al.CATALOG}
    terms = model.split("+") if "(" not in model else []
    if any(term in known for term in terms):
        first = [term for term in terms if term not in known]
        return [e.kind for e in al.parse_model("+".join(first))] + [t for t in terms if t in known]
    return [e.kind for e in al.parse_model(model)]


def compared(new: list[dict[str, Any]], old: list[dict[str, Any]]) -> str:
    """Return a line for each record whose model differs, and the sums of both results."""
    known = {one["name"]: one for one in old}
    lines = []
    for one in new:
        was = known.get(one["name"])
        if was is not None and was["model"] != one["model"]:
            mark = {1: "better", 0: "other", -1: "WORSE"}[one["exact"] - was["exact"]]
            lines.append(f"  {one['name']}: {was['model']} → {one['model']} ({mark})")
    both = [known[one["name"]] for one in new if one["name"] in known]
    for name, rows in (("before", both), ("now", new)):
        exact, seconds = sum(r["exact"] for r in rows), sum(r["seconds"] for r in rows)
        lines.append(f"{name}: {exact} of {len(rows)} exact, {seconds:.0f} CPU s")
    return "\n".join(lines)


def main() -> None:
    """Search all records, write the result file after each, and print the comparison."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("result", type=Path, help="JSON file that is written")
    parts = ("sets", "effects", "nulls", "cases")
    parser.add_argument("--part", action="append", choices=parts, help="search this part only")
    parser.add_argument("--against", type=Path, help="earlier result to compare with")
    parser.add_argument("--records", type=Path, help="folder that keeps the sets of three")
    asked = parser.parse_args()
    found: list[dict[str, Any]] = []
    for part in asked.part or parts:
        for case in cases(part, asked.records):
            found.append(search(case))
            print(found[-1], flush=True)
            asked.result.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", "utf-8")
    old = [] if asked.against is None else json.loads(asked.against.read_text("utf-8"))
    print(compared(found, old))


if __name__ == "__main__":
    main()
