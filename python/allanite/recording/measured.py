"""Samples that a sensor measured: without no-data markers and without samples that repeat the previous one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.numbers import percent_text
from allanite.recording.findings import Finding, stamp_findings
from allanite.recording.markers import Marker, markers_of
from allanite.recording.recording import Recording
from allanite.recording.repeats import polling_of


def measured_samples(recording: Recording) -> Recording:
    """Recording with no-data markers replaced by NaN and without repeated samples; the same object if it has neither.

    Repeated rows are removed only from rates, and only if a sensor is logged faster than it measures. The result then has
    the rate of the sensor. Stuck values and rows that are equal by chance remain.
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
    """`Recording` without repeated rows, at the rate of the sensor, with a finding; unchanged without such rows."""
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
