"""allanite adev: the deviation of a log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.options import LogOptions, log_options, plot_option

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.deviation import Deviation
    from allanite.recording import Recording

KINDS = ("oadev", "adev", "mdev", "hdev", "tdev", "totdev")


@click.command("adev")
@click.argument("log")
@click.option(
    "--kind", type=click.Choice(KINDS), default="oadev", show_default=True, help="Which deviation."
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
    """Allan deviation of LOG: tau, deviation, 95 % interval."""
    from allanite.cli import output
    from allanite.cli.options import columns_of

    columns = columns_of(log, options)
    output.check_targets(plot)
    from allanite import deviation

    grid = int(taus) if taus.isdigit() else taus
    results = [_Measured(column, getattr(deviation, kind)(column, taus=grid)) for column in columns]
    output.plot(results, [c.columns[0] for c in columns], plot)
    output.notes(columns, options)
    output.show(results, options)


@dataclass(frozen=True, slots=True)
class _Measured:
    """A deviation with the recording it is of."""

    recording: Recording
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
        """Draw the curve with its interval."""
        from allanite.plots import plot_deviation

        plot_deviation(self.deviation, path, recording=self.recording)
