"""allanite report: one file to hand on."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from allanite.cli.options import LogOptions, log_options, model_option
from allanite.cli.pipe import PIPE
from allanite.common.plain import file_name, plain


@click.command("report")
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@model_option
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="Ends in .html (default: the log's name and -report.html, here) or .md.",
)
@click.option("--interactive", is_flag=True, help="Embed plotly, so that figures can be zoomed.")
@log_options
def command(
    logs: tuple[str, ...],
    model: str,
    output: str | None,
    interactive: bool,
    options: LogOptions,
) -> None:
    """Write what was recorded, the model, where it failed and what is left, as one file.

    With --json the same numbers go to standard output, and a file is written only if --output names one.
    """
    from allanite.cli import output as out
    from allanite.cli.options import columns_of
    from allanite.common.errors import InputError
    from allanite.effects.files import parse_model
    from allanite.report.document import Entry, Report, kind_of, make_report

    parsed = parse_model(model)
    target = _target(logs[0], output) if output or not options.as_json else None
    if target is not None:
        kind = kind_of(target)
        out.check_target(target)
        if interactive and kind != "html":
            raise InputError(f"{target}: only HTML can be interactive: end the name in .html")
    columns = [column for log in logs for column in columns_of(log, options)]
    entries: list[Entry] = []
    for column in columns:
        with out.progress(column.columns[0], options) as on_progress:
            entries += make_report(column, parsed, on_progress).entries
    report = Report(tuple(entries), _asked(logs, model, options))
    if target is not None:
        _write(report, target, interactive)
    if options.as_json:
        click.echo(out.dumps(report.to_dict()))
        return
    out.notes(columns, options)
    for entry in report.entries:
        click.echo(f"{entry.recording.columns[0]}: {entry.study.fit.model.name}")
    click.echo(f"written: {target}")


def _target(log: str, output: str | None) -> Path:
    if output is not None:
        return Path(output)
    return Path("report.html" if log == PIPE else f"{file_name(Path(log).stem)}-report.html")


def _write(report: object, target: Path, interactive: bool) -> None:
    from allanite.cli.output import whole_file
    from allanite.report.document import Report, kind_of
    from allanite.report.markdown import write_figures

    assert isinstance(report, Report)
    folder = target.with_name(f"{target.stem}_figures")
    with whole_file(target) as draft:
        if kind_of(target) == "html":
            draft.write_text(report.to_html(interactive), encoding="utf-8")
        else:
            write_figures(report, folder)
            draft.write_text(report.to_markdown(folder.name), encoding="utf-8")


def _asked(logs: tuple[str, ...], model: str, options: LogOptions) -> dict[str, str]:
    """What decides the numbers, as it was given: the command, the first model, the seed."""
    words = [w for w in sys.argv[1:] if w != "--quiet"]
    command = " ".join(["allanite", *words]) if words[:1] == ["report"] else "allanite report"
    seed = "none: nothing in a report is random" if options.seed is None else str(options.seed)
    asked = {"logs": ", ".join(logs), "command": command, "first model": model, "seed": seed}
    return {name: plain(text) for name, text in asked.items()}
