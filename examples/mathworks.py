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

import allanite as al
from allanite.fit.classical.lines import nearest_slopes, read_lines

RATE, HOURS = 100.0, 6.0


def main(hours: float = HOURS) -> al.Study:
    """Run the example on a record of `hours` hours; returns the study."""
    sensor = al.parse_model(
        "N(N=0.0126)+B(B=0.0020)+K(K=9.0679e-5)+Q(Q=1.5e-4)+GM(correlation_time=600,q_c=8e-4)"
    )
    recording = sensor.simulate(duration=3600 * hours, rate=RATE, seed=7, unit="rad/s")

    seed = nearest_slopes(recording.samples, RATE)
    print(f"nearest slopes, as published: N {seed.N:.4g}, K {seed.K:.4g}, B {seed.B:.4g} rad/s, √s")

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
