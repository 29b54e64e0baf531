"""Measure and draw the power of `check`: python docs/make_power.py [--records 30] (half an hour).

For each kind of effect the strength is chosen (by `al.detection_power`, without simulation) at which its expected rise
of logL is 5 … 30. Records are made by code independent of the package (tests/python/generators.py). The model without
the effect is fitted and checked, and it is counted how often the effect is named as significant. The counts go to
figures/power.csv, from which the figure is drawn. `--draw` only draws; `--kind` measures one kind again and keeps the
other rows.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

import allanite as al

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "python"))
import generators as g  # noqa: E402

TABLE, FIGURE = HERE / "figures" / "power.csv", HERE / "figures" / "power.svg"
RATE, N = 100.0, 30_000
FLAT, FLICKER, WALK = 0.01, 2e-3, 4e-4
WHITE = f"N(N={FLAT})"
TARGETS = (15.0, 5.0, 10.0, 20.0, 30.0)


def noise(rng, *, flicker=True, walk=False):
    """Samples of the effects that both models contain."""
    out = g.white(rng, N, RATE, FLAT)
    if flicker:
        out += g.flicker(rng, N, RATE, FLICKER)
    return out + g.walk(rng, N, RATE, WALK) if walk else out


#: kind: (model without it, effect of strength s, strength to begin with, samples of a record)
N_B = f"{WHITE}+B(B={FLICKER})"
N_K = f"{WHITE}+K(K={WALK})"
N_B_K = f"{N_B}+K(K={WALK})"
KINDS = {
    "gauss_markov": (
        N_B,
        lambda s: f"GM(q_c={s},T=2)",
        6e-3,
        lambda rng, s: noise(rng) + g.gauss_markov(rng, N, RATE, s, 2.0),
    ),
    "sinusoid": (
        N_B,
        lambda s: f"SIN(f=3.1,A={s})",
        5e-3,
        lambda rng, s: noise(rng) + g.sinusoid(N, RATE, 3.1, s, rng.uniform(0.0, 2.0 * np.pi)),
    ),
    "quantization": (
        N_B,
        lambda s: f"Q(Q={s})",
        1.7e-4,
        lambda rng, s: noise(rng) + g.quantization(rng, N, RATE, s),
    ),
    "rate_random_walk": (
        N_B,
        lambda s: f"K(K={s})",
        2e-3,
        lambda rng, s: noise(rng) + g.walk(rng, N, RATE, s),
    ),
    "bias_instability": (
        N_K,
        lambda s: f"B(B={s})",
        5e-3,
        lambda rng, s: noise(rng, flicker=False, walk=True) + g.flicker(rng, N, RATE, s),
    ),
    "resonance": (
        N_B,
        lambda s: f"RES(f=5,damping=0.05,rms={s})",
        1e-2,
        lambda rng, s: noise(rng) + g.resonance(rng, N, RATE, 5.0, 0.05, s),
    ),
    "bandwidth": (
        N_B,
        lambda s: f"BW(cutoff={s},order=1,design=sampled)",
        90.0,
        lambda rng, s: g.flicker(rng, N, RATE, FLICKER) + g.low_passed(rng, N, RATE, FLAT, s),
    ),
    "rate_ramp": (
        N_B_K,
        lambda s: f"R(R={s})",
        2e-4,
        lambda rng, s: noise(rng, walk=True) + g.ramp(N, RATE, s),
    ),
    "bias_step": (
        N_B_K,
        lambda s: f"STEP(time=130,height={s})",
        2e-2,
        lambda rng, s: noise(rng, walk=True) + g.step(N, RATE, 130.0, s),
    ),
    "noise_level_change": (
        N_B,
        lambda s: f"LEVEL(start=100,end=160,factor={s})",
        1.07,
        lambda rng, s: (
            g.louder(g.white(rng, N, RATE, FLAT), RATE, 100.0, 160.0, s)
            + g.flicker(rng, N, RATE, FLICKER)
        ),
    ),
}


def strength(kind, target):
    """The strength whose expected rise of logL is `target`, and what `al.detection_power` says of it."""
    base, effect, start, _ = KINDS[kind]
    neutral = 1.0 if kind == "noise_level_change" else 0.0

    def predict(x):
        size = start / x if kind == "bandwidth" else neutral + (start - neutral) * x
        return size, al.detection_power(base, effect(size), duration=N / RATE, rate=RATE)

    low, high = 0.05, 20.0
    for _ in range(24):
        middle = np.sqrt(low * high)
        if predict(middle)[1].delta_log_likelihood < target:
            low = middle
        else:
            high = middle
    return predict(high)


COLUMNS = [
    "kind",
    "strength",
    "expected",
    "needed",
    "predicted",
    "records",
    "rise",
    "named",
    "anything",
]


def measure(records, kinds):
    """Rows of the table, one a kind and strength; rows of other kinds stay."""
    kept = []
    if TABLE.exists():
        with TABLE.open(encoding="utf-8") as stream:
            kept = [row for row in csv.DictReader(stream) if row["kind"] not in kinds]
    with TABLE.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, COLUMNS)
        writer.writeheader()
        writer.writerows(kept)
        for target in TARGETS:
            for kind in kinds:
                base, _, _, make = KINDS[kind]
                size, told = strength(kind, target)
                rises, named, anything = [], 0, 0
                for seed in range(records):
                    rng = np.random.default_rng([seed, int(target), *kind.encode()])
                    recording = al.Recording(make(rng, size), rate=RATE, unit="rad/s")
                    check = al.fit_model(recording, al.parse_model(base).name).check()
                    mine = [s for s in check.suggestions if s.kind == kind]
                    rises.append(max((s.delta_log_likelihood for s in mine), default=0.0))
                    named += any(s.significant for s in mine)
                    anything += bool(check.significant)
                row = [kind, size, told.delta_log_likelihood, told.needed, told.probability]
                row = [x if isinstance(x, str) else f"{x:.6g}" for x in row]
                row += [records, f"{np.mean(rises):.4g}", named, anything]
                writer.writerow(dict(zip(COLUMNS, row, strict=True)))
                stream.flush()


def draw():
    """Detection rate against expected ΔlogL: points measured, lines predicted."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    with TABLE.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    kinds = [k for k in KINDS if any(r["kind"] == k for r in rows)]
    with mpl.rc_context({"svg.hashsalt": "allanite", "font.size": 9}):
        columns = 5
        figure, panels = plt.subplots(
            2, columns, figsize=(12.0, 5.0), sharex=True, sharey=True, layout="constrained"
        )
        for kind, panel in zip(kinds, panels.flat, strict=False):
            mine = sorted(
                (r for r in rows if r["kind"] == kind), key=lambda r: float(r["expected"])
            )
            x = np.array([float(r["expected"]) for r in mine])
            count = np.array([float(r["records"]) for r in mine])
            hits = np.array([float(r["named"]) for r in mine])
            # 68 % interval of a proportion (Wilson): the spread of the count itself.
            centre = (hits + 0.5) / (count + 1.0)
            half = np.sqrt(hits * (count - hits) / count + 0.25) / (count + 1.0)
            panel.plot(
                x, [float(r["predicted"]) for r in mine], color="0.35", label="al.detection_power"
            )
            panel.errorbar(
                x,
                hits / count,
                np.abs([centre - half - hits / count, centre + half - hits / count]),
                fmt="o",
                ms=4,
                label="measured",
            )
            panel.axhline(0.01, ls="--", lw=0.8, color="tab:red", label="chance (1 %)")
            panel.axhline(0.8, ls=":", lw=0.8, color="0.6")
            panel.axvline(15.0, ls=":", lw=0.8, color="0.6")
            panel.set_title(kind)
        panels[0, 0].legend(loc="lower right", frameon=False, fontsize=8)
        figure.supxlabel("expected ΔlogL of the effect")
        figure.supylabel("named as significant")
        figure.savefig(FIGURE, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=30)
    parser.add_argument("--draw", action="store_true")
    parser.add_argument("--kind", choices=KINDS, action="append")
    options = parser.parse_args()
    if not options.draw:
        measure(options.records, options.kind or list(KINDS))
    draw()


if __name__ == "__main__":
    main()
