"""Fits of one model to several columns of a recording, as one object."""

from __future__ import annotations

import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.common.files import whole_file
from allanite.common.several import Several
from allanite.fit.result import Fit

if TYPE_CHECKING:
    from allanite.fit.several.many import ManyFits
    from allanite.suggestion import Check

__all__ = ["Fits"]


class Fits(Several[Fit]):
    """A fit of each column, by its name.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((5000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> fits = al.fit_columns(log, "N")
    >>> round(fits["gyro_x"]["N"].value, 2), fits.together[0].agree, fits.check()["gyro_x"].adequate
    (0.1, True, True)
    >>> sorted(fits.to_dict())
    ['columns', 'pooled', 'schema']
    >>> fits.save("fits.json")
    """

    @cached_property
    def together(self) -> tuple[ManyFits, ...]:
        """Columns of one unit and model pooled, and whether they agree."""
        from allanite.fit.several.many import of_fits

        groups: dict[tuple[str, str], list[Fit]] = {}
        for fit in self.values():
            groups.setdefault((fit.recording.unit, fit.model.name), []).append(fit)
        return tuple(of_fits(group) for group in groups.values() if len(group) > 1)

    def check(self) -> Several[Check]:
        """Where each column's model fails and what it lacks."""
        return Several({name: fit.check() for name, fit in self.items()})

    def _missing(self, name: str) -> str:
        first = next(iter(self))
        try:
            self[first][name]
        except KeyError:
            return super()._missing(name)
        return f"{len(self)} columns were fitted; use fit[{first!r}][{name!r}]"

    def to_dict(self) -> dict[str, Any]:
        """``columns`` of the contract, and ``pooled``, one entry a unit."""
        return {**super().to_dict(), "pooled": [many.pooled_dict() for many in self.together]}

    def save(self, path: str | Path) -> None:
        """Write the fits to `path` as JSON, which ``--model``, `allanite simulate`, `compare` and `export` read back."""
        with whole_file(path) as draft:
            draft.write_text(json.dumps(super().to_dict(), indent=1) + "\n", encoding="utf-8")

    def __str__(self) -> str:
        return "\n\n".join([super().__str__(), *map(str, self.together)])
