"""allanite characterize: every axis at once."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.commands.improve import Percent
from allanite.cli.options import LogOptions, log_options, model_option, plot_option
from allanite.cli.words import words_of
from allanite.common.plain import plain
from allanite.export import ANY_SENSOR, TARGETS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.axes import Characterization
    from allanite.recording import Recording


@click.command("characterize")
@click.argument("log")
@model_option
@click.option(
    "--tolerance",
    type=Percent(),
    help="Stop once a model is within this much of the deviation, e.g. 5%.",
)
@plot_option
@click.option("--report", metavar="FILE", help="Report on all axes: HTML or Markdown.")
@click.option("--save", metavar="FILE", help="Write the models of all axes as JSON.")
@click.option(
    "--export",
    "target",
    type=click.Choice((*TARGETS, "all")),
    help="Parameters of all axes for a filter or simulator; all: a file a target.",
)
@click.option("--output", metavar="FILE", help="Where --export writes: a file; of all, a folder.")
@click.option(
    "--overbound",
    is_flag=True,
    help="With --export: smallest N and K that cover the 95 % limits of the models.",
)
@click.option(
    "--as-fitted",
    is_flag=True,
    help="With --export: the fitted coefficients alone, without B, lags and lines.",
)
@click.option(
    "--horizon",
    type=float,
    metavar="SECONDS",
    help="With --export: longest time without aiding (default: 100 s, or a tenth of the log).",
)
@log_options
def command(
    log: str,
    model: str,
    tolerance: float | None,
    plot: str | None,
    report: str | None,
    save: str | None,
    target: str | None,
    output: str | None,
    overbound: bool,
    as_fitted: bool,
    horizon: float | None,
    options: LogOptions,
) -> None:
    """Improve a model of every axis of LOG: one table, what the axes share, figure, report and exports."""
    from allanite.axes import characterize
    from allanite.cli import output as out
    from allanite.cli.options import recordings_of
    from allanite.common.files import whole_file
    from allanite.effects.files import parse_model

    parsed = parse_model(model)
    _check(plot, report, save, target, output)
    suits = None if target is None else partial(_refuse, target)
    recordings = recordings_of(log, options, suits)
    count = sum(len(recording.columns) for recording in recordings)
    with out.progress_of_axes(count, options) as on_progress:
        found = characterize(recordings, parsed, on_progress, tolerance=tolerance)
    written = []
    if plot is not None:
        found.plot(plot)
        written.append(plot)
    if report is not None:
        found.report().save(report)
        written.append(report)
    if save is not None:
        with whole_file(save) as draft:
            draft.write_text(out.dumps(found.to_dict()) + "\n", encoding="utf-8")
        written.append(save)
    if target is not None and output is not None:
        how = {"overbound": overbound, "as_fitted": as_fitted, "horizon": horizon}
        written += _export(found, target, Path(output), how)
    if options.as_json:
        click.echo(out.dumps(found.to_dict()))
        return
    click.echo(found.table(out.width(), words_of(options.trim)))
    if written and not options.quiet:
        click.echo(f"\nwritten: {plain(', '.join(written))}")


def _check(
    plot: str | None, report: str | None, save: str | None, target: str | None, output: str | None
) -> None:
    """Refuse what cannot be written before anything long is computed."""
    from allanite.cli import output as out
    from allanite.common.errors import InputError
    from allanite.common.files import check_target
    from allanite.report.document import kind_of

    out.check_targets(plot, save)
    if report is not None:
        kind_of(Path(report))
        check_target(report)
    if (target is None) != (output is None):
        given, other = (
            ("--output", "--export TARGET") if target is None else ("--export", "--output FILE")
        )
        raise InputError(f"{given} needs {other} beside it")
    if output is None:
        return
    if target != "all":
        check_target(output)
    elif not Path(output).is_dir():
        raise InputError(f"--output {output}: --export all writes into a folder that exists")


def _refuse(target: str, recordings: Sequence[Recording]) -> None:
    """Refuse columns that the target has no place for before minutes are spent on their models."""
    from allanite.common.errors import InputError
    from allanite.common.units import FREQUENCY, parse_unit
    from allanite.effects.files import model_to_dict, parse_model
    from allanite.export import export
    from allanite.export._axis import axes_of
    from allanite.readers.sensor_names import sensor_kind
    from allanite.readers.unit_names import remedy_of
    from allanite.recording.findings import named

    pairs = [pair for r in recordings for pair in zip(r.columns, r.units, strict=True)]
    bare = [c for c, unit in pairs if sensor_kind(c) and parse_unit(unit).kind == FREQUENCY]
    if bare and target not in ANY_SENSOR:
        raise InputError(
            f"{named(bare)} {'have' if len(bare) > 1 else 'has'} no unit, which {target} needs",
            missing="unit",
            remedy=": " + remedy_of(bare),
        )
    if target == "all":
        return
    # What the target says of a model of white noise it will say of any.
    model = model_to_dict(parse_model("N(N=1)+K(K=1)"))
    tried = (
        {**model, "recording": {"column": c, "unit": unit, "rate_hz": r.rate}}
        for r in recordings
        for c, unit in zip(r.columns, r.units, strict=True)
    )
    export(axes_of(tried), target)


def _export(found: Characterization, target: str, output: Path, how: dict[str, Any]) -> list[str]:
    """Write one target, or all that have a place for these axes."""
    from allanite.common.errors import InputError
    from allanite.common.files import whole_file
    from allanite.export._axis import warning_of

    for name, study in found.studies.items():
        warning = warning_of(study.fit.body(searched=False))
        if warning:
            click.echo(f"! {name}: {warning}", err=True)

    if target != "all":
        with whole_file(output) as draft:
            draft.write_text(found.export(target, **how), encoding="utf-8")
        return [str(output)]
    written = []
    for name in TARGETS:
        try:
            text = found.export(name, **how)
        except InputError as error:
            click.echo(f"! {name}: {error}", err=True)
            continue
        path = output / f"{name}.txt"
        with whole_file(path) as draft:
            draft.write_text(text, encoding="utf-8")
        written.append(str(path))
    return written
