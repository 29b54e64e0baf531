"""Common mistakes in reading Allan deviations, compared with results of allanite: python docs/site/compared.py."""

from __future__ import annotations

from pathlib import Path

import allantools
import numpy as np

import allanite as al

HOURS, RATE, N = 3.0, 100.0, 0.01


def write(path: Path) -> None:
    """The page with the numbers of this run; seeds are fixed."""
    path.write_text(page(), encoding="utf-8")


def skipped() -> tuple[float, float]:
    """N over the truth, of a 400 Hz record brought to 100 Hz by skipping and by averaging."""
    fast = al.AngleRandomWalk(N=N).simulate(n=2**19, rate=400.0, seed=1, unit="deg/s")
    thinned = al.Recording(fast.samples[::4], rate=100.0, unit="deg/s")
    return tuple(
        float(al.AngleRandomWalk().fit(r)["N"].value / N) for r in (thinned, fast.decimate(4))
    )


def forced_line(curve: al.Deviation) -> float:
    """K of the line of slope +½ that is least far from all points of a curve, read at τ = 3 s."""
    return float(np.exp(np.mean(np.log(curve.deviation / np.sqrt(curve.tau / 3.0)))))


def error_bars() -> tuple[float, float, float]:
    """Of white noise, n = 1000, m = 100: deviation/√n, the scatter of 2000 records, the half interval (68 %), in per cent."""
    x = np.random.default_rng(3).standard_normal((2000, 1000))
    found = np.array([al.oadev(row, factors=[100]).deviation[0] for row in x])
    _, dev, err, _ = allantools.oadev(x[0], rate=1.0, data_type="freq", taus=[100.0])
    one = al.oadev(x[0], factors=[100])
    half = float(np.log(one.high[0] / one.low[0])) / 2.0 / 1.96
    return 100.0 * err[0] / dev[0], 100.0 * found.std() / found.mean(), 100.0 * half


def missing() -> tuple[int, int]:
    """How many averaging times have a value after one NaN in 10 000 samples: allantools' and ours."""
    x = np.random.default_rng(4).standard_normal(10_000)
    x[500] = np.nan
    _, theirs, _, _ = allantools.oadev(x, rate=1.0, data_type="freq", taus="octave")
    return int(np.isfinite(theirs).sum()), int(np.isfinite(al.oadev(x).deviation).sum())


def page() -> str:
    """The page."""
    thinned, averaged = skipped()
    white = al.AngleRandomWalk(N=N).simulate(
        duration=HOURS * 3600.0, rate=RATE, seed=2, unit="deg/s"
    )
    curve = al.oadev(white, taus=8)
    fit = al.fit_model(white, "N+B+K")
    short = al.oadev(al.Recording(white.samples[: white.n // 9], rate=RATE, unit="deg/s"), taus=8)
    bottom = [float(np.nanmin(c.deviation)) / 0.664 for c in (short, curve)]
    naive, scatter, ours = error_bars()
    theirs_nan, ours_nan = missing()
    sheet = al.Estimate(0.03, None, None, "deg/s/√Hz one-sided", True, "N")
    one_sided = float(sheet.to("deg/√h").value)
    return f"""# Compared with

Scripts and programs that read Allan deviations often make these mistakes. Each mistake is made here on purpose, and compared with
the result of allanite on the same samples. `docs/site/compared.py` computes the numbers whenever this site is built.

| mistake | truth | with the mistake | allanite |
|---|---|---|---|
| A 400 Hz log brought to 100 Hz by keeping every fourth sample: N | 1 | {thinned:.3f} | {averaged:.3f} (`recording.decimate(4)` averages) |
| A line of slope +½ fitted to the whole curve of white noise: K | 0 | {forced_line(curve):.2g} {fit["K"].unit} | {fit["K"]} |
| The lowest point of the curve, divided by 0.664, taken for B; {HOURS:g} h of white noise | 0 | {bottom[1]:.3g} deg/s | {fit["B"]} |
| The same on a ninth of the record | 0 | {bottom[0]:.3g} deg/s | |
| Error bars of deviation/√n, white noise, n = 1000, m = 100 | ± {scatter:.0f} % | ± {naive:.1f} % (allantools) | ± {ours:.0f} % |
| One NaN in 10 000 samples: averaging times with a value | {ours_nan} | {theirs_nan} (allantools `oadev`) | {ours_nan} |
| A data sheet's 0.03 °/s/√Hz (one-sided) taken for N in °/√h | {one_sided:.3g} | 0.03 or 1.8 | {one_sided:.3g} (units say `one-sided`) |

* **Skipping samples** folds the noise of the whole band below the new Nyquist frequency: N rises by √4 = 2. Averages keep it.
* **A forced line** finds a coefficient in any curve. allanite reports a coefficient that agrees with zero as not detected, with a 95 % limit.
* **The lowest point** of white noise lies at the end of the record. A record nine times as long lowers it by √9 on average ({bottom[0] / bottom[1]:.1f} in this run). It contains no information on flicker noise.
* **deviation/√n** treats overlapping averages as independent. The truth here is the scatter of 2000 simulated records.
* **One missing sample** spoils every later point of a running sum. allanite leaves out only the differences that touch it, and counts them.

[Speed](speed.md) compares computing times, and [validation](validation.md) lists the coverage of intervals.
"""


if __name__ == "__main__":
    print(page())
