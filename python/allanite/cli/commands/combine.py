"""allanite combine: combine several sensors of one axis into one."""

from __future__ import annotations

import click

from allanite.cli import output as out
from allanite.cli.options import (
    LogCommand,
    LogOptions,
    log_options,
    noise_model_option,
    plot_option,
    read_recording,
)
from allanite.common.errors import InputError


@click.command(
    "combine",
    cls=LogCommand,
    epilog="Example: allanite combine four-imus.csv --column gyro0_x --column gyro1_x --save gyro_x.json",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@noise_model_option("Noise model of each sensor: a sum of random effects.")
@click.option(
    "--tau",
    type=click.FloatRange(0.0, min_open=True),
    metavar="SECONDS",
    help="Averaging time for which the weights are optimized. Default: all averaging times.",
)
@click.option("--save", metavar="FILE", help="Write the noise model of the combination as JSON.")
@plot_option
@log_options
def command(
    logs: tuple[str, ...],
    model: str,
    tau: float | None,
    save: str | None,
    plot: str | None,
    options: LogOptions,
) -> None:
    """Combine several sensors that measure the same axis into one by a weighted mean.

    With one LOG, the sensors are on one board: columns whose names differ in a number (gyro0_x, gyro1_x), or the columns
    named with --column. With several LOGs, each LOG is another board; all are combined. Boards
    are taken as independent, so that the LOGs may have different times and rates.

    Prints the best weights, and the Allan deviation of the combination at each τ against that of the single sensors. Names
    the sensors that are noisier or quieter than the others. allanite export reads the file of --save.
    """
    from allanite.combination import combine
    from allanite.combination.combine import units_of

    out.check_targets(plot, save)
    recordings = [read_recording(log, options) for log in logs]
    groups = units_of(recordings, named=bool(options.reading.column))
    if save is not None and len(groups) > 1:
        raise InputError(
            "--save writes one combination, found several axes: choose one with --column"
        )
    for log, recording in zip(logs, recordings, strict=True):
        out.print_findings(list(recording), options, log if len(logs) > 1 else "")
    found = []
    for name, units in groups.items():
        with out.progress(name, options) as on_progress:
            found.append(combine(units, model, tau=tau, on_progress=on_progress))
    out.save_figures((one.plot() for one in found), list(groups), plot)
    if save is not None:
        found[0].save(save)
    out.print_results(found, options)
