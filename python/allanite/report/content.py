"""Sections of a report on one column."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.numbers import count_text, duration_text, number, with_readable_numbers
from allanite.common.parameters import Estimate
from allanite.common.printing import column_unit
from allanite.effects import title_of
from allanite.fit.table import misfit_line, parameter_rows, undecided_sentence
from allanite.plots import plot_check, plot_fit, plot_recording, plot_study, plot_time
from allanite.plots.words import label_in_unit, unit_text, values_text
from allanite.report.blocks import Block, Bullets, Card, Heading, Paragraph, Picture, Table
from allanite.report.words import COMPLETED, as_sentence, tone_and_verdict
from allanite.suggestion.check import evidence_text
from allanite.suggestion.explanation import name_with_lines

if TYPE_CHECKING:
    from allanite.deviation.result import Deviation
    from allanite.fit import Fit
    from allanite.recording import Recording
    from allanite.report.document import Entry
    from allanite.study import Study
    from allanite.suggestion import Check, Suggestion

#: Number of segments of the samples in their figure, which is 920 pixels wide: 4 pixels each.
SEGMENTS = 230
#: Maximum number of suggested effects that are described in full. Chosen by judgment; not measured.
MAX_CARDS = 3


def column_title(entry: Entry) -> str:
    """Text of file and column of an entry: ``gyro.csv · gyro_x``; ``recording · gyro_x`` without a file."""
    recording = entry.recording
    file = Path(recording.path).name if recording.path else "recording"
    return f"{file} · {recording.columns[0]}"


def column_section(entry: Entry, *, with_curve: bool = True) -> list[Block]:
    """All sections of one column of a report; without the curve if the first page already shows it."""
    tone, words = tone_and_verdict(entry.study, entry.first)
    curve: list[Block] = [Heading("Allan deviation and spectrum"), curve_picture(entry)]
    return [
        Paragraph(words, tone),
        *_record_section(entry.recording),
        *(curve if with_curve else []),
        *_model_section(entry.study),
        *_first_model_section(entry),
        *_steps_section(entry.study),
        *_ending_sections(entry.study),
        *_curve_table(entry.deviation),
    ]


def _record_section(recording: Recording) -> list[Block]:
    """Section on the record: file, size, unit, findings of the audit (warnings first), and a plot of the samples."""
    rows = [
        ("file", Path(recording.path).name if recording.path else "–"),
        ("column", recording.columns[0]),
        ("samples", f"{count_text(recording.n)} ({recording.quantity})"),
        ("rate", f"{recording.rate:.6g} Hz"),
        ("duration", f"{recording.duration:.6g} s ({duration_text(recording.duration)})"),
        ("unit", unit_text(recording.unit)),
        ("gaps", count_text(recording.gaps)),
    ]
    if recording.covariates:
        named = (
            (n, column_unit(n, recording.covariate_units.get(n))) for n in recording.covariates
        )
        rows.append(
            ("logged columns", ", ".join(n if n == u else label_in_unit(n, u) for n, u in named))
        )
    warnings = tuple(f.message for f in recording.audit if f.severity == "warning")
    remarks = tuple(f.message for f in recording.audit if f.severity != "warning")
    out: list[Block] = [Heading("Record"), Table((), tuple(rows))]
    if warnings:
        out.append(Bullets(warnings, "bad"))
    if remarks:
        out.append(Bullets(remarks))
    if not recording.audit:
        out.append(Paragraph("The data audit found no problem.", "quiet"))
    caption = "Samples over time: minimum, maximum and mean of short segments."
    out.append(Picture(plot_recording(recording, segments=SEGMENTS), caption, "samples", 2.6))
    return out


def curve_picture(entry: Entry) -> Picture:
    """`Picture` of the Allan deviation and the spectrum with the last model."""
    fit = entry.study.fit
    caption = (
        f"Allan deviation and two-sided density with the last model, {fit.model.name}, and its effects. The strips below "
        "show the residuals in standard deviations, with guides at 2 (dashed) and 3.5 (dotted; the largest residual of a "
        "true model exceeds it in 1 % of records)."
    )
    if fit.data.missing is not None:
        caption += f" {COMPLETED}"
    return Picture(plot_fit(fit), caption, "curve", 6.0)


def _model_section(study: Study) -> list[Block]:
    """List of `Block`: section with the goodness of fit and the parameters of the last model."""
    fit = study.fit
    notes = (
        "Densities are two-sided: white noise of density N² has an Allan variance of N²/τ; a data sheet's one-sided "
        "noise density is √2 N."
    )
    values = [v for own in fit.estimates for v in own.values() if isinstance(v, Estimate)]
    if not all(v.detected for v in values):
        notes += " Not detected: the coefficient is compatible with zero; the limit is at 95 % confidence."
    head = ("effect", "parameter", "value", "95 % interval")
    return [
        Heading("Model"),
        _goodness_of_fit(fit, study.adequate),
        Table(head, tuple(parameter_rows(fit)), (2, 3)),
        Paragraph(notes, "quiet"),
    ]


def _goodness_of_fit(fit: Fit, whole: bool) -> Paragraph:
    """`Paragraph` on χ², Allan error, discrepancy, and frequencies without a test.

    `whole` is False if other checks than χ² and the Allan deviation failed.
    """
    return Paragraph(with_readable_numbers(f"{fit.model.name}: {misfit_line(fit, whole)}."))


def _first_model_section(entry: Entry) -> list[Block]:
    """Section on the first model: goodness of fit, where the model fails, and the missing effects."""
    check, fit = entry.first, entry.first.fit
    out: list[Block] = [
        Heading(_first_model_title(check)),
        _goodness_of_fit(fit, check.adequate),
        *_failure_blocks(check),
    ]
    if len(entry.study.ladder) > 1:
        shaded = check.where.worst_tau or check.where.worst_frequency
        caption = f"The first model, {fit.model.name}" + (
            "; shaded where it fails." if shaded else "."
        )
        out.append(Picture(plot_check(check), caption, "first", 6.0))
    if check.where.time:
        caption = (
            "Measured over expected power, by time and octave band. Frames mark significant cells."
        )
        out.append(Picture(plot_time(check), caption, "time", 3.4))
    if check.significant:
        out.append(Heading("Missing effects, strongest evidence first", 4))
        out += _card_blocks(check)
    return out


def _first_model_title(check: Check) -> str:
    """Heading on the first model: "Where … fails", "… fits the record", or "Effects missing from …"."""
    name = check.fit.model.name
    if check.left:
        return f"Where {name} fails"
    return f"{name} fits the record" if check.adequate else f"Effects missing from {name}"


def _failure_blocks(check: Check) -> list[Block]:
    """A bulleted list of the τ, frequencies and times at which a model fails, or one sentence if it fails at none."""
    sentences = tuple(as_sentence(s) for s in check.left)
    return [Bullets(sentences)] if sentences else [Paragraph(as_sentence(check.nowhere))]


def _card_blocks(check: Check) -> list[Block]:
    """Cards of the first 3 suggestions in the groups of `Check.grouped`, and a sentence that names the others."""
    cards: list[Block] = []
    rest = []
    left = MAX_CARDS
    for title, group in check.grouped:
        if left > 0 and cards:
            cards.append(Paragraph(f"{as_sentence(title)[:-1]}:", "quiet"))
        for rank, suggestion in group:
            name = name_with_lines(suggestion.effect, check.fit)
            if left > 0:
                cards.append(_suggestion_card(suggestion, f"{rank}. {name}"))
            else:
                rest.append(name)
            left -= 1
    if rest:
        cards.append(Paragraph(f"Further suggestions: {', '.join(rest)}.", "quiet"))
    return cards


def _suggestion_card(suggestion: Suggestion, title: str) -> Card:
    """`Card` of a suggested effect: sentence, values, evidence, size, alternatives, and how to confirm it."""
    values = values_text(suggestion.effect, suggestion.estimates, len(suggestion.estimates))
    terms = [
        ("values", values or "–"),
        ("evidence", evidence_text(suggestion)),
        ("size", suggestion.removes_text),
    ]
    if suggestion.rivals:
        terms.append(("alternative explanations", ", ".join(map(title_of, suggestion.rivals))))
    terms.append(("to confirm", with_readable_numbers(suggestion.check_by)))
    # Drop the name and the values from the sentence, because the card shows them separately.
    words = suggestion.explanation.partition("): ")[2] or suggestion.explanation
    return Card(title, with_readable_numbers(words[0].upper() + words[1:]), tuple(terms))


def _steps_section(study: Study) -> list[Block]:
    """Section on the stepwise model building: a table of steps and a plot, or one sentence for a single step."""
    if len(study.ladder) == 1:
        words = "No effect was added: there is only one step."
        return [Heading("Stepwise model building"), Paragraph(words)]
    # Zero-width spaces allow a line break in a long sum.
    rows = tuple((*row[:-1], row[-1].replace("+", "+\u200b")) for row in study.rows())
    head = (
        "step",
        "unexplained misfit",
        "model discrepancy",
        "Allan error, rms",
        "largest error",
        "predictive score",
        "model",
    )
    caption = (
        "The errors of each step, and the Allan deviation of the first and the last model. Predictive score: loss on data "
        "that the fit did not use, in nats per bin above the saturated model."
    )
    return [
        Heading("Stepwise model building"),
        Table(head, rows, (1, 2, 3, 4, 5)),
        Picture(plot_study(study), caption, "ladder", 5.4, 12.8),
    ]


def _ending_sections(study: Study) -> list[Block]:
    """Sections on undecided alternative models, if there are any, and on the unexplained misfit."""
    check = study.check
    out: list[Block] = []
    if study.undecided is not None:
        undecided = undecided_sentence(study.fit, study.undecided)
        out = [Heading("Undecided alternatives"), Paragraph(as_sentence(undecided))]
    out.append(Heading("Unexplained misfit"))
    if study.adequate:
        out.append(
            Paragraph(
                "No significant misfit remains, and no significant effect is missing from the last model."
            )
        )
        return out
    out.append(Paragraph(f"The search ended: {study.ending}."))
    out += _failure_blocks(check)
    out += [Paragraph(f"{doubt[0].upper()}{doubt[1:]}.") for doubt in study.doubts]
    if check.significant and len(study.ladder) > 1:
        out.append(Heading("Tested effects that did not help", 4))
        out += _card_blocks(check)
    return out


def _curve_table(deviation: Deviation) -> list[Block]:
    """List of `Block`: section with all points of the overlapping Allan deviation."""
    rows = tuple(
        tuple(_point_text(name, value) for name, value in point.items())
        for point in deviation.to_dict()["points"]
    )
    unit = unit_text(deviation.unit)
    head = ("τ (s)", "m", "differences", f"deviation ({unit})", "95 % low", "high", "edf")
    words = "Overlapping Allan deviation. The interval uses the noise type identified at each τ and needs no model."
    table = Table(head, rows, tuple(range(7)), small=True)
    return [Heading("Allan deviation in numbers"), Paragraph(words, "quiet"), table]


def _point_text(name: str, value: float | None) -> str:
    """Text of the quantity `name` of a point of the curve: τ with six digits, a deviation with five; a dash for None."""
    if value is None:
        return "–"
    if name in ("m", "n", "edf"):
        return count_text(value) if value >= 100 or value == int(value) else f"{value:.3g}"
    return number(value, 6 if name == "tau_s" else 5)
