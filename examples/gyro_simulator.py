"""A gyroscope simulator: the five terms of IEEE 952 one by one and together, then two data sheets.

A student project of 2019 ("Simulador de giróscopo y Allan variance") simulates each term from its coefficient (its
Table 2). It shows the density and the Allan curve of each term and of the sum. Then it uses the data sheets of a MEMS
gyroscope and of a ring laser gyroscope. Two of its questions are answered here:

* A data sheet's noise density of 0.03 deg/s/√Hz was used as an angle random walk of 0.03 deg/√h. The project calls
  this "completely wrong": three recordings gave 1.4, 1.17 and 1.33 deg/√h. A conversion of units gives 1.27.
* A linear grid of averaging times gives other coefficients than a logarithmic one. On the MEMS gyroscope its N is 10
  to 25 times too large.

Run it with a folder to get the figures: python examples/gyro_simulator.py figures
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import allanite as al
from allanite.common.units import conversion
from allanite.plots.axes import log_axis
from allanite.plots.spec import Figure, Line, Mark, Panel, Points

RATE, HOURS, SEED = 10.0, 12.0, 4
#: Table 2 of the project, in its units; allanite's unit of each coefficient for samples in deg/s.
TABLE_2 = {
    "Q": (al.Quantization, 2e-4, "deg", "deg/s·s"),
    "N": (al.AngleRandomWalk, 8e-3, "deg/sqrt(h)", "deg/s·s^½"),
    "B": (al.BiasInstability, 0.1, "deg/h", "deg/s"),
    "K": (al.RateRandomWalk, 1.0, "deg/h/sqrt(h)", "deg/s/s^½"),
    "R": (al.RateRamp, 5.0, "deg/h^2", "deg/s/s"),
}
#: Level of the flat part of flicker over its B.
FLICKER = float(np.sqrt(2.0 * np.log(2.0) / np.pi))
#: Where the slope of each term is read on its own Allan curve, and what is read there for a coefficient of 1.
READ_AT = {"Q": (3**0.5, 1.0), "N": (1.0, 1.0), "B": (100.0, FLICKER), "K": (3.0, 1.0), "R": (2**0.5, 1.0)}  # fmt: skip


@dataclass
class Term:
    """One term: its effect, a simulated record, and the coefficients read and fitted, in the unit of Table 2."""

    effect: al.Effect
    recording: al.Recording
    unit: str
    truth: float
    read: float
    fitted: al.Estimate


def si(name: str, value: float) -> float:
    """A value of Table 2 in deg, deg/s and s."""
    _, _, unit, own = TABLE_2[name]
    return value * conversion(unit, own)


def term(name: str, hours: float, seed: int) -> Term:
    """Simulate one term alone; read its line; fit it."""
    make, value, unit, own = TABLE_2[name]
    effect = make().with_values(**{name: si(name, value)})
    recording = effect.simulate(duration=3600 * hours, rate=RATE, seed=seed, unit="deg/s")
    at, height = READ_AT[name]
    factor = round(at * RATE)
    curve = al.oadev(recording.samples, rate=RATE, factors=[factor])
    slope = {"Q": -1.0, "N": -0.5, "B": 0.0, "K": 0.5, "R": 1.0}[name]
    # τ is a whole number of samples; the line carries the value on to the τ at which it is read.
    line = float(curve.deviation[0]) * (at / float(curve.tau[0])) ** slope / height
    fitted = fit_alone(make(), recording)[name].to(unit)
    return Term(effect, recording, unit, value, line * conversion(own, unit), fitted)


def fit_alone(effect: al.Effect, recording: al.Recording) -> al.Fit:
    """Fit of one term to its record. A ramp needs noise for a fit, so white noise is added."""
    if effect.kind != "rate_ramp":
        return effect.fit(recording)
    noise = al.AngleRandomWalk(N=si("N", 8e-3)).simulate(
        duration=recording.duration, rate=RATE, seed=SEED, unit="deg/s"
    )
    both = al.Recording(recording.samples + noise.samples, rate=RATE, unit="deg/s")
    return (al.AngleRandomWalk() + effect).fit(both)


def grids(recording: al.Recording, slope: float, at: float) -> tuple[float, float]:
    """Nearest-slope readings of one line on a logarithmic and on a linear grid of 100 and 2000 averaging times."""
    top = recording.n // 2 - 1
    found = []
    for factors in (np.geomspace(1, top, 100), np.linspace(1, top, 2000)):
        m = np.unique(factors.astype(int))
        curve = al.oadev(recording.samples, rate=RATE, factors=m)
        x, y = np.log10(curve.tau), np.log10(curve.deviation)
        k = int(np.argmin(np.abs(np.diff(y) / np.diff(x) - slope)))
        found.append(float(10 ** (y[k] + slope * (np.log10(at) - x[k]))))
    return found[0], found[1]


def figure(terms: dict[str, Term], whole: al.Recording, model: al.Model) -> Figure:
    """Density and Allan deviation of each term and of the sum, simulated (points) and expected (lines)."""
    psd: list[Mark] = []
    allan: list[Mark] = []
    everything: dict[str, tuple[al.Effect | al.Model, al.Recording]] = {
        name: (t.effect, t.recording) for name, t in terms.items()
    }
    for i, (name, (effect, record)) in enumerate({**everything, "sum": (model, whole)}.items()):
        color = "measured" if name == "sum" else f"c{i + 1}"
        width = 2.0 if name == "sum" else 1.2
        spectrum, curve = record.psd(), record.oadev(taus=4)
        tau, f = curve.tau, spectrum.frequency
        psd.append(Points(f, spectrum.density, color, size=2.0))
        if name != "R":  # a ramp has a spectrum only by the length of its record
            psd.append(Line(f, effect.psd(f, RATE), color, width=width))
        expected = np.sqrt(effect.allan_variance(tau, RATE))
        allan += [
            Line(tau, expected, color, name, width),
            Points(tau, curve.deviation, color, size=3.0),
        ]
    sum_psd, sum_curve = whole.psd().density, whole.oadev(taus=4).deviation
    left = log_axis("two-sided density [(°/s)²/Hz]", sum_psd, sum_psd.min() / 30)
    right = log_axis("Allan deviation (°/s)", sum_curve, sum_curve.min() / 10)
    x = log_axis("frequency f (Hz)", whole.psd().frequency)
    times = log_axis("averaging time τ (s)", whole.oadev(taus=4).tau)
    panels = (
        Panel(x, left, tuple(psd), title="Power spectral density"),
        Panel(times, right, tuple(allan), column=1, title="Allan deviation"),
    )
    subtitle = f"Table 2, {whole.duration / 3600:g} h at {RATE:g} Hz: simulated (points) and expected (lines)"
    return Figure("The five terms and their sum", subtitle, panels, widths=(1.0, 1.0))


def data_sheets() -> dict[str, float]:
    """Coefficients and crossing times of the two data sheets."""
    density = 0.03 * conversion("deg/s/√Hz one-sided", "deg/sqrt(h)")
    mems_b, mems_n = 18 * conversion("deg/h", "deg/s"), density * conversion("deg/sqrt(h)", "deg/s·s^½")  # fmt: skip
    rlg_n = 0.015 * conversion("deg/sqrt(h)", "deg/s·s^½")
    rlg_q = 1.62 * conversion("rad", "deg")
    return {
        "MEMS N (deg/√h)": density,
        "MEMS white meets flicker at τ (s)": (mems_n / (FLICKER * mems_b)) ** 2,
        "MEMS with the slip, at τ (s)": (
            0.03 * conversion("deg/sqrt(h)", "deg/s·s^½") / (FLICKER * mems_b)
        )
        ** 2,
        "RLG quantization meets white at τ (years)": 3 * (rlg_q / rlg_n) ** 2 / 3.156e7,
        "RLG the same if 1.62 were µrad, at τ (s)": 3 * (1e-6 * rlg_q / rlg_n) ** 2,
    }


def main(hours: float = HOURS, folder: str | None = None) -> dict[str, object]:
    """Run the example; returns what was found."""
    terms = {name: term(name, hours, SEED + i) for i, name in enumerate(TABLE_2)}
    print("each term alone      Table 2      read      fitted")
    for name, t in terms.items():
        print(f"  {name}  {t.unit:14} {t.truth:10.4g} {t.read:9.4g}  {t.fitted!r}")

    model = al.Model(tuple(t.effect for t in terms.values()))
    whole = model.simulate(duration=3600 * hours, rate=RATE, seed=SEED, unit="deg/s")
    fit = al.fit_model(whole, "Q+N+B+K+R")
    print("\ntogether, by one fit of all five:")
    for name, (_, value, unit, _) in TABLE_2.items():
        print(f"  {name}  {value:10.4g}  {fit[name].to(unit)!r}")

    sheets = data_sheets()
    print()
    for what, number in sheets.items():
        print(f"  {what}: {number:.4g}")

    own = sheets["MEMS N (deg/√h)"] * conversion("deg/sqrt(h)", "deg/s·s^½")
    mems = al.AngleRandomWalk(N=own) + al.BiasInstability(B=18 * conversion("deg/h", "deg/s"))
    record = mems.simulate(duration=3600 * hours, rate=RATE, seed=SEED, unit="deg/s")
    by_log, by_linear = (value / own for value in grids(record, -0.5, 1.0))
    print(
        f"\nMEMS, N by the nearest slope over its true value: {by_log:.2f} on a logarithmic grid,\n"
        f"{by_linear:.2f} on a linear one, which has nearly all its points at the long end, where the\n"
        "slope between two neighbours is chance."
    )
    if folder is not None:
        Path(folder).mkdir(parents=True, exist_ok=True)
        figure(terms, whole, model).save(Path(folder) / "gyro_simulator.svg")
    return {
        "terms": terms,
        "whole": whole,
        "fit": fit,
        "sheets": sheets,
        "grids": (by_log, by_linear),
    }


if __name__ == "__main__":
    main(folder=sys.argv[1] if len(sys.argv) > 1 else None)
