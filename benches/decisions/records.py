"""Records of the benchmark: one hidden effect of the catalog each, and records with a complete start model.

The samples are made without the package. Hidden effects are so strong that the log-likelihood of the true model exceeds that
of the start by more than 30 in nearly every record; the benchmark counts only those.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import signal

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE, LENGTH = 100.0, 30_000
T = LENGTH / RATE
N, B, K = 0.01, 2e-3, 4e-4
TIME = np.arange(LENGTH) / RATE
COLUMN = g.temperature(LENGTH, RATE, 190.0)


@dataclass(frozen=True)
class Hidden:
    """One effect to hide: the model to start from, the truth as a model string, and a source of samples."""

    start: str
    truth: str
    make: Callable[[np.random.Generator], np.ndarray]
    covariate: bool = False
    #: False if the true model and the start are fitted to different samples, so that their likelihoods are not comparable.
    comparable: bool = True


def white(rng):
    """Return white noise."""
    return g.white(rng, LENGTH, RATE, N)


def base(rng):
    """Return white noise and flicker noise."""
    return white(rng) + g.flicker(rng, LENGTH, RATE, B)


def filtered(rng, b, a):
    """Return white noise after a digital filter, stationary from the first sample."""
    return signal.lfilter(b, a, g.white(rng, LENGTH + 8192, RATE, N))[8192:]


def peaking(frequency, gain, width):
    """Return the coefficients of a peaking equalizer, which is not in the catalog."""
    w = 2 * np.pi * frequency / RATE
    alpha = np.sin(w) * width / 2
    b = [1 + alpha * gain, -2 * np.cos(w), 1 - alpha * gain]
    a = [1 + alpha / gain, -2 * np.cos(w), 1 - alpha / gain]
    return np.array(b) / a[0], np.array(a) / a[0]


def switching(start, end, factor):
    """Return a source of noise whose level is `factor` times as high from start to end."""
    return lambda rng: (
        g.louder(white(rng), RATE, start, end, factor) + g.flicker(rng, LENGTH, RATE, B)
    )


def louder_band(rng):
    """Return noise with a resonance that is three times as strong for 100 s."""
    band = g.resonance(rng, LENGTH, RATE, 12.0, 0.02, 1e-2)
    return base(rng) + g.louder(band, RATE, 100.0, 200.0, 3.0)


def bursts(rng, f=7.0):
    """Return noise with a line during a segment."""
    on = (TIME > 80.0) & (TIME < 190.0)
    return base(rng) + np.where(on, 1.3e-2 * np.sin(2 * np.pi * f * TIME + 1.0), 0.0)


def modulated(rng):
    """Return noise with a vibration of periodic amplitude; its side bands are twelve half-widths from the carrier."""
    swing = 1.0 + 0.9 * np.sin(2 * np.pi * 1.5 * TIME + 0.7)
    return base(rng) + swing * g.resonance(rng, LENGTH, RATE, 12.0, 0.01, 2e-2)


def shaken(rng):
    """Return noise with a disturbance of 6 s: a hand moves the sensor, which is slower than the noise of the sensor."""
    moved = signal.sosfilt(
        signal.butter(2, 4.0, output="sos", fs=RATE), rng.standard_normal(LENGTH)
    )
    during = (TIME > 140.0) & (TIME < 146.0)
    return base(rng) + np.where(during, 0.6 / moved.std() * moved, 0.0)


def of_column(effect):
    """Return a source of noise with an added function of the column."""
    return lambda rng: base(rng) + effect()


def two_lags():
    """Return the difference of the column with two different lags."""
    return 7e-3 * (g.lagged(COLUMN, RATE, 1.0) - 20.0) - 7e-3 * (
        g.lagged(COLUMN, RATE, 25.0) - 20.0
    )


def noise_of_column(rng):
    """Return white noise whose level depends on the column, and flicker noise."""
    return white(rng) * (1.0 + 0.04 * (COLUMN - COLUMN.mean())) + g.flicker(rng, LENGTH, RATE, B)


def cycle(rng):
    """Return noise whose level is periodic."""
    on = (TIME - 3.0) % 20.0 < 6.0
    return np.where(on, 1.5, 1.0) * white(rng) + g.flicker(rng, LENGTH, RATE, B)


NB = f"N(N={N})+B(B={B})"
HIDDEN = {
    "quantization": Hidden("N", f"N(N={N})+Q(Q=8e-4)", lambda r: white(r) + g.quantization(r, LENGTH, RATE, 8e-4)),
    "angle_random_walk": Hidden("B", NB, base),
    "bias_instability": Hidden("N", NB, lambda r: white(r) + g.flicker(r, LENGTH, RATE, 8e-3)),
    "rate_random_walk": Hidden("N", f"N(N={N})+K(K=2e-3)", lambda r: white(r) + g.walk(r, LENGTH, RATE, 2e-3)),
    "rate_ramp": Hidden("N", f"N(N={N})+R(R=2e-4)", lambda r: white(r) + g.ramp(LENGTH, RATE, 2e-4)),
    "gauss_markov": Hidden("N+B", f"{NB}+GM(q_c=5e-2,T=2)", lambda r: base(r) + g.gauss_markov(r, LENGTH, RATE, 5e-2, 2.0)),
    "sinusoid": Hidden("N+B", f"{NB}+SIN(f=3.1,A=8e-3)", lambda r: base(r) + g.sinusoid(LENGTH, RATE, 3.1, 8e-3, r.uniform(0, 6.28))),
    "drifting_line": Hidden("N+B", f"{NB}+CHIRP(f=10,drift=0.01,A=9e-3)", lambda r: base(r) + 9e-3 * np.sin(2 * np.pi * (10.0 * TIME + 0.005 * TIME**2) + 1.0)),
    "tone_burst": Hidden("N+B", f"{NB}+TONE(f=7,start=80,end=190,A=1.3e-2)", bursts),
    "bandwidth": Hidden("N+B", f"{NB}+BW(cutoff=25,order=2,design=digital)", lambda r: filtered(r, *signal.butter(2, 25.0, fs=RATE)) + g.flicker(r, LENGTH, RATE, B)),
    "high_pass": Hidden("N", f"N(N={N})+HP(cutoff=0.5,order=1)", lambda r: filtered(r, *signal.butter(1, 0.5, "high", fs=RATE))),
    "notch": Hidden("N", f"N(N={N})+NOTCH(f=20,quality=4,left=0.01)", lambda r: filtered(r, *signal.iirnotch(20.0, 4.0, fs=RATE))),
    "resonance": Hidden("N+B", f"{NB}+RES(f=5,damping=0.05,rms=1.8e-2)", lambda r: base(r) + g.resonance(r, LENGTH, RATE, 5.0, 0.05, 1.8e-2)),
    "modulated_vibration": Hidden("N+B", f"{NB}+MOD(f=12,damping=0.01,rms=2.4e-2,modulation=1.5,depth=0.9)", modulated, comparable=False),
    "drifting_resonance": Hidden("N+B", NB, lambda r: base(r) + g.moving_band(r, LENGTH, RATE, 8.0 + 6.0 * TIME / T, 0.1, 1.5e-2), comparable=False),
    "wandering_line": Hidden("N+B", f"{NB}+WLINE(f=9,wander=0.3,rms=4.2e-2)", lambda r: base(r) + g.wandering_line(r, LENGTH, RATE, 9.0, 0.3, 4.0, 6e-2)),
    "power_law": Hidden("N", f"N(N={N})+PL(exponent=-0.6,level=6e-3)", lambda r: white(r) + g.power_law(r, LENGTH, RATE, -0.6, 1e-2)),
    "unexplained": Hidden("N", f"N(N={N})", lambda r: filtered(r, *peaking(15.0, 1.35, 1.5)), comparable=False),
    "covariate": Hidden("N+B", f"{NB}+COV(column=temperature,coefficient=5e-3)", of_column(lambda: 5e-3 * (COLUMN - 20.0)), True),
    "two_lags": Hidden("N+B", f"{NB}+LAGS(column=temperature,fast=7e-3,slow=-7e-3,fast_lag=1,slow_lag=25)", of_column(two_lags), True),
    "hysteresis": Hidden("N+B", f"{NB}+HYS(column=temperature,coefficient=6e-3,width=2)", of_column(lambda: 6e-3 * (g.backlash(COLUMN, 2.0) - 20.0)), True),
    "rate_of_change": Hidden("N+B", f"{NB}+DOT(column=temperature,coefficient=8e-2,lag=0.1)", of_column(lambda: 8e-2 * np.gradient(COLUMN, 1.0 / RATE)), True),
    "bias_step": Hidden("N+B", f"{NB}+STEP(time=130,height=3e-2)", lambda r: base(r) + g.step(LENGTH, RATE, 130.0, 3e-2)),
    "excursion": Hidden("N+B", f"{NB}+EXC(start=100,end=140,height=3.5e-2)", lambda r: base(r) + g.step(LENGTH, RATE, 100.0, 3.5e-2) - g.step(LENGTH, RATE, 140.0, 3.5e-2)),
    "excursions": Hidden("N+B", NB, lambda r: base(r) + sum(g.step(LENGTH, RATE, t, 3e-2) - g.step(LENGTH, RATE, t + 6.0, 3e-2) for t in (30.0, 95.0, 170.0, 241.0)), comparable=False),
    "hump": Hidden("N+B", f"{NB}+HUMP(width=4,time=140,height=8e-2)", lambda r: base(r) + 8e-2 * np.exp(-0.5 * ((TIME - 140.0) / 4.0) ** 2)),
    "transient": Hidden("N+B", f"{NB}+PULSE(time=120,time_constant=8,height=9e-2)", lambda r: base(r) + np.where(TIME >= 120.0, 9e-2 * np.exp(-(TIME - 120.0) / 8.0), 0.0)),
    "transition": Hidden("N+B", f"{NB}+RISE(begin=100,end=150,height=4e-2)", lambda r: base(r) + 4e-2 * np.clip((TIME - 100.0) / 50.0, 0.0, 1.0)),
    "warm_up": Hidden("N+B", f"{NB}+WARM(time_constant=40,amplitude=9e-2)", lambda r: base(r) + g.settling(LENGTH, RATE, 40.0, 9e-2)),
    "burst_noise": Hidden("N+B", f"{NB}+RTS(amplitude=4e-2,dwell_time=5)", lambda r: base(r) + g.telegraph(r, LENGTH, RATE, 4e-2, 5.0)),
    "noise_level_change": Hidden("N+B", f"{NB}+LEVEL(start=100,end=160,factor=1.2)", switching(100.0, 160.0, 1.2), comparable=False),
    "noise_levels": Hidden("N+B", NB, lambda r: np.select([TIME < 70, TIME < 140, TIME < 220], [1.0, 1.3, 1.8], 1.15) * white(r) + g.flicker(r, LENGTH, RATE, B), comparable=False),
    "periodic_noise_level": Hidden("N+B", f"{NB}+CYCLE(period=20,start=3,share=0.3,factor=1.5)", cycle, comparable=False),
    "noise_of_column": Hidden("N+B", f"{NB}+NCOL(column=temperature,coefficient=0.04,reference=20)", noise_of_column, True, False),
    "band_level_change": Hidden("N+B+RES", f"{NB}+RES(f=12,damping=0.02,rms=1.9e-2)+BLEVEL(low=11.5,high=12.5,start=100,end=200,factor=3)", louder_band, comparable=False),
    "disturbance": Hidden("N+B", NB, shaken, comparable=False),
    "outliers": Hidden("N+B", NB, lambda r: base(r) + g.spikes(r, LENGTH, 20, 1.0), comparable=False),
}  # fmt: skip


def record(kind: str, seed: int) -> al.Recording:
    """Return the record of an effect and a seed."""
    hidden = HIDDEN[kind]
    rng = np.random.default_rng([seed, 61, *kind.encode()])
    columns = {"temperature": COLUMN} if hidden.covariate else None
    return al.Recording(hidden.make(rng), rate=RATE, unit="deg/s", covariates=columns)


def _null(start, make):
    """Return the start model and a function seed → record."""

    def made(seed):
        rng = np.random.default_rng([seed, 17, *start.encode()])
        return al.Recording(make(rng), rate=RATE, unit="deg/s")

    return start, made


def _tail(rng, freedom):
    """Return samples of Student's t with the standard deviation of the white noise."""
    return N * np.sqrt(RATE * (freedom - 2) / freedom) * rng.standard_t(freedom, LENGTH)


NULLS = {
    "N": _null("N", white),
    "N+B": _null("N+B", base),
    "N+K": _null("N+K", lambda r: white(r) + g.walk(r, LENGTH, RATE, K)),
    "N+B+K": _null("N+B+K", lambda r: base(r) + g.walk(r, LENGTH, RATE, K)),
    "Q+N+B+K": _null("Q+N+B+K", lambda r: base(r) + g.walk(r, LENGTH, RATE, K) + g.quantization(r, LENGTH, RATE, 8e-4)),
    "N+GM": _null("N+GM", lambda r: white(r) + g.gauss_markov(r, LENGTH, RATE, 1e-2, 10.0)),
    "Student t5": _null("N+B", lambda r: _tail(r, 5.0) + g.flicker(r, LENGTH, RATE, B)),
    "rounded": _null("N+B", lambda r: np.round(base(r) / 0.05) * 0.05),
}  # fmt: skip
