"""allanite improve: the ladder."""

from __future__ import annotations

import click

from allanite.cli.options import LogOptions, log_options, model_option, plot_option


class Percent(click.types.FloatParamType):
    """A positive number of per cent, with or without the sign."""

    name = "percent"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """The number; a float is one already."""
        text = str(value).strip().removesuffix("%").strip()
        try:
            number = float(text)
        except ValueError:
            number = -1.0
        if not 0.0 < number < float("inf"):
            self.fail(f"{value!r} is not a positive number of per cent, e.g. 5%", param, ctx)
        return number


@click.command("improve")
@click.argument("log")
@model_option
@click.option("--save", metavar="FILE", help="Write the last rung's model as JSON.")
@click.option(
    "--tolerance",
    type=Percent(),
    help="Stop once the model is within this much of the deviation, e.g. 5%.",
)
@plot_option
@log_options
def command(
    log: str,
    model: str,
    save: str | None,
    tolerance: float | None,
    plot: str | None,
    options: LogOptions,
) -> None:
    """Check, add the best effect, refit LOG, until nothing helps; print the ladder."""
    from allanite.cli import output
    from allanite.cli.options import columns_of
    from allanite.effects.files import parse_model

    parsed = parse_model(model)
    columns = columns_of(log, options)
    output.check_targets(plot, save, len(columns))
    from allanite.study import improve

    studies = []
    for column in columns:
        with output.progress(column.columns[0], options) as on_progress:
            studies.append(improve(column, parsed, on_progress, tolerance=tolerance))
    if save is not None:
        with output.whole_file(save) as draft:
            studies[0].fit.save(draft)
    output.plot(studies, [c.columns[0] for c in columns], plot)
    output.notes(columns, options)
    output.show(studies, options)
