"""Recording: samples of a sensor with rate, units, column names, covariates and gaps. Immutable; owns its array."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.aligned import with_aligned_arrays
from allanite.common.arrays import Array
from allanite.common.errors import InputError, about
from allanite.common.former import Former
from allanite.common.showing import recording_html
from allanite.common.units import rate_unit
from allanite.common.validation import positive_rate, require_quantity, sample_index
from allanite.recording import samples as arrays
from allanite.recording.findings import Finding, stamp_findings
from allanite.recording.measured import measured_samples
from allanite.recording.record import Record
from allanite.recording.samples import (
    column_names,
    find_column,
    group_means,
    private_array,
    read_only,
    stamps_of_index,
)
from allanite.recording.timebase import Stamps, epoch_of, fill_gaps, read_stamps, uneven_times

if TYPE_CHECKING:
    from allanite.deviation import Deviation, Deviations
    from allanite.deviation.averaging import Taus
    from allanite.plots import Figure
    from allanite.recording.log_column import LogColumn
    from allanite.recording.motion import Motion
    from allanite.spectrum import Spectrum

#: Fields that are computed from the others at the first access.
COMPUTED = ("_audit", "_measured", "_motion")


@dataclass(frozen=True, slots=True, weakref_slot=True, init=False, eq=False, repr=False)
class Recording(Record):
    """Samples at a constant rate, with what is known about them.

    Parameters
    ----------
    samples : array_like of shape (n,) or (n, columns)
        Samples in `unit`; integers stay integers, NaN marks a missing sample.
        A pint quantity has its own unit.
    rate : float, optional
        Sampling rate, Hz; by default computed from `time`.
    time : array_like of shape (n,), optional
        Time stamps, numbers or date-times; by default the index of a pandas or xarray object, if it is a time.
        Gaps become NaN rows on the regular grid.
    unit : str or sequence of str
        Unit of the rate (or of each column's): ``deg/s``, ``m/s^2``, ``1``, …
    quantity : {"rate", "increment", "angle"}
        Quantity of the samples: the rate itself, its integral over one sample, or its integral from
        the start (the phase of a clock).
    columns : sequence of str, optional
        Names of the columns.
    covariates : mapping of str to array_like of shape (n,), optional
        Columns that may explain the samples, e.g. a temperature.
    path : str or Path, optional
        Source of the samples.
    covariate_units : mapping of str to str, optional
        Units of the covariates, free text.
    time_unit : {"s", "ms", "us", "ns", "min", "h", "d"}, optional
        Unit of `time`; by default guessed from its magnitude, which the audit reports.
    piece : int, optional
        Segment to use if jumps of time split the record, counted from 1; by default the segment with
        most samples, which the audit reports.

    Raises
    ------
    InputError
        A rate that is missing or not positive, an unknown unit or quantity, infinite samples,
        or different lengths.
    TooShortError
        No samples, or only NaN.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(0.1, 0.02, (6000, 2))
    >>> recording = al.Recording(x, rate=100, unit="deg/s", columns=["gx", "gy"])
    >>> recording
    Recording(gx, gy: 6000 samples at 100 Hz (60 s) in deg/s)
    >>> gx, gy = recording["gx"], recording.column("gy")
    >>> gx.to("deg/h").unit, gx.decimate(10).rate, gx.trim(10.0, 20.0).n, gx.half(0).n, gx.quiet().n
    ('deg/h', 10.0, 1000, 3000, 6000)
    >>> gx.recording() is gx  # a summary makes a recording of its samples
    True
    >>> gx.oadev().tau.size, gx.psd().density.size > 10, gx.rate_samples().shape, gx.describe()["n"]
    (12, True, (6000,), 6000)
    >>> list(recording.deviations("mdev"))
    ['gx', 'gy']
    >>> recording.in_units({"gx": "rad/s"}).units, recording.with_path("a.csv").path
    (('rad/s', 'deg/s'), 'a.csv')
    >>> found = al.Recording([*x[:, 0], 9.0], rate=100, unit="deg/s").audit
    >>> gx.with_findings(found).audit[0].kind
    'outliers'
    >>> gx.with_rows(np.arange(6000) % 2 == 0, 50.0).duration, gx.with_samples(2 * gx.samples).n
    (60.0, 6000)
    >>> recording.seconds()[:3]
    array([0.  , 0.01, 0.02])
    >>> figure = recording.plot("samples.svg")
    """

    samples: NDArray[Any]
    rate: float
    units: tuple[str, ...]
    quantity: str
    columns: tuple[str, ...]
    covariates: Mapping[str, Array]
    covariate_units: Mapping[str, str]
    path: str | None
    stamps: Stamps | None
    epoch: float | None
    times: Array | None
    added_findings: tuple[Finding, ...]
    log_columns: tuple[LogColumn, ...]
    _audit: list[Finding] | None
    _measured: Recording | bool | None
    _motion: Motion | bool | None

    def __init__(
        self,
        samples: ArrayLike,
        rate: float | None = None,
        *,
        time: ArrayLike | None = None,
        unit: str | Sequence[str] = "1",
        quantity: str = "rate",
        columns: Sequence[str] | None = None,
        covariates: Mapping[str, ArrayLike] | None = None,
        path: str | Path | None = None,
        covariate_units: Mapping[str, str] | None = None,
        time_unit: str | None = None,
        piece: int | None = None,
    ) -> None:
        with about(path):
            require_quantity(quantity)
            if hasattr(samples, "magnitude") and hasattr(samples, "units"):  # a pint quantity
                samples, unit = arrays.from_pint(samples, unit)
            if columns is None and hasattr(samples, "columns"):  # a pandas or polars frame
                columns = [str(name) for name in samples.columns]
            index = stamps_of_index(samples)
            array = private_array(samples, columns)
            if array.ndim == 2 and array.shape[1] == 1:
                array = array[:, 0]
            n = array.shape[0]
            names = column_names(columns, array)
            extra = {
                name: arrays.covariate_of(name, values, n)
                for name, values in (covariates or {}).items()
            }
            stamps, epoch, times = None, None, None
            time = index if time is None else time
            if time is not None:
                stamps = read_stamps(time, time_unit, rate, piece)
                if stamps.n != n:
                    raise InputError(f"{stamps.n} time stamps for {n} samples")
                epoch, times = epoch_of(time, stamps), uneven_times(time, stamps)
                array = fill_gaps(array, stamps)
                extra = {k: np.asarray(fill_gaps(v, stamps), float) for k, v in extra.items()}
            if rate is None:
                if stamps is None:
                    raise InputError(
                        "no sampling rate",
                        missing="rate",
                        remedy=": give {rate} or a time column",
                    )
                rate = stamps.rate
            rate = positive_rate(rate)
            self._set_fields(
                samples=read_only(array),
                rate=rate,
                units=arrays.unit_names(unit, quantity, len(names)),
                quantity=quantity,
                columns=names,
                covariates=MappingProxyType({name: read_only(v) for name, v in extra.items()}),
                covariate_units=MappingProxyType(dict(covariate_units or {})),
                path=None if path is None else str(path),
                stamps=stamps,
                epoch=epoch,
                times=None if times is None else read_only(times),
                added_findings=(),
                log_columns=(),
                _audit=None,
                _measured=None,
                _motion=None,
            )

    def _set_fields(self, **fields: Any) -> None:
        """Set the given fields of this frozen object."""
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def _with(self, **changes: Any) -> Recording:
        """Copy of the recording with the fields in `changes`, unchecked; cached results such as the audit are dropped."""
        other = object.__new__(Recording)
        same = {field.name: getattr(self, field.name) for field in fields(self)}
        computed = dict.fromkeys(COMPUTED)
        other._set_fields(**{**same, **computed, **changes})
        return other

    def in_units(self, units: Mapping[str, str]) -> Recording:
        """Recording whose columns have the units in `units` (column name to unit); samples are not converted.

        Other columns keep their unit. Raises `InputError` for an unknown unit.
        """
        declared_units = [units.get(c, u) for c, u in zip(self.columns, self.units, strict=True)]
        names = tuple(rate_unit(text, self.quantity).name for text in declared_units)
        return self if names == self.units else self._with(units=names)

    told_of = Former("with_findings")
    told = Former("added_findings")
    called = Former("with_path")
    whole = Former("keeps_all_samples")

    def with_findings(
        self, findings: Sequence[Finding], log_columns: Sequence[LogColumn] | None = None
    ) -> Recording:
        """Recording with additional findings, which its audit reports, and optionally with the columns of its log.

        Parameters
        ----------
        findings : sequence of Finding
            Findings to add.
        log_columns : sequence of LogColumn, optional
            Every column of the log, used or not.
        """
        columns = self.log_columns if log_columns is None else tuple(log_columns)
        return self._with(
            added_findings=(*self.added_findings, *findings),
            log_columns=columns,
            _motion=self._motion,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        state = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in COMPUTED}
        state["covariates"] = dict(self.covariates)
        state["covariate_units"] = dict(self.covariate_units)
        return (recording_of_fields, (state,))

    # -- what it is ------------------------------------------------------------------------------

    @property
    def n(self) -> int:
        """Number of samples of each column, with missing samples."""
        return int(self.samples.shape[0])

    @property
    def keeps_all_samples(self) -> bool:
        """Always True."""
        return True

    def recording(self) -> Recording:
        """The recording itself, as `Summary.recording` gives one."""
        return self

    @property
    def missing(self) -> int:
        """Number of rows in which a sample is missing."""
        return int(np.count_nonzero(self._missing_rows()))

    @property
    def gaps(self) -> int:
        """Number of gaps: runs of consecutive rows in which at least one column lacks its sample."""
        holes = self._missing_rows()
        return int(holes[0]) + int(np.count_nonzero(holes[1:] & ~holes[:-1])) if holes.size else 0

    def _missing_rows(self) -> NDArray[np.bool_]:
        """Mask of rows in which at least one column lacks a sample (NaN), shape (n,); all False for integers."""
        if self.samples.dtype.kind != "f":
            return np.zeros(self.n, dtype=bool)
        holes = np.isnan(self.samples)
        return holes if holes.ndim == 1 else holes.any(axis=1)

    @property
    def audit(self) -> list[Finding]:
        """List of `Finding` about the data; nothing is repaired.

        The findings are computed at the first access. Each access returns a new list of them.
        """
        if self._audit is None:
            from allanite.recording.audit import audit

            self._set_fields(_audit=audit(self))
        return list(self._audit or [])

    @property
    def measured(self) -> Recording:
        """Recording of what the sensor measured: no-data markers become NaN, and repeated samples are removed. Cached.

        A recording without markers and repeats is returned itself. Every fit uses these samples, and the audit reports
        the changes.
        """
        if self._measured is None:
            found = measured_samples(self)
            self._set_fields(_measured=True if found is self else found)
            if found is not self:
                found._set_fields(_measured=True)
        return self._measured if isinstance(self._measured, Recording) else self

    @property
    def motion(self) -> Motion | None:
        """`Motion` of gyroscopes and accelerometers; computed at the first access.

        None for other sensors, for angles, and for fewer than 100 samples or 0.4 s.
        """
        if self._motion is None:
            from allanite.recording.motion import motion_of

            self._set_fields(_motion=motion_of(self) or False)
        return None if isinstance(self._motion, bool) else self._motion

    def seconds(self) -> Array:
        """Time of each sample since the first, s, shape (n,): from uneven time stamps if known, else from the rate."""
        return np.arange(self.n) / self.rate if self.times is None else self.times

    def with_samples(self, samples: NDArray[Any]) -> Recording:
        """Recording whose samples are replaced by `samples` of the same shape, which become read-only.

        Nothing is checked.
        """
        return self._with(samples=read_only(samples))

    def with_rows(self, rows: NDArray[np.bool_], rate: float) -> Recording:
        """`Recording` of the rows where the mask `rows` is True, at the rate `rate` (Hz), without `stamps`."""
        extra = {name: read_only(values[rows]) for name, values in self.covariates.items()}
        kept = read_only(self.samples[rows])
        times = None if self.times is None else read_only(self.times[rows])
        columns = MappingProxyType(extra)
        return self._with(samples=kept, rate=rate, stamps=None, times=times, covariates=columns)

    # -- parts of it -----------------------------------------------------------------------------

    def column(self, name: str | int) -> Recording:
        """Recording of one column, by `name` or index.

        Raises
        ------
        InputError
            There is no such column; the names are listed.
        """
        return self._with_columns([find_column(name, self.columns)])

    def __getitem__(self, columns: str | int | Sequence[str | int]) -> Recording:
        """Recording of one column, ``recording["gyro_x"]``, or of several, ``recording[["gyro_x", "gyro_y"]]``.

        The columns are in the order of the names. Raises `InputError` for an unknown column and for an empty list.
        """
        names = (columns,) if isinstance(columns, (str, int)) else columns
        if not names:
            raise InputError(f"no column is named: there are {', '.join(self.columns)}")
        return self._with_columns([find_column(name, self.columns) for name in names])

    def _with_columns(self, places: list[int]) -> Recording:
        """Recording of the columns with these indices, in their order; for one index, samples of shape (n,)."""
        kept = self.samples
        if kept.ndim > 1:
            kept = read_only(
                np.ascontiguousarray(kept[:, places[0] if len(places) == 1 else places])
            )
        names, units = zip(*((self.columns[i], self.units[i]) for i in places), strict=True)
        return self._with(samples=kept, columns=names, units=units)

    def __iter__(self) -> Iterator[Recording]:
        """Yield the columns, each a recording of its own."""
        return (self.column(i) for i in range(len(self.columns)))

    def trim(self, start_s: float | None = None, end_s: float | None = None) -> Recording:
        """Recording of the samples from `start_s` to `end_s`, s since the first sample; None is the start or end.

        Raises `InputError` if the range holds no sample.
        """
        first = 0 if start_s is None else max(sample_index(start_s, self.rate), 0)
        last = self.n if end_s is None else min(sample_index(end_s, self.rate), self.n)
        if last <= first:
            raise InputError(
                f"from {start_s or 0:g} s to {self.duration if end_s is None else end_s:g} s there are no samples:"
                f" the record is {self.duration:g} s long"
            )
        return self._rows(slice(first, last))

    def quiet(self) -> Recording:
        """`Recording` of the longest segment at rest, with a finding.

        Raises `TooShortError` if no segment is quiet, and `InputError` without inertial sensors.
        """
        from allanite.recording.at_rest import quiet_segment

        return quiet_segment(self)

    def half(self, which: int) -> Recording:
        """Recording of the first n // 2 samples (`which` = 0) or of all others (any other value)."""
        middle = self.n // 2
        return self._rows(slice(0, middle) if which == 0 else slice(middle, None))

    def _rows(self, rows: slice) -> Recording:
        """Recording of the rows in a slice; its times begin at 0, and the epoch moves with the first row."""
        extra = {name: values[rows] for name, values in self.covariates.items()}
        first = rows.start or 0
        times, begin = None, first / self.rate
        if self.times is not None:
            begin = float(self.times[first])
            times = read_only(self.times[rows] - begin)
        epoch = None if self.epoch is None else self.epoch + begin
        parts = {"samples": self.samples[rows], "times": times, "epoch": epoch}
        return self._with(**parts, covariates=MappingProxyType(extra))

    def decimate(self, k: int) -> Recording:
        """Recording at 1/k of the rate: averages of `k` rates, sums of k increments, or every k-th angle.

        Covariates are averaged. Averaging keeps the white level N; skipping samples would raise it by √k. A group that
        lacks more than half of its samples is NaN; in others, the present ones are averaged. Raises `InputError` unless
        1 ≤ k ≤ n.
        """
        if k < 1 or k > self.n:
            raise InputError(
                f"decimation by {k}: the record has {self.n} samples; give a number from 1 to {self.n}"
            )
        if k == 1:
            return self
        samples = arrays.averaged(self.samples, k, self.quantity)
        extra = {
            name: read_only(group_means(values, k)) for name, values in self.covariates.items()
        }
        # The stamps belong to the samples that were averaged, so their findings are kept instead.
        findings = () if self.stamps is None else stamp_findings(self.stamps, self.rate)
        return self._with(
            samples=read_only(samples),
            rate=self.rate / k,
            stamps=None,
            times=None,
            covariates=MappingProxyType(extra),
            added_findings=(*self.added_findings, *findings),
        )

    def with_path(self, path: str) -> Recording:
        """Copy of the recording whose attribute `path` is the given path."""
        return self._with(path=path, _motion=self._motion)

    def to(self, unit: str) -> Recording:
        """Recording with its samples converted to another `unit` of the same kind; ``"deg/h,ug"`` converts two kinds.

        Raises
        ------
        InputError
            No column is of this kind.
        """
        factors, units = arrays.factors_to(unit, self.units)
        if units == self.units:
            return self
        samples = read_only(self.samples * (factors if self.samples.ndim == 2 else factors[0]))
        return self._with(samples=samples, units=units)

    def rate_samples(self) -> NDArray[Any]:
        """Rate samples of a one-column recording, in `unit`.

        Returns
        -------
        ndarray of shape (n,), or (n − 1,) for angles
            Increments are divided by the sampling interval, angles are differenced. int64 for integer rates, else
            float64, but float32 for increments in float32.

        Raises
        ------
        InputError
            The recording has several columns.
        """
        self._require_one_column()
        x = self.samples
        if self.quantity == "rate":
            with np.errstate(invalid="ignore"):  # a float32 NaN that signals is one like others
                return np.ascontiguousarray(
                    x, dtype=np.int64 if x.dtype.kind in "iu" else np.float64
                )
        if self.quantity == "increment":
            return x * self.rate
        return np.diff(x.astype(np.int64 if x.dtype.kind in "iu" else np.float64)) * self.rate

    # -- what follows from it --------------------------------------------------------------------

    def oadev(self, taus: Taus = "octave", factors: ArrayLike | None = None) -> Deviation:
        """Overlapping Allan deviation of one column; for `taus` and `factors` see `allanite.oadev`."""
        import allanite as al

        return al.oadev(self, taus=taus, factors=factors)

    def deviations(
        self, kind: str = "oadev", taus: Taus = "octave", factors: ArrayLike | None = None
    ) -> Deviations:
        """`Deviations`: mapping from the name of each column to its deviation.

        For the parameters see `allanite.deviations`.
        """
        import allanite as al

        return al.deviations(self, kind, taus, factors)

    def psd(self) -> Spectrum:
        """Two-sided power spectral density of one column; see `allanite.psd`."""
        import allanite as al

        return al.psd(self)

    def describe(self) -> dict[str, Any]:
        """Dict for JSON: path, column, n, rate_hz, duration_s, unit, gaps, audit; log_unit if the log has another unit."""
        units = {column.unit for column in self.log_columns if column.name in self.columns}
        log_unit = units.pop() if len(units) == 1 else None
        own = {} if log_unit in (None, self.unit) else {"log_unit": log_unit}
        return Record.describe(self) | own

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the samples over time, one panel for each column.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        return al.plots.plot_recording(self, path, theme)

    def _repr_html_(self) -> str:
        """HTML text that shows the recording in notebooks."""
        return recording_html(self)

    def __repr__(self) -> str:
        what = f"{self.n} samples at {self.rate:g} Hz ({self.duration:g} s) in {self.unit}"
        extra = f"; logged columns {', '.join(self.covariates)}" if self.covariates else ""
        return f"Recording({', '.join(self.columns)}: {what}{extra})"


def recording_of_fields(state: Mapping[str, Any]) -> Recording:
    """`Recording` with given values of all fields but the cached ones, unchecked; arrays become read-only."""
    recording = object.__new__(Recording)
    found = with_aligned_arrays(dict(state))
    covariates = {name: read_only(values) for name, values in found["covariates"].items()}
    found |= {
        "samples": read_only(found["samples"]),
        "covariates": MappingProxyType(covariates),
        "covariate_units": MappingProxyType(found["covariate_units"]),
    }
    recording._set_fields(**found, **dict.fromkeys(COMPUTED))
    return recording
