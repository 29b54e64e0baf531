"""Sections of a report on one column."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.common.numbers import (
    MIN_PRINTED_P,
    count_text,
    duration_text,
    harmonics_text,
    log10_probability_text,
    trials_text,
    with_readable_numbers,
)
from allanite.common.printing import column_unit
from allanite.effects import find, title_of
from allanite.fit.table import undecided_sentence
from allanite.plots import plot_check, plot_fit, plot_recording, plot_study, plot_time
from allanite.plots.words import label_in_unit, unit_text
from allanite.report.blocks import (
    Block,
    Bullets,
    Card,
    Cell,
    Heading,
    Number,
    Paragraph,
    Picture,
    Table,
)
from allanite.report.words import (
    COMPLETED,
    as_sentence,
    data_sheet_value,
    number_cell,
    parameter_cells,
    parameter_text,
    tone_and_verdict,
    with_unit,
)

if TYPE_CHECKING:
    from allanite.report.document import Entry

#: Number of segments of the samples in their figure, which is 920 pixels wide: 4 pixels each.
SEGMENTS = 230
#: Maximum number of suggested effects that are described in full. Chosen by judgment; not measured.
MAX_CARDS = 3


def column_title(entry: Entry) -> str:
    """Text of file and column of an entry: ``gyro.csv · gyro_x``; ``recording · gyro_x`` without a file."""
    recording = entry.recording
    file = Path(recording.path).name if recording.path else "recording"
    return f"{file} · {recording.columns[0]}"


def column_section(
    entry: Entry, document: dict[str, Any], place: str = "", *, with_curve: bool = True
) -> list[Block]:
    """List of `Block`: all sections of one column of a report.

    `document` is the JSON document of the column, and `place` its path in that of the whole report. `with_curve` is False
    if the first page of the report already shows the curve of this column.
    """
    at = f"{place}." if place else ""
    tone, words = tone_and_verdict(entry.study, entry.first)
    return [
        Paragraph(words, tone),
        *_record_section(entry, document, at),
        *(_curve_section(entry) if with_curve else []),
        *_model_section(entry, document["fit"], f"{at}fit"),
        *_first_model_section(entry, document, at),
        *_steps_section(entry, document, at),
        *_ending_sections(entry, at),
    ]


def _record_section(entry: Entry, document: dict[str, Any], at: str) -> list[Block]:
    """List of `Block`: section on the record: file, size, unit, findings of the audit, and a plot of the samples.

    Warnings come before other findings; without any, a sentence says so.
    """
    facts, recording = document["recording"], entry.recording
    place = f"{at}recording"
    rows: list[tuple[Cell, ...]] = [
        ("file", Path(facts["path"]).name if facts["path"] else "–"),
        ("column", facts["column"]),
        (
            "samples",
            (Number(count_text(facts["n"]), facts["n"], f"{place}.n"), f", {recording.quantity}"),
        ),
        ("rate", (Number(f"{facts['rate_hz']:.6g}", facts["rate_hz"], f"{place}.rate_hz"), " Hz")),
        (
            "duration",
            (
                Number(f"{facts['duration_s']:.6g}", facts["duration_s"], f"{place}.duration_s"),
                f" s ({duration_text(facts['duration_s'])})",
            ),
        ),
        ("unit", unit_text(facts["unit"])),
        ("gaps", (Number(count_text(facts["gaps"]), facts["gaps"], f"{place}.gaps"),)),
    ]
    if recording.covariates:
        named = (
            (n, column_unit(n, recording.covariate_units.get(n))) for n in recording.covariates
        )
        rows.append(
            ("logged columns", ", ".join(n if n == u else label_in_unit(n, u) for n, u in named))
        )
    found = facts["audit"]
    warnings = tuple(str(f["message"]) for f in found if f["severity"] == "warning")
    remarks = tuple(str(f["message"]) for f in found if f["severity"] != "warning")
    out: list[Block] = [Heading("Record"), Table((), tuple(rows))]
    if warnings:
        out.append(Bullets(warnings, "bad"))
    if remarks:
        out.append(Bullets(remarks))
    if not found:
        out.append(Paragraph("The data audit found no problem.", "quiet"))
    caption = "Samples over time: minimum, maximum and mean of short segments."
    out.append(Picture(plot_recording(recording, segments=SEGMENTS), caption, "samples", 2.6))
    return out


def _curve_section(entry: Entry) -> list[Block]:
    """List of `Block`: section with the Allan deviation and the spectrum of the last model."""
    return [Heading("Allan deviation and spectrum"), curve_picture(entry)]


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


def _model_section(entry: Entry, fit: dict[str, Any], place: str) -> list[Block]:
    """List of `Block`: section with the goodness of fit and the parameters of the last model.

    The column in data-sheet units is left out if it is empty.
    """
    rows: list[tuple[Cell, ...]] = []
    sheet = False
    for i, effect in enumerate(fit["effects"]):
        title, kind = effect["name"], find(effect["kind"])
        for name, value in effect["parameters"].items():
            where = f"{place}.effects.{i}.parameters.{name}"
            shown, interval, unit = parameter_cells(value, where)
            if name == "overtones" and value.get("value"):
                first = effect["parameters"]["frequency"]["value"]
                shown = harmonics_text(first, value["value"], unit_text(entry.recording.unit))
            for key, word in (("held", "held fixed"), ("at_limit", "at its limit")):
                if name in effect.get(key, ()):
                    interval = word
            other = (
                data_sheet_value(kind.parameter(name), value, entry.recording.unit) if kind else ""
            )
            sheet |= bool(other)
            rows.append((title, parameter_text(name), shown, interval, unit, other))
            title = ""
    head: tuple[str, ...] = (
        "effect",
        "parameter",
        "value",
        "95 % interval",
        "unit",
        "in data-sheet units",
    )
    if not sheet:
        head, rows = head[:-1], [row[:-1] for row in rows]
    out: list[Block] = [
        Heading("Model"),
        Paragraph(_goodness_of_fit_cell(fit, place)),
        Table(head, tuple(rows), (2, 3, 5)),
    ]
    notes = [
        (
            "Densities are two-sided: white noise of density N² has an Allan variance of N²/τ; a data sheet's one-sided "
            "noise density is √2 N."
        )
    ]
    if any(v.get("detected") is False for e in fit["effects"] for v in e["parameters"].values()):
        notes.append(
            "Not detected: the coefficient is compatible with zero; the limit is at 95 % confidence."
        )
    out.append(Paragraph(" ".join(notes), "quiet"))
    return out


def _goodness_of_fit_cell(fit: dict[str, Any], place: str) -> Cell:
    """`Cell`: sentence on the goodness of fit: χ², Allan error, discrepancy, and frequencies without a test.

    Parts that are None or empty are left out.
    """
    m, e = fit["misfit"], fit["error"]
    words: list[str | Number] = [
        f"{fit['model']}: χ²/dof ",
        number_cell(m["reduced"], f"{place}.misfit.reduced"),
        " (p ",
        number_cell(m["p_value"], f"{place}.misfit.p_value", 2),
        ")",
    ]
    if e["adev_rms_percent"] is not None:
        words += [
            ", Allan deviation: residual ",
            number_cell(e["adev_rms_percent"], f"{place}.error.adev_rms_percent", 2),
            " % rms (expected scatter: ",
            number_cell(e["chance_rms_percent"], f"{place}.error.chance_rms_percent", 2),
            " %)",
        ]
    worst = e["adev_worst"]
    if worst is not None:
        words += [
            ", largest error at τ = ",
            number_cell(worst["tau_s"], f"{place}.error.adev_worst.tau_s", 3),
            " s: model/measured = ",
            number_cell(worst["factor"], f"{place}.error.adev_worst.factor", 3),
        ]
    percent = fit["discrepancy"]["percent"]
    if percent:
        words += [
            ". Model discrepancy: ",
            number_cell(percent, f"{place}.discrepancy.percent", 2),
            " % of the deviation",
        ]
    for k, (low, high) in enumerate(fit["not_judged_hz"]):
        words += [
            ", " if k else ". Not judged: ",
            number_cell(low, f"{place}.not_judged_hz.{k}.0", 3),
            " … ",
            number_cell(high, f"{place}.not_judged_hz.{k}.1", 3),
            " Hz",
        ]
    if fit["not_judged_hz"]:
        words += [", where a filter removed more than 99.99 % of the power"]
    return (*words, ".")


def _first_model_section(entry: Entry, document: dict[str, Any], at: str) -> list[Block]:
    """List of `Block`: section on the first model: goodness of fit, where the model fails, and the missing effects.

    Its plot is left out if the study has only one step.
    """
    check, fit = entry.first, entry.first.fit
    out: list[Block] = [
        Heading(_first_model_title(check)),
        Paragraph(_goodness_of_fit_cell(document["check"], f"{at}check")),
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
        out += _card_blocks(check, f"{at}check.suggestions")
    return out


def _first_model_title(check: Any) -> str:
    """Text of the heading on the first model.

    It is "Where … fails" if the model fails at some τ, frequency or time. Otherwise it is "… fits the record" for an
    adequate check, else "Effects missing from …".
    """
    name = check.fit.model.name
    if check.left:
        return f"Where {name} fails"
    return f"{name} fits the record" if check.adequate else f"Effects missing from {name}"


def _failure_blocks(check: Any) -> list[Block]:
    """List of one `Block`: a bulleted list of the τ, frequencies and times at which a model fails.

    If it fails at none, one sentence says so. An effect may be missing even then.
    """
    sentences = tuple(as_sentence(s) for s in check.left)
    return [Bullets(sentences)] if sentences else [Paragraph(as_sentence(check.nowhere))]


def _card_blocks(check: Any, place: str) -> list[Block]:
    """List of `Block`: cards of the first 3 suggestions of a check, and a sentence that names the others.

    Suggestions come in the groups of `Check.grouped`; the title of a group precedes its cards, except for the first group.
    Empty without suggestions. `place` is the path of the suggestions in the JSON document.
    """
    cards: list[Block] = []
    rest = []
    left = MAX_CARDS
    for title, group in check.grouped:
        if left > 0 and cards:
            cards.append(Paragraph(f"{as_sentence(title)[:-1]}:", "quiet"))
        for rank, suggestion in group:
            if left > 0:
                at = rank - 1
                cards.append(
                    _suggestion_card(check, suggestion, suggestion.to_dict(), f"{place}.{at}", rank)
                )
            else:
                rest.append(check.fit.display_name(suggestion.effect))
            left -= 1
    if rest:
        cards.append(Paragraph(f"Further suggestions: {', '.join(rest)}.", "quiet"))
    return cards


def _suggestion_card(
    check: Any, suggestion: Any, described: dict[str, Any], place: str, rank: int
) -> Card:
    """`Card` of a suggested effect: sentence, values, evidence (ΔlogL, ΔBIC, p), alternatives, and how to confirm it.

    It also says which percentage of the unexplained misfit the effect removes. The title is "`rank`. name". `described`
    is the dict of the suggestion in the JSON document, and `place` its path there.
    """
    evidence = described["evidence"]
    terms: list[tuple[str, Cell]] = []
    values: list[str | Number] = []
    for name, value in described["parameters"].items():
        shown, _, unit = parameter_cells(value, f"{place}.parameters.{name}")
        values += [", " if values else "", f"{parameter_text(name)} ", shown, with_unit(unit)]
    terms.append(("values", tuple(values)))
    p = number_cell(evidence["p_value"], f"{place}.evidence.p_value", 2)
    if evidence["p_value"] < MIN_PRINTED_P:
        p = log10_probability_text(suggestion.log10_p)
    terms.append(
        (
            "evidence",
            (
                "ΔlogL ",
                number_cell(
                    evidence["delta_log_likelihood"], f"{place}.evidence.delta_log_likelihood"
                ),
                ", ΔBIC ",
                number_cell(evidence["delta_bic"], f"{place}.evidence.delta_bic"),
                ", p ",
                p,
                f" after {trials_text(evidence['trials'])}",
            ),
        )
    )
    removes = number_cell(described["removes_percent"], f"{place}.removes_percent", 2)
    terms.append(("size", ("removes ", removes, " % of the unexplained misfit")))
    rivals = described.get("rivals")
    if rivals:
        names = ", ".join(map(title_of, rivals))
        terms.append(("alternative explanations", names))
    terms.append(("to confirm", with_readable_numbers(str(described["check_by"]))))
    name = check.fit.display_name(suggestion.effect)
    words = str(described["explanation"])
    # Drop the name and the values from the sentence, because the card shows them separately.
    if words.startswith(f"{name} (") and "): " in words:
        words = words.split("): ", 1)[1]
    words = with_readable_numbers(words[0].upper() + words[1:])
    return Card(f"{rank}. {name}", words, tuple(terms), suggestion.significant)


def _steps_section(entry: Entry, document: dict[str, Any], at: str) -> list[Block]:
    """List of `Block`: section on the stepwise model building: a table of steps and a plot.

    A single step gives one sentence.
    """
    ladder = document["improve"]["ladder"]
    if len(ladder) == 1:
        words = "No effect was added: there is only one step."
        return [Heading("Stepwise model building"), Paragraph(words)]
    rows: list[tuple[Cell, ...]] = []
    for i, (step, described) in enumerate(zip(entry.study.ladder, ladder, strict=True)):
        where = f"{at}improve.ladder.{i}"
        error = described["error"]
        rows.append(
            (
                ", ".join(step.changes) or ("values changed by hand" if i else "start"),
                described["model"].replace("+", "+\u200b"),  # allows a line break in a long sum
                number_cell(error["misfit_left_percent"], f"{where}.error.misfit_left_percent", 3),
                number_cell(described["misfit"]["reduced"], f"{where}.misfit.reduced"),
                number_cell(described["misfit"]["p_value"], f"{where}.misfit.p_value", 2),
                number_cell(error["adev_rms_percent"], f"{where}.error.adev_rms_percent"),
                number_cell(described["discrepancy"]["percent"], f"{where}.discrepancy.percent", 2),
                number_cell(
                    (error["predictive"] or {}).get("score"), f"{where}.error.predictive.score", 4
                ),
            )
        )
    head = (
        "step",
        "model",
        "unexplained misfit, %",
        "χ²/dof",
        "p",
        "Allan error, % rms",
        "model discrepancy, %",
        "predictive score",
    )
    caption = (
        "The errors of each step, and the Allan deviation of the first and the last model. Predictive score: loss on data "
        "that the fit did not use, in nats per bin above the saturated model."
    )
    return [
        Heading("Stepwise model building"),
        Table(head, tuple(rows), (2, 3, 4, 5, 6, 7)),
        Picture(plot_study(entry.study), caption, "ladder", 5.4, 12.8),
    ]


def _ending_sections(entry: Entry, at: str) -> list[Block]:
    """List of `Block`: a section on undecided alternative models, if there are any, then one on the unexplained misfit.

    If the last model is adequate, the second section is one sentence. Otherwise it says why the search ended, where the
    model fails, and which effects were tested without success.
    """
    study, check = entry.study, entry.study.check
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
        out += _card_blocks(check, f"{at}left.suggestions")
    return out
