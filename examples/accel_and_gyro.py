"""One function for accelerometers and gyroscopes: five slopes and the Markov peak.

A Julia package asks for "the same function" for both sensors. The function takes samples in m/s², g, deg/h or deg/s
and returns the curve and the coefficients in the same unit. It reads each coefficient where the IEEE standard says:

    Q at τ = √3 (slope −1), N at 1 (−½), B ≫ 1/f_c (0), K at 3 (+½), R at √2 (+1),
    Gauss-Markov: a peak of 0.437 q_c √T at τ = 1.89 T.

First the readings are checked on the exact curve of each effect. Then they are compared with a fit on records of both
sensors. The second sensor shows a limit of the slope method: the flat top of a Markov peak looks like a plateau. It
is read as a B that the sensor does not have.
"""

from __future__ import annotations

import numpy as np

import allanite as al
from allanite.fit.classical.lines import read_lines

#: Level of the flat part of flicker over its B.
FLICKER = float(np.sqrt(2.0 * np.log(2.0) / np.pi))

RATE, HOURS = 20.0, 4.0
#: Effect with coefficient 1, where its line is read, and what is read there.
SLOPES = {
    "Q": (al.Quantization(Q=1.0), 3**0.5, -1.0, 1.0),
    "N": (al.AngleRandomWalk(N=1.0), 1.0, -0.5, 1.0),
    "B": (al.BiasInstability(B=1.0), 1e3, 0.0, FLICKER),
    "K": (al.RateRandomWalk(K=1.0), 3.0, 0.5, 1.0),
    "R": (al.RateRamp(R=1.0), 2**0.5, 1.0, 1.0),
}
#: Peak of a Gauss-Markov process: τ over T, and deviation over q_c √T.
PEAK, HEIGHT = 1.892618, 0.436542
ACCELEROMETER = "N(N=1.2e-4)+B(B=2e-5)+K(K=2e-6)"  # g
GYROSCOPE = "N(N=5e-3)+GM(correlation_time=60,q_c=1.5e-3)"  # deg/s


def exact_readings() -> dict[str, tuple[float, float]]:
    """(slope, reading) of each effect's own curve at the place of the standard, in the limit of fast sampling."""
    found = {}
    for name, (effect, at, _, _) in SLOPES.items():
        tau = at * np.array([0.99, 1.0, 1.01])
        rate = 1e5 / at  # 100 000 samples to the reading: steps of τ do not matter
        sigma = np.sqrt(effect.allan_variance(tau, rate))
        slope = np.log(sigma[2] / sigma[0]) / np.log(tau[2] / tau[0])
        found[name] = float(slope), float(sigma[1])
    return found


def markov_peak(correlation_time: float = 60.0, q_c: float = 1.0) -> tuple[float, float]:
    """Place over T and height over q_c √T of the peak of a Gauss-Markov process."""
    tau = correlation_time * np.linspace(1.5, 2.5, 4001)
    effect = al.GaussMarkov(q_c=q_c, correlation_time=correlation_time)
    sigma = np.sqrt(effect.allan_variance(tau, 1e4 / correlation_time))
    k = int(np.argmax(sigma))
    return float(tau[k] / correlation_time), float(sigma[k] / (q_c * correlation_time**0.5))


def analyse(samples: np.ndarray, rate: float, unit: str, model: str) -> dict[str, float | None]:
    """Readings and fit of samples, in the unit of the samples."""
    print(f"{unit}:")
    recording = al.Recording(samples, rate=rate, unit=unit)
    curve = recording.oadev(taus=8)
    out: dict[str, float | None] = {
        f"{r.name} by its line": r.value for r in read_lines(curve).lines
    }
    fit = al.fit_model(recording, model)
    for effect, values in zip(fit.model, fit.estimates, strict=True):
        for name, value in values.items():
            out[f"{name} fitted"] = float(value) if value.detected else None
            print(f"  {fit.display_name(effect):24} {name:16} {value!r}")
    return out


def main(hours: float = HOURS) -> dict[str, object]:
    """Run the example; returns what was found."""
    exact, peak = exact_readings(), markov_peak()
    print("each effect alone, with coefficient 1, read where the standard says:")
    for name, (slope, value) in exact.items():
        print(f"  {name}: slope {slope:+.3f}, reading {value:.4f}")
    print(f"  Gauss-Markov: peak at {peak[0]:.3f} T, {peak[1]:.4f} q_c √T high\n")

    sensors = {"accelerometer": (ACCELEROMETER, "g", "m/s^2", 9.80665, "N+B+K"),
               "gyroscope": (GYROSCOPE, "deg/s", "deg/h", 3600.0, "N+GM")}  # fmt: skip
    found: dict[str, object] = {"exact": exact, "peak": peak}
    for sensor, (truth, unit, other, factor, model) in sensors.items():
        x = al.parse_model(truth).simulate(duration=3600 * hours, rate=RATE, seed=6, unit=unit)
        read = analyse(x.samples, RATE, unit, model)
        found[f"{sensor} {unit}"] = read
        lines = [name[0] for name, value in read.items() if "line" in name and value is not None]
        print(f"  its lines that hold: {', '.join(lines) or 'none'}")
        found[f"{sensor} {other}"] = analyse(x.samples * factor, RATE, other, model)
        print()
    return found


if __name__ == "__main__":
    main()
