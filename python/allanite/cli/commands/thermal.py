"""allanite thermal: the law of temperature."""

from __future__ import annotations

from pathlib import Path

import click

from allanite.calibration.targets import TARGETS
from allanite.cli.options import DEFAULT_MODEL, LogOptions, log_options, plot_option


@click.command("thermal")
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--model",
    default=DEFAULT_MODEL,
    show_default=True,
    metavar="MODEL",
    help="Noise beside the law: a sum of random effects.",
)
@plot_option
@click.option(
    "--export", "target", type=click.Choice(tuple(TARGETS)), help="Write the law for a consumer."
)
@click.option("--output", metavar="FILE", help="File for --export (default: standard output).")
@log_options
def command(
    logs: tuple[str, ...],
    model: str,
    plot: str | None,
    target: str | None,
    output: str | None,
    options: LogOptions,
) -> None:
    """Law b(T) of every axis from warm-up or chamber logs, with a band, and what its correction leaves.

    Each LOG is the same sensor at rest while the temperature changes, after a switch-on of its own. Powers of the
    temperature, a lag, hysteresis and rate dependence are tried; the evidence under the noise of the axis chooses.
    Name the thermometer with --covariate if the log does not.
    """
    from allanite.calibration import thermal
    from allanite.cli import output as out
    from allanite.cli.options import recording_of
    from allanite.common.errors import InputError
    from allanite.common.files import check_target, whole_file

    out.check_targets(plot)
    if output is not None:
        if target is None:
            raise InputError("--output names the file of --export: give --export too")
        check_target(output)
    if target is not None and output is None and options.as_json:
        raise InputError("--export and --json both print to standard output: add --output FILE")
    if len(options.covariate) > 1:
        raise InputError("--covariate names the thermometer here: give one")
    recordings = [recording_of(log, options) for log in logs]
    if target is None or output is not None:
        for recording in recordings:
            out.notes(list(recording), options)
    count = len([n for n in recordings[0].columns if all(n in r.columns for r in recordings)])
    with out.progress("forms", options) as report:
        done: dict[str, float] = {}

        def on_progress(name: str, step: int, steps: int) -> None:
            done[name] = step / steps
            if report is not None:
                report(round(100 * sum(done.values())), 100 * count)

        found = thermal(
            recordings,
            model,
            temperature=options.covariate[0] if options.covariate else None,
            on_progress=on_progress,
        )
    if plot is not None:
        out.save_figure(found.plot(), plot)
    if options.as_json:
        click.echo(out.dumps(found.to_dict()))
    elif target is None or output is not None:
        click.echo(out.wrapped(str(found)))
    if target is not None:
        text = found.export(target)
        if output is None:
            click.echo(text, nl=False)
        else:
            with whole_file(Path(output)) as draft:
                draft.write_text(text, encoding="utf-8")
