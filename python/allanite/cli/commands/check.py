"""allanite check: test a model and suggest missing effects."""

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


@click.command(
    "check",
    cls=LogCommand,
    epilog="Example: allanite check imu.csv --column gyro_x --model N+B+K --plot check.svg",
)
@click.argument("log")
@model_option
@click.option("--strict", is_flag=True, help="Exit with code 1 unless every model is adequate.")
@plot_option
@log_options
@click.pass_context
def command(
    ctx: click.Context,
    log: str,
    model: str | None,
    strict: bool,
    plot: str | None,
    options: LogOptions,
) -> None:
    """Fit MODEL to LOG; show where the model fails and which effects are missing.

    Prints for each column whether the model is adequate, the averaging times and frequencies where the model fails,
    and a ranked list of missing effects with their evidence. "adequate" means that no view (Allan curve, spectrum,
    record over time) fails, and no effect is significantly missing; an effect that is too weak for this log is not
    found. If the model is complete, a check still reports a missing effect in 1 % of cases. allanite improve adds
    these effects.

    The exit code is 0 for every verdict. With --strict it is 1 unless every model is adequate. LOG is a file, or - for
    standard input.
    """
    columns = read_columns(log, options)
    output.check_targets(plot)
    starts = start_models(model, columns)
    checks = []
    for column, own in zip(columns, starts, strict=True):
        with output.progress(column.columns[0], options) as on_progress:
            checks.append(own.fit(column).check(on_progress=on_progress))
    output.save_figures((check.plot() for check in checks), [c.columns[0] for c in columns], plot)
    output.print_findings(columns, options)
    output.print_results(checks, options)
    if strict and any(check.verdict != "adequate" for check in checks):
        ctx.exit(1)
