"""allanite combine: several units of one axis as one sensor."""

from __future__ import annotations

import click

from allanite.cli.options import DEFAULT_MODEL, LogOptions, log_options, plot_option


@click.command("combine")
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--model",
    default=DEFAULT_MODEL,
    show_default=True,
    metavar="MODEL",
    help="Noise of each unit: a sum of random effects.",
)
@click.option(
    "--tau",
    type=click.FloatRange(0.0, min_open=True),
    metavar="SECONDS",
    help="Averaging time at which the weights are best (default: over all times).",
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
    """What averaging several units of one axis gains at each τ, with which weights, and which unit deviates.

    One LOG holds units on one board: columns whose names differ in a number (gyro0_x, gyro1_x), or those named with
    --column. Several LOGs are different boards, with one unit of each axis or more in each. The model of --save goes into
    allanite export with the unit of the log.
    """
    from allanite.cli import output as out
    from allanite.cli.options import recording_of
    from allanite.combination import combine
    from allanite.combination.combine import units_of
    from allanite.common.errors import InputError

    out.check_targets(plot, save)
    recordings = [recording_of(log, options) for log in logs]
    groups = units_of(recordings, named=bool(options.column))
    if save is not None and len(groups) > 1:
        raise InputError("--save holds one combination: choose one axis with --column")
    found = []
    for name, units in groups.items():
        for unit in units:
            out.notes(list(unit), options)
        with out.progress(name, options) as on_progress:
            found.append(combine(units, model, tau=tau, on_progress=on_progress))
    out.plot(found, list(groups), plot)
    if save is not None:
        found[0].model.save(save)
    out.show(found, options)
