"""First page of a report: the test, the verdict and coefficients of every axis, and the next step."""

from __future__ import annotations

import shlex
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.numbers import count_text, duration_text, number, with_readable_numbers
from allanite.common.parameters import Estimate
from allanite.common.units import parse_unit
from allanite.effects import Stochastic, standard
from allanite.effects.sheet_units import in_sheet_unit
from allanite.plots.words import with_unit
from allanite.report.blocks import Block, Bullets, Heading, Paragraph, Picture, Table
from allanite.report.content import column_title, curve_picture
from allanite.report.overview import axes_picture
from allanite.report.words import as_sentence

if TYPE_CHECKING:
    from allanite.recording import Recording
    from allanite.report.document import Entry, Report

#: Options of a report for facts that a log rarely contains.
GIVEN = ("sensor", "serial number", "date")
#: Unit of a temperature → its printed form.
TEMPERATURE = {"degC": "°C", "degF": "°F", "K": "K"}
#: Coefficients that navigation filters use.
COEFFICIENTS = ("N", "B", "K")
#: Coefficients that the parameter file of a filter holds.
FILTER = ("N", "K")


def first_page_blocks(report: Report) -> list[Block]:
    """Blocks of the first page: description, verdicts, coefficients of all axes, one figure, and the next step."""
    first = report.entries[0].recording
    rows = [(name, report.options.get(name, "not stated")) for name in GIVEN]
    rows += [
        ("temperature", temperature_text(first)),
        ("duration", f"{duration_text(first.duration)} at {first.rate:.6g} Hz"),
    ]
    entries = [_axis_cells(entry) for entry in report.entries]
    shown = [i for i in range(len(COEFFICIENTS)) if any(cells[2 + i] != "–" for cells in entries)]
    head = ("axis", "verdict", *(COEFFICIENTS[i] for i in shown), "further effects")
    body = tuple((*cells[:2], *(cells[2 + i] for i in shown), cells[-1]) for cells in entries)
    return [
        Table((), tuple(rows)),
        Heading("Verdict and coefficients"),
        *_verdict_blocks(report),
        Table(head, body),
        _first_page_picture(report),
        Heading("Next step"),
        Bullets(_next_steps(report)),
    ]


def title_and_line(report: Report) -> tuple[str, str]:
    """(title, line below the title): sensor name and serial number, then the log; without both, the log is the title."""
    entry = report.entries[0]
    given = [report.options[name] for name in ("sensor", "serial number") if name in report.options]
    log = column_title(entry)
    if len(report.entries) > 1:
        log = log.rsplit(" · ", 1)[0]
    samples = f"{count_text(entry.recording.n)} samples at {entry.recording.rate:.6g} Hz"
    return (" · ".join(given), f"{log} · {samples}") if given else (log, samples)


def _is_usable(entry: Entry) -> bool:
    """True if the model of an axis is adequate or within the requested tolerance."""
    return entry.study.adequate or entry.study.verdict == "within tolerance"


def _verdict_blocks(report: Report) -> list[Block]:
    """List of one `Paragraph` on all axes: how many models explain their record, and which do not; empty for one axis."""
    if len(report.entries) == 1:
        return []
    poor = [e.recording.columns[0] for e in report.entries if not _is_usable(e)]
    count = len(report.entries)
    if not poor:
        return [Paragraph(f"The models of all {count} axes explain their records.", "good")]
    words = f"Do not use the values of {', '.join(poor)} yet: a misfit remains unexplained."
    return [
        Paragraph(f"{count - len(poor)} of {count} models explain their records. {words}", "bad")
    ]


def _first_page_picture(report: Report) -> Picture:
    """`Picture` of the first page: all axes that were characterized together, or the curve of the first column."""
    if len(report.entries) == 1 or report.axes is None:
        return curve_picture(report.entries[0])
    return axes_picture(report.axes)


def temperature_text(recording: Recording) -> str:
    """Text ``30.1 °C on average, 25.0 to 35.2 °C`` of the first logged temperature; "not logged" if there is none."""
    for name, column in recording.covariates.items():
        unit = recording.covariate_units.get(name, "")
        values = np.asarray(column, dtype=float)
        values = values[np.isfinite(values)]
        if values.size and (unit in TEMPERATURE or "temp" in name.lower()):
            middle, low, high = (number(float(f(values)), 3) for f in (np.mean, np.min, np.max))
            written = f" {TEMPERATURE[unit]}" if unit in TEMPERATURE else ""
            return f"{middle}{written} on average, {low} to {high}{written}"
    return "not logged"


def _axis_cells(entry: Entry) -> tuple[str, ...]:
    """Name, verdict, N, B and K of an axis in data-sheet units, and its further effects (``GM, 12 SIN``), as texts.

    The cell of an undetected coefficient is its limit (``< 0.12 °/h``); without such an effect, it is a dash.
    """
    fit, found = entry.study.fit, {}
    further = Counter(e.short for e in fit.model.effects if e.short not in COEFFICIENTS)
    counted = ", ".join(f"{n} {short}" if n > 1 else short for short, n in further.items())
    known = {effect.kind: name for name, effect in standard().items()}
    for effect, values in zip(fit.model.effects, fit.estimates, strict=True):
        name = known.get(effect.kind, "")
        value = values.get(name)
        if name in COEFFICIENTS and isinstance(value, Estimate):
            shown = in_sheet_unit(value, effect.parameter(name))
            text = number(shown.value)
            if not shown.detected and shown.interval is not None:
                text = f"< {number(shown.limit, 2)}"
            found[name] = with_unit(text, shown.unit)
    name = entry.recording.columns[0]
    texts = (found.get(c, "–") for c in COEFFICIENTS)
    return (name, entry.study.verdict, *texts, counted or "–")


def _export_sentence(report: Report) -> str:
    """How to write a filter's file, and why its N and K can be larger than in the table, if they cover other effects.

    Empty unless the sensor is inertial.
    """
    recording = report.entries[0].recording
    if parse_unit(recording.unit).kind not in ("angular rate", "acceleration"):
        return ""
    log = shlex.quote(Path(recording.path).name) if recording.path else "LOG"
    effects = [effect for entry in report.entries for effect in entry.study.fit.model]
    shorts = (e.short for e in effects if isinstance(e, Stochastic) or e.periodic)
    covered = [short for short in dict.fromkeys(shorts) if short not in FILTER]
    why = (
        f" N and K of a filter file also cover {', '.join(covered)}, so they can be larger."
        if covered
        else ""
    )
    return (
        f"{why} To write the file of your filter, for example for Kalibr: "
        f"allanite characterize {log} --export kalibr --output imu.yaml, with the path and the reading options (such as "
        "--unit and --rate) of this report."
    )


def _next_steps(report: Report) -> tuple[str, ...]:
    """Tuple of sentences: one per inadequate axis on how to clarify its misfit, then which values to use, if any."""
    out = []
    for entry in report.entries:
        study, name = entry.study, entry.recording.columns[0]
        if _is_usable(entry):
            continue
        if study.check.significant:
            s = study.check.significant[0]
            out.append(
                f"{name}: {study.fit.display_name(s.effect)} may be missing. {as_sentence(s.check_by)}"
            )
        else:
            left = study.left[0] if study.left else "the cause of the misfit is unknown"
            out.append(
                f"{name}: {with_readable_numbers(left)}. Repeat the measurement, or examine this part of the record."
            )
    if len(out) < len(report.entries):
        which = "the values of the adequate axes" if out else "these values"
        out.append(f"Use {which}.{_export_sentence(report)}")
    return tuple(out)
