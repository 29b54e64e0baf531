"""allanite adev: the deviation of a log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import click

from allanite.cli.options import LogOptions, is_number, log_options, plot_option
from allanite.cli.pipe import PIPE
from allanite.common.errors import InputError
from allanite.deviation import ESTIMATORS

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.cli.stream import Stream
    from allanite.deviation import Deviation
    from allanite.recording import Recording

#: Averaging times by name.
GRIDS = ("octave", "decade", "all")


@click.command("adev")
@click.argument("log")
@click.option(
    "--kind",
    type=click.Choice(tuple(ESTIMATORS)),
    default="oadev",
    show_default=True,
    help="Which deviation.",
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
def command(log: str, kind: str, taus: str, plot: str | None, options: LogOptions) -> None:
    """Allan deviation of LOG: tau, deviation, 95 % interval.

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
    passing = _streams(log, kind, taus, options)
    results = _stream(log, options, taus) if passing else _whole(log, kind, taus, options)
    if plot is not None and len(results) > 1:
        _plot_all(results, plot)
    else:
        output.plot(results, [r.recording.columns[0] for r in results], plot)
    output.notes([r.recording for r in results], options)
    output.show(results, options)


def _plot_all(results: list[_Measured], path: str) -> None:
    """All columns in one figure."""
    from allanite.comparison.curves import of_deviations
    from allanite.plots import plot_compare

    curves = of_deviations({r.recording.columns[0]: r.deviation for r in results})
    plot_compare(curves, path, title="Columns")


def _streams(log: str, kind: str, taus: str, options: LogOptions) -> bool:
    """Tell whether the log is to be taken as it comes, without being kept."""
    from allanite.cli.stream import too_large

    simple = options.trim is None and options.decimate is None and options.piece is None
    if kind != "oadev" or not simple or not (is_number(taus) or taus == "octave"):
        return False
    return log == PIPE or too_large(log)


def _stream(log: str, options: LogOptions, taus: str) -> list[_Measured]:
    from allanite.cli.stream import deviations

    return [_Measured(stream, deviation) for stream, deviation in deviations(options, taus, log)]


def _whole(log: str, kind: str, taus: str, options: LogOptions) -> list[_Measured]:
    from allanite.cli.options import columns_of

    columns = columns_of(log, options, for_fit=False)
    from allanite import deviation

    estimate = getattr(deviation, kind)
    grid = int(taus) if is_number(taus) else taus
    return [_Measured(column, estimate(column, taus=grid)) for column in columns]


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

    def plot(self, path: Path) -> None:
        """Draw the curve with its interval, where one is known."""
        from allanite.plots import plot_deviation

        plot_deviation(self.deviation, path, recording=cast("Recording", self.recording))
