"""allanite fit: fit a noise model."""

from __future__ import annotations

import click

from allanite.cli import output
from allanite.cli.models import start_models
from allanite.cli.options import (
    LogCommand,
    LogOptions,
    log_options,
    model_option,
    plot_option,
    read_columns,
)
from allanite.common.choices import METHODS


@click.command(
    "fit",
    cls=LogCommand,
    epilog='Example: allanite fit imu.csv --column gyro_x --model "N+B+K" --output-unit deg/h --save gyro_x.json',
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@model_option
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default="whittle",
    show_default=True,
    help="Estimator. whittle: likelihood of the spectrum, recommended; gls: generalized least squares on the Allan curve,"
    " to confirm it; lines: classical straight lines on the Allan curve, to compare with published results.",
)
@click.option(
    "--compare-methods",
    is_flag=True,
    help="Compare the results of all three methods.",
)
@click.option(
    "--save",
    metavar="FILE",
    help="Write the fitted models as JSON, for allanite export, simulate, predict, watch.",
)
@plot_option
@log_options
def command(
    logs: tuple[str, ...],
    model: str | None,
    method: str,
    compare_methods: bool,
    save: str | None,
    plot: str | None,
    options: LogOptions,
) -> None:
    """Fit MODEL to each sensor column in LOG.

    Prints a table of the coefficients with 95 % intervals, and how well the model fits. A coefficient that agrees with
    zero is not detected: the table shows its 95 % upper limit. "adequate" means that the model agrees with the spectrum
    and the Allan curve. allanite check also searches for effects that the model lacks. LOG is a file, or - for standard
    input.

    Several columns or logs are fitted one by one. For columns of one kind, such as several logs of one sensor, a table
    follows. Its row "all" has the common values, and the p-value of agreement is below 0.05 if the logs differ.
    """
    columns = [column for log in logs for column in read_columns(log, options)]
    output.check_targets(plot, save)
    starts = start_models(model, columns)
    fits = [m.fit(column, method=method) for m, column in zip(starts, columns, strict=True)]
    if save is not None:
        output.save_fits(fits, save)
    names = [c.columns[0] for c in columns]
    if len(logs) > 1:
        names = [f"{number}-{name}" for number, name in enumerate(names, start=1)]
    output.save_figures((fit.plot() for fit in fits), names, plot)
    output.print_findings(columns, options)
    results = [fit.compare_methods() for fit in fits] if compare_methods else fits
    if len(fits) == 1:
        output.print_results(results, options)
        return
    from allanite.fit.several import of_fits
    from allanite.recording.sensor_names import kind_of_sensor

    # Without units in the log, a gyroscope and an accelerometer have the same unit. They must not be pooled.
    sensors = [(c.unit, kind_of_sensor(c.columns[0], c.unit)) for c in columns]
    groups = [
        [fit for fit, own in zip(fits, sensors, strict=True) if own == sensor]
        for sensor in dict.fromkeys(sensors)
    ]
    together = [of_fits(group) for group in groups if len(group) > 1]
    if options.as_json:
        documents = [result.to_dict() for result in results]
        document = {
            "schema": documents[0]["schema"],
            "columns": documents,
            "pooled": [many.pooled_dict() for many in together],
        }
        click.echo(output.json_text(document))
        return
    output.print_results(results, options)
    for many in together:
        click.echo(output.wrapped_to_terminal(f"\n{many}"))
