"""Searches of one record in other scales, signs, units, precisions, column orders, and from other starts end alike.

python benches/claims/invariance.py RESULT.jsonl [--seeds 5] [--kinds KIND …] [--variants VARIANT …] [--workers 1]

Twelve kinds of records with five seeds each. Two results are alike if the record supports the same effects of their last
models, and if their scores are within 0.5 nats. An effect is not supported if the model without it has more evidence,
or if a check of the model without it finds nothing missing. The score is the log evidence of the supported effects over
white noise with the same samples excluded and the same changes of the noise level. RESULT.jsonl keeps finished records,
so that an interrupted run continues.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "decisions"))

from records import HIDDEN, NULLS, record
from results_file import Results

import allanite as al
from allanite.fit import refitted
from allanite.fit.likelihood.changing_power import changing_effects
from allanite.fit.rivals.alternatives import is_removable
from allanite.fit.rivals.evidence import evidence_gain

#: Names of records without and with a hidden effect.
COMPLETE = ("N+B", "N+B+K")
KINDS = (
    *COMPLETE,
    "quantization",
    "gauss_markov",
    "sinusoid",
    "bandwidth",
    "resonance",
    "covariate",
    "bias_step",
    "warm_up",
    "noise_level_change",
    "outliers",
)
STARTS = ("N+B+K", "N+GM", "N+Q+B+K+R")
#: First seed: other records than those of the benchmark.
FIRST_SEED = 9000
#: Largest difference of two scores, nats (DECISIONS: acceptance of the search).
MAX_SCORE_DIFFERENCE = 0.5
#: Values of a second, unrelated column with its own scale.
COMPANION = 3.0


def the_record(kind: str, seed: int) -> al.Recording:
    """Return the record of a kind and a seed; records with a temperature also log an unrelated voltage."""
    if kind in COMPLETE:
        return NULLS[kind][1](FIRST_SEED + seed)
    log = record(kind, FIRST_SEED + seed)
    if not HIDDEN[kind].covariate:
        return log
    return _again(log, log.samples, covariates={**log.covariates, "voltage": _voltage(log.n, seed)})


def _voltage(n: int, seed: int):
    """Return a slow, unrelated column."""
    rng = np.random.default_rng([seed, 71])
    return 5.0 + 0.01 * np.cumsum(rng.standard_normal(n)) / np.sqrt(n)


def _again(log, samples, unit=None, covariates=None):
    """Return a recording with other samples, unit or logged columns."""
    other = log.covariates if covariates is None else covariates
    return al.Recording(
        samples, rate=log.rate, unit=unit or log.unit, covariates=dict(other) or None
    )


def _beside(log, first):
    """Return the study of the record in a log with a second column, which is the `first` or the last one."""
    second = COMPANION * np.random.default_rng(5).standard_normal(log.n)
    names = ["other", "record"] if first else ["record", "other"]
    columns = [second, log.samples] if first else [log.samples, second]
    covariates = dict(reversed(list(log.covariates.items()))) or None
    both = al.Recording(
        np.column_stack(columns), rate=log.rate, unit=log.unit, columns=names, covariates=covariates
    )
    return al.improve_columns(both, "N")["record"]


VARIANTS = {
    "reference": lambda log: al.improve(log, "N"),
    "scale 1e-6": lambda log: al.improve(_again(log, 1e-6 * log.samples), "N"),
    "scale 1e6": lambda log: al.improve(_again(log, 1e6 * log.samples), "N"),
    "sign": lambda log: al.improve(_again(log, -log.samples), "N"),
    "offset": lambda log: al.improve(_again(log, log.samples + 1e3 * log.samples.std()), "N"),
    "unit": lambda log: al.improve(_again(log, np.deg2rad(log.samples), "rad/s"), "N"),
    "float32": lambda log: al.improve(_again(log, log.samples.astype(np.float32)), "N"),
    "second column": lambda log: _beside(log, True),
    "first column": lambda log: _beside(log, False),
    **{f"start {start}": partial(al.improve, model=start) for start in STARTS},
}  # fmt: skip


def ending(study: al.Study) -> dict[str, object]:
    """Return the effects of the last model that the record supports, their score in nats, and the verdict.

    Effects of the start stay in the last model even if the record does not show them, so they are removed here.
    """
    fit = reduced(study.fit)
    white = al.parse_model("N").effects[0]
    common = (e for e in fit.model if e.removes or e in changing_effects(fit.model))
    least = refitted(fit, al.Model((white, *common)))
    return {
        "model": study.fit.model.name,
        "kept": sorted(e.kind for e in fit.model),
        "score": float(evidence_gain(fit.solution, least.solution, fit.data)),
        "verdict": study.verdict,
    }


def reduced(fit: al.Fit) -> al.Fit:
    """Return the fit without effects that the record does not support, see the docstring of this module."""
    while True:
        lesser = [
            refitted(fit, al.Model(tuple(e for p, e in enumerate(fit.model) if p != place)))
            for place, effect in enumerate(fit.model)
            if is_removable(effect) and effect not in changing_effects(fit.model)
        ]
        lesser.sort(key=lambda less: -evidence_gain(less.solution, fit.solution, fit.data))
        found = next((less for less in lesser if is_enough(less, fit)), None)
        if found is None:
            return fit
        fit = found


def is_enough(less: al.Fit, fit: al.Fit) -> bool:
    """Return true if the fit `less`, with fewer effects, has more evidence, or if its check finds nothing missing."""
    gain = evidence_gain(less.solution, fit.solution, fit.data)
    return gain > 0.0 or not less.check().significant


def one(kind: str, seed: int, names: tuple[str, ...]) -> dict[str, dict[str, object]]:
    """Return the ends of the searches of one record, by variant."""
    log, ends = the_record(kind, seed), {}
    for name in names:
        began = process_time()
        try:
            end = ending(VARIANTS[name](log))
        except Exception as error:
            end = {"model": f"{type(error).__name__}: {error}", "kept": [], "score": -np.inf}
        ends[name] = {**end, "seconds": round(process_time() - began, 1)}
    return ends


def differences(ends: dict[str, dict[str, object]]) -> dict[str, str]:
    """Return what differs from the reference, by variant."""
    reference, found = ends["reference"], {}
    for name, end in ends.items():
        if end["kept"] != reference["kept"]:
            found[name] = (
                f"{reference['model']} → {end['model']}, {end['score'] - reference['score']:+.2f} nats"
            )
        elif abs(end["score"] - reference["score"]) > MAX_SCORE_DIFFERENCE:
            found[name] = f"score {end['score'] - reference['score']:+.2f} nats"
    return found


def main() -> None:
    """Print what differs in each record, and the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("result", type=Path, help="file of finished records")
    parser.add_argument("--seeds", type=int, default=5, help="number of records of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, help="kinds of records")
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, default=tuple(VARIANTS))
    parser.add_argument("--workers", type=int, default=1, help="processes")
    options = parser.parse_args()
    names = tuple(dict.fromkeys(("reference", *options.variants)))
    results = Results(options.result, " ".join(names))
    cases = [(kind, seed) for seed in range(options.seeds) for kind in options.kinds]
    alike, counts = 0, Counter()
    with ProcessPoolExecutor(options.workers) as pool:
        missing = {
            c: pool.submit(one, *c, names) for c in cases if f"{c[0]} {c[1]}" not in results.rows
        }
        for kind, seed in cases:
            run = missing.get((kind, seed))
            found = differences(results.of(f"{kind} {seed}", run.result if run else dict))
            alike += not found
            counts.update(list(found))
            for name, text in found.items():
                print(f"{kind} {seed}, {name}: {text}", flush=True)
    print(f"{alike} of {len(cases)} records end alike in all of {len(names)} variants")
    for name in names[1:]:
        print(f"  {name}: {len(cases) - counts[name]} of {len(cases)}")


if __name__ == "__main__":
    main()
