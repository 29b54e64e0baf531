"""Claim: filters that use the exported files are consistent (NEES near 1) on new data of the same truth.

Each sensor gets a log of two hours, from which `allanite.improve` builds a model. A bias filter with the numbers of
each file is aided for 300 s by the exact angle each second, then it coasts for 10, 60 and 120 s on new data of the same
truth. The generator and the filters are plain NumPy, with each consumer's conversion reimplemented. NEES is the mean
squared error over the variance that the filter predicts: 1 is consistent. All sensors of a truth coast on the same
segments of new data.

    python benches/claims/filter_files.py [--sensors 3] [--truths 12] [--segments 2000] [--results FILE] [--models FOLDER]

The file of results gets one JSON line per sensor. A repeated run skips the sensors in it; `--sensors 0` only prints it.
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import re
import warnings
from pathlib import Path

import numpy as np
import scipy.fft
from results_file import Results

import allanite as al
from allanite.exports import axes_of, export

RATE, LOG, AIDED, COASTING = 20, 7200, 300, (10, 60, 120)
N = 1e-3
DT = 1.0 / RATE
DEGREE = math.pi / 180
#: B (per sample), Gauss–Markov processes `lags` (q_c, T), lines (amplitude, Hz), cutoff `corner` of the white noise (Hz).
SHAPES: dict[str, dict[str, object]] = {
    "N+B": {"B": 2e-4},
    "N+lag 10 s": {"lags": [(3e-4, 10.0)]},
    "N+lag 120 s": {"lags": [(1e-4, 120.0)]},
    "N+B+lag 120 s": {"B": 1e-4, "lags": [(1e-4, 120.0)]},
    "N+B+line": {"B": 2e-4, "lines": [(2e-3, 3.7)]},
    "filtered N+lag 10 s": {"lags": [(3e-4, 10.0)], "corner": 3.0},
}
SMALL_K = 2e-6
TRUTHS = {
    f"{name}{'+K' if K else ''}": {**s, "K": K}
    for name, s in SHAPES.items()
    for K in (0.0, SMALL_K)
}


#: Coefficients of impulse responses (4 h): a record is stationary from its first sample.
MEMORY = 2 * LOG * RATE


@functools.cache
def response(kind, value=0.0):
    """Return the impulse response of flicker noise, a correlation time of `value` seconds, or a filter at `value` Hz."""
    if kind == "flicker":
        # Kasdin (1995): h(k) = h(k−1)(k − ½)/k has the spectrum 1/(2 sin(w/2)).
        k = np.arange(1, MEMORY)
        return np.cumprod(np.concatenate([[1.0], (k - 0.5) / k]))
    if kind == "lag":
        return math.exp(-DT / value) ** np.arange(int(12 * value * RATE))
    a = math.exp(-2 * math.pi * value * DT)
    return (1 - a) * a ** np.arange(400)


@functools.cache
def response_spectrum(size, *what):
    """Return the discrete Fourier transform of an impulse response, zero-padded to `size`."""
    return scipy.fft.fft(response(*what), size)


def convolved(rng, rows, count, *what):
    """Return white noise filtered by an impulse response, stationary from the first sample, shape (rows, count)."""
    size = scipy.fft.next_fast_len(count + response(*what).size - 1)
    out = np.empty((rows, count))
    for row in range(0, rows, 2):
        # Real and imaginary part are two independent records. White noise can be drawn in the frequency domain.
        noise = rng.standard_normal(2 * size).view(complex)
        pair = scipy.fft.ifft(noise * response_spectrum(size, *what))[:count] * math.sqrt(size)
        out[row] = pair.real
        if row + 1 < rows:
            out[row + 1] = pair.imag
    return out


def records(rng, truth, rows, count):
    """Return independent records in rad/s, shape (rows, count)."""
    if "corner" in truth:
        x = N * math.sqrt(RATE) * convolved(rng, rows, count, "corner", truth["corner"])
    else:
        x = N * math.sqrt(RATE) * rng.standard_normal((rows, count))
    if truth.get("B"):
        x += truth["B"] * convolved(rng, rows, count, "flicker")
    for q_c, T in truth.get("lags", ()):
        step = q_c * math.sqrt(T / 2 * (1 - math.exp(-2 * DT / T)))
        x += step * convolved(rng, rows, count, "lag", T)
    for amplitude, frequency in truth.get("lines", ()):
        t = np.arange(count) * DT
        x += amplitude * np.cos(2 * math.pi * (frequency * t + rng.random((rows, 1))))
    if truth["K"]:
        x += truth["K"] * math.sqrt(DT) * np.cumsum(rng.standard_normal((rows, count)), axis=1)
    return x


def number(text, key):
    """Return the number that follows a key in an exported file."""
    return float(
        re.search(rf"^\s*(?:param set )?{re.escape(key)}[:,\s(=\[]+([-+.\deE]+)", text, re.M).group(
            1
        )
    )


def white_and_walk(text, target):
    """Return N and K that the consumer's own update computes from its file."""
    if target == "kalibr":
        return number(text, "gyroscope_noise_density"), number(text, "gyroscope_random_walk")
    if target == "vins":
        # A step averages two independent samples; a bias step is dt·w.
        return number(text, "gyr_n") * math.sqrt(DT / 2), number(text, "gyr_w") * math.sqrt(DT)
    if target == "gtsam":
        return number(text, "parameters.setGyroscopeCovariance"), number(
            text, "parameters.setBiasOmegaCovariance"
        )
    if target == "fastlio":
        return math.sqrt(number(text, "gyr_cov") * DT), math.sqrt(number(text, "b_gyr_cov") * DT)
    if target == "px4":
        return number(text, "EKF2_GYR_NOISE") * 0.1, number(text, "EKF2_GYR_B_NOISE") * 0.1
    root = math.sqrt(0.012)
    return number(text, "EK3_GYRO_P_NSE") * root, number(text, "EK3_GBIAS_P_NSE") * root


def coasted(F, Q, P, period, new, scale=1.0):
    """NEES at each coasting time of a filter whose first state is the angle; the exact angle aids the filter each second.

    An input times `scale` enters the angle each `1 / period` seconds. The error is linear in the inputs; its weights
    are computed from the gains backward in time.
    """
    size = len(P)
    gains, variances = [], {}
    for k in range((AIDED + COASTING[-1]) * period):
        P = F @ P @ F.T + Q
        second, rest = divmod(k + 1, period)
        gains.append(None)
        if rest:
            continue
        if second <= AIDED:
            gains[k] = P[:, 0] / P[0, 0]
            P = P - np.outer(gains[k], P[0])
            P = 0.5 * (P + P.T)
        elif second - AIDED in COASTING:
            variances[k] = P[0, 0]
    weights = np.zeros((len(gains), len(COASTING)))
    v = np.zeros((size, len(COASTING)))
    for k in range(len(gains) - 1, -1, -1):
        if k in variances:
            v[0, list(variances).index(k)] = 1.0
        if gains[k] is not None:
            v[0] -= gains[k] @ v
        weights[k] = v[0]
        v = F.T @ v
    error = new @ (scale * weights).astype(new.dtype)
    return [float(s) for s in np.mean(error.astype(float) ** 2, axis=0) / list(variances.values())]


def bias_filter(white, slow, time, integrals):
    """Return the NEES of a filter of angle and bias; integrals over one second, shape (segments, seconds)."""
    phi = 1.0 if time is None else math.exp(-1.0 / time)
    # Integrate the noise of a second in a hundred steps.
    Q, h = np.zeros((2, 2)), 0.01
    f = np.array([[1.0, -h], [0.0, phi**h]])
    for _ in range(100):
        Q = f @ Q @ f.T + np.diag([white**2 * h, slow**2 * h])
    P = np.diag([0.0, 1e4 * white**2 if time is None else slow**2 * time / 2])
    return coasted(np.linalg.matrix_power(f, 100), Q, P, 1, integrals)


def state_filter(axis, samples):
    """Return the NEES of a filter with all states of the file; samples of shape (segments, count)."""
    f, q, h, r, p0 = (np.array(axis[key]) for key in ("F", "Q", "H", "R", "P0"))
    size = h.size
    F, Q, P = np.eye(size + 1), np.zeros((size + 1, size + 1)), np.zeros((size + 1, size + 1))
    F[0, 1:], F[1:, 1:] = -DT * h.ravel(), f
    Q[0, 0], Q[1:, 1:], P[1:, 1:] = r[0, 0] * DT**2, q, p0
    return coasted(F, Q, P, RATE, samples, DT)


TARGETS = ("kalibr", "vins", "gtsam", "fastlio", "px4", "ardupilot")


def model_of(rng, truth):
    """Return the document of the model found from one log."""
    log = al.Recording(records(rng, truth, 1, LOG * RATE)[0], rate=RATE, unit="rad/s")
    study = al.improve(log, "N+B+K")
    return {
        "schema": "allanite/fit/1",
        **study.to_dict()["ladder"][-1],
        "recording": {**log.describe(), "column": "gyro_x"},
    }


def nees_of(document, segments, states, overbound=True):
    """Return the NEES at 10, 60 and 120 s of the filter of each target."""
    accel = json.loads(json.dumps(document).replace("rad/s", "m/s^2").replace("gyro_x", "acc_x"))
    out = {}
    integrals = segments.reshape(len(segments), -1, RATE).sum(axis=2) * DT
    horizon = float(COASTING[-1])
    for target in TARGETS:
        text = export(axes_of([document]), target, horizon=horizon)
        white, walk = white_and_walk(text, target)
        out[target] = bias_filter(white, walk, None, integrals)
    text = export(axes_of([document, accel]), "kfgins", horizon=horizon)
    arw, sigma = number(text, "arw") * DEGREE / 60, number(text, "gbstd") * DEGREE / 3600
    T = number(text, "corrtime") * 3600
    out["kfgins"] = bias_filter(arw, sigma * math.sqrt(2 / T), T, integrals)
    if overbound:
        text = export(axes_of([document]), "kalibr", horizon=horizon, overbound=True)
        white, walk = white_and_walk(text, "kalibr")
        out["overbound"] = bias_filter(white, walk, None, integrals)
    if states:
        (axis,) = json.loads(export(axes_of([document]), "statespace"))["axes"]
        out["statespace"] = state_filter(axis, segments)
    return out


def new_data(name, segments, seed=0):
    """Return segments of new data of one truth as float32, whose rounding is far below the noise."""
    rng = np.random.default_rng([seed, list(TRUTHS).index(name), 1 << 20])
    length = (AIDED + COASTING[-1]) * RATE
    out = np.empty((segments, length), dtype=np.float32)
    for start in range(0, segments, 100):
        part = out[start : start + 100]
        part[:] = records(rng, TRUTHS[name], len(part), length)
    return out


def sensor_of(name, sensor, new, states=True, seed=0, folder=None, overbound=True):
    """Model and NEES by target of one sensor of a truth."""
    place = list(TRUTHS).index(name)
    kept = None if folder is None else folder / f"{place}-{sensor}.json"
    if kept is not None and kept.exists():
        document = json.loads(kept.read_text())
    else:
        document = model_of(np.random.default_rng([seed, place, sensor]), TRUTHS[name])
        if kept is not None:
            kept.write_text(json.dumps(document))
    return {"model": document["model"], "nees": nees_of(document, new, states, overbound)}


def summary(name, rows, segments):
    """Lines of one truth: mean NEES ± standard error, and the range over sensors.

    A mean has two errors: the scatter between sensors, and √(2 / segments) from the segments that they share.
    """
    out = [f"{name}: {len(rows)} sensors, models {', '.join(sorted({r['model'] for r in rows}))}"]
    for target in rows[0]["nees"]:
        nees = np.array([r["nees"][target] for r in rows])
        mean = nees.mean(axis=0)
        scatter = nees.std(axis=0, ddof=1) if len(rows) > 1 else np.zeros(len(COASTING))
        error = np.hypot(scatter / math.sqrt(len(rows)), mean * math.sqrt(2 / segments))
        cells = ", ".join(f"{m:.3f} ± {e:.3f}" for m, e in zip(mean, error, strict=True))
        line = f"  {target:12} NEES after 10, 60, 120 s: {cells} (sensors {nees.min():.2f} to {nees.max():.2f})"
        if target == "overbound":
            below = 100 * np.mean(nees.max(axis=1) < 1.05)
            line += f"; below 1.05 in {below:.0f} % of the sensors"
        out.append(line)
    return out


def main() -> None:
    """Print NEES at 10, 60 and 120 s of each truth and target."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--sensors", type=int, default=3, help="sensors of each truth; 0 prints the results"
    )
    parser.add_argument(
        "--truths", type=int, default=len(TRUTHS), help="number of truths, the first ones"
    )
    parser.add_argument(
        "--segments", type=int, default=2000, help="segments of new data of each truth"
    )
    parser.add_argument("--results", type=Path, help="file with one JSON line per sensor")
    parser.add_argument("--models", type=Path, help="folder in which fitted models are kept")
    given = parser.parse_args()
    results = Results(given.results, f"{given.segments} segments")
    for name in list(TRUTHS)[: given.truths]:
        missing = [k for k in range(given.sensors) if f"{name} {k}" not in results.rows]
        new = new_data(name, given.segments) if missing else None
        for k in missing:
            run = functools.partial(sensor_of, name, k, new, folder=given.models)
            results.of(f"{name} {k}", run)
        rows = [row for case, row in results.rows.items() if case.rpartition(" ")[0] == name]
        if rows:
            print("\n".join(summary(name, rows, given.segments)), flush=True)


if __name__ == "__main__":
    main()
