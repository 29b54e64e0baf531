"""Knowledge about one column of a log, and the source of each part of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from allanite.common.documents import fields_dict

#: Sources of a fact about a column, the most certain one first.
SOURCES = ("header", "file", "option", "guess")


@dataclass(frozen=True, slots=True)
class LogColumn:
    """One column of a log: its role and unit, whether it is used, and the source of each.

    Attributes
    ----------
    name : str
        Name in the log; x0, x1, … in a log without names.
    role : str
        ``"time"``, ``"sensor"``, ``"temperature"`` or ``"other"``. A used column with the role ``"other"`` is a logged
        column that the option `covariate` names.
    used : bool
        True if the column is read as samples, as time or as a covariate.
    unit : str or None
        Unit of the numbers in the log; None if neither the log nor an option states it.
    scale : float
        Factor that is applied to the numbers of the log: 1e-9 for a phase in ns, which is read in s.
    rate : float or None
        Sampling rate of the column, Hz; None if it is unknown or the column is not used.
    reason : str
        Why the column is not used; empty for a column that is used.
    sources : mapping of str to str
        Source of ``"name"``, ``"role"``, ``"unit"``, ``"scale"`` and ``"rate"``: ``"header"``, ``"file"``, ``"option"``
        or ``"guess"``. A missing key means that the fact is unknown.
    """

    name: str
    role: str
    used: bool
    unit: str | None = None
    scale: float = 1.0
    rate: float | None = None
    reason: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)

    @property
    def source(self) -> str:
        """Least certain source of the role, the unit and the scale: ``header``, ``file``, ``option`` or ``guess``."""
        known = [self.sources[key] for key in ("role", "unit", "scale") if key in self.sources]
        return max(known, key=SOURCES.index, default="guess")

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with all attributes; `source` has the key ``from``."""
        return fields_dict(self) | {"from": self.source}
