"""A simulated six-axis sensor with known models."""

from __future__ import annotations

import numpy as np

import allanite as al

#: Gyroscope with two equal axes and a noisier one, with a spectral line that the accelerometer measures too.
GYRO = (
    "N(N=0.01)+K(K=3e-4)",
    "N(N=0.01)+K(K=3e-4)",
    "N(N=0.015)+K(K=3e-4)+SIN(f=7.3,A=0.02,phase=1)",
)
ACCELEROMETER = (
    "N(N=0.001)+GM(q_c=2e-3,T=4)",
    "N(N=0.001)+GM(q_c=2e-3,T=4)",
    "N(N=0.001)+GM(q_c=2e-3,T=4)+SIN(f=7.3,A=0.003,phase=0)",
)
NAMES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
UNITS = ("deg/s",) * 3 + ("m/s^2",) * 3


def six_axes(n=20_000, seed=1, rate=100.0, models=GYRO + ACCELEROMETER):
    """Recording of six independent axes with n samples."""
    axes = [
        al.parse_model(text).simulate(n=n, rate=rate, seed=seed, unit=unit, axis=i).samples
        for i, (text, unit) in enumerate(zip(models, UNITS, strict=True))
    ]
    return al.Recording(np.column_stack(axes), rate, unit=UNITS, columns=NAMES)


def write_csv(recording, path, **more):
    """Write the columns of a recording and `more` columns to a CSV file, with units in the header."""
    head = [f"{n} [{u}]" for n, u in zip(recording.columns, recording.units, strict=True)]
    body = np.column_stack(
        [np.arange(recording.n) / recording.rate, recording.samples, *more.values()]
    )
    np.savetxt(
        path,
        body,
        delimiter=",",
        header=",".join(["time [s]", *head, *more]),
        comments="",
        fmt="%.9g",
    )
    return path
