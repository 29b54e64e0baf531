"""Benchmark of the search for missing effects: one command, one result file.

    python benches/decisions/benchmark.py RESULT.json [--full] [--part effects|sets|nulls|speed]
        [--against OLD.json] [--workers 2]

It searches records with one hidden effect of the catalog (confusion matrix), with sets of two and three, and with a
complete start model (false additions), and measures the CPU time of a search. All records come from `records.py` and
tests/python/generators.py; the samples are made without the package.

The small version takes about fifteen minutes of two processors, `--full` some hours. `--against` prints both results side
by side and marks shares that decreased by more than their standard error.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from time import process_time
from typing import Any

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "claims"), str(HERE.parents[1] / "tests" / "python")]

#: Records of each effect, of each kind of set and of each null, as (small, full).
EFFECTS, SETS, NULLS = (4, 30), (6, 60), (12, 200)


def one_effect(kind: str, seed: int) -> dict[str, Any]:
    """Search one record with one hidden effect."""
    from records import HIDDEN, record

    import allanite as al

    hidden = HIDDEN[kind]
    log = record(kind, seed)
    began = process_time()
    study = al.improve(log, hidden.start)
    spent = process_time() - began
    start = Counter(e.kind for e in al.parse_model(hidden.start))
    found = Counter(e.kind for e in study.fit.model)
    return {
        "hidden": kind,
        "seed": seed,
        "added": sorted((found - start).elements()),
        "exact": found - start == Counter([kind]),
        "alternative": kind in _alternatives(study.fit)
        or _is_shown(study, start + Counter([kind])),
        "rise": _rise(log, hidden),
        "verdict": study.verdict,
        "seconds": round(spent, 2),
    }


def _alternatives(fit: Any) -> set[str]:
    """Return the kinds that are declared as alternative explanations of an effect of the model."""
    from allanite.fit.rivals.alternatives import rivals

    found: set[str] = set()
    for place in range(len(fit.model)):
        declared = rivals(fit, place)
        found.update(declared.alone)
        found.update(kind for pair in declared.pairs for kind in pair)
    return found


def _is_shown(study: Any, kinds: Counter[str]) -> bool:
    """True if a model with these effects is among those that the study calls indistinguishable from its last one."""
    import allanite as al

    shown = () if study.undecided is None else study.undecided.models
    return any(Counter(e.kind for e in al.parse_model(name)) == kinds for name, _ in shown)


def _rise(log: Any, hidden: Any) -> float | None:
    """Return the log-likelihood of the truth minus that of the start; None if they use different samples."""
    import allanite as al

    if not hidden.comparable:
        return None
    fits = (al.fit_model(log, model) for model in (hidden.truth, hidden.start))
    with_it, without = (fit.solution.log_likelihood for fit in fits)
    return round(float(with_it - without), 1)


def one_set(hidden: int, start: str, seed: int) -> dict[str, Any]:
    """Search one record with several hidden effects of ΔlogL 30 each."""
    import hidden_sets

    began = process_time()
    kinds, study, ahead = hidden_sets.one(seed, hidden, start)
    return {
        "set": f"{hidden} from {start}",
        "seed": seed,
        "hidden": kinds,
        "model": study.fit.model.name,
        "exact": bool(hidden_sets.matches(kinds, study, start)),
        "named": bool(hidden_sets.named(kinds, study, start)),
        "evidence_of_truth": round(float(ahead), 1),
        "seconds": round(process_time() - began, 2),
    }


def one_null(name: str, seed: int) -> dict[str, Any]:
    """Search one record of the start's own model."""
    from records import NULLS as CASES

    import allanite as al

    start, make = CASES[name]
    log = make(seed)
    began = process_time()
    study = al.improve(log, start)
    asked = Counter(e.kind for e in al.parse_model(start))
    found = Counter(e.kind for e in study.fit.model)
    return {
        "null": name,
        "seed": seed,
        "added": sorted((found - asked).elements()),
        "more": found.total() > asked.total(),
        "alternative": _is_shown(study, asked),
        "adequate": bool(study.adequate),
        "seconds": round(process_time() - began, 2),
    }


def speed() -> dict[str, Any]:
    """Return the CPU seconds of six ADIS axes, of a check of a million samples, and of many lines, in this process."""
    import numpy as np

    import allanite as al
    import generators as g

    found: dict[str, Any] = {}
    rng = np.random.default_rng(1)
    n = 1_000_000
    long = al.Recording(g.white(rng, n, 100.0, 0.01) + g.walk(rng, n, 100.0, 1e-4), rate=100.0)
    # The first check of a process also imports modules and fills caches.
    for name in ("check of 10^6 samples", "second check of 10^6 samples"):
        fit = al.fit_model(long, "N+B+K")
        began = process_time()
        fit.check()
        found[name] = round(process_time() - began, 2)
    lines = g.white(rng, 20_000, 100.0, 0.01)
    for f in np.linspace(2.0, 45.0, 16):
        lines = lines + g.sinusoid(20_000, 100.0, f * (1 + 0.01 * rng.random()), 0.004)
    began = process_time()
    al.improve(al.Recording(lines, rate=100.0), "N")
    found["sixteen lines in 20 000 samples"] = round(process_time() - began, 2)
    adis = Path(os.environ.get("ALLANITE_DATA", "")) / "adis16405_imu1.npz"
    if adis.exists():
        began = process_time()
        al.characterize(al.read(adis))
        found["six ADIS axes"] = round(process_time() - began, 1)
    return found


def _jobs(part: str, full: bool) -> list[tuple[Any, ...]]:
    """Return the searches of a part as (function, names, seed)."""
    from records import HIDDEN
    from records import NULLS as CASES

    size = {"effects": EFFECTS, "sets": SETS, "nulls": NULLS}[part][full]
    if part == "effects":
        return [(one_effect, kind, seed) for seed in range(size) for kind in HIDDEN]
    if part == "sets":
        kinds = [(k, start) for k in (2, 3) for start in ("N", "N+B+K")]
        return [(one_set, k, start, seed) for seed in range(size) for k, start in kinds]
    return [(one_null, name, seed) for seed in range(size) for name in CASES]


def measure(path: Path, parts: list[str], full: bool, workers: int) -> dict[str, Any]:
    """Return the results of all parts, which are written after each search; a repeated run of a commit continues."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    result: dict[str, Any] = {"commit": commit.stdout.strip(), "full": full}
    if path.exists():
        earlier = json.loads(path.read_text("utf-8"))
        if all(earlier.get(name) == value for name, value in result.items()):
            result = earlier
    with ProcessPoolExecutor(max_workers=workers) as pool:
        futures = {}
        for part in ("effects", "sets", "nulls"):
            if part in parts:
                done = {_name(one) for one in result.setdefault(part, [])}
                jobs = [job for job in _jobs(part, full) if _name_of_job(job) not in done]
                futures.update({pool.submit(*job): part for job in jobs})
        for future in as_completed(futures):
            result[futures[future]].append(future.result())
            _write(path, result)
    if "speed" in parts:
        result["speed"] = speed()
        _write(path, result)
    return result


def _name(one: dict[str, Any]) -> tuple[str, int]:
    """Return name and seed of the record of a result."""
    return one.get("null") or one.get("set") or one["hidden"], one["seed"]


def _name_of_job(job: tuple[Any, ...]) -> tuple[str, int]:
    """Return name and seed of the record that a job searches."""
    _, *names, seed = job
    return names[0] if len(names) == 1 else f"{names[0]} from {names[1]}", seed


def _write(path: Path, result: dict[str, Any]) -> None:
    """Replace the result file atomically."""
    new = path.with_suffix(".new")
    new.write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n", "utf-8")
    new.replace(path)


def shares(result: dict[str, Any]) -> dict[str, tuple[int, int]]:
    """Return name of a row → (successes, records)."""
    rows: dict[str, list[bool]] = {}
    for one in result.get("effects", ()):
        if one["rise"] is None or one["rise"] >= 30.0:
            rows.setdefault(f"effect {one['hidden']}", []).append(one["exact"])
            rows.setdefault("effects, exact", []).append(one["exact"])
            named = one["exact"] or one["alternative"]
            rows.setdefault("effects, exact or declared", []).append(named)
            if one["exact"] or not one["alternative"]:
                rows.setdefault("effects without declared alternative, exact", []).append(
                    one["exact"]
                )
    for one in result.get("sets", ()):
        rows.setdefault(f"set of {one['set']}, exact", []).append(one["exact"])
        rows.setdefault(f"set of {one['set']}, named", []).append(one["named"])
    for one in result.get("nulls", ()):
        rows.setdefault(f"null {one['null']}, nothing added", []).append(not one["added"])
        rows.setdefault("nulls, nothing added", []).append(not one["added"])
        exact = not one["added"]
        rows.setdefault("nulls, nothing added or start shown", []).append(
            exact or one["alternative"]
        )
        rows.setdefault("nulls, not more effects than the start", []).append(not one["more"])
        rows.setdefault("nulls, adequate", []).append(one["adequate"])
    return {name: (sum(row), len(row)) for name, row in rows.items()}


def confusion(result: dict[str, Any]) -> list[str]:
    """Return a line for each search that did not add exactly the hidden effect, with the effects added."""
    lines = []
    for one in result.get("effects", ()):
        if not one["exact"]:
            instead = "+".join(one["added"]) or "nothing"
            declared = ", declared as alternative" if one["alternative"] else ""
            rise = "" if one["rise"] is None else f", ΔlogL {one['rise']}"
            lines.append(f"  {one['hidden']} (seed {one['seed']}{rise}): {instead}{declared}")
    return lines


def table(result: dict[str, Any], old: dict[str, Any] | None) -> str:
    """Format a result as a table. With an older result, each row shows both."""
    lines = []
    before = {} if old is None else shares(old)
    for name, (hits, count) in shares(result).items():
        line = f"{name:50} {hits:4} of {count:4}"
        if name in before:
            was, of = before[name]
            share = (was + 1) / (of + 2)
            error = math.sqrt(share * (1 - share) * (1 / of + 1 / count))
            worse = was / of - hits / count > error
            line += f"   before {was:4} of {of:4}{'   WORSE' if worse else ''}"
        lines.append(line)
    for part in ("effects", "sets", "nulls"):
        times = [one["seconds"] for one in result.get(part, ())]
        if times:
            middle = sorted(times)[len(times) // 2]
            lines.append(
                f"CPU of a search, {part}: median {middle:.1f} s, longest {max(times):.1f} s"
            )
    for name, seconds in result.get("speed", {}).items():
        earlier = "" if old is None else f"   before {old.get('speed', {}).get(name)}"
        lines.append(f"CPU of {name}: {seconds} s{earlier}")
    return "\n".join([*lines, "Not exact:", *confusion(result)])


def main() -> None:
    """Measure, write the result file and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("result", type=Path, help="JSON file that is written")
    parser.add_argument("--full", action="store_true", help="use more records")
    parser.add_argument(
        "--part",
        action="append",
        choices=("effects", "sets", "nulls", "speed"),
        help="run this part only",
    )
    parser.add_argument("--against", type=Path, help="earlier result to compare with")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="number of processes")
    asked = parser.parse_args()
    parts = asked.part or ["effects", "sets", "nulls", "speed"]
    result = measure(asked.result, parts, asked.full, asked.workers)
    old = None if asked.against is None else json.loads(asked.against.read_text("utf-8"))
    print(table(result, old))


if __name__ == "__main__":
    main()
