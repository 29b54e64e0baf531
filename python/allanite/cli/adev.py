"""allanite adev: the deviation of a log."""

from __future__ import annotations

import click

from allanite.cli.options import LogOptions, log_options, plot_option

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
    results = [getattr(deviation, kind)(column, taus=grid) for column in columns]
    output.plot(results, [c.columns[0] for c in columns], plot)
    output.notes(columns, options)
    output.show(results, options)
