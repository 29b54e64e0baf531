"""Allan deviation and its relatives of a record, of windows along it, and of a stream."""

from __future__ import annotations

from allanite.deviation.functions import (
    Deviation,
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

__all__ = [
    "Deviation",
    "adev",
    "hdev",
    "htotdev",
    "mdev",
    "mtie",
    "mtotdev",
    "oadev",
    "ohdev",
    "pdev",
    "tdev",
    "tierms",
    "totdev",
    "ttotdev",
]
