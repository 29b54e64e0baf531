"""Deviations of several columns of a recording in one object."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.common.several import Several, results_by_column
from allanite.deviation.result import Deviation
from allanite.deviation.table import estimator_named

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike

    from allanite.deviation.averaging import Taus
    from allanite.plots import Figure
    from allanite.recording import Recording


class Deviations(Several[Deviation]):
    """Deviation of each column, by its name.

    Parameters
    ----------
    recording : Recording
        Recording with several columns.
    results : mapping of str to Deviation

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((1000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> found = log.deviations()
    >>> len(found.plot().panels), found.document("gyro_x")["kind"]
    (1, 'oadev')
    """

    def __init__(self, recording: Recording, results: dict[str, Deviation]) -> None:
        super().__init__(results)
        self.recording = recording

    def document(self, column: str) -> dict[str, Any]:
        """Dict for JSON of one column: schema ``allanite/adev/1``, version, recording, and the deviation's `to_dict`."""
        head = {"schema": "allanite/adev/1", "version": _kernels.version()}
        description = self.recording.column(column).describe()
        return {**head, "recording": description, **self[column].to_dict()}

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the curves of all columns, one panel for each kind of sensor.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        curves = al.comparison.curves_of_deviations(self)
        return al.plots.plot_compare(curves, path, theme, "Columns")


def deviations(
    recording: Recording,
    kind: str = "oadev",
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
) -> Deviations:
    """Deviation of each column of a recording.

    Parameters
    ----------
    recording : Recording
        One or more columns.
    kind : str
        Name of the estimator: ``oadev``, ``mdev``, ``hdev``, … (a key of `allanite.deviation.ESTIMATORS`).
    taus, factors
        As of `allanite.oadev`.

    Returns
    -------
    Deviations
        A mapping from the name of a column to its `Deviation`.

    Raises
    ------
    InputError
        Unknown kind, or as of `allanite.oadev`.
    TooShortError
        As of `allanite.oadev`.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((1000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> found = al.deviations(log, "mdev", taus=[1.0])
    >>> list(found), found["gyro_x"].tau
    (['gyro_x', 'gyro_y'], array([1.]))
    """
    from allanite import deviation

    estimate = getattr(deviation, estimator_named(kind).name)
    return Deviations(
        recording,
        results_by_column(recording, lambda one: estimate(one, taus=taus, factors=factors)),
    )
