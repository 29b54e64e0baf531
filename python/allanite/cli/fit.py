"""allanite fit: coefficients of a model."""

from __future__ import annotations

import click

from allanite.cli.options import LogOptions, log_options, model_option, plot_option


@click.command("fit")
@click.argument("log")
@model_option
@click.option(
    "--method",
    type=click.Choice(["whittle", "gls", "lines"]),
    default="whittle",
    show_default=True,
    help="How to estimate.",
)
@click.option("--save", metavar="FILE", help="Write the fitted model as JSON.")
@plot_option
@log_options
def command(
    log: str, model: str, method: str, save: str | None, plot: str | None, options: LogOptions
) -> None:
    """Fit MODEL to LOG: coefficients with 95 % intervals."""
    from allanite.cli import output
    from allanite.cli.options import columns_of
    from allanite.effects.files import parse_model

    parsed = parse_model(model)
    columns = columns_of(log, options)
    output.check_targets(plot, save, len(columns))
    fits = [parsed.fit(column, method=method) for column in columns]
    if save is not None:
        with output.whole_file(save) as draft:
            fits[0].save(draft)
    output.plot(fits, [c.columns[0] for c in columns], plot)
    output.notes(columns, options)
    output.show(fits, options)
