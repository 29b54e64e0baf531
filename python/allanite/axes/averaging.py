"""Reduction of the Allan deviation by averaging several sensors of one axis."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import fields_dict
from allanite.deviation import oadev
from allanite.recording import Recording
from allanite.recording.axis_names import axis_letter

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.study import Study

#: The longest compared averaging time fits into the record this many times: a ratio of two deviations is known to 10 %.
MIN_AVERAGES = 50
#: Pattern of the names that readers give to unnamed columns. Their number is a position, not the number of a sensor.
POSITION_NAME = re.compile(r"x\d+")


@dataclass(frozen=True, slots=True)
class Averaged:
    """Weighted mean of several sensors of one axis, and its Allan deviation.

    Attributes
    ----------
    columns : tuple of str
    weights : tuple of float
        Weight of each column, proportional to 1/N², which is optimal for independent white noise. Their sum is 1.
    tau : tuple of float
        Averaging times, s, one a decade.
    gain : tuple of float
        Allan deviation of the column that is best at this τ, divided by that of the mean.
    """

    columns: tuple[str, ...]
    weights: tuple[float, ...]
    tau: tuple[float, ...]
    gain: tuple[float, ...]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: columns, weights, tau_s and gain."""
        return fields_dict(self, tau="tau_s")

    def __str__(self) -> str:
        weights = ", ".join(f"{w:.2f}" for w in self.weights)
        gains = ", ".join(
            f"×{g:.2f} at {t:.3g} s" for t, g in zip(self.tau, self.gain, strict=True)
        )
        return (
            f"{', '.join(self.columns)}: averaged with the weights {weights}, their Allan deviation is lower than that of"
            f" the best one by {gains}; `allanite combine` also weights slow and shared noise"
        )


def averaged(recordings: Sequence[Recording], studies: Mapping[str, Study]) -> tuple[Averaged, ...]:
    """Weighted mean of the columns that measure one axis, for each such axis; often empty.

    Columns measure one axis if their names differ only in numbers (``gyro0_x``, ``gyro1_x``) and their units agree.
    Only columns whose model has white noise (N) take part. An axis is omitted if an N is 0, the samples are angles, or
    the record has fewer than 50 samples.
    """
    found = []
    for recording in recordings:
        groups: dict[tuple[str, str], list[str]] = {}
        for name, unit in zip(recording.columns, recording.units, strict=True):
            own = studies.get(name)
            if own is None or axis_letter(name) is None or POSITION_NAME.fullmatch(name):
                continue
            if own.fit.model.white is not None:
                groups.setdefault((re.sub(r"\d+", "#", name), unit), []).append(name)
        found += [
            _average_of(recording, names, studies) for names in groups.values() if len(names) > 1
        ]
    return tuple(one for one in found if one is not None)


def _average_of(
    recording: Recording, names: Sequence[str], studies: Mapping[str, Study]
) -> Averaged | None:
    """`Averaged` with weights proportional to 1/N², and its gain at averaging times of 1, 10, 100, … samples.

    None if an N is not above 0, the samples are angles, or the record has fewer than 50 samples.
    """
    noise = np.array([float(studies[name].fit["N"]) for name in names])
    most = recording.n // MIN_AVERAGES
    if not (noise > 0.0).all() or recording.quantity == "angle" or most < 1:
        return None
    weights = noise**-2 / np.sum(noise**-2)
    factors = [10**k for k in range(len(str(most)))]
    columns = [recording[name] for name in names]
    mean = np.sum([w * c.samples for w, c in zip(weights, columns, strict=True)], axis=0)
    one = Recording(
        mean, recording.rate, unit=columns[0].unit, quantity=recording.quantity, columns=["mean"]
    )
    own = np.array([oadev(c, factors=factors).deviation for c in columns])
    curve = oadev(one, factors=factors)
    gain = own.min(axis=0) / curve.deviation
    return Averaged(
        tuple(names), tuple(weights.tolist()), tuple(curve.tau.tolist()), tuple(gain.tolist())
    )
