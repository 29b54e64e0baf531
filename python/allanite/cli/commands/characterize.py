"""allanite characterize: every axis at once."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.commands.improve import Percent
from allanite.cli.options import (
    INFLATE,
    LogOptions,
    log_options,
    model_option,
    plot_option,
    time_option,
)
from allanite.cli.words import words_of
from allanite.common.plain import plain
from allanite.export import TARGETS, export_files
from allanite.study import MAX_ADDED_EFFECTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.axes import Characterization
    from allanite.recording import Recording


@click.command("characterize")
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@model_option
@click.option(
    "--tolerance",
    type=Percent(),
    help="Stop once a model is within this much of the deviation, e.g. 5%.",
)
@click.option(
    "--steps",
    type=click.IntRange(1),
    default=MAX_ADDED_EFFECTS,
    show_default=True,
    help="Most additions to a model; lines and excluded samples do not count.",
)
@time_option
@plot_option
@click.option("--report", metavar="FILE", help="Report on all axes: HTML or Markdown.")
@click.option("--save", metavar="FILE", help="Write the models of all axes as JSON.")
@click.option(
    "--export",
    "target",
    type=click.Choice((*TARGETS, "all")),
    help="Parameters of all axes for a filter or simulator; all: one file per target.",
)
@click.option(
    "--output",
    metavar="PATH",
    help="File for --export, or a folder (with / at its end) for all files: those of an axis are written as soon as it is"
    " finished, and a repeated run continues.",
)
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
    "--working",
    metavar="LOG",
    help="The same sensor with motors or engine running: files for filters then follow its noise at work.",
)
@INFLATE
@click.option(
    "--horizon",
    type=float,
    metavar="SECONDS",
    help="With --export: longest time without aiding (default: 100 s, or a tenth of the log).",
)
@log_options
def command(
    logs: tuple[str, ...],
    model: str,
    tolerance: float | None,
    steps: int,
    seconds: float | None,
    plot: str | None,
    report: str | None,
    save: str | None,
    target: str | None,
    output: str | None,
    overbound: bool,
    as_fitted: bool,
    working: str | None,
    inflate: float,
    horizon: float | None,
    options: LogOptions,
) -> None:
    """Improve a model of every axis of the first LOG: one table, what the axes share, figure, report and exports.

    Further LOGs of the same sensor, each after a switch-on of its own, tell the bias at switch-on: its spread, the share of
    temperature, and the initial covariance of filters.

    With --output FOLDER/ the model, table and parameter files of each axis are written as soon as the axis is finished.
    After an interrupt, or with more --steps or --time, the same command continues from the saved models.
    """
    from allanite.axes import characterize
    from allanite.axes.turn_on import turn_on_biases
    from allanite.cli import output as out
    from allanite.cli.options import recordings_of
    from allanite.cli.run_folder import RunFolder
    from allanite.common.files import whole_file
    from allanite.effects.files import parse_model

    parsed = parse_model(model)
    in_folder = _is_folder(target, output)
    _check(plot, report, save, target, output, in_folder=in_folder)
    suits = None if target is None else partial(_refuse, target)
    recordings = recordings_of(logs[0], options, suits)
    further = [recordings_of(log, options) for log in logs[1:]]
    at_work = _at_work(working, options, recordings)
    how: dict[str, Any] = {
        "overbound": overbound,
        "as_fitted": as_fitted,
        "horizon": horizon,
        "inflate": inflate,
    }
    folder, starts = None, {}
    if in_folder:
        assert output is not None
        turn_on = turn_on_biases(recordings, further)
        targets = TARGETS if target == "all" else (target,) if target is not None else ()
        folder = RunFolder(Path(output), targets, how, f"{tolerance}", at_work, turn_on)
        starts = {c.columns[0]: folder.start_of(c, parsed) for r in recordings for c in r.measured}
    count = sum(len(recording.columns) for recording in recordings)
    try:
        with out.progress_of_axes(count, options) as on_progress:
            found = characterize(
                recordings,
                starts or parsed,
                on_progress,
                limit=steps,
                tolerance=tolerance,
                seconds=seconds,
                on_study=None if folder is None else folder.write,
                working=at_work,
                further=further,
            )
    except KeyboardInterrupt:
        if folder is not None and folder.finished:
            done = ", ".join(folder.finished)
            click.echo(plain(f"{output}: holds {done}; the same command continues"), err=True)
        raise
    written = []
    if plot is not None:
        out.phase("figure", options)
        out.save_figure(found.plot(), plot)
        written.append(plot)
    if report is not None:
        out.phase("report", options)
        found.report().save(report)
        written.append(report)
    if save is not None:
        with whole_file(save) as draft:
            draft.write_text(out.dumps(found.to_dict()) + "\n", encoding="utf-8")
        written.append(save)
    if target is not None:
        _warn(found)
    if folder is not None:
        out.phase("files of all axes", options)
        written += folder.finish(found)
    elif target is not None and output is not None:
        for path, text in export_files(found.export_axes(), target, Path(output), **how).items():
            with whole_file(path) as draft:
                draft.write_text(text, encoding="utf-8")
            written.append(str(path))
    if options.as_json:
        click.echo(out.dumps(found.to_dict()))
        return
    click.echo(found.table(out.width(), words_of(options.trim)))
    if written and not options.quiet:
        click.echo(f"\nwritten: {plain(', '.join(written))}")


def _at_work(
    working: str | None, options: LogOptions, rest: Sequence[Recording]
) -> list[Recording]:
    """The working log as it is read with the same options; it may move, and is used whole."""
    from dataclasses import replace

    from allanite.axes.working import check_working
    from allanite.cli.options import recordings_of
    from allanite.common.errors import about

    if working is None:
        return []
    own = replace(options, anyway=True, trim=None, quiet=True)
    found = recordings_of(working, own)
    with about(working):
        check_working(rest, found)
    return found


def _is_folder(target: str | None, output: str | None) -> bool:
    """Whether --output names a folder: by a slash at its end, by being one, or for all targets."""
    return output is not None and (
        target == "all" or output.endswith(("/", "\\")) or Path(output).is_dir()
    )


def _check(
    plot: str | None,
    report: str | None,
    save: str | None,
    target: str | None,
    output: str | None,
    *,
    in_folder: bool,
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
    if target is not None and output is None:
        raise InputError("--export needs --output beside it: a file, or a folder with / at its end")
    if output is not None and not in_folder:
        if target is None:
            raise InputError(
                f"--output {output} needs --export TARGET beside it, or a / at its end for a folder"
            )
        check_target(output)


def _refuse(target: str, recordings: Sequence[Recording]) -> None:
    """Refuse columns that the target has no place for before minutes are spent on their models."""
    from allanite.common.errors import InputError
    from allanite.common.units import FREQUENCY, parse_unit
    from allanite.effects.files import model_to_dict, parse_model
    from allanite.export._axis import axes_of
    from allanite.readers.sensor_names import sensor_kind
    from allanite.readers.unit_names import remedy_of
    from allanite.recording.findings import named

    pairs = [pair for r in recordings for pair in zip(r.columns, r.units, strict=True)]
    bare = [c for c, unit in pairs if sensor_kind(c) and parse_unit(unit).kind == FREQUENCY]
    if bare and (target == "all" or not TARGETS[target].any_sensor):
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
    export_files(axes_of(tried), target, Path(target))


def _warn(found: Characterization) -> None:
    """Name the axes whose fit is not adequate."""
    from allanite.export._axis import warning_of

    for name, study in found.studies.items():
        warning = warning_of(study.fit.body(searched=False))
        if warning:
            click.echo(plain(f"! {name}: {warning}"), err=True)
