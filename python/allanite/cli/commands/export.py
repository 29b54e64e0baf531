"""allanite export: parameters for a filter or simulator."""

from __future__ import annotations

import click

from allanite.common.plain import plain
from allanite.export import TARGETS


@click.command("export")
@click.argument("models", nargs=-1, required=True, metavar="MODEL...")
@click.option(
    "--format",
    "target",
    type=click.Choice(tuple(TARGETS)),
    default="json",
    show_default=True,
    help="Target.",
)
@click.option(
    "--unit", metavar="UNIT", help="Unit of the samples, for a model without a recording."
)
@click.option("--rate", type=float, metavar="HZ", help="Sampling rate, where the target needs one.")
@click.option(
    "--overbound",
    is_flag=True,
    help="The smallest numbers above the model's upper limits at every τ, in place of those fitted.",
)
@click.option(
    "--until", type=float, metavar="SECONDS", help="Longest τ of use (default: a tenth of the log)."
)
@click.option(
    "--column", multiple=True, metavar="NAME", help="Axis of a file of several; repeatable."
)
@click.option("-o", "--output", metavar="FILE", help="File to write; default stdout.")
def command(
    models: tuple[str, ...],
    target: str,
    unit: str | None,
    rate: float | None,
    overbound: bool,
    until: float | None,
    column: tuple[str, ...],
    output: str | None,
) -> None:
    """Write the coefficients of MODELs (saved fits, or sums with values) for another program.

    Several models are several axes: three of a gyroscope, three of an accelerometer.
    """
    from pathlib import Path

    from allanite.common.files import whole_file
    from allanite.effects.files import model_to_dict, parse_model
    from allanite.export import export
    from allanite.export._axis import axes_of, documents_of
    from allanite.recording.samples import find_column

    axes = []
    for model in models:
        is_file = model.endswith(".json") or Path(model).is_file()
        documents = documents_of(model) if is_file else [model_to_dict(parse_model(model))]
        axes += axes_of(documents, unit, model)
    if column:
        names = [axis.name for axis in axes]
        axes = [axes[find_column(name, names)] for name in column]
    text = export(axes, target, rate, overbound=overbound, until=until)
    for axis in axes:
        if axis.warning:
            click.echo(plain(f"! {axis.name}: {axis.warning}; improve the model first"), err=True)
    if output is None:
        click.echo(text, nl=False)
        return
    with whole_file(output) as draft:
        draft.write_text(text, encoding="utf-8")
    click.echo(plain(f"{output}: {target} parameters of {', '.join(axis.name for axis in axes)}"))
