"""Coverage of intervals and bands, and time, on simulated six-axis sensors.

    python benches/python/bench_six_axes.py [SENSORS] [SAMPLES]
    python benches/python/bench_six_axes.py LOG                 # time and memory for a log

By default fifty sensors of 20 000 samples: 300 axes, about ten minutes of two cores. Each quantity is printed with its
nominal value.
"""

import resource
import sys
import time
from pathlib import Path

import numpy as np

import allanite as al

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

from six_axes import six_axes

RATE = 100.0


def models(rng: np.random.Generator) -> tuple[str, ...]:
    """Draw a model for each axis of a sensor: white noise and one of K, GM and B."""
    out = []
    for axis in range(6):
        level = 10.0 ** rng.uniform(-2.3, -1.7) * (1.0 if axis < 3 else 0.1)
        slow = (
            f"K(K={level * 10.0 ** rng.uniform(-1.0, -0.3):.4g})",
            f"GM(q_c={level * 10.0 ** rng.uniform(-0.3, 0.2):.4g},T={10.0 ** rng.uniform(0.0, 1.0):.4g})",
            f"B(B={level * 10.0 ** rng.uniform(-0.3, 0.0):.4g})",
        )[int(rng.integers(3))]
        out.append(f"N(N={level:.4g})+{slow}")
    return tuple(out)


def main(sensors: int, samples: int) -> None:
    """Characterize the sensors and print the coverage."""
    began = time.process_time()
    inside: dict[str, list[bool]] = {}
    form, covered = [], []
    for seed in range(sensors):
        own = models(np.random.default_rng([seed, 15]))
        found = al.characterize(six_axes(samples, seed, RATE, own))
        made = found.simulate(seed=seed)
        for text, (name, study) in zip(own, found.studies.items(), strict=True):
            truth = al.parse_model(text)
            form.append({e.kind for e in truth} <= {e.kind for e in study.fit.model})
            for effect in truth:
                place = next(
                    (i for i, e in enumerate(study.fit.model) if e.kind == effect.kind), None
                )
                for parameter in effect.parameters:
                    value = effect.values[parameter.name]
                    if place is None or value is None or parameter.role == "derived":
                        continue
                    low, high = study.fit.estimates[place][parameter.name].interval
                    label = f"{effect.short}.{parameter.name}"
                    inside.setdefault(label, []).append(bool(low <= value <= high))
            curve, band = study.fit.curve, study.fit.band
            measured = al.oadev(made[name], factors=curve.factors).deviation
            within = (band.low_everywhere <= measured) & (measured <= band.high_everywhere)
            covered.append(bool(within.all()))
    every = [hit for hits in inside.values() for hit in hits]
    print(f"{sensors} sensors of {samples} samples, {time.process_time() - began:.0f} s of CPU")
    print(
        f"values inside their 95 % intervals (93 to 97 %): {100 * np.mean(every):.1f} % of {len(every)}"
    )
    for label, hits in sorted(inside.items()):
        print(f"  {label}: {100 * np.mean(hits):.1f} % of {len(hits)}")
    print(f"final models with all true effects: {100 * np.mean(form):.1f} %")
    print(
        f"curves of simulated sensors inside the simultaneous band (95 %): {100 * np.mean(covered):.1f} %"
    )


def of_log(path: str) -> None:
    """Print processor time, wall-clock time, peak memory and final models of all axes of a log."""
    recording = al.read(path)
    began, clock = time.process_time(), time.perf_counter()
    found = al.characterize(recording)
    spent, passed = time.process_time() - began, time.perf_counter() - clock
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{len(found.studies)} axes: {spent:.0f} s of CPU, {passed:.0f} s, {most:.2f} GiB")
    for name, study in found.studies.items():
        print(f"  {name}: {study.fit.model.name}, {study.stopped_because}")


if __name__ == "__main__":
    if len(sys.argv) == 2 and not sys.argv[1].isdigit():
        of_log(sys.argv[1])
    else:
        main(*(int(text) for text in [*sys.argv[1:], *("50", "20000")[len(sys.argv) - 1 :]]))
