"""Consistency of filters with the exported files: log, file, new data of the same truth, aiding, coasting.

Each sensor gets a log of two hours, from which `allanite.improve` builds a model. A bias filter with the numbers of each
file is aided for 300 s by the exact angle each second, then it coasts for 10, 60 and 120 s on new data of the same truth.
The generator and the filters are plain NumPy, with each consumer's conversion transcribed. NEES is the mean squared error
over the variance that the filter predicts: 1 is consistent.

    python benches/claims/filter_files.py [--sensors 50] [--truths 12] [--segments 200] [--models FOLDER]
"""

from __future__ import annotations

import argparse
import json
import math
import re
import warnings
from pathlib import Path

import numpy as np

import allanite as al
from allanite.export import export
from allanite.export._axis import axes_of

RATE, LOG, AIDED, COASTING = 20, 7200, 300, (10, 60, 120)
N = 1e-3
DT = 1.0 / RATE
DEGREE = math.pi / 180
#: B (per sample), lags (q_c, T), lines (amplitude, Hz), corner of a first-order filter of the white noise (Hz).
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


def convolved(rng, count, response):
    """White noise through an impulse response, stationary from its first sample."""
    total = count + response.size - 1
    size = 1 << (total - 1).bit_length()
    spectrum = np.fft.rfft(rng.standard_normal(total), size) * np.fft.rfft(response, size)
    return np.fft.irfft(spectrum, size)[response.size - 1 : total]


def record(rng, truth, count):
    """Samples in rad/s."""
    if "corner" in truth:
        a = math.exp(-2 * math.pi * truth["corner"] * DT)
        x = N * math.sqrt(RATE) * convolved(rng, count, (1 - a) * a ** np.arange(400))
    else:
        x = N * math.sqrt(RATE) * rng.standard_normal(count)
    if truth.get("B"):
        # Kasdin (1995): h(k) = h(k−1)(k − ½)/k has the spectrum 1/(2 sin(w/2)).
        k = np.arange(1, 2 * LOG * RATE)
        x += truth["B"] * convolved(rng, count, np.cumprod(np.concatenate([[1.0], (k - 0.5) / k])))
    for q_c, T in truth.get("lags", ()):
        phi = math.exp(-DT / T)
        step = q_c * math.sqrt(T / 2 * (1 - phi**2))
        x += step * convolved(rng, count, phi ** np.arange(int(12 * T * RATE)))
    for amplitude, frequency in truth.get("lines", ()):
        t = np.arange(count) * DT
        x += amplitude * np.cos(2 * math.pi * (frequency * t + rng.random()))
    return x + truth["K"] * math.sqrt(DT) * np.cumsum(rng.standard_normal(count))


def number(text, key):
    return float(
        re.search(rf"^\s*(?:param set )?{re.escape(key)}[:,\s(=\[]+([-+.\deE]+)", text, re.M).group(
            1
        )
    )


def white_and_walk(text, target):
    """N and K that the consumer's own update makes of its file."""
    if target == "kalibr":
        return number(text, "gyroscope_noise_density"), number(text, "gyroscope_random_walk")
    if target == "vins":
        # Two independent draws of half weight a step; a bias step is dt·w.
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


def bias_filter(white, slow, time, integrals):
    """NEES at each coasting time over segments of integrals over one second, shape (segments, seconds)."""
    phi = 1.0 if time is None else math.exp(-1.0 / time)
    F = np.array([[1.0, -1.0], [0.0, phi]])
    # The noise of a second in a hundred steps.
    Q, h = np.zeros((2, 2)), 0.01
    f = np.array([[1.0, -h], [0.0, phi**h]])
    for _ in range(100):
        Q = f @ Q @ f.T + np.diag([white**2 * h, slow**2 * h])
    whole = np.linalg.matrix_power(f, 100)
    F = whole if time is not None else F
    P = np.diag([0.0, 1e4 * white**2 if time is None else slow**2 * time / 2])
    state = np.zeros((2, len(integrals)))
    out = []
    for k in range(integrals.shape[1]):
        P = F @ P @ F.T + Q
        state = F @ state
        state[0] += integrals[:, k]
        if k < AIDED:
            gain = P[:, 0] / P[0, 0]
            state = state - np.outer(gain, state[0])
            P = P - np.outer(gain, P[0])
        elif k + 1 - AIDED in COASTING:
            out.append(float(np.mean(state[0] ** 2) / P[0, 0]))
    return out


def state_filter(axis, samples):
    """The same with all states of the file, sample by sample; samples of shape (segments, count)."""
    f, q, h, r, p0 = (np.array(axis[key]) for key in ("F", "Q", "H", "R", "P0"))
    size = h.size
    F, Q, P = np.eye(size + 1), np.zeros((size + 1, size + 1)), np.zeros((size + 1, size + 1))
    F[0, 1:], F[1:, 1:] = -DT * h.ravel(), f
    Q[0, 0], Q[1:, 1:], P[1:, 1:] = r[0, 0] * DT**2, q, p0
    state = np.zeros((size + 1, len(samples)))
    out = []
    for k in range(samples.shape[1]):
        P = F @ P @ F.T + Q
        state = F @ state
        state[0] += samples[:, k] * DT
        second, rest = divmod(k + 1, RATE)
        if rest:
            continue
        if second <= AIDED:
            gain = P[:, 0] / P[0, 0]
            state = state - np.outer(gain, state[0])
            P = P - np.outer(gain, P[0])
            P = 0.5 * (P + P.T)
        elif second - AIDED in COASTING:
            out.append(float(np.mean(state[0] ** 2) / P[0, 0]))
    return out


TARGETS = ("kalibr", "vins", "gtsam", "fastlio", "px4", "ardupilot")


def model_of(rng, truth):
    """The document of a model of one log."""
    log = al.Recording(record(rng, truth, LOG * RATE), rate=RATE, unit="rad/s")
    study = al.improve(log, "N+B+K")
    return {
        "schema": "allanite/fit/1",
        **study.to_dict()["ladder"][-1],
        "recording": {**log.describe(), "column": "gyro_x"},
    }


def nees_of(document, segments, states, overbound=True):
    """NEES at 10, 60, 120 s of each target's filter."""
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


def study_of(name, sensors, segments, states=True, seed=0, folder=None, overbound=True):
    """NEES of all sensors of one truth: target → array of shape (sensors, 3); and the models' names."""
    truth = TRUTHS[name]
    place = list(TRUTHS).index(name)
    length = (AIDED + COASTING[-1]) * RATE
    found, names = {}, []
    for sensor in range(sensors):
        # Segments of its own: the mean over sensors has a standard error of √(2 / (sensors · segments)).
        rng = np.random.default_rng([seed, place, sensor, 1])
        new = np.array([record(rng, truth, length) for _ in range(segments)])
        kept = None if folder is None else folder / f"{place}-{sensor}.json"
        if kept is not None and kept.exists():
            document = json.loads(kept.read_text())
        else:
            document = model_of(np.random.default_rng([seed, place, sensor]), truth)
            if kept is not None:
                kept.write_text(json.dumps(document))
        names.append(document["model"])
        for target, row in nees_of(document, new, states, overbound).items():
            found.setdefault(target, []).append(row)
    return {target: np.array(rows) for target, rows in found.items()}, names


def main() -> None:
    """Print NEES at 10, 60 and 120 s of each truth and target."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser()
    parser.add_argument("--sensors", type=int, default=3)
    parser.add_argument("--truths", type=int, default=len(TRUTHS))
    parser.add_argument("--segments", type=int, default=200)
    parser.add_argument("--models", type=Path, help="Folder in which fitted models are kept.")
    asked = parser.parse_args()
    for name in list(TRUTHS)[: asked.truths]:
        found, names = study_of(name, asked.sensors, asked.segments, folder=asked.models)
        print(f"{name}: models {', '.join(sorted(set(names)))}")
        for target, rows in found.items():
            mean = ", ".join(f"{v:.2f}" for v in rows.mean(axis=0))
            line = f"  {target:12} NEES after 10, 60, 120 s: {mean}"
            if target == "overbound":
                line += (
                    f"; below 1.05 in {100 * np.mean(rows.max(axis=1) < 1.05):.0f} % of the sensors"
                )
            print(line, flush=True)


if __name__ == "__main__":
    main()
