"""allanite adev: Allan deviation and related deviations of a log."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import click

from allanite.cli import output
from allanite.cli.options import (
    LogCommand,
    LogOptions,
    log_options,
    plot_option,
    read_columns,
)
from allanite.cli.pipe import INPUT_NAME, STANDARD_INPUT, errors_name_input, log_file
from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.common.showing import heading
from allanite.deviation import ESTIMATORS

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.deviation import Deviation
    from allanite.plots.spec import Figure
    from allanite.recording.record import Record

#: Values of --taus that are names.
GRIDS = ("octave", "decade", "all")
#: Maximum number of averaging times per octave (limit of `Accumulator`).
MAX_TAUS_PER_OCTAVE = 16


def _kinds_and_uses() -> str:
    """Table of the help: names of the deviations, and when to use them; deviations of the same use share a line."""
    names: dict[str, list[str]] = {"deviation, and when to use it": ["--kind"]}
    for estimator in sorted(ESTIMATORS.values(), key=lambda one: one.use):
        names.setdefault(estimator.use.text, []).append(estimator.name)
    lines = []
    for use, sharing in names.items():
        head = ", ".join(sharing)
        # Names that are too long for their column get a line of their own.
        lines.append(f"{head:<18}{use}" if len(head) < 18 else f"{head}\n{'':18}{use}")
    return "\n".join(lines)


#: Help of the command.
HELP = f"""Compute the Allan deviation of each sensor column in LOG.

Prints a table: averaging time τ in s, deviation, its interval (95 % by default), equivalent degrees of freedom
(edf) and number n of averaged differences. The deviation is in the unit of the samples, or in --output-unit.
For a clock it has no unit; mtie, tierms and tdev are in s. LOG is a file, or - for standard input. A log larger than
half of the free memory is read in chunks.

\b
{_kinds_and_uses()}
"""


@click.command(
    "adev",
    cls=LogCommand,
    help=HELP,
    epilog="Example: allanite adev imu.csv --column gyro_x --plot adev.svg",
)
@click.argument("log")
@click.option(
    "--kind",
    type=click.Choice(tuple(ESTIMATORS)),
    multiple=True,
    help="Deviation to compute (default oadev: overlapping Allan deviation); repeatable. One figure shows all.",
)
@click.option(
    "--confidence",
    type=float,
    default=0.95,
    show_default=True,
    metavar="P",
    help="Confidence level of the intervals in the table and the figure. 0.683 gives one standard deviation.",
)
@click.option(
    "--taus",
    default="octave",
    show_default=True,
    metavar="GRID",
    help="Averaging times τ in sampling intervals: octave (1, 2, 4, 8, …), decade (1, 2, 4, 10, 20, 40, …), all, or a"
    " number of points per decade."
    " Single times can be given only in Python: al.oadev(recording, taus=[1, 100]).",
)
@plot_option
@log_options
def command(
    log: str,
    kind: tuple[str, ...],
    confidence: float,
    taus: str,
    plot: str | None,
    options: LogOptions,
) -> None:
    """Print the deviations of `kind` of each sensor column of `log`, and save their figure to `plot` if given."""
    output.check_targets(plot)
    if _points_per_decade(taus) is None and taus not in GRIDS:
        raise InputError(
            f"--taus {plain(taus, 40)}: write {', '.join(GRIDS)} or a number of points per decade; for single averaging"
            " times in seconds use Python: al.oadev(…, taus=[1, 10])"
        )
    kinds = kind or ("oadev",)
    with log_file(log) as file, errors_name_input(file, log):
        results = _measured_columns(log, file, kinds, taus, options)
    if options.output_unit is not None and all(r.deviation.unit == "1" for r in results):
        raise InputError(
            f"--output-unit {plain(options.output_unit, 40)}: deviations of a clock have no unit, and tdev, tierms and"
            " mtie are in s: leave the option out"
        )
    results = [replace(r, deviation=r.deviation.at_confidence(confidence)) for r in results]
    if plot is not None and len(kinds) > 1:
        _plot_kinds(results, len(kinds), plot)
    elif plot is not None and len(results) > 1:
        _plot_all_columns(results, plot)
    else:
        names = [r.recording.columns[0] for r in results]
        output.save_figures((r.plot() for r in results), names, plot)
    output.print_findings([r.recording for r in results], options)
    output.print_results(results, options)


def _points_per_decade(taus: str) -> int | None:
    """Whole number of points per decade, if the text of --taus is such a number of at most 9 digits; otherwise None."""
    # "²".isdigit() is true, and int() refuses thousands of digits. No log has 10⁹ averaging times.
    return int(taus) if taus.isascii() and taus.isdigit() and len(taus) <= 9 else None


def _plot_all_columns(results: list[_Measured], path: str) -> None:
    """Write one figure with the deviation curves of all columns to `path`."""
    from allanite.comparison.curves import curves_of_deviations
    from allanite.plots import plot_compare

    curves = curves_of_deviations({r.recording.columns[0]: r.deviation for r in results})
    output.save_figure(plot_compare(curves, title="Columns"), path)


def _plot_kinds(results: list[_Measured], kinds: int, path: str) -> None:
    """Write one figure per column, each with all deviations of this column.

    `results` holds `kinds` results for the first column, then `kinds` for the second, and so on.
    """
    from allanite.plots import plot_stability

    columns = [results[i : i + kinds] for i in range(0, len(results), kinds)]
    figures = (
        plot_stability([r.deviation for r in own], recording=own[0].recording) for own in columns
    )
    output.save_figures(figures, [own[0].recording.columns[0] for own in columns], path)


def _measured_columns(
    log: str, file: Path, kinds: tuple[str, ...], taus: str, options: LogOptions
) -> list[_Measured]:
    """One deviation for each column of a log and each of the `kinds`, such as ``oadev``.

    `file` holds the content of the log. A text log or NPY file larger than half of the free memory is read in chunks.
    This needs oadev as the only kind, octaves or a number per decade in `taus`, and neither --trim nor --decimate.
    """
    from allanite.readers import long_log

    simple = kinds == ("oadev",) and options.trim is None and options.decimate is None
    points = _points_per_decade(taus)
    if simple and (points is not None or taus == "octave") and long_log.is_too_large(file):
        return _measured_in_chunks(log, file, taus, options)
    from allanite import deviation

    columns = read_columns(log, options, for_fit=False, copy=file)
    grid = taus if points is None else points
    return [
        _Measured(column, getattr(deviation, kind)(column, taus=grid))
        for column in columns
        for kind in kinds
    ]


def _measured_in_chunks(log: str, file: Path, taus: str, options: LogOptions) -> list[_Measured]:
    """Overlapping Allan deviation, with a diagnostic, of each column of a log that is read in chunks.

    Raises `InputError` if `taus` states 0 or too many averaging times per decade.
    """
    from allanite.readers.long_log import summary_of_log

    per_octave = 1
    points = _points_per_decade(taus)
    if points is not None:
        # A decade has log2(10) octaves.
        per_octave = math.ceil(points / math.log2(10))
        if not 1 <= per_octave <= MAX_TAUS_PER_OCTAVE:
            raise InputError(
                f"--taus {taus}: a log that is read in chunks can have 1 to"
                f" {int(MAX_TAUS_PER_OCTAVE * math.log2(10))} averaging times per decade"
            )
    unit = ",".join(options.output_units.values()) or None
    summary = summary_of_log(file, replace(options.reading, topic=None), unit, per_octave)
    if log == STANDARD_INPUT:
        summary = replace(summary, path=INPUT_NAME)
    why = "log read in chunks, as it is larger than half of the free memory"
    results = [_Measured(column, column.oadev()) for column in summary]
    return [
        replace(r, deviation=replace(r.deviation, diagnostics=(why, *r.deviation.diagnostics)))
        for r in results
    ]


@dataclass(frozen=True, slots=True)
class _Measured:
    """A deviation and the recording from which it was computed."""

    recording: Record
    deviation: Deviation

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with the schema ``allanite/adev/1``: version, description of the recording, and the deviation."""
        from allanite._kernels import version

        head = {"schema": "allanite/adev/1", "version": version()}
        return {**head, "recording": self.recording.describe(), **self.deviation.to_dict()}

    def __str__(self) -> str:
        from allanite.effects.sheet_units import in_figure_unit

        return f"{heading(self.recording)}\n{in_figure_unit(self.deviation)}"

    def plot(self) -> Figure:
        """Figure of the deviation over τ; a dimensionless deviation is drawn as the stability of a clock."""
        from allanite.plots import plot_deviation, plot_stability

        if self.deviation.unit == "1":
            return plot_stability([self.deviation], recording=self.recording)
        return plot_deviation(self.deviation, recording=self.recording)
