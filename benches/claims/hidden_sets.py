"""Claim: one to three hidden effects are found together, exactly or as declared alternative explanations.

The effects are drawn from B, K, GM, SIN, STEP, COV, Q, BW, RES and R. Each has the size at which `power` predicts a ΔlogL
of 30 besides all others. The samples come from tests/python/generators.py, which does not use the package. If the final
model is another one, the difference in evidence between the truth and that model is printed.

    python benches/claims/hidden_sets.py [--seeds 50] [--hidden 1 2 3] [--start N N+B+K]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g
from allanite.fit.rivals.alternatives import rivals
from allanite.fit.rivals.evidence import evidence

RATE, DURATION = 50.0, 3600.0
N, B, K = 0.0126, 0.002, 9.07e-5
WORTH = 30.0
#: Maximum number of rounds in which the sizes are adapted to each other; two drifts converge in three or four.
SWEEPS = 6
#: Effects whose size grows by more than this besides the others are not distinguishable on this record.
FAR = 10.0
#: Maximum size of an effect, 80 times that of the noise.
LARGEST = 1.0
KINDS = ("B", "K", "GM", "SIN", "STEP", "COV", "Q", "BW", "RES", "R")
NAMES = {
    "B": "bias_instability",
    "K": "rate_random_walk",
    "GM": "gauss_markov",
    "SIN": "sinusoid",
    "STEP": "bias_step",
    "COV": "covariate",
    "Q": "quantization",
    "BW": "bandwidth",
    "RES": "resonance",
    "R": "rate_ramp",
}
KINDS_OF = {effect.kind: effect for effect in al.CATALOG}


def course(time_s):
    """Return a temperature that oscillates slowly and warms up."""
    return 2.0 * np.sin(2 * np.pi * time_s / 2500.0) + 3.0 * np.exp(-time_s / 1500.0)


def effect_of(kind, size, u):
    """Return the effect of a given size as a model string."""
    return {
        "B": f"B(B={size})",
        "K": f"K(K={size})",
        "GM": f"GM(q_c={size},correlation_time={u['time']})",
        "SIN": f"SIN(frequency={u['frequency']},amplitude={size},phase={u['phase']})",
        "STEP": f"STEP(time={u['when']},height={size})",
        "COV": f"COV(column=temperature,coefficient={size},lag=0)",
        "Q": f"Q(Q={size})",
        "BW": f"BW(cutoff={1.0 / size},order=2,design=digital)",
        "RES": f"RES(frequency={u['ring']},damping={u['damping']},rms={size})",
        "R": f"R(R={size})",
    }[kind]


def samples_of(kind, size, rng, u, rate):
    """Return the samples of an effect other than the filter, which acts on the white noise."""
    length = round(DURATION * rate)
    t = np.arange(length) / rate
    return {
        "B": lambda: g.flicker(rng, length, rate, size),
        "K": lambda: g.walk(rng, length, rate, size),
        "GM": lambda: g.gauss_markov(rng, length, rate, size, u["time"]),
        "SIN": lambda: g.sinusoid(length, rate, u["frequency"], size, u["phase"]),
        "STEP": lambda: g.step(length, rate, u["when"], size),
        "COV": lambda: size * (course(t) - course(t).mean()),
        "Q": lambda: g.quantization(rng, length, rate, size),
        "RES": lambda: g.resonance(rng, length, rate, u["ring"], u["damping"], size),
        "R": lambda: g.ramp(length, rate, size),
    }[kind]()


def numbers(rng, rate):
    """Draw the other parameters of all kinds (times, frequencies, damping) for one record."""
    return {
        "time": float(np.exp(rng.uniform(np.log(2.0), np.log(100.0)))),
        "frequency": float(rng.uniform(0.01, 0.4) * rate),
        "phase": float(rng.uniform(0.0, 2.0 * np.pi)),
        "when": float(rng.uniform(0.2, 0.8) * DURATION),
        "ring": float(rng.uniform(0.06, 0.3) * rate),
        "damping": float(np.exp(rng.uniform(np.log(0.02), np.log(0.1)))),
    }


def strength(base, kind, u, rate):
    """Return the size at which an effect has ΔlogL = `WORTH` besides a model."""
    low, high = (2.0 / rate, 100.0 / rate) if kind == "BW" else (1e-8, LARGEST)
    for _ in range(40):
        middle = float(np.sqrt(low * high))
        found = al.detection_power(
            base,
            effect_of(kind, middle, u),
            duration=DURATION,
            rate=rate,
            covariates={"temperature": course},
        )
        if found.delta_log_likelihood < WORTH:
            low = middle
        else:
            high = middle
        if high < 1.02 * low:
            break
    return high


def strengths(base, kinds, u, rate):
    """Return the size of each effect with ΔlogL = `WORTH` besides the others; None if two are not distinguishable."""
    sizes, first = {}, {}
    for sweep in range(SWEEPS):
        before = dict(sizes)
        for kind in kinds:
            others = [effect_of(k, size, u) for k, size in sizes.items() if k != kind]
            sizes[kind] = strength("+".join([base, *others]), kind, u, rate)
            grown = sizes[kind] > FAR * first.setdefault(kind, sizes[kind])
            if grown or sizes[kind] == LARGEST:
                return None
        if len(kinds) == 1 or (
            sweep and all(abs(np.log(sizes[k] / before[k])) < 0.05 for k in kinds)
        ):
            return sizes
    return None


def record(seed, hidden, start, rate=RATE):
    """Return the hidden kinds, the recording, and the true model as a string."""
    length = round(DURATION * rate)
    rng = np.random.default_rng([seed, hidden, len(start)])
    pool = [k for k in KINDS if k not in start.split("+")]
    base = f"N(N={N})" + (f"+B(B={B})+K(K={K})" if start != "N" else "")
    sizes = None
    while sizes is None:
        kinds = list(rng.choice(pool, hidden, replace=False))
        u = numbers(rng, rate)
        sizes = strengths(base, kinds, u, rate)
    if "BW" in kinds:
        from scipy import signal

        b, a = signal.butter(2, 2.0 / sizes["BW"] / rate)
        white = signal.lfilter(b, a, g.white(rng, length + 4096, rate, N))[4096:]
    else:
        white = g.white(rng, length, rate, N)
    x = white
    if start != "N":
        x = x + g.flicker(rng, length, rate, B) + g.walk(rng, length, rate, K)
    for kind in kinds:
        if kind != "BW":
            x = x + samples_of(kind, sizes[kind], rng, u, rate)
    t = np.arange(length) / rate
    thermometer = course(t) + 0.01 * rng.standard_normal(length)
    recording = al.Recording(x, rate=rate, unit="rad/s", covariates={"temperature": thermometer})
    truth = "+".join([base, *(effect_of(k, size, u) for k, size in sizes.items())])
    return [NAMES[k] for k in kinds], recording, truth


def one(seed, hidden, start):
    """Return the hidden kinds, the study of the record, and by how much the truth has more evidence than its model."""
    kinds, recording, truth = record(seed, hidden, start)
    study = al.improve(recording, start)
    return kinds, study, ahead(study, truth)


def ahead(study, truth):
    """Return the evidence of the true model, fitted from its true values, minus that of the final model."""
    fits = study.fit, al.fit_model(study.recording, truth)
    of_found, of_truth = (evidence(f.solution) for f in fits)
    return of_truth - of_found


def matches(hidden, study, start):
    """Return whether the model has exactly the hidden effects, or declared alternatives of them.

    Alternatives are those of the class of an effect and those of the fit; one effect may replace a pair that the fit
    declares. An effect of the start may be removed or replaced by a declared alternative.
    """
    fit = study.fit
    asked = ["angle_random_walk", *(NAMES[k] for k in start.split("+")[1:])]
    missing, spare, others = list(hidden), list(asked), []
    for place, effect in enumerate(fit.model):
        for wanted in (missing, spare):
            if effect.kind in wanted:
                wanted.remove(effect.kind)
                break
        else:
            others.append(place)
    for place in others:
        effect, declared = fit.model.effects[place], rivals(fit, place)
        pair = next((p for p in declared.pairs if set(p) <= set(missing)), None)
        alike = [k for k in (*missing, *spare) if k in declared.alone or effect.may_be(KINDS_OF[k])]
        if pair is not None:
            missing = [k for k in missing if k not in pair]
        elif alike:
            (missing if alike[0] in missing else spare).remove(alike[0])
        else:
            return False
    return not missing


def named(hidden, study, start):
    """Return whether all hidden effects are in the model or among the declared alternatives, and no other effect is."""
    fit = study.fit
    every = {e.kind for e in fit.model}
    for place in range(len(fit.model)):
        every.update(rivals(fit, place).to_dict()["rivals"])
    known = {"angle_random_walk", *(NAMES[k] for k in start.split("+")[1:]), *hidden}
    spare = [e for e in fit.model if e.kind not in known and not _stands_for(e, hidden)]
    return set(hidden) <= every and not spare


def _stands_for(effect, hidden):
    """Return whether an effect is a declared alternative of a hidden kind."""
    return any(effect.may_be(KINDS_OF[k]) for k in hidden)


def main():
    """Print how many records are exact, and the final models of the others."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=50, help="records of each case")
    parser.add_argument(
        "--hidden", type=int, nargs="+", default=[1, 2, 3], help="numbers of hidden effects"
    )
    parser.add_argument("--start", nargs="+", default=["N", "N+B+K"], help="models to start from")
    asked = parser.parse_args()
    for hidden in asked.hidden:
        for start in asked.start:
            began = time.process_time()
            found = Counter()
            for seed in range(asked.seeds):
                kinds, study, evidence = one(seed, hidden, start)
                exact = matches(kinds, study, start)
                found["exact" if exact else "missed" if evidence > 0.0 else "untold"] += 1
                found["named"] += exact or named(kinds, study, start)
                if not exact:
                    what = f"{'+'.join(kinds)} → {study.fit.model}"
                    print(f"   seed {seed}: {what}, evidence {evidence:+.1f}", flush=True)
            spent = (time.process_time() - began) / asked.seeds
            print(
                f"{hidden} hidden, from {start}: {found['exact']} of {asked.seeds} exact, {found['named']} named with "
                f"alternatives, {found['untold']} with more evidence for the model found, {spent:.1f} s each",
                flush=True,
            )


if __name__ == "__main__":
    main()
