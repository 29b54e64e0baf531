"""Fits of one model to several columns of a recording."""

from __future__ import annotations

import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.common.files import write_text
from allanite.common.former import Former
from allanite.common.several import Several
from allanite.fit.result import Fit
from allanite.fit.several.many import ManyFits, of_fits

if TYPE_CHECKING:
    from allanite.suggestion import Check


class Fits(Several[Fit]):
    """Fits of one model to several columns, by column name.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((5000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> fits = al.fit_columns(log, "N")
    >>> round(fits["gyro_x"]["N"].value, 2), fits.pooled[0].agree, fits.check()["gyro_x"].adequate
    (0.1, True, True)
    >>> sorted(fits.to_dict())
    ['columns', 'pooled', 'schema']
    >>> fits.save("fits.json")
    """

    together = Former("pooled")

    @cached_property
    def pooled(self) -> tuple[ManyFits, ...]:
        """Tuple of `ManyFits`: pooled coefficients for each group of at least two columns with the same unit and model."""
        groups: dict[tuple[str, str], list[Fit]] = {}
        for fit in self.values():
            groups.setdefault((fit.recording.unit, fit.model.name), []).append(fit)
        return tuple(of_fits(group) for group in groups.values() if len(group) > 1)

    def check(self) -> Several[Check]:
        """`Several` (a mapping) from the name of each column to the `Check` of its fit."""
        return Several({name: fit.check() for name, fit in self.items()})

    def _missing(self, name: str) -> str:
        """Message of the KeyError for an unknown column `name`; for a parameter it explains how to access it."""
        first = next(iter(self))
        effects = self[first].model
        if name in effects.labels and name not in {p.name for e in effects for p in e.parameters}:
            return f"{len(self)} columns were fitted; use fit[{first!r}].estimates_of({name!r})"
        try:
            self[first][name]
        except KeyError:
            return super()._missing(name)
        return f"{len(self)} columns were fitted; use fit[{first!r}][{name!r}]"

    def to_dict(self) -> dict[str, Any]:
        """Dict (JSON form) with ``schema``, ``columns`` and ``pooled`` (an entry for each unit and model of several)."""
        return {**super().to_dict(), "pooled": [many.pooled_dict() for many in self.pooled]}

    def save(self, path: str | Path) -> None:
        """Write the fits, without pooled values, to `path` as JSON.

        ``--model``, `allanite simulate`, `compare` and `export` can read the file.
        """
        write_text(path, json.dumps(super().to_dict(), indent=1) + "\n")

    def __str__(self) -> str:
        return "\n\n".join([super().__str__(), *map(str, self.pooled)])
