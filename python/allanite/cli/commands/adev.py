"""allanite adev: the deviation of a log."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import click

from allanite.cli.options import LogOptions, is_number, log_options, plot_option
from allanite.cli.pipe import PIPE
from allanite.common.errors import InputError
from allanite.deviation import ESTIMATORS

if TYPE_CHECKING:
    from allanite.cli.stream import Stream
    from allanite.deviation import Deviation
    from allanite.plots.spec import Figure
    from allanite.recording import Recording

#: Averaging times by name.
GRIDS = ("octave", "decade", "all")


@click.command("adev")
@click.argument("log")
@click.option(
    "--kind",
    type=click.Choice(tuple(ESTIMATORS)),
    multiple=True,
    help="Which deviation (default oadev); repeatable, then one figure shows all.",
)
@click.option(
    "--confidence",
    type=float,
    default=0.95,
    show_default=True,
    metavar="P",
    help="Of the intervals: 0.683 for one standard deviation.",
)
@click.option(
    "--taus",
    default="octave",
    show_default=True,
    metavar="GRID",
    help="octave, decade, all, or a number of points per decade.",
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
    """Allan deviation of LOG: tau, deviation, interval.

    tierms and mtie have no interval; theo1 and theoh have averaging times of their own, up to three
    quarters of the log, and take time in proportion to them.
    """
    from allanite.cli import output

    output.check_targets(plot)
    if not (is_number(taus) or taus in GRIDS):
        raise InputError(
            f"--taus {taus}: {', '.join(GRIDS)} or a number of points per decade (seconds are for"
            " Python: al.oadev(…, taus=[1, 10]))"
        )
    kinds = kind or ("oadev",)
    passing = kinds == ("oadev",) and _streams(log, taus, options)
    results = _stream(log, options, taus) if passing else _whole(log, kinds, taus, options)
    results = [replace(r, deviation=r.deviation.at_confidence(confidence)) for r in results]
    if plot is not None and len(kinds) > 1:
        _plot_kinds(results, len(kinds), plot)
    elif plot is not None and len(results) > 1:
        _plot_all(results, plot)
    else:
        output.plot(results, [r.recording.columns[0] for r in results], plot)
    output.notes([r.recording for r in results], options)
    output.show(results, options)


def _plot_all(results: list[_Measured], path: str) -> None:
    """All columns in one figure."""
    from allanite.cli import output
    from allanite.comparison.curves import of_deviations
    from allanite.plots import plot_compare

    curves = of_deviations({r.recording.columns[0]: r.deviation for r in results})
    output.save_figure(plot_compare(curves, title="Columns"), path)


def _plot_kinds(results: list[_Measured], kinds: int, path: str) -> None:
    """All kinds of a column in one figure; several columns get their name into the file's."""
    from allanite.cli import output
    from allanite.plots import plot_stability

    columns = [results[i : i + kinds] for i in range(0, len(results), kinds)]
    figures = [
        _Drawing(
            plot_stability(
                [r.deviation for r in own], recording=cast("Recording", own[0].recording)
            )
        )
        for own in columns
    ]
    output.plot(figures, [own[0].recording.columns[0] for own in columns], path)


@dataclass(frozen=True, slots=True)
class _Drawing:
    """A figure that is made."""

    figure: Figure

    def plot(self) -> Figure:
        """The figure."""
        return self.figure


def _streams(log: str, taus: str, options: LogOptions) -> bool:
    """Tell whether the log is to be taken as it comes, without being kept."""
    from allanite.cli.stream import too_large

    simple = options.trim is None and options.decimate is None and options.piece is None
    if not simple or not (is_number(taus) or taus == "octave"):
        return False
    return log == PIPE or too_large(log)


def _stream(log: str, options: LogOptions, taus: str) -> list[_Measured]:
    from allanite.cli.stream import deviations

    return [_Measured(stream, deviation) for stream, deviation in deviations(options, taus, log)]


def _whole(log: str, kinds: tuple[str, ...], taus: str, options: LogOptions) -> list[_Measured]:
    from allanite.cli.options import columns_of

    columns = columns_of(log, options, for_fit=False)
    from allanite import deviation

    grid = int(taus) if is_number(taus) else taus
    return [
        _Measured(column, getattr(deviation, kind)(column, taus=grid))
        for column in columns
        for kind in kinds
    ]


@dataclass(frozen=True, slots=True)
class _Measured:
    """A deviation with the recording it is of."""

    recording: Recording | Stream
    deviation: Deviation

    def to_dict(self) -> dict[str, Any]:
        """``allanite/adev/1`` of the contract."""
        from allanite._kernels import version

        head = {"schema": "allanite/adev/1", "version": version()}
        return {**head, "recording": self.recording.describe(), **self.deviation.to_dict()}

    def __str__(self) -> str:
        r = self.recording
        what = f"{r.n} samples at {r.rate:g} Hz ({r.duration:.6g} s), {r.unit}"
        return f"{r.path or 'recording'} · {r.columns[0]} · {what}\n{self.deviation}"

    def plot(self) -> Figure:
        """The curve with its interval, where one is known."""
        from allanite.plots import plot_deviation, plot_stability

        recording = cast("Recording", self.recording)
        if self.deviation.unit == "1":
            return plot_stability([self.deviation], recording=recording)
        return plot_deviation(self.deviation, recording=recording)
