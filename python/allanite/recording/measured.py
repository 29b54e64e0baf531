"""Samples that a sensor measured: without no-data markers and without samples that repeat the previous one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.numbers import percent_text
from allanite.recording.findings import Finding, stamp_findings
from allanite.recording.repeats import polling_of
from allanite.recording.resolution import step_of

if TYPE_CHECKING:
    from allanite.recording.recording import Recording

#: Codes that loggers write for "no data": ends of signed and unsigned integers, in units of the least step.
TYPE_ENDS = frozenset(
    float(code)
    for bits in (8, 12, 16, 20, 24, 32)
    for code in (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1, 2**bits - 1)
)
#: Values that loggers write for "no data" whatever the step is: the largest single-precision number and rows of nines.
FILL_VALUES = frozenset(
    {float(np.finfo(np.float32).max), 1e20, 999.0, 9999.0, 99999.0, 32767.0, 32768.0}
)
#: Minimum distance of a marker from the median, in standard deviations of the other samples. Student noise with three
#: degrees of freedom exceeds 30 σ once in 300 000 samples; the gap and the repetition below make this rarer still.
MIN_DISTANCE = 30.0
#: Minimum ratio of the distance of a marker to that of the most distant other sample on its side. Samples that exceed the
#: range pass through the values between; markers do not.
MIN_GAP = 2.0
#: Minimum number of samples with the same value that are a marker if the value is no end of a type. Three independent
#: outliers have the same value by chance in less than 1e-4 of the records where 30 σ hold a hundred steps or more.
MIN_COUNT = 3
#: Maximum share of markers: where more samples have one value, the value is a state of the sensor.
MAX_SHARE = 0.2
#: Minimum number of different values among the other samples; fewer are a status, not a measurement.
MIN_VALUES = 3
#: Samples from which the step is computed.
STEP_SAMPLES = 1 << 16


def measured_samples(recording: Recording) -> Recording:
    """Recording with no-data markers replaced by NaN and without repeated samples; the same object if it has neither.

    Repeated rows are removed only from rates, and only if a sensor is logged faster than it measures: at least 2 % of
    the rows, all over the record, repeat the row before. The result then has the rate of the sensor. Stuck values and
    rows that are equal by chance remain.
    """
    return _without_repeats(_without_markers(recording))


def _without_markers(recording: Recording) -> Recording:
    """`Recording` with NaN in place of no-data markers, and a finding for each marker; the same object without markers."""
    found: list[Finding] = []
    samples: NDArray[Any] | None = None
    for at, name in enumerate(recording.columns):
        x = recording.samples if recording.samples.ndim == 1 else recording.samples[:, at]
        for marker in markers_of(x):
            if samples is None:
                single = recording.samples.dtype == np.float32
                samples = np.array(recording.samples, np.float32 if single else np.float64)
            column = samples if samples.ndim == 1 else samples[:, at]
            column[x == marker.value] = np.nan
            found.append(_marker_finding(name, marker, recording.units[at]))
    if samples is None:
        return recording
    return recording.with_samples(samples).with_findings(found)


def _marker_finding(column: str, marker: Marker, unit: str) -> Finding:
    """Warning that a column has a no-data marker, with the value (in `unit`) and number of samples."""
    several = marker.count > 1
    what = f", {marker.type_end}" if marker.type_end else ", far from all other samples"
    unit = "" if unit == "1" else f" {unit}"
    found = (
        f"{column}: {marker.count} sample{'s' * several} of {marker.value:.6g}{unit}{what}:"
        f" no-data marker{'s' * several}, excluded"
    )
    return Finding(
        "marker", "warning", found, column, {"value": marker.value, "count": marker.count}
    )


def _without_repeats(recording: Recording) -> Recording:
    """`Recording` without repeated rows, at the rate of the sensor, with a finding; unchanged without such rows.

    Increments and angles are unchanged, too.
    """
    # Increments and angles of a held rate do not repeat, so they are not changed.
    if recording.quantity != "rate":
        return recording
    polling = polling_of(recording.samples)
    if polling is None:
        return recording
    rate = recording.rate * polling.ratio
    found = (
        f"{rate:.4g} Hz sensor read at {recording.rate:.4g} Hz: {percent_text(polling.share, 1)} of the samples repeat"
        " the one before; the repeats are removed, so N is that of the sensor"
    )
    values = {"share": polling.share, "sensor_hz": rate, "read_hz": recording.rate}
    kept = recording.with_rows(polling.kept, rate)
    stamps = (
        [] if recording.stamps is None else list(stamp_findings(recording.stamps, recording.rate))
    )
    return kept.with_findings([*stamps, Finding("repeats", "warning", found, values=values)])


@dataclass(frozen=True, slots=True)
class Marker:
    """A value (in the unit of the samples) that stands for missing samples, and their count.

    `type_end` is ``"the smallest 16-bit integer"`` or the like; empty if the value is no end of a type.
    """

    value: float
    count: int
    type_end: str


def markers_of(x: NDArray[np.floating | np.integer]) -> list[Marker]:
    """No-data markers among the samples of one column: none, one or two.

    A marker is the smallest or the largest value, far beyond all other samples. It must be the smallest or largest
    number of an integer type, a fill value such as 9999, or occur at least three times. Empty for fewer than 20 finite
    samples.
    """
    found: list[Marker] = []
    values = x[np.isfinite(x)] if x.dtype.kind == "f" else x
    if values.size < 20:
        return found
    low, high = float(values.min()), float(values.max())
    for edge in (low, high):
        # Sums and squares of samples above 1e154 are infinite: such samples have no marker.
        with np.errstate(over="ignore", invalid="ignore"):
            marker = _marker_at(values, edge)
        if marker is not None:
            found.append(marker)
    return found


def _marker_at(values: NDArray[np.floating | np.integer], edge: float) -> Marker | None:
    """`Marker` if the extreme value `edge` stands for missing samples, else None.

    Its distance from the median is at least 30 standard deviations and twice that of the other samples on its side. At
    most 20 % of the samples have it.
    """
    some = values[:: max(1, values.size // STEP_SAMPLES)].astype(np.float64)
    middle = float(np.median(some))
    quarter, three_quarters = np.quantile(some, [0.25, 0.75])
    spread = float(three_quarters - quarter) / 1.349
    distance = abs(edge - middle)
    # Most records end here: their extremes are near the other samples.
    if not 0.0 < distance < math.inf or distance < MIN_DISTANCE * spread:
        return None
    at = values == edge
    count = int(np.count_nonzero(at))
    if count > MAX_SHARE * values.size:
        return None
    rest = values[~at]
    same_side = rest[rest > middle] if edge > middle else rest[rest < middle]
    reach = float(np.abs(same_side - middle).max()) if same_side.size else 0.0
    deviation = float(np.std(rest, dtype=np.float64))
    if distance < MIN_GAP * reach or distance < MIN_DISTANCE * deviation:
        return None
    if np.unique(rest[:STEP_SAMPLES]).size < MIN_VALUES:
        return None
    end = _type_end(rest, edge)
    if not end and abs(edge) not in FILL_VALUES and count < MIN_COUNT:
        return None
    return Marker(edge, count, end)


def _type_end(rest: NDArray[np.floating | np.integer], edge: float) -> str:
    """Text such as ``"the smallest 16-bit integer"`` if `edge` is such a multiple of the step of `rest`, else empty."""
    some = rest[:STEP_SAMPLES].astype(np.float64)
    single = bool(np.array_equal(some.astype(np.float32), some))
    step = 1.0 if rest.dtype.kind in "iu" else step_of(some, single)
    if step == 0.0:
        return ""
    code = edge / step
    # The step of printed samples is known to some parts in a million of the code.
    nearest = float(np.rint(code))
    if abs(code - nearest) > max(0.02, 3e-6 * abs(code)) or nearest not in TYPE_ENDS:
        return ""
    bits = math.ceil(math.log2(abs(nearest)))
    if nearest < 0:
        return f"the smallest {bits + 1}-bit integer"
    signed = bits + 1 in (8, 12, 16, 20, 24, 32)
    return f"the largest {bits + 1 if signed else bits}-bit integer"
