"""Summary of a record of any length in a few megabytes: made in one pass, mergeable, and sufficient for a fit."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.former import Former
from allanite.common.numbers import number
from allanite.deviation import Deviation
from allanite.deviation.accumulator import Accumulator
from allanite.recording import Recording
from allanite.recording.findings import Finding
from allanite.recording.record import Record
from allanite.recording.samples import find_column
from allanite.summary import storage
from allanite.summary.level import MAX_KEPT_SAMPLES
from allanite.summary.lines import Line, without_lines
from allanite.summary.reading import Reading, read_column
from allanite.summary.stream_segment import Extremes, StreamSegment

#: The audit warns of outliers if the kurtosis of the sample-to-sample differences, divided by that of normal noise, is at
#: least this. Chosen by judgment; not measured.
MIN_KURTOSIS_RATIO = 1.5
#: Number of missing samples that are added to a curve at a time; limits the memory.
MISSING_AT_ONCE = 1 << 20


@dataclass(frozen=True, slots=True, eq=False)
class Summary(Record):
    """Summary of a record of any length, made in one pass: a few megabytes for each column.

    Fits, checks and studies accept a summary instead of a recording. Up to 2^18 samples it keeps all of them and acts as
    the recording. For longer records it keeps the low frequencies as samples at a lower rate, and the Allan curve. Of the
    higher frequencies it keeps the power in segments of 8192 samples of each octave.

    Attributes
    ----------
    rate : float
        Hz.
    units, columns : tuple of str
        Unit and name of each column.
    covariates_named : tuple of str
        Columns that may explain others; only their low frequencies are kept.
    covariate_units : dict of str to str
    path : str or None
    stretches : tuple of StreamSegment
        Segments of the stream in the order of time; the samples between them are missing.
    added_findings : tuple of Finding
        Findings that were given to the summary; `audit` begins with them.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal(100_000)
    >>> halves = [al.summarize(x[a:b], rate=10.0, start=a) for a, b in ((0, 60_000), (60_000, 100_000))]
    >>> whole = halves[1].merge(halves[0])
    >>> print(whole)
    Summary(x: 100000 samples at 10 Hz (10000 s) in 1)
    >>> whole.save("log.summary")
    >>> again = al.Summary.load("log.summary")
    >>> again.column(0).oadev().tau.size > 20, again.describe()["n"], again.lines()
    (True, 100000, [])
    >>> again.recording().n, again.rate_samples().shape  # only a short record keeps its samples
    (100000, (100000,))
    >>> again.reading().samples.size, again.low_rate(2)
    (100000, {})
    """

    rate: float
    units: tuple[str, ...]
    columns: tuple[str, ...]
    covariates_named: tuple[str, ...]
    covariate_units: dict[str, str]
    path: str | None
    stretches: tuple[StreamSegment, ...]
    added_findings: tuple[Finding, ...] = ()

    #: Samples are rates.
    quantity = "rate"

    told = Former("added_findings")
    whole = Former("keeps_all_samples")

    # -- size ------------------------------------------------------------------------------------

    @property
    def start(self) -> int:
        """Index of the first sample in its stream."""
        return self.stretches[0].start

    @property
    def n(self) -> int:
        """Number of samples from the first to the last, with missing samples."""
        return self.stretches[-1].stop - self.stretches[0].start

    @property
    def missing(self) -> int:
        """Number of missing samples of the first column, including all samples between the segments of the summary."""
        return self.n - self.extremes.count

    @property
    def gaps(self) -> int:
        """Number of runs of missing samples of the first column; each pause between two segments counts as one more."""
        return self.extremes.gaps + len(self.stretches) - 1

    @property
    def keeps_all_samples(self) -> bool:
        """True if the summary keeps all samples, so that `recording` and `rate_samples` work.

        At most 2¹⁸ samples are kept of one stream, and at most 2¹⁹ in total of joined streams.
        """
        every = all(level.whole for one in self.stretches for level in one.levels)
        return every and self.n <= 2 * MAX_KEPT_SAMPLES

    @property
    def extremes(self) -> Extremes:
        """New `Extremes` of the first column over all segments; later changes of it do not affect the summary."""
        out = deepcopy(self.stretches[0].extremes[0])
        for one in self.stretches[1:]:
            out.merge(one.extremes[0])
        return out

    # -- parts -----------------------------------------------------------------------------------

    def column(self, name: str | int) -> Summary:
        """`Summary` of one column, by name or index, with the covariates.

        Raises
        ------
        InputError
            There is no such column; the names are listed.
        """
        at = find_column(name, self.columns)
        extra = slice(len(self.columns), None)
        return replace(
            self,
            units=(self.units[at],),
            columns=(self.columns[at],),
            stretches=tuple(one.one_column(at, extra) for one in self.stretches),
        )

    def __iter__(self) -> Iterator[Summary]:
        """Iterator over the columns, each as a `Summary` of one column."""
        return (self.column(i) for i in range(len(self.columns)))

    def merge(self, *others: Summary) -> Summary:
        """New `Summary` of this summary and of `others`, which hold other segments of the same stream, in any order.

        Adjacent segments are joined; empty ones are dropped. No given summary is changed.

        Raises
        ------
        InputError
            Segments with another rate, unit or set of columns, segments that overlap, or an argument that is no summary.
        """
        pieces = [(self, one) for one in self.stretches]
        for other in others:
            if not isinstance(other, Summary):
                raise InputError(f"cannot merge {other!r}: another Summary is needed")
            mine = (self.rate, self.units, self.columns, self.covariates_named)
            theirs = (other.rate, other.units, other.columns, other.covariates_named)
            if mine != theirs:
                raise InputError(
                    f"cannot merge {', '.join(theirs[2])} at {other.rate:g} Hz in {other.unit} into"
                    f" {', '.join(mine[2])} at {self.rate:g} Hz in {self.unit}"
                )
            pieces += [(other, one) for one in other.stretches]
        # At least one segment remains, also if all are empty.
        pieces = [pair for pair in pieces if pair[1].stop > pair[1].start] or pieces[:1]
        pieces.sort(key=lambda pair: (pair[1].start, pair[1].stop))
        joined: list[StreamSegment] = []
        fresh: list[bool] = []
        for _, one in pieces:
            if joined and one.start < joined[-1].stop:
                raise InputError(
                    f"two segments hold sample {one.start}: give each its own start, the index of its first sample"
                )
            if joined and one.start == joined[-1].stop:
                if not fresh[-1]:
                    joined[-1], fresh[-1] = deepcopy(joined[-1]), True
                joined[-1].merge(deepcopy(one))
            else:
                joined.append(one)
                fresh.append(False)
        findings = dict.fromkeys(f for one in (self, *others) for f in one.added_findings)
        return replace(self, stretches=tuple(joined), added_findings=tuple(findings))

    # -- results ---------------------------------------------------------------------------------

    def reading(self) -> Reading:
        """`Reading` of the only column: octaves of its spectrum, and low-rate samples below them."""
        self._require_one_column()
        return read_column([one.levels[0] for one in self.stretches])

    def low_rate(self, depth: int) -> dict[str, Array]:
        """Dict from the name of each covariate to its samples at the sampling rate divided by 2^`depth`."""
        first = len(self.columns)
        return {
            name: read_column([one.levels[first + i] for one in self.stretches], depth).samples
            for i, name in enumerate(self.covariates_named)
        }

    def recording(self) -> Recording:
        """`Recording` with the samples of the summary, if the summary keeps all samples.

        Raises
        ------
        InputError
            The samples are not kept.
        """
        if not self.keeps_all_samples:
            raise InputError(
                f"the summary of {self.n} samples does not keep the samples: read the log for the segment that you need"
            )
        return Recording(
            self.reading().samples,
            self.rate,
            unit=self.units,
            columns=self.columns,
            covariates=self.low_rate(0),
            covariate_units=self.covariate_units,
            path=self.path,
        )

    def rate_samples(self) -> Array:
        """Samples of the only column, shape (n,). Raises `InputError` if they are not kept."""
        return np.asarray(self.recording().rate_samples())

    def oadev(self) -> Deviation:
        """`Deviation`: overlapping Allan deviation of the only column, two averaging times per octave.

        Raises
        ------
        TooShortError
            Fewer than 3 samples.
        """
        self._require_one_column()
        return _deviation_of_stream([one.curves[0] for one in self.stretches])

    def lines(self) -> list[Line]:
        """List of the spectral lines (`Line`) of the only column at frequencies of which only the power is kept.

        Those are the frequencies above the kept low-rate samples; none if all samples are kept. Fits exclude these lines.
        """
        reading = self.reading()
        return [
            line
            for level in range(len(reading.octaves))
            for line in without_lines(reading, level, self.rate)[1]
        ]

    @property
    def covariates(self) -> dict[str, Array]:
        """Dict from the name of each covariate to its samples at a reduced rate.

        The rate is the sampling rate divided by 2^k, where k is the number of octaves of the first column. Empty without
        covariates.
        """
        return self.low_rate(len(self.column(0).reading().octaves)) if self.covariates_named else {}

    @property
    def audit(self) -> list[Finding]:
        """List of `Finding`: those already stored, then gaps, repeated samples, outliers and lines of each column.

        A missing unit comes last, since faults of the data matter more. Gaps that a stored finding counts are not
        repeated. Repeated samples count if they are over half of all, outliers if the kurtosis of the steps exceeds 4.5.
        """
        out = list(self.added_findings)
        # A gap of the time column is reported once.
        known = {0, *(f.values.get("missing") for f in self.added_findings if f.kind == "gaps")}
        for name, unit, one in zip(self.columns, self.units, self, strict=True):
            found = one.extremes
            if one.missing not in known:
                text = f"{one.missing} of {one.n} samples are missing, in {one.gaps} gaps"
                out.append(_warning(name, "gaps", text, missing=float(one.missing)))
            count, still, square, fourth = found.steps.value
            if count and still > 0.5 * count:
                text = f"{number(100 * still / count)} % of the samples repeat the one before"
                out.append(_warning(name, "quantisation", text))
            if square > 0.0 and fourth * count > MIN_KURTOSIS_RATIO * 3.0 * square**2:
                at = max(found.low, found.high, key=lambda v: abs(v[0]))
                text = (
                    f"steps from sample to sample have heavy tails (kurtosis {fourth * count / square**2:.3g}, normal"
                    f" noise has 3); the extremes are {found.low[0]:g} and {found.high[0]:g} {unit}"
                )
                time = (at[1] - self.start) / self.rate
                out.append(_warning(name, "outliers", text, time_s=time))
            for line in one.lines():
                text = (
                    f"a line at {line.frequency:.6g} ± {line.width:.1g} Hz, amplitude {line.amplitude:.3g} {unit}: fits"
                    " exclude the line, because the summary keeps no phase at this frequency; to fit the line, fit a"
                    " segment of the log"
                )
                values = {"frequency_hz": line.frequency, "amplitude": line.amplitude}
                out.append(_warning(name, "line", text, **values))
        return sorted(out, key=lambda finding: finding.kind == "no_unit")

    def save(self, path: str | Path) -> None:
        """Write the summary to `path` as one file, which `load` reads back.

        The name is kept as it is, and an existing file is replaced.
        """
        storage.save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Summary:
        """`Summary` that `save` has written to `path`.

        Raises
        ------
        InputError
            No such file, or not a summary.
        """
        return storage.load(cls, path)

    def __str__(self) -> str:
        extra = (
            f"; logged columns {', '.join(self.covariates_named)}" if self.covariates_named else ""
        )
        parts = f"; {len(self.stretches)} segments" if len(self.stretches) > 1 else ""
        what = f"{self.n} samples at {self.rate:g} Hz ({self.duration:g} s) in {self.unit}"
        return f"Summary({', '.join(self.columns)}: {what}{extra}{parts})"

    __repr__ = __str__


def _warning(column: str, kind: str, text: str, **values: float) -> Finding:
    """`Finding` (warning) about a column; its sentence begins with the name of the column."""
    return Finding(kind, "warning", f"{column}: {text}", column, values)


def _deviation_of_stream(curves: list[Accumulator]) -> Deviation:
    """Allan `Deviation` of a stream from those of its segments in time order; samples between are missing."""
    if len(curves) == 1:
        return curves[0].oadev()
    whole = curves[0].__copy__()
    for following in curves[1:]:
        end = whole.start + whole.n
        while end < following.start:
            size = min(MISSING_AT_ONCE, following.start - end)
            whole.update(np.full(size, np.nan))
            end += size
        whole.merge(following)
    return whole.oadev()
