"""Error for samples that nearly always have the same code, with the upper limit of the noise that they allow."""

from __future__ import annotations

import numpy as np

from allanite.common.errors import TooShortError
from allanite.common.numbers import percent_text
from allanite.common.parameters import Estimate
from allanite.common.printing import printed
from allanite.common.units import coefficient_unit
from allanite.effects import standard
from allanite.effects.sheet_units import in_sheet_unit
from allanite.recording import Recording
from allanite.recording.locked import locked_of


def locked_error(column: Recording) -> TooShortError | None:
    """`TooShortError` (returned, not raised) for a column of rates in which nearly all samples have one code; else None."""
    if column.quantity != "rate":
        return None
    locked = locked_of(column.samples)
    if locked is None:
        return None
    unit = "" if column.unit == "1" else f" {column.unit}"
    found = (
        f"{column.columns[0]}: {percent_text(locked.share, 1)} of the samples have one code, so rounding"
        f" (step {locked.step:.4g}{unit})"
        f" hides the noise; no estimate is possible"
    )
    if np.isfinite(locked.most):
        density = locked.most / np.sqrt(column.rate)
        declared = standard()["N"].parameter("N")
        limit = Estimate(density, None, (0.0, density), coefficient_unit(column.unit, 0.5))
        limit = in_sheet_unit(limit, declared)
        found += f", only N < {float(limit):.3g} {printed(limit.unit)} (95 %) for white noise"
    return TooShortError(found, remedy="; log with a finer step or more noise")
