"""Allan deviation and its relatives of a record, of windows along it, and of a stream.

Input: samples with a rate, or chunks of a stream. Output: averaging times, deviations, intervals and degrees of
freedom (`Deviation`). Add a deviation as a kernel in `rust/deviation/` and a row in `estimators.py`.
"""

from __future__ import annotations

from allanite.deviation.accumulator import Accumulator
from allanite.deviation.columns import Deviations, deviations
from allanite.deviation.dynamic import DynamicDeviation, dynamic_oadev
from allanite.deviation.estimators import (
    adev,
    hdev,
    htotdev,
    mdev,
    mtie,
    mtotdev,
    oadev,
    ohdev,
    pdev,
    tdev,
    tierms,
    totdev,
    ttotdev,
)
from allanite.deviation.result import Deviation
from allanite.deviation.table import ESTIMATORS, Estimator, estimator_named
from allanite.deviation.theo import theo1, theoh

__all__ = [
    "ESTIMATORS",
    "Accumulator",
    "Deviation",
    "Deviations",
    "DynamicDeviation",
    "Estimator",
    "adev",
    "deviations",
    "dynamic_oadev",
    "estimator_named",
    "hdev",
    "htotdev",
    "mdev",
    "mtie",
    "mtotdev",
    "oadev",
    "ohdev",
    "pdev",
    "tdev",
    "theo1",
    "theoh",
    "tierms",
    "totdev",
    "ttotdev",
]
