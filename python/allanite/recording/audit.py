"""Audit of the data before any model: findings with numbers; nothing is repaired.

Each check is a small function of a column; together they cost a few passes over the samples. Checks that need a
distribution use blocks spread over the record instead of all samples.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array, runs_of
from allanite.common.numbers import number, percent_text
from allanite.common.units import coefficient_unit
from allanite.recording.at_rest import motion_findings
from allanite.recording.coarse_column import coarse_step_of
from allanite.recording.copies import copies_of
from allanite.recording.distorted import dead_band_of, dead_zone_of
from allanite.recording.findings import Finding, stamp_findings
from allanite.recording.locked import locked_of
from allanite.recording.repeats import longest_run
from allanite.recording.resolution import step_of, two_codes
from allanite.recording.tails import CENSORED_SHARES, outlier_limit, tail_of

if TYPE_CHECKING:
    from allanite.recording.recording import Recording

#: Maximum share of LSB²/12 in the white variance for which noise and rounding add: LSB = 1.9 σ of the samples. In
#: simulations, N² differs from the sum by up to 3 % at LSB = 2 σ of the noise before rounding, whatever its mean. The
#: difference is 13 % at 2.5 σ, 31 % at 3 σ and 72 % at 4 σ. The standard deviation of the samples distinguishes 2 σ (LSB at
#: most 1.76 times it) from 2.5 σ (at least 1.90 times, and 2 times if they flip between two codes).
MAX_ROUNDING_SHARE = 0.3
#: Minimum number of averages from which decimation is advised for a curve. Chosen by judgment; not measured.
MIN_AVERAGES = 100
#: Maximum power near half of the rate over that of lower octaves for values that were smoothed: the mean of two samples
#: leaves 0.045, that of three 0.1. And the number of octaves below the rate that are compared.
MAX_SMOOTHED_RATIO, OCTAVES = 0.25, 8
#: Minimum number of changes of averages for the check on one dominating event: two of 32 normal changes make more than half
#: of the sum of squares once in 100 000 records.
MIN_CHANGES = 32
#: Samples processed at a time, so that they stay in the cache.
CHUNK = 1 << 18


def audit(recording: Recording) -> list[Finding]:
    """Findings about the time stamps and every column of a recording, without markers and repeated samples.

    Of angles, the differences of neighboring samples are checked.
    """
    recording = recording.measured
    findings = list(stamp_findings(recording.stamps, recording.rate)) if recording.stamps else []
    findings = [*motion_findings(recording), *recording.added_findings, *findings]
    units = recording.units
    for i, name in enumerate(recording.columns):
        x = recording.samples if recording.samples.ndim == 1 else recording.samples[:, i]
        # A gap of angles costs one difference more than samples, but all findings count samples.
        rows = x.size
        missing = int(np.count_nonzero(np.isnan(x))) if x.dtype.kind == "f" else 0
        if recording.quantity == "angle":
            # Angles wander by nature: only their steps can be judged.
            x = np.diff(x)
            if x.size == 0:
                continue
        unit = units[i]
        if recording.quantity != "rate":
            unit = coefficient_unit(unit, 1).removeprefix("1·")
        # Squares of extreme samples overflow; the checks handle the infinities.
        with np.errstate(all="ignore"):
            column = _Column(name, np.ascontiguousarray(x), recording.rate, unit, rows, missing)
            for check in CHECKS:
                findings.extend(check(column))
    findings.extend(_coarse_column_findings(recording))
    # Faults of the data matter more than a missing unit.
    return sorted(findings, key=lambda finding: finding.kind == "no_unit")


def _coarse_column_findings(recording: Recording) -> Iterator[Finding]:
    """Iterator over a `Finding` for each covariate logged in coarse steps, such as a temperature in whole degrees."""
    for name, values in recording.covariates.items():
        step = coarse_step_of(values)
        if step:
            yield Finding(
                "coarse_column",
                "info",
                f"{name} is logged in steps of {step:.4g}: fits use the smoothest curve that rounds to it",
                values={"step": step},
            )


# -- one column ----------------------------------------------------------------------------------


class _Column:
    """A column, with the statistics that several checks need.

    `x` are the samples, or the differences of angles. `rows` and `missing` count the samples and those that are NaN.
    """

    def __init__(
        self, name: str, x: NDArray[Any], rate: float, unit: str, rows: int, missing: int
    ) -> None:
        self.name, self.x, self.rate, self.unit = name, x, rate, unit
        self.rows, self.missing = rows, missing
        self.n = x.size
        # The first doubles may be single-precision numbers.
        some = x[: 1 << 12]
        self.single = x.dtype.kind == "f" and np.array_equal(
            some.astype(np.float32), some, equal_nan=True
        )
        self.spread = _spread_blocks(x)
        finite = self.spread[np.isfinite(self.spread)]
        self.step = step_of(finite, self.single)
        low, high = _smallest_and_largest(x)
        self.low, self.high = low, high
        second = np.diff(self.spread, n=2, axis=1)
        second = np.abs(second[np.isfinite(second)])
        # Second differences of white noise have 6 times its variance. Their middle half ignores
        # outliers, and its mean (0.6934 σ), unlike the median, is not caught on a coarse step.
        second.sort()
        middle = second[second.size // 4 : 3 * second.size // 4]
        self.white = float(middle.mean()) / 0.6934 / math.sqrt(6) if middle.size else 0.0
        self.zone = dead_zone_of(self.spread, self.white, self.step)
        self.band = dead_band_of(self.spread)

    def pieces(self, overlap: int = 0) -> Iterator[tuple[int, NDArray[Any]]]:
        """Yield (index of the first sample, block) of consecutive blocks that extend `overlap` samples into the next."""
        for at in range(0, max(self.n - overlap, 1), CHUNK):
            yield at, self.x[at : at + CHUNK + overlap]

    def finding(
        self, kind: str, severity: str, found: str, *, remedy: str = "", **values: float
    ) -> Finding:
        """`Finding` about this column; its sentence begins with the name of the column."""
        return Finding(kind, severity, f"{self.name}: {found}", self.name, values, remedy)


def _spread_blocks(x: NDArray[Any], length: int = 512, most: int = 256) -> Array:
    """At most `most` blocks at even distances over the record, as doubles, shape (blocks, length).

    A record shorter than `length` is one block.
    """
    length = min(length, x.size)
    count = min(most, x.size // length)
    starts = np.linspace(0, x.size - length, count).astype(np.int64)
    return np.stack([x[s : s + length] for s in starts]).astype(np.float64)


def _smallest_and_largest(x: NDArray[Any]) -> tuple[float, float]:
    """Tuple (smallest, largest) of the samples; NaN samples are ignored. Both are NaN if all samples are."""
    low, high = float(np.min(x)), float(np.max(x))
    if math.isnan(low) and (there := ~np.isnan(x)).any():
        # np.nanmin would return a signaling NaN.
        low = float(np.min(x, where=there, initial=np.inf))
        high = float(np.max(x, where=there, initial=-np.inf))
    return low, high


def _missing_findings(c: _Column) -> Iterator[Finding]:
    """At most one `Finding` with the number of missing samples and their effect on the Allan deviation.

    If the deviation loses over half of its differences at an averaging time below an eighth of the record, the finding
    advises a decimation that leaves at least 100 averages.
    """
    missing = c.missing
    if missing:
        runs = _run_lengths(c)
        few = remedy = ""
        half = _factor_at_half_lost(runs, c.n)
        if half < c.n / 8:
            few = ". The plain Allan deviation loses more than half of its differences"
            few += f" beyond {half / c.rate:.3g} s" if half else ""
            coarser = _advised_decimation((c.n - missing) / (2 * runs.size), missing / runs.size)
            # Fewer averages make no curve, so decimation does not help with a long pause.
            if coarser <= c.n / MIN_AVERAGES:
                remedy = f"; for its curve use {{decimate:{coarser}}}"
        yield c.finding(
            "missing",
            "warning",
            f"{missing} samples are NaN ({percent_text(missing / c.rows, 2)}). The fit uses all other samples{few}",
            remedy=remedy,
            count=missing,
        )


def _advised_decimation(apart: float, gap: float) -> int:
    """Decimation factor (1, 2 or 5 × 10ⁿ) with which nearly all averages have most of their samples.

    `apart` is half the mean length of the runs of present samples, `gap` the mean length of the gaps.
    """
    least = max(4.0, 4.0 * gap, apart / 8.0)
    decade = 10.0 ** math.floor(math.log10(least))
    return int(next(k * decade for k in (1, 2, 5, 10) if k * decade >= 0.9 * least))


def _run_lengths(c: _Column) -> NDArray[np.int64]:
    """Number of samples in each run without a missing sample; ``[1]`` if all samples are missing."""
    begins, ends = runs_of(~np.isnan(c.x))
    return ends - begins if ends.size else np.ones(1, dtype=np.int64)


def _factor_at_half_lost(runs: NDArray[np.int64], n: int) -> int:
    """Largest averaging factor m at which half of the differences of the Allan deviation touch no missing sample, or 0.

    A difference needs 2 m consecutive samples. `runs` are the lengths of the runs of present samples. The factor is at
    most n // 2.
    """
    low, high = 0, n // 2 + 1
    while high - low > 1:
        m = (low + high) // 2
        there = int(np.maximum(runs - 2 * m + 1, 0).sum())
        low, high = (m, high) if 2 * there >= n - 2 * m + 1 else (low, m)
    return low


def _constant_findings(c: _Column) -> Iterator[Finding]:
    """Iterator over a `Finding` about a column whose samples are all equal; empty for others."""
    if c.low == c.high:
        yield c.finding(
            "constant", "warning", f"every sample is {c.low:g}: a stuck sensor or the wrong column"
        )


def _stuck_findings(c: _Column) -> Iterator[Finding]:
    """At most one `Finding` about the longest run of one value, if noise would not repeat for so long."""
    if c.n < 2 or c.low == c.high:
        return
    start, longest, equal = longest_run(c.x)
    share = equal / (c.n - 1)
    # Longest run to expect of independent samples that repeat with this probability; tripled,
    # because slow noise under a coarse step repeats in clusters.
    expected = math.log(c.n) / -math.log(min(max(share, 1.0 / c.n), 0.999))
    if longest > 3 * expected + 20:
        yield c.finding(
            "stuck",
            "warning",
            f"the value {c.x[start]:.6g} stands for {longest} samples from {start / c.rate:.6g} s:"
            " a stuck sensor or a lost link",
            start_s=start / c.rate,
            count=longest,
        )


def _copy_findings(c: _Column) -> Iterator[Finding]:
    """Iterator over a `Finding` about blocks of samples that the log holds twice; empty without such blocks."""
    copies = copies_of(c.x)
    if copies:
        count = sum(copy.count for copy in copies)
        longest = max(copies, key=lambda copy: copy.count)
        blocks = "a block equals" if len(copies) == 1 else f"{len(copies)} blocks equal"
        yield c.finding(
            "copies",
            "warning",
            f"{blocks} an earlier block, sample by sample ({count} samples, {percent_text(count / c.n, 2)}), the longest"
            f" at {longest.start / c.rate:.6g} s with {longest.count} samples, {longest.lag / c.rate:.4g} s after its"
            " original: the log holds samples twice; fits count them as measured",
            start_s=longest.start / c.rate,
            count=count,
        )


def _clipping_findings(c: _Column) -> Iterator[Finding]:
    """A `Finding` for the lowest and for the highest value, if clipping of the range repeats this value.

    The value must be over three times as frequent as the value next to it. At least 10 and at most half of the samples
    must have the value. The first 10 000 samples must contain at least 5 different values.
    """
    for edge, name in ((c.low, "lowest"), (c.high, "highest")):
        at_edge = int(np.count_nonzero(c.x == edge))
        if at_edge < 10 or at_edge > 0.5 * c.n or np.unique(c.x[:10_000]).size < 5:
            continue
        if at_edge > 3 * _neighbor_count(c, edge):
            yield c.finding(
                "clipping",
                "warning",
                f"{at_edge} samples sit at the {name} value {edge:.6g} {c.unit}: the range was"
                " exceeded",
                value=edge,
                count=at_edge,
            )


def _neighbor_count(c: _Column, edge: float) -> int:
    """Number of samples at the value next to `edge`, the smallest or the largest sample; 0 without another value."""
    nearest, count = math.nan, 0
    for _, piece in c.pieces():
        inner = piece[piece < edge] if edge == c.high else piece[piece > edge]
        if inner.size == 0:
            continue
        value = float(inner.max() if edge == c.high else inner.min())
        if not abs(value - edge) >= abs(nearest - edge):
            nearest, count = value, 0
        count += int(np.count_nonzero(inner == nearest))
    return count


def _step_findings(c: _Column) -> Iterator[Finding]:
    """At most one `Finding`: a column locked to one code, or a resolution whose rounding adds noise.

    Nothing if rounding adds less than 0.1 % of the white variance. Over 30 %, or two codes only, is a warning.
    """
    locked = locked_of(c.x)
    if locked is not None:
        yield c.finding(
            "locked",
            "warning",
            f"{percent_text(locked.share, 1)} of the samples have one code: rounding"
            f" (step {locked.step:.4g} {c.unit}) hides the noise,"
            f" whose standard deviation is below {locked.most:.3g} {c.unit} (95 %)",
            share=locked.share,
            step=locked.step,
            most=locked.most,
        )
        return
    # The step between two codes is used only here; other checks use the values of such a column.
    two = 0.0 if c.step else two_codes(c.spread, c.single)
    step = c.step or two
    if not step:
        return
    changes = np.diff(c.spread, axis=1)
    changes = changes[np.isfinite(changes)]  # empty if every second sample is missing
    share = step**2 / 12 / max(float(changes.var()) / 2 if changes.size else 0.0, step**2 / 12)
    if share < 1e-3:
        return
    coarse = share > MAX_ROUNDING_SHARE or two > 0.0
    found = (
        "is as large as the noise: the samples rarely change code or flip between two, and the coefficients are deformed"
        if coarse
        else f"its rounding adds {percent_text(share, 1)} of the white noise"
        " (variance LSB²/12, slope −½ like N, not the slope −1 of Q)"
    )
    yield c.finding(
        "quantisation",
        "warning" if coarse else "info",
        f"resolution (LSB) {step:.4g} {c.unit}{' ' if coarse else ': '}{found}",
        step=step,
        share=share,
    )


def _distorted_findings(c: _Column) -> Iterator[Finding]:
    """Iterator over at most one `Finding`: a dead zone around one value, or a dead band between logged values."""
    unit = "" if c.unit == "1" else f" {c.unit}"
    if c.zone is not None:
        value, share, ratio = c.zone
        yield c.finding(
            "dead_zone",
            "warning",
            f"{percent_text(share, 2)} of the samples are exactly {value:.6g}{unit}, {number(ratio, 2)} times as many as"
            " at any value near it: a dead zone, or a value written for missing samples; no noise model describes these"
            " values",
            value=value,
            share=share,
            ratio=ratio,
        )
    elif c.band is not None:
        yield c.finding(
            "dead_band",
            "warning",
            f"neighboring samples are equal or differ by at least {c.band:.4g}{unit}: the log writes no smaller changes"
            " (dead band); no noise model describes these values",
            band=c.band,
        )


def _outlier_findings(c: _Column) -> Iterator[Finding]:
    """At most one `Finding`: outliers (second differences too large for the noise) or heavy-tailed noise.

    Nothing below 100 samples, without noise, with a dead zone or dead band, or without large differences. Over 1 in 10
    000 outliers give a warning.
    """
    level = max(c.white, 0.4 * c.step) * math.sqrt(6)
    if level == 0.0 or c.n < 100 or c.zone is not None or c.band is not None:
        return
    limit = level * math.sqrt(2 * math.log(c.n) + 16) + c.step
    found = []
    for at, piece in c.pieces(overlap=2):
        x = piece.astype(np.float64)
        jumps = np.abs(x[2:] - 2 * x[1:-1] + x[:-2]) > limit
        found.append(np.flatnonzero(jumps) + at + 1)
    rows = np.concatenate(found)
    if not rows.size:
        return
    sizes = np.abs(np.diff(c.spread, n=2, axis=1))
    sizes = sizes[np.isfinite(sizes)]
    tail = tail_of(sizes, CENSORED_SHARES[0])
    if tail is not None and tail.heavy:
        reached = max(limit, outlier_limit(sizes, 0.001 / c.n, c.step))
        x = c.x[rows[:, None] + np.array([-1, 0, 1])].astype(np.float64)
        rows = rows[np.abs(x[:, 0] - 2.0 * x[:, 1] + x[:, 2]) > reached]
        if not rows.size:
            yield c.finding(
                "heavy_tails",
                "info",
                "heavy-tailed noise: its differences follow a Student law of"
                f" {1.0 / tail.inverse_freedom:.2g} degrees of freedom; N is its standard deviation's,"
                " and its largest samples are no outliers",
                freedom=1.0 / tail.inverse_freedom,
            )
            return
        limit = reached
    # One spike moves three second differences.
    events = 1 + int(np.count_nonzero(np.diff(rows) > 2))
    usual = float(np.nanmedian(c.spread))
    # Neighbors too, since the first and last sample are not the middle of a second difference.
    neighbors = np.unique(np.clip(rows[:, None] + np.array([-1, 0, 1]), 0, c.n - 1))
    worst = int(neighbors[np.nanargmax(np.abs(c.x[neighbors].astype(np.float64) - usual))])
    yield c.finding(
        "outliers",
        "warning" if events > 1e-4 * c.n else "info",
        f"{events} outlier{'s' * (events > 1)} ({events / c.n:.2g} of the samples): jumps beyond"
        f" {limit:.3g} {c.unit}, the largest at {worst / c.rate:.6g} s ({c.x[worst]:.4g} {c.unit})",
        count=events,
        share=events / c.n,
        time_s=worst / c.rate,
    )


def _smoothed_findings(c: _Column) -> Iterator[Finding]:
    """At most one `Finding` about values that were averaged or low-passed before they were logged.

    The finding needs two conditions on median power densities. First, the density above 3/8 of the sampling rate is at
    most a quarter of that in each of the five octaves from 1/256 to 1/8 of the rate. Second, the density extrapolated
    to this band from at least one pair of neighboring octaves is more than four times the density in this band. Missing
    samples exclude their block of 512 samples. Without 4 complete blocks there is no finding.
    """
    blocks = c.spread[np.isfinite(c.spread).all(axis=1)]
    if blocks.shape[0] < 4 or blocks.shape[1] < 2**OCTAVES:
        return
    x = (blocks - blocks.mean(axis=1, keepdims=True)) * np.hanning(blocks.shape[1])
    power = np.median(np.abs(np.fft.rfft(x, axis=1)) ** 2, axis=0)
    share = np.arange(power.size) / blocks.shape[1]
    top = float(np.median(power[share >= 3 / 8]))
    octaves = [
        float(np.median(power[(share >= 2.0 ** -(k + 1)) & (share < 2.0**-k)]))
        for k in range(3, OCTAVES)
    ]
    if not top > 0.0 or top > MAX_SMOOTHED_RATIO * min(octaves):
        return
    for k, (upper, lower) in enumerate(pairwise(octaves), start=3):
        # Octaves from the middle of a band, 3/4 of its upper end, to that of the top, 7/16.
        apart = math.log2(7 / 16) - math.log2(0.75 * 2.0**-k)
        if math.log2(top / upper) < apart * min(math.log2(upper / lower), 0.0) + math.log2(
            MAX_SMOOTHED_RATIO
        ):
            yield c.finding(
                "smoothed",
                "info",
                f"the values were smoothed before they were logged: above {0.375 * c.rate:.3g} Hz their power is"
                f" {top / lower:.2g} of that at {c.rate * 2.0 ** -(k + 2):.2g}–{c.rate * 2.0 ** -(k + 1):.2g} Hz; the"
                " shortest averaging times show the filter, not the noise of the sensor",
                share=top / lower,
            )
            return


@dataclass(slots=True)
class _Changes:
    """Squared changes between neighboring averages of one length, updated piece by piece."""

    count: int = 0
    total: float = 0.0
    largest: float = 0.0
    end: int = 0
    last: Array = field(default_factory=lambda: np.zeros(0))
    square: float = 0.0

    def add(self, averages: Array) -> None:
        """Add the averages that follow those already added, to the sums of squared changes between neighbors.

        `largest` is the largest sum of two consecutive squares, and `end` the number of changes before the second one.
        """
        changes = np.diff(np.concatenate([self.last, averages]))
        squares = np.where(np.isfinite(changes), changes, 0.0) ** 2
        if squares.size:
            pairs = squares + np.concatenate([[self.square], squares[:-1]])
            at = int(np.argmax(pairs))
            if pairs[at] > self.largest:
                self.largest, self.end = float(pairs[at]), self.count + at
            self.square = float(squares[-1])
        self.count += squares.size
        self.total += float(squares.sum())
        self.last = averages[-1:]


def _dominated_findings(c: _Column) -> Iterator[Finding]:
    """At most one `Finding`: a single event makes more than half of the Allan variance at an averaging time.

    An event is the largest sum of two consecutive squared changes between neighboring averages. Averaging times are
    octaves with more than 32 averages.
    """
    changes: dict[int, _Changes] = {}
    for _, piece in c.pieces():
        averages, m = piece.astype(np.float64), 1
        while averages.size and c.n // m > MIN_CHANGES:
            changes.setdefault(m, _Changes()).add(averages)
            averages = averages[: averages.size // 2 * 2].reshape(-1, 2).mean(axis=1)
            m *= 2
    found = {m: own for m, own in changes.items() if 2.0 * own.largest > own.total}
    if not found:
        return
    m = max(found, key=lambda m: found[m].largest / found[m].total)
    share, time = found[m].largest / found[m].total, (found[m].end + 0.5) * m / c.rate
    low, high = min(found) / c.rate, max(found) / c.rate
    span = f"{number(low)} s" if low == high else f"{number(low)}–{number(high)} s"
    yield c.finding(
        "dominated",
        "warning",
        f"one event at about {number(time, 4)} s makes up to {percent_text(share)} of the Allan variance at τ = {span}",
        share=share,
        time_s=time,
        tau_s=m / c.rate,
    )


def _static_findings(c: _Column) -> Iterator[Finding]:
    """At most one `Finding` about segments with over three times the usual activity, such as handling.

    The activity of a block is the typical step between its samples, so slow motion does not count. Nothing for fewer
    than 4096 samples, or if the usual activity is 0.
    """
    if c.n < 16 * 256:  # fewer blocks have no usual activity
        return
    blocks = _spread_blocks(c.x, length=256, most=1024)
    moves = np.abs(np.diff(blocks, axis=1))
    there = np.isfinite(moves)
    moves[~there] = 0.0
    # The mean of the middle half ignores outliers and, unlike the median, is not rounded to the step.
    moves.sort(axis=1)
    activity = moves[:, 64:192].mean(axis=1)
    # Blocks with few samples have no activity.
    activity[2 * there.sum(axis=1) < moves.shape[1]] = np.nan
    if np.isnan(activity).all():
        return
    usual = float(np.nanmedian(activity))
    loud = activity > 3 * max(usual, 0.1 * c.step)
    if usual == 0.0 or not loud.any():
        return
    begins, ends = runs_of(loud)
    first, end = int(begins[0]), int(ends[0])
    others = np.count_nonzero(loud) - (end - first)
    more = f" and in {others} other segments" if others else ""
    span = c.n / c.rate / loud.size
    remedy = _remedy_by_quiet_blocks(np.isfinite(activity) & ~loud, span, blocks.shape[1], c)
    yield c.finding(
        "not_static",
        "warning",
        f"not at rest: activity {activity[first:end].max() / usual:.3g} times the usual"
        f" around {first * span:.4g}–{end * span:.4g} s{more}",
        remedy=remedy and f"{remedy} excludes {'it' if begins.size == 1 else 'them'}",
        start_s=first * span,
        end_s=end * span,
        share=float(loud.mean()),
    )


def _remedy_by_quiet_blocks(quiet: NDArray[np.bool_], span: float, length: int, c: _Column) -> str:
    """Remedy that names the longest segment of quiet blocks; empty if it is below a tenth of the record.

    `quiet` is a mask of the blocks of `length` samples, one each `span` seconds.
    """
    begins, ends = runs_of(quiet)
    longest = int(np.argmax(ends - begins))
    first, end = int(begins[longest]), int(ends[longest])
    # The block next to a loud one may contain the end of the motion.
    start_s = 0.0 if first == 0 else first * span + length / c.rate
    end_s = c.n / c.rate if end == quiet.size else (end - 1) * span
    if end_s - start_s < 0.1 * c.n / c.rate:
        return ""
    return f"; {{this_span:{start_s:.6g}:{end_s:.6g}}}"


#: All checks of a column, in the order of the findings.
CHECKS: tuple[Callable[[_Column], Iterator[Finding]], ...] = (
    _missing_findings,
    _constant_findings,
    _stuck_findings,
    _copy_findings,
    _clipping_findings,
    _step_findings,
    _distorted_findings,
    _outlier_findings,
    _dominated_findings,
    _smoothed_findings,
    _static_findings,
)
