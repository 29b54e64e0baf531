"""allanite compare: compare logs, models and data sheets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from allanite.cli import output
from allanite.cli.models import models_of
from allanite.cli.options import (
    LogCommand,
    LogOptions,
    log_options,
    model_option,
    plot_option,
    read_columns,
)
from allanite.common.choices import SENSOR_START
from allanite.common.errors import InputError
from allanite.common.files import exists, is_file
from allanite.common.units import parse_unit

#: Suffixes of model files and data sheets, which are never logs, and of items that are logs even if the file is missing.
MODEL_SUFFIXES = (".json", ".toml", ".yaml", ".yml", ".m")
LOG_SUFFIXES = (".csv", ".txt", ".npy", ".npz", ".mat")


@click.command(
    "compare",
    cls=LogCommand,
    epilog="Example: allanite compare monday.csv tuesday.csv gyro.toml --plot compare.svg",
)
@click.argument("items", nargs=-1, required=True, metavar="LOG|MODEL...")
@click.option(
    "--sheet",
    "--datasheet",
    "sheet",
    metavar="FILE",
    help="Compare the coefficients of each log with the figures of this data sheet (TOML or JSON).",
)
@model_option
@plot_option
@log_options
def command(
    items: tuple[str, ...],
    sheet: str | None,
    model: str | None,
    plot: str | None,
    options: LogOptions,
) -> None:
    """Compare the Allan deviations of logs, models and data sheets in one table and figure.

    Each item is a log, a model (a string or a file), a data sheet, a YAML file of Kalibr or imu_utils, or a table of Allan
    deviations. The table shows the ratio of each item to the first item.

    With --sheet, MODEL is fitted to each log, and each figure of the sheet is compared with the fitted coefficient.
    A data sheet is a TOML file. Its figures are in a table [figures], or in [gyroscope] and [accelerometer]:

    \b
      name = "MEMS gyroscope"
      [figures]
      noise_density = "0.03 deg/s/sqrt(Hz)"   # one-sided; or "0.02 deg/s/sqrt(Hz) two-sided"
      angle_random_walk = "1.27 deg/sqrt(h)"
      bias_instability = "18 deg/h"           # the coefficient B
      in_run_bias_stability = "12 deg/h"      # the minimum of the Allan deviation
      rate_random_walk = "1 deg/h^1.5"
    """  # noqa: D301
    from allanite.comparison.curves import Drawn, compare
    from allanite.sources.deviation_table import curves_of_table

    output.check_targets(plot)
    named: list[tuple[str, Any, str | None]] = []
    columns = []
    for item, label in zip(items, _item_labels(items), strict=True):
        if _is_table(item):
            for name, unit, tau, deviation in curves_of_table(Path(item), options.reading.unit):
                curve = Drawn(f"{label} {name}", "recording", unit, tau, deviation)
                named.append((curve.name, curve, unit))
        elif _is_log(item):
            for column in read_columns(item, options):
                columns.append(column)
                named.append((f"{label} {column.columns[0]}", column, None))
        else:
            named += [
                (m.name, m.model, m.unit) for m in models_of(item, None, options.reading.rate_hz)
            ]
    results: list[Any] = []
    unit_of_models = options.output_unit or options.reading.unit
    if sheet is not None:
        results += _datasheet_comparisons(columns, sheet, model or SENSOR_START)
    if sheet is None or len(named) > 1:
        results.append(compare(named, rate=options.reading.rate_hz, unit=unit_of_models))
    if plot is not None:
        if sheet is not None:
            named += [(m.name, m.model, m.unit) for m in _models_of_sheet(sheet, columns)]
        output.save_figure(
            compare(named, rate=options.reading.rate_hz, unit=unit_of_models).plot(), plot
        )
    output.print_findings(columns, options)
    output.print_results(results, options)


def _item_labels(items: Sequence[str]) -> list[str]:
    """List of the base names of the items; ``folder/name`` for an item whose base name occurs more than once."""
    names = [Path(item).name for item in items]
    return [
        f"{Path(item).parent.name}/{name}" if names.count(name) > 1 else name
        for item, name in zip(items, names, strict=True)
    ]


def _is_table(item: str) -> bool:
    """True if the item is an existing .csv, .txt, .dat or .tsv file whose content is a table of Allan deviations."""
    from allanite.sources.deviation_table import is_deviation_table

    path = Path(item)
    return (
        path.suffix.lower() in {".csv", ".txt", ".dat", ".tsv"}
        and is_file(path)
        and is_deviation_table(path)
    )


def _models_of_sheet(datasheet: str, columns: list[Any]) -> list[Any]:
    """Models from a data sheet for the kinds of sensor of these columns; empty if it states too few values."""
    kinds = {parse_unit(column.unit).kind for column in columns}
    try:
        found = models_of(datasheet)
    except InputError:
        return []
    return [m for m in found if m.unit is not None and parse_unit(m.unit).kind in kinds]


def _is_log(item: str) -> bool:
    """True if the item is a file or folder that exists, or a name that ends like a log, such as .csv.

    False for a name that ends like a model file or data sheet, such as .json, even if it exists.
    """
    if Path(item).suffix.lower() in MODEL_SUFFIXES:
        return False
    return exists(item) or Path(item).suffix.lower() in LOG_SUFFIXES


def _datasheet_comparisons(columns: list[Any], datasheet: str, model: str) -> list[Any]:
    """List of comparisons with a data sheet, one for each column that the sheet covers.

    `model`, plus the effects that the figures of the sheet need, is fitted. Raises `InputError` if the sheet covers no
    column.
    """
    from allanite.comparison.datasheet import compare_datasheet, with_figures
    from allanite.effects.files import parse_model
    from allanite.sources.datasheet import read_datasheet

    sheet = read_datasheet(datasheet)
    parsed = with_figures(parse_model(model), sheet)
    compared = [c for c in columns if sheet.of_kind(parse_unit(c.unit).kind).figures]
    if not compared:
        raise InputError(f"{datasheet} has no figure for the kinds of sensor in the logs")
    return [
        compare_datasheet(parsed.fit(column), sheet.of_kind(parse_unit(column.unit).kind))
        for column in compared
    ]
