"""allanite report: write a report on a log and its model."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from allanite.cli import output as out
from allanite.cli.options import LogCommand, LogOptions, log_options, model_option, read_recording
from allanite.cli.pipe import STANDARD_INPUT
from allanite.common.plain import file_name, plain


@click.command(
    "report",
    cls=LogCommand,
    epilog='Example: allanite report imu.csv -o imu.html --sensor "IMU 7" --serial 0042',
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@model_option
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="File to write, .html or .md. Default: imu-report.html in the current folder for the log imu.csv.",
)
@click.option("--sensor", metavar="TEXT", help="Name of the sensor, for the first page.")
@click.option("--serial", metavar="TEXT", help="Serial number, for the first page.")
@click.option("--date", metavar="TEXT", help="Date of the record, for the first page.")
@click.option(
    "--interactive", is_flag=True, help="Embed plotly in the HTML, so that figures can be zoomed."
)
@log_options
def command(
    logs: tuple[str, ...],
    model: str | None,
    output: str | None,
    sensor: str | None,
    serial: str | None,
    date: str | None,
    interactive: bool,
    options: LogOptions,
) -> None:
    """Build a model of every sensor column in LOG step by step, and write a report.

    The report is one HTML or Markdown file. For each column it shows the record, the model, where the first model failed,
    each step, and the misfit that remains unexplained. The report of allanite characterize --report also compares the
    axes. LOG is a file, or - for standard input.

    With --json, the same numbers go to standard output. A file is then written only if --output names one.
    """
    from allanite.effects.files import parse_model
    from allanite.readers.starts import start_model
    from allanite.report.document import Report, checked_format, make_report

    target = _report_path(logs[0], output) if output or not options.as_json else None
    if target is not None:
        checked_format(target, interactive)
    recordings = [read_recording(log, options) for log in logs]
    model = model or start_model(recordings[0])
    parsed = parse_model(model)
    reports = []
    for recording in recordings:
        with out.progress(", ".join(recording.columns), options) as on_progress:
            reports.append(make_report(recording, parsed, on_progress))
    entries = tuple(entry for one in reports for entry in one.entries)
    axes = reports[0].axes if len(reports) == 1 else None
    texts = {"sensor": sensor, "serial number": serial, "date": date}
    given = {name: plain(text) for name, text in texts.items() if text is not None}
    report = Report(entries, {**given, **_provenance_texts(logs, model, options)}, axes)
    if target is not None:
        report.save(target, interactive)
    if options.as_json:
        click.echo(out.json_text(report.to_dict()))
        return
    out.print_findings([entry.recording for entry in report.entries], options)
    for entry in report.entries:
        click.echo(f"{entry.recording.columns[0]}: {entry.study.fit.model.name}")
    click.echo(f"written: {plain(target)}")


def _report_path(log: str, output: str | None) -> Path:
    """Path of the report: that of --output, or ``NAME-report.html`` in the current folder for the log ``NAME.csv``."""
    if output is not None:
        return Path(output)
    return Path(
        "report.html" if log == STANDARD_INPUT else f"{file_name(Path(log).stem)}-report.html"
    )


def _provenance_texts(logs: tuple[str, ...], model: str, options: LogOptions) -> dict[str, str]:
    """Texts with which a reader can repeat the report; the keys are logs, command, first model and seed."""
    words = [w for w in sys.argv[1:] if w != "--quiet"]
    command = " ".join(["allanite", *words]) if words[:1] == ["report"] else "allanite report"
    seed = "none: nothing in a report is random" if options.seed is None else str(options.seed)
    inputs = {"logs": ", ".join(logs), "command": command, "first model": model, "seed": seed}
    return {name: plain(text) for name, text in inputs.items()}
