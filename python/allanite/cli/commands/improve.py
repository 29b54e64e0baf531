"""allanite improve: build a model step by step."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
    time_option,
    tolerance_option,
)
from allanite.common.threads import results_or_raise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.study import Study


@click.command(
    "improve",
    cls=LogCommand,
    epilog="Example: allanite improve imu.csv --column gyro_x --save gyro_x.json --plot steps.svg",
)
@click.argument("log")
@model_option
@click.option("--save", metavar="FILE", help="Write the final models as JSON.")
@tolerance_option
@time_option
@plot_option
@log_options
def command(
    log: str,
    model: str | None,
    save: str | None,
    tolerance: float | None,
    seconds: float | None,
    plot: str | None,
    options: LogOptions,
) -> None:
    """Build a noise model of LOG step by step.

    Starting with MODEL, each step fits the model, searches for missing effects and adds the best one. The steps end
    when the model is adequate, no effect helps, or the time is up. At most 32 steps are made. Ctrl-C prints and
    saves the steps so far. Two columns are computed at a time. LOG is a file, or - for standard input.

    Prints a row for each step, then the final coefficients. A row has the added effect, the unexplained misfit, the model
    discrepancy δ, the rms error of the Allan deviation and where it is worst, and the model. "prediction" tells how badly
    the model predicts samples that the fit has not used: lower is better.

    "adequate" means that this log shows no fault of the model. No effect is significantly missing, the Allan error is
    within twice its expected scatter, and no other model is clearly better. "unexplained" means that the model fails:
    no known effect repairs it, or the search reached its limit of time or of 32 steps, as the line "stopped" says. The exit
    code is 0 for every verdict; a script can use allanite check --strict.
    """
    from allanite.axes.run import improve_columns
    from allanite.study import SearchInterrupted, improve

    columns = read_columns(log, options)
    starts = start_models(model, columns)
    output.check_targets(plot, save)
    names = [c.columns[0] for c in columns]

    def write(studies: Sequence[Study]) -> None:
        """Write the fits and the figures to files if --save and --plot are given, and print findings and results."""
        if save is not None:
            output.save_fits([study.fit for study in studies], save)
        output.save_figures((study.plot() for study in studies), names, plot)
        output.print_findings(columns, options)
        output.print_results(studies, options)

    if len(columns) > 1:
        with output.progress_of_axes(len(columns), options) as on_axes:
            found = improve_columns(columns, starts, on_axes, tolerance=tolerance, seconds=seconds)
        write(results_or_raise(found))
        return
    try:
        with output.progress(names[0], options) as on_progress:
            study = improve(
                columns[0], starts[0], on_progress, tolerance=tolerance, seconds=seconds
            )
    except SearchInterrupted as interrupt:
        write([interrupt.study])
        raise
    write([study])
