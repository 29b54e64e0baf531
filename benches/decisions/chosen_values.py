"""Results with other values of constants that have no derivation.

    python benches/decisions/chosen_values.py [background] [bands] [courses] [drift] [edges] [forms] [gates] [posterior]
        [rounds]

background: blocks of neighboring frequencies of a periodic level; false periods of levels that nearly repeat, and true
    ones.
bands: limits between lines, wandering lines, resonances and moving bands; names of hidden bands.
courses: forms of a moving band; names of hidden bands that drift.
drift: spreads of the prior of a clock's drift; difference of the half-width of a holdover band at 3 h.
edges: trial times of an edge; error of the time of a step in flicker or a random walk, and coverage of its interval.
forms: forms of weak events that need no refit (MAX_NOISE_REFIT_FRACTION), and the significant ones among them.
gates: fine steps of a periodic noise level; coverage of N.
posterior: draws behind a holdover band; difference of its half-width at 3 h from that of ten times as many draws.
rounds: tolerances of the completion of missing samples between fits; difference of the coefficients, and CPU time.
"""

from __future__ import annotations

import importlib
import sys
import time
from pathlib import Path

import numpy as np
from scipy import signal

import allanite as al
from allanite.suggestion import constants

sys.path += [str(Path(__file__).parent), str(Path(__file__).parents[1] / "claims")]
import holdover
import records

BANDS = importlib.import_module("allanite.suggestion.screens.drifting_bands")
ESTIMATES = importlib.import_module("allanite.fit.estimates")
COMPLETION = importlib.import_module("allanite.fit.missing.completion")
LEVELS = importlib.import_module("allanite.suggestion.screens.level_forms")
WANDERING = importlib.import_module("allanite.effects.wandering_line")
HOLDOVER = importlib.import_module("allanite.clocks.holdover")
POSTERIOR = importlib.import_module("allanite.fit.stamped.posterior")


def courses():
    """Print how many of six drifting bands are named exactly."""
    kind = "drifting_resonance"
    start = records.HIDDEN[kind].start
    for name, value in (
        ("WIDTH_RATIOS", BANDS.WIDTH_RATIOS),
        ("WIDTH_RATIOS", (1.0,)),
        ("WIDTH_RATIOS", (1.0, 0.25)),
        ("STRAIGHT_PARTS", ()),
        ("STRAIGHT_PARTS", (1, 2)),
    ):
        kept = getattr(BANDS, name)
        setattr(BANDS, name, value)
        found = [al.improve(records.record(kind, seed), start).fit.model for seed in range(6)]
        setattr(BANDS, name, kept)
        exact = sum(sorted(m.name.split("+")) == sorted([*start.split("+"), "DRES"]) for m in found)
        print(f"{name} = {value}: {exact} of 6 exact", flush=True)


def background():
    """Print the significant periodic levels of eight records that nearly repeat, and of eight that repeat exactly."""
    names = ("BACKGROUND_PARTS", "MIN_BACKGROUND_VALUES", "MAX_BACKGROUND_VALUES")
    kept = [getattr(LEVELS, name) for name in names]
    for factor in (1.0, 0.5, 2.0):
        sizes = (int(kept[0] / factor), int(kept[1] * factor), int(kept[2] * factor))
        for name, value in zip(names, sizes, strict=True):
            setattr(LEVELS, name, value)
        counts = [0, 0]
        for seed in range(8):
            for exact in (False, True):
                recording = al.Recording(_loud_at_times(seed, exact), rate=10.0)
                found = al.fit_model(recording, "N").check().significant
                counts[exact] += any(s.kind == "periodic_noise_level" for s in found)
        print(f"{sizes}: {counts[0]} false of 8, {counts[1]} true of 8", flush=True)
    for name, value in zip(names, kept, strict=True):
        setattr(LEVELS, name, value)


def _loud_at_times(seed, exact):
    """60 000 samples of white noise at 10 Hz, whose level repeats every 4.6 s, exactly or nearly."""
    rng, n, rate = np.random.default_rng(seed), 60_000, 10.0
    white = rng.standard_normal(n)
    if exact:
        return white * np.where(np.arange(n) / rate % 4.623 < 1.5, 1.2, 1.0)
    frequency = np.fft.rfftfreq(n, 1.0 / rate)
    band = np.exp(-0.5 * ((frequency - 0.2163) / 0.006) ** 2)
    log_level = np.fft.irfft(band * (rng.standard_normal((2, band.size)).T @ [1.0, 1.0j]), n)
    return white * np.exp(0.12 * log_level / log_level.std())


def bands():
    """Print how many of four records with each kind of hidden band are named exactly."""
    kinds = ("wandering_line", "resonance", "drifting_resonance", "modulated_vibration", "sinusoid")
    for module, name, value in (
        (WANDERING, "MIN_RESOLVED_FREQUENCIES", WANDERING.MIN_RESOLVED_FREQUENCIES),
        (WANDERING, "MIN_RESOLVED_FREQUENCIES", 5.0),
        (WANDERING, "MIN_RESOLVED_FREQUENCIES", 20.0),
        (WANDERING, "MAX_RELATIVE_WANDER", 0.05),
        (WANDERING, "MAX_RELATIVE_WANDER", 0.2),
    ):
        kept = getattr(module, name)
        setattr(module, name, value)
        counts = []
        for kind in kinds:
            start, short = records.HIDDEN[kind].start, al.CATALOG.find(kind).short
            found = [al.improve(records.record(kind, seed), start).fit.model for seed in range(4)]
            goal = sorted([*start.split("+"), short])
            counts.append(f"{kind} {sum(sorted(m.name.split('+')) == goal for m in found)}")
        setattr(module, name, kept)
        print(f"{name} = {value}, of 4 exact: {', '.join(counts)}", flush=True)


def gates():
    """Print the coverage and the bias of N where white noise is 1.5 times as loud for 37 % of a period."""
    n, rate, N = 20_000, 10.0, 0.01
    t = np.arange(n) / rate
    for steps in (1, 2, 8, 16):
        kept, LEVELS.FINE_PHASES = LEVELS.FINE_PHASES, steps
        covered, bias = 0, []
        for seed in range(12):
            white = N * np.sqrt(rate) * np.random.default_rng([seed, 3]).standard_normal(n)
            x = white * np.where((t / 37.3 + 0.21) % 1 < 0.37, 1.5, 1.0)
            own = al.improve(al.Recording(x, rate=rate, unit="deg/s"), "N").fit["N"]
            assert own.interval is not None
            covered += own.interval[0] <= N <= own.interval[1]
            bias.append(own.value / N - 1.0)
        LEVELS.FINE_PHASES = kept
        error = np.std(bias) / np.sqrt(len(bias))
        print(
            f"FINE_PHASES = {steps}: N covered in {covered} of 12, bias {100 * np.mean(bias):.2f} ± {100 * error:.2f} %",
            flush=True,
        )


def half_widths():
    """Return the half-width of the band at the longest time for two clocks of each kind, shape (clocks,)."""
    widths = []
    for name in holdover.CLOCKS:
        for seed in range(2):
            phase, _ = holdover.simulated(name, seed, 600)
            found = al.timing(
                al.Recording(phase, rate=holdover.RATE, quantity="angle"), after=holdover.AFTER
            )
            last = found.holdover[-1]
            widths.append(0.5 * (last.high - last.low))
    return np.array(widths)


def drift():
    """Print the rms and the largest relative difference of half-widths from those of twice as dense and wide spreads."""
    values = (("MIN_SPREAD", 0.15), ("MAX_SPREAD", 6.0), ("SPREAD_RATIO", 2.0**0.5))
    kept = {name: getattr(HOLDOVER, name) for name, _ in values}
    for name, value in values:
        setattr(HOLDOVER, name, value)
    exact = half_widths()
    for name, value in kept.items():
        setattr(HOLDOVER, name, value)
    _print_differences(HOLDOVER, exact, (*kept.items(), ("MIN_SPREAD", 0.6), ("MAX_SPREAD", 1.5)))


def posterior():
    """Print the rms and the largest relative difference of half-widths from those of ten times as many draws."""
    kept, POSTERIOR.POINTS = POSTERIOR.POINTS, (320, 960)
    exact = half_widths()
    POSTERIOR.POINTS = kept
    values = (
        ("POINTS", kept),
        ("POINTS", (16, 48)),
        ("POINTS", (64, 192)),
        ("PROPOSAL_FREEDOM", 2.5),
        ("PROPOSAL_FREEDOM", 10.0),
        ("MAX_WIDTH_STEPS", 7),
        ("MAX_WIDTH_STEPS", 28),
    )
    _print_differences(POSTERIOR, exact, values)


def _print_differences(module, exact, values):
    """Print for each constant of the module and its value how far half-widths differ from the exact ones."""
    for name, value in values:
        kept = getattr(module, name)
        setattr(module, name, value)
        away = np.abs(half_widths() / exact - 1.0)
        setattr(module, name, kept)
        rms = float(np.sqrt(np.mean(away**2)))
        print(
            f"{name} = {value}: {100 * rms:.1f} % rms, {100 * away.max():.1f} % at most", flush=True
        )


def _hidden(rng, kind, n, rate):
    """Return samples of N+K with a tone burst, a drifting line, a narrow band, or nothing, of ΔlogL 10 to 60."""
    t, gain = np.arange(n) / rate, rng.uniform(10.0, 60.0)
    x = rng.standard_normal(n) + 0.002 * np.cumsum(rng.standard_normal(n))
    f = rng.uniform(5.0, 40.0)
    if kind == "burst":
        length = rng.uniform(0.02, 0.5)
        first = int(rng.uniform(0.0, 1.0 - length) * n)
        inside = slice(first, first + int(length * n))
        x[inside] += 2.0 * np.sqrt(gain / (n * length)) * np.cos(2.0 * np.pi * f * t[inside])
    elif kind == "drifting line":
        rate_of_drift = rng.uniform(2.0, 200.0) / t[-1] ** 2
        x += 2.0 * np.sqrt(gain / n) * np.cos(2.0 * np.pi * (f + 0.5 * rate_of_drift * t) * t)
    elif kind == "narrow band":
        width = rng.uniform(0.002, 0.2)
        low, high = 2.0 * (f - width) / rate, 2.0 * (f + width) / rate
        band = signal.lfilter(*signal.butter(1, [low, high], "band"), rng.standard_normal(n))
        x += band / band.std() * np.sqrt(2.0 * width / rate * rng.uniform(1.0, 20.0))
    return x


def edges():
    """Print the coverage of 95 % intervals of the times of steps, and the median standard error, s."""
    n, rate, kept = 20_000, 10.0, ESTIMATES.EDGE_TIMES
    noises = {
        "N": ("N(N=0.01)", 0.02),
        "N+B": ("N(N=0.01)+B(B=0.003)", 0.02),
        "N+K": ("N(N=0.01)+K(K=4e-4)", 0.035),
    }
    for name, (noise, height) in noises.items():
        for times in (kept // 2, kept, 2 * kept):
            ESTIMATES.EDGE_TIMES = times
            inside, errors, formula = 0, [], []
            for seed in range(60):
                at = float(np.random.default_rng(seed).uniform(500.0, 1500.0))
                truth = al.parse_model(f"{noise}+STEP(time={at},height={height})")
                log = truth.simulate(n=n, rate=rate, seed=seed)
                fit = al.fit_model(log, f"{name}+STEP")
                low, high = fit.estimates[-1]["time"].interval
                step = fit.solution.effects[-1]
                variance = float(step.covariance[0, 0])
                formula.append(step.effect.shape_error("time", variance, fit.data.duration))
                inside += low <= at <= high
                errors.append((high - low) / (2.0 * 1.96))
            print(
                f"{name}: EDGE_TIMES = {times}: {inside} of 60 cover, {np.median(errors):.3g} s"
                f" (formula for white noise {np.median(formula):.3g} s)",
                flush=True,
            )
    ESTIMATES.EDGE_TIMES = kept


def forms():
    """Print how many forms of weak events a check need not refit, and how many of those would be significant."""
    slow = importlib.import_module("allanite.suggestion.screens.slow_functions")
    limits, significant, refit = (
        slow.may_become_significant,
        slow._significant_richer_forms,
        slow._refitted_candidate,
    )
    given, found = {}, []

    def watched(simple, forms, *more):
        given.update(forms)
        return significant(simple, forms, *more)

    def candidate(effect, own, base, data, rival, whitened, over=None):
        made = refit(effect, own, base, data, rival, whitened, over)
        if over is not None and made is not None:
            arc, starts, noise = given[effect]
            family = slow.Family(effect.family, (arc * starts,))
            hope = (1.0 + constants.MAX_NOISE_REFIT_FRACTION) * slow._matched_delta_logl(
                effect, base, noise, data
            )
            # A check makes at least 15 searches.
            chance = slow.log_p_value(family, made.judged_gain) + np.log(15.0)
            found.append((limits(family, hope), chance < np.log(constants.FALSE_ALARM_PROBABILITY)))
        return made

    def limit(family, hope):
        # Only the first limit, on the gain over the simple form, is in use.
        return (
            limits(family, hope)
            if all(family.arcs != (a * s,) for a, s, _ in given.values())
            else True
        )

    slow.may_become_significant = limit
    slow._significant_richer_forms, slow._refitted_candidate = watched, candidate
    rng = np.random.default_rng(5)
    n, rate = 20_000, 20.0
    t = np.arange(n) / rate
    for k in range(400):
        walk = 10.0 ** rng.uniform(-5.5, -3.5)
        start, length = rng.uniform(100.0, 700.0), 10.0 ** rng.uniform(0.3, 2.5)
        shape = (
            (t >= start) & (t < start + length),
            (t >= start) * np.exp(-np.maximum(t - start, 0.0) / length),
            0.5 * np.clip((t - start) / length, 0.0, 1.0),
        )[k % 3]
        x = 0.0134 * rng.standard_normal(n) + walk / np.sqrt(rate) * np.cumsum(
            rng.standard_normal(n)
        )
        x += 0.013 * rng.uniform(2.0, 8.0) / np.sqrt(length * rate) * shape
        al.fit_model(al.Recording(x, rate=rate), "N+B+K").check()
        given.clear()
    slow.may_become_significant = limits
    slow._significant_richer_forms, slow._refitted_candidate = significant, refit
    left_out = [is_significant for is_refitted, is_significant in found if not is_refitted]
    print(
        f"{len(found)} forms, {sum(s for _, s in found)} significant; left out {len(left_out)}, "
        f"{sum(left_out)} significant",
        flush=True,
    )


def rounds():
    """Print how far coefficients of a clock, two thirds of its samples missing, are from those with a tolerance of 1e-5."""
    rng = np.random.default_rng(6)
    model = al.parse_model("Q(Q=1e-9)+N(N=1e-10)+K(K=1e-12)")
    samples = np.array(model.simulate(n=100_000, rate=1.0, seed=6, unit="1").samples)
    # Segments of 50 samples on average are present, of 100 missing.
    state = np.repeat(np.arange(4000) % 2, rng.geometric(1.0 / np.tile([50, 100], 2000)))
    samples[state[: samples.size] == 1] = np.nan
    kept, first = COMPLETION.ROUND_TOLERANCE, None
    for value in (1e-5, 1e-4, 1e-3, 1e-2):
        COMPLETION.ROUND_TOLERANCE = value
        start = time.process_time()
        fit = al.fit_model(al.Recording(samples, rate=1.0, unit="1"), "Q+N+K")
        seconds = time.process_time() - start
        found = np.array([float(fit[name]) for name in ("Q", "N", "K")])
        errors = np.array([fit[name].std_error for name in ("Q", "N", "K")])
        first = found if first is None else first
        worst = float(np.max(np.abs(found - first) / errors))
        print(
            f"ROUND_TOLERANCE = {value}: {worst:.2g} standard errors, {seconds:.1f} CPU s",
            flush=True,
        )
    COMPLETION.ROUND_TOLERANCE = kept


if __name__ == "__main__":
    parts = {
        "background": background,
        "bands": bands,
        "courses": courses,
        "drift": drift,
        "edges": edges,
        "forms": forms,
        "gates": gates,
        "posterior": posterior,
        "rounds": rounds,
    }
    for part in sys.argv[1:] or parts:
        parts[part]()
