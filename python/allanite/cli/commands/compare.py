"""allanite compare: logs, models and data sheets side by side."""

from __future__ import annotations

from typing import Any

import click

from allanite.cli.options import LogOptions, log_options, model_option, plot_option


@click.command("compare")
@click.argument("items", nargs=-1, required=True, metavar="LOG|MODEL...")
@click.option(
    "--datasheet",
    metavar="FILE",
    help="Compare each log with the figures of a data sheet (TOML, JSON).",
)
@model_option
@plot_option
@log_options
def command(
    items: tuple[str, ...], datasheet: str | None, model: str, plot: str | None, options: LogOptions
) -> None:
    """Compare logs, models (sums with values, or files) and a data sheet.

    The first item is the reference of the ratios. With --datasheet, MODEL is fitted to each log.
    """
    from allanite.cli import output
    from allanite.cli.models import models_of
    from allanite.cli.options import columns_of
    from allanite.comparison import compare

    output.check_targets(plot)
    named: list[tuple[str, Any, str | None]] = []
    columns = []
    for item in items:
        if _is_log(item):
            for column in columns_of(item, options):
                columns.append(column)
                named.append((f"{item} {column.columns[0]}", column, None))
        else:
            named += [(m.name, m.model, m.unit) for m in models_of(item)]
    results: list[Any] = []
    if datasheet is not None:
        results += _against_sheet(columns, datasheet, model)
    if len(named) > 1 or datasheet is None:
        curves = compare(named, rate=options.rate, unit=options.output_unit or options.unit)
        results.append(curves)
        if plot is not None:
            output.plot([curves], [""], plot)
    output.notes(columns, options)
    output.show(results, options)


def _is_log(item: str) -> bool:
    """Tell a log from a model; what looks like neither is left to the model parser."""
    from pathlib import Path

    if item.endswith(".json"):
        return False
    return Path(item).exists() or Path(item).suffix.lower() in {
        ".csv",
        ".txt",
        ".npy",
        ".npz",
        ".mat",
    }


def _against_sheet(columns: list[Any], datasheet: str, model: str) -> list[Any]:
    from allanite.common.errors import InputError
    from allanite.comparison.datasheet import compare_datasheet, read_datasheet
    from allanite.effects import find
    from allanite.effects.files import parse_model

    sheet = read_datasheet(datasheet)
    parsed = parse_model(model)
    present = {effect.kind for effect in parsed}
    for name in dict.fromkeys(figure.coefficient for figure in sheet.figures):
        effect = find(name.partition(".")[0])
        if effect is not None and effect.kind not in present:
            parsed = parsed + effect()
    fitting = [c for c in columns if _fits(sheet, c)]
    if not fitting:
        raise InputError(f"{datasheet}: no log given is of the kind of sensor of its figures")
    return [compare_datasheet(parsed.fit(column), sheet) for column in fitting]


def _fits(sheet: Any, column: Any) -> bool:
    """Tell whether the sheet speaks of this column's kind of sensor."""
    from allanite.common.errors import InputError

    try:
        sheet.figures[0].in_unit(column.unit)
    except InputError:
        return False
    return True
