"""The analysis of "Inertial Sensor Noise Analysis Using Allan Variance", and the effect that it misses.

The recording of that article is not available. Therefore a six-hour record with its N, K and B is simulated. Its last
paragraph names two omitted effects, and both are added: quantization and a thermal effect (a lag of 10 minutes).

1. The published recipe: the points nearest to three slopes are read at τ = 1, 3 and on the plateau.
2. Slope lines with the range of τ in which each slope holds, or "not present".
3. A fit of N+B+K, and a simulation of the fitted model, which differs from the sensor at short times.
4. Stepwise model building, and a simulation of its last model, which agrees with the sensor.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.fit.classical.lines import read_lines

RATE, HOURS = 100.0, 6.0


def main(hours: float = HOURS) -> al.Study:
    """Run the example on a record of `hours` hours; returns the study."""
    sensor = al.parse_model(
        "N(N=0.0126)+B(B=0.0020)+K(K=9.0679e-5)+Q(Q=1.5e-4)+GM(correlation_time=600,q_c=8e-4)"
    )
    recording = sensor.simulate(duration=3600 * hours, rate=RATE, seed=7, unit="rad/s")

    n, k, b = nearest_slopes(recording.samples, RATE)
    print(f"nearest slopes, as published: N {n:.4g}, K {k:.4g}, B {b:.4g} rad/s, √s")

    curve = al.oadev(recording.samples, rate=RATE, taus=8)
    for line in read_lines(curve).lines:
        words = (
            f"{line.value:.4g} ({line.low:.4g} … {line.high:.4g}), holds at "
            f"{line.tau_low_s:.3g}–{line.tau_high_s:.3g} s"
            if line.present
            else f"not present: {line.reason}"
        )
        print(f"  {line.name}: {words}")

    fit = al.fit_model(recording, "N+B+K")
    print(f"\n{fit}\n")
    tau, ratio = against_simulation(curve, fit)
    print(
        f"the sensor against the simulation of N+B+K: {100 * (ratio - 1):+.0f} % at τ = {tau:.3g} s\n"
    )

    study = al.improve(recording, "N+B+K")
    print(study)
    tau, ratio = against_simulation(curve, study.fit)
    print(
        f"\nagainst the simulation of the last model: {100 * (ratio - 1):+.1f} % at τ = {tau:.3g} s"
    )
    return study


def nearest_slopes(samples: NDArray[np.float64], rate: float) -> tuple[float, float, float]:
    """N, K and B by the recipe exactly as published, including its mistakes.

    The phase has no leading zero, so that the first sample is ignored. There are 100 averaging factors, rounded up, to
    the largest power of two within half the record. Each line goes through the one point whose slope to the next is
    nearest to −½, +½ or 0, even if the point is noisy or the curve has no such slope.
    """
    top = 2.0 ** np.floor(np.log2(samples.size / 2))
    m = np.unique(np.ceil(np.logspace(0.0, np.log10(top), 100)).astype(np.int64))
    phase = np.cumsum(samples) / rate
    curve = al.oadev(phase, rate=rate, factors=m[2 * m < samples.size], quantity="angle")
    tau, sigma = np.log10(curve.tau), np.log10(curve.deviation)
    slopes = np.diff(sigma) / np.diff(tau)

    def read(slope: float, at: float) -> float:
        """Deviation at `at` seconds on the line through the point with the nearest slope."""
        i = int(np.argmin(np.abs(slopes - slope)))
        return float(10.0 ** (sigma[i] + slope * (np.log10(at) - tau[i])))

    return read(-0.5, 1.0), read(0.5, 3.0), read(0.0, 1.0) / float(np.sqrt(2 * np.log(2) / np.pi))


def against_simulation(curve: al.Deviation, fit: al.Fit, seed: int = 8) -> tuple[float, float]:
    """τ (s) of the largest ratio of the sensor to a simulation of the fitted model, up to 1 s, and this ratio."""
    simulated = fit.simulate(duration=fit.recording.duration, seed=seed)
    again = al.oadev(simulated.samples, rate=RATE, factors=curve.factors)
    short = curve.tau <= 1.0  # at longer τ, both curves scatter by several per cent
    ratio = (curve.deviation / again.deviation)[short]
    worst = int(abs(ratio - 1).argmax())
    return float(curve.tau[worst]), float(ratio[worst])


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else HOURS)
