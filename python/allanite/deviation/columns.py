"""Deviations of several columns of a recording as one object."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeGuard

from allanite import _kernels
from allanite.common import verbs
from allanite.common.several import Several, by_column
from allanite.deviation.result import Deviation
from allanite.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Deviations", "deviations", "has_columns"]


class Deviations(Several[Deviation]):
    """A deviation a column, by its name.

    Parameters
    ----------
    recording : Recording
        Of several columns.
    results : mapping of str to Deviation
    """

    def __init__(self, recording: Recording, results: dict[str, Deviation]) -> None:
        super().__init__(results)
        self.recording = recording

    def document(self, column: str) -> dict[str, Any]:
        """``allanite/adev/1`` of one column."""
        head = {"schema": "allanite/adev/1", "version": _kernels.version()}
        told = self.recording.column(column).describe()
        return {**head, "recording": told, **self[column].to_dict()}

    plot = verbs.deviations_plot


def deviations(recording: Recording, compute: Callable[[Recording], Deviation]) -> Deviations:
    """What an estimator makes of each column."""
    return Deviations(recording, by_column(recording, compute))


def has_columns(x: object) -> TypeGuard[Recording]:
    """Whether it is a recording of several columns."""
    return isinstance(x, Recording) and len(x.columns) > 1
