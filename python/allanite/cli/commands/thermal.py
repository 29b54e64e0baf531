"""allanite thermal: bias as a function of temperature."""

from __future__ import annotations

import click

from allanite.calibration.targets import TARGETS
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
from allanite.common.files import check_target, write_text


@click.command(
    "thermal",
    cls=LogCommand,
    epilog="Example: allanite thermal warmup1.csv warmup2.csv --export px4 --output thermal.params",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@noise_model_option(
    "Noise model of the axes: a sum of random effects. The temperature law is added to it."
)
@plot_option
@click.option(
    "--export",
    "target",
    type=click.Choice(tuple(TARGETS)),
    help="Write the law as PX4 or ArduPilot parameters, C code, CSV or JSON.",
)
@click.option("--output", metavar="FILE", help="File for --export. Default: standard output.")
@log_options
def command(
    logs: tuple[str, ...],
    model: str,
    plot: str | None,
    target: str | None,
    output: str | None,
    options: LogOptions,
) -> None:
    """Fit the bias of every axis as a function of temperature, b(T).

    Give one LOG for each switch-on of the same sensor. In each LOG the sensor is at rest, and its temperature changes: a
    warm-up, or a run in a chamber. Name the temperature column with --covariate if it is not recognized.

    Polynomials, a thermal lag, hysteresis and a dependence on the rate of change are fitted together with the noise.
    The evidence (logL minus a cost for each parameter) decides which of these terms are kept. Prints the chosen law of
    each axis with its 95 % band, and the error that remains after correction.
    """
    from allanite.calibration import thermal

    out.check_targets(plot)
    if output is not None:
        if target is None:
            raise InputError("--output needs --export: it names the file of --export")
        check_target(output)
    if target is not None and output is None and options.as_json:
        raise InputError("--export and --json both use standard output: add --output FILE")
    covariates = options.reading.covariates
    if len(covariates) > 1:
        raise InputError("give only one --covariate: the column of the temperature")
    recordings = [read_recording(log, options) for log in logs]
    if target is None or output is not None:
        for log, recording in zip(logs, recordings, strict=True):
            out.print_findings(list(recording), options, log if len(logs) > 1 else "")
    count = len([n for n in recordings[0].columns if all(n in r.columns for r in recordings)])
    with out.progress_of_axes(count, options) as on_progress:
        found = thermal(
            recordings,
            model,
            temperature=covariates[0] if covariates else None,
            on_progress=on_progress,
        )
    if plot is not None:
        out.save_figure(found.plot(), plot)
    if target is None or output is not None:
        out.print_results([found], options)
    if target is not None:
        text = found.export(target)
        if output is None:
            click.echo(text, nl=False)
        else:
            write_text(output, text)
