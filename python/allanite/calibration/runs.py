"""Several logs (runs) of one sensor, joined into one record. Each run has its own offset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from allanite._kernels import play
from allanite.common.arrays import Array
from allanite.common.errors import InputError, TooShortError
from allanite.common.showing import brief
from allanite.recording import Recording
from allanite.recording.coarse_column import coarse_step_of, without_steps
from allanite.recording.sensor_names import role_of
from allanite.spectrum import bridge_gaps

#: Maximum relative difference of two equal sampling rates. Clocks of sensors differ by less than 1 %.
MAX_RATE_DIFFERENCE = 0.01
#: A change of direction counts if the temperature changes by more than twice this fraction of its range. Chosen by
#: judgment; not measured.
TURN_FRACTION = 1.0 / 40.0
#: Unit of a temperature → (factor, offset) of its conversion to °C.
CELSIUS = {
    "K": (1.0, -273.15),
    "degK": (1.0, -273.15),
    "F": (5 / 9, -160 / 9),
    "degF": (5 / 9, -160 / 9),
}


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """One axis of several logs (runs), joined in time, with the temperature.

    Attributes
    ----------
    recording : Recording
        One column. Its only covariate is the temperature in °C, without the steps of a coarse thermometer.
    starts : tuple of int
        First sample of each run after the first one.
    column : str
        Name of the thermometer.
    step : float
        Step of a coarse thermometer, °C; 0 for a fine one.
    rounding : ndarray, shape (n,)
        The logged temperature minus the temperature without steps, °C.
    """

    recording: Recording
    starts: tuple[int, ...]
    column: str
    step: float
    rounding: Array

    __repr__ = brief

    @property
    def temperature(self) -> Array:
        """Temperature of each sample, °C, shape (n,)."""
        return self.recording.covariates[self.column]

    def averaged(self, most: int) -> Runs:
        """Copy with averages of neighboring samples of a log, at most `most`, and zero `rounding`; may be `self`."""
        k = -(-self.recording.n // most)
        if k < 2:
            return self
        runs = [
            Recording(
                self.recording.samples[part],
                self.recording.rate,
                unit=self.recording.unit,
                covariates={self.column: self.temperature[part]},
            ).decimate(k)
            for part in self.parts
        ]
        joined = Recording(
            np.concatenate([run.samples for run in runs]),
            runs[0].rate,
            unit=self.recording.unit,
            columns=self.recording.columns,
            covariates={self.column: np.concatenate([r.covariates[self.column] for r in runs])},
        )
        starts = np.cumsum([run.n for run in runs])[:-1].tolist()
        return replace(self, recording=joined, starts=tuple(starts), rounding=np.zeros(joined.n))

    @property
    def parts(self) -> list[slice]:
        """List of `slice`, one per log: its samples in the joined record."""
        edges = [0, *self.starts, self.recording.n]
        return [slice(a, b) for a, b in pairwise(edges)]

    @property
    def direction(self) -> Array:
        """Direction of the temperature, shape (n,): ½ while it falls, −½ while it rises, in between near a reversal.

        A regression on it gives the bias while cooling minus the bias while warming.
        """
        width = TURN_FRACTION * float(np.ptp(self.temperature))
        found = [
            (play(t, width) - t) / (2.0 * width) for t in np.split(self.temperature, self.starts)
        ]
        return np.concatenate(found)

    @property
    def both_ways(self) -> tuple[float, float] | None:
        """(lowest, highest) temperature, °C, that was passed both while warming and while cooling, or None."""
        direction, t = self.direction, self.temperature
        up, down = t[direction <= -0.45], t[direction >= 0.45]
        if not up.size or not down.size:
            return None
        low, high = max(up.min(), down.min()), min(up.max(), down.max())
        return (float(low), float(high)) if high > low else None


def thermometers(recordings: Sequence[Recording], temperature: str | None) -> tuple[str, ...]:
    """Names of the temperature columns that all logs have; only `temperature` if it is given.

    A single common column counts even if nothing shows that it is a temperature. Raises `InputError` if the logs have
    no temperature column in common, or if not all have the column `temperature`.
    """
    common = [n for n in recordings[0].covariates if all(n in r.covariates for r in recordings)]
    if temperature is not None:
        if temperature not in common:
            raise InputError(
                f"not every log has a column {temperature!r} (columns in all logs: {', '.join(common) or 'none'})"
            )
        return (temperature,)
    units = recordings[0].covariate_units
    found = [n for n in common if role_of(n, units.get(n)) == "temperature"]
    found = found or (common if len(common) == 1 else [])
    if not found:
        raise InputError(
            f"no temperature column was found in every log (other columns: {', '.join(common) or 'none'})",
            missing="covariate",
            remedy=": name it with {covariate}",
        )
    return tuple(found)


def join(columns: Sequence[Recording], thermometer: str) -> Runs:
    """`Runs`: the same column of several logs, joined into one record, with the temperature in °C.

    Missing temperatures are interpolated, and coarse steps of the thermometer are smoothed. Raises `InputError` if the
    sampling rates differ by over 1 %, or the temperature is missing at more than half of the samples. Raises
    `TooShortError` if the temperature never changes.
    """
    first = columns[0]
    samples, temperatures, logged, steps = [], [], [], []
    for own in columns:
        if abs(own.rate / first.rate - 1.0) > MAX_RATE_DIFFERENCE:
            raise InputError(
                f"{own.path or 'a log'}: {own.rate:g} Hz, but {first.path or 'the first log'} has {first.rate:g} Hz",
                missing="decimate",
                remedy=": bring both to one rate with {decimate}",
            )
        values = np.asarray(own.covariates[thermometer], dtype=np.float64)
        if np.count_nonzero(np.isfinite(values)) < 0.5 * values.size:
            raise InputError(
                f"{own.path or 'a log'}: {thermometer} is missing at more than half of the samples"
            )
        factor, offset = CELSIUS.get(own.covariate_units.get(thermometer, ""), (1.0, 0.0))
        values = factor * bridge_gaps(values) + offset
        steps.append(coarse_step_of(values))
        temperatures.append(without_steps(values))
        samples.append(np.asarray(own.to(first.unit).rate_samples(), dtype=np.float64))
        # Angles become rates by differences, which are one fewer than the angles.
        temperatures[-1] = temperatures[-1][-samples[-1].size :]
        logged.append(values[-samples[-1].size :])
    temperature = np.concatenate(temperatures)
    if not float(np.ptp(temperature)) > 0.0:
        raise TooShortError(
            f"{thermometer} is always {temperature[0]:g}: record a log while the temperature changes"
        )
    starts = np.cumsum([s.size for s in samples])[:-1]
    joined = Recording(
        np.concatenate(samples),
        first.rate,
        unit=first.unit,
        columns=first.columns,
        covariates={thermometer: temperature},
        covariate_units={thermometer: "degC"},
        path=first.path,
    )
    rounding = np.concatenate(logged) - temperature
    return Runs(joined, tuple(starts.tolist()), thermometer, max(steps), rounding)
