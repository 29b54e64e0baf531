"""Texts and table cells of a report, generated from the JSON document so that both always agree."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Any

from allanite.common.numbers import number, numbers_text, with_readable_numbers
from allanite.common.units import conversion, parse_unit
from allanite.effects import title_of
from allanite.effects.sheet_units import units_of_sheets
from allanite.plots.words import effect_text, unit_text, values_text
from allanite.report.blocks import Cell, Number

if TYPE_CHECKING:
    from allanite.effects import Parameter

#: Note for figures of fits with missing samples, whose points differ from the table that `adev` prints.
COMPLETED = (
    "Samples are missing: the points belong to the record completed under the model, while the plain Allan deviation uses "
    "only complete samples."
)

#: Maximum number of effects that one sentence names; four effects with their values have about 30 words.
EFFECTS_PER_SENTENCE = 4
#: If any of several numbers is below this, all of them are written with a power of ten.
SMALL = 1e-4


def number_cell(value: float | None, place: str, figures: int = 3) -> str | Number:
    """`Number` with `figures` significant digits and its path `place` in the document; a dash for None."""
    return "–" if value is None else Number(number(value, figures), float(value), place)


def texts_to_uncertainty(values: tuple[float, ...], spread: float) -> tuple[str, ...]:
    """Tuple of texts of several numbers, each rounded to two digits of the uncertainty `spread`: 3.0999, 3.1002.

    A number has at least two significant digits. Without a positive finite spread, a number has four.
    """
    if not (math.isfinite(spread) and spread > 0):
        return tuple(number(v, 4) for v in values)
    # Use one notation for all: 9.949·10⁻⁵ … 0.00010015 would mix two.
    power = any(v and math.isfinite(v) and abs(v) < SMALL for v in values)
    return tuple(_rounded_text(v, math.floor(math.log10(spread)), power) for v in values)


def _rounded_text(value: float, last: int, power: bool) -> str:
    """Text of a number whose last printed digit is that of 10^(`last` − 1), but with at least 2 and at most 12 digits.

    It has a power of ten below 10⁻⁴ (with `power`: below 0.1), and from 10⁶ on unless the digits reach the units. Zero
    and non-finite numbers are not rounded.
    """
    if value == 0 or not math.isfinite(value):
        return number(value)
    first = math.floor(math.log10(abs(value)))
    figures = min(max(first - last + 2, 2), 12)
    if power or not -5 < first < 6:
        return number(value, figures, power=power)
    return f"{value:.{max(0, figures - 1 - first)}f}".replace("-", "−")


def parameter_text(name: str) -> str:
    """Printed name of a parameter: underscores become blanks, except in names of up to three characters (``q_c``)."""
    return name if len(name) < 4 else name.replace("_", " ")


def with_unit(unit: str | None) -> str:
    """Text of a unit with a leading blank, for printing after a number; empty for None, "" and "1"."""
    return "" if unit in (None, "", "1") else f" {unit_text(str(unit))}"


def as_sentence(text: str) -> str:
    """Copy of a text as a sentence: with a capital letter and one full stop; ``1.3e-05`` becomes ``1.3·10⁻⁵``."""
    return with_readable_numbers(f"{text[:1].upper()}{text[1:].rstrip('.')}.")


def parameter_cells(value: dict[str, Any], place: str) -> tuple[str | Number, Cell, str]:
    """Tuple (value, 95 % interval, text of the unit) of a parameter, as cells of a table.

    `value` is the dict of the parameter in the JSON document of a fit, and `place` its path there. If it was not
    detected, the first cell is "not detected" and the second its upper limit; without a limit it is "not present".
    Lists, texts and values without both ends have an empty interval. A missing value is ``–``.
    """
    found, interval = value.get("value"), value.get("interval")
    unit = unit_text(str(value.get("unit") or ""))
    unit = "" if unit == "1" else unit
    if isinstance(found, list):
        return numbers_text(found, times=unit == "s"), "", unit
    if isinstance(found, str) or found is None:
        return str(found or "–"), "", unit
    if value.get("detected") is False:
        limit = None if interval is None else interval[1]
        if limit is None:
            return "not present", "", unit
        return "not detected", ("< ", Number(number(limit, 3), limit, f"{place}.interval.1")), unit
    if interval is None or interval[0] is None or interval[1] is None:
        return Number(number(found, 4), found, f"{place}.value"), "", unit
    low, high = interval
    texts = texts_to_uncertainty((found, low, high), (high - low) / 4.0)
    cell, *ends = (
        Number(text, v, at)
        for text, v, at in zip(
            texts,
            (found, low, high),
            (f"{place}.value", f"{place}.interval.0", f"{place}.interval.1"),
            strict=True,
        )
    )
    return cell, (ends[0], " … ", ends[1]), unit


def data_sheet_value(parameter: Parameter, value: dict[str, Any], sensor: str) -> str:
    """Text of a parameter in the unit of data sheets, ``0.72 °/√h``, or ``< limit`` if it was not detected.

    `value` is the dict of the parameter in the JSON document, `sensor` the unit of the samples. The text is empty if
    the parameter has no such unit, no value, or no limit although it was not detected.
    """
    wanted = units_of_sheets(parameter).get(parse_unit(sensor).kind)
    found, interval = value.get("value"), value.get("interval")
    if wanted is None or not isinstance(found, float | int):
        return ""
    factor = conversion(str(value["unit"]), wanted)
    if value.get("detected") is False:
        limit = None if interval is None else interval[1]
        return "" if limit is None else f"< {number(limit * factor, 3)} {unit_text(wanted)}"
    return f"{number(found * factor, 4)} {unit_text(wanted)}"


def tone_and_verdict(study: Any, check: Any) -> tuple[str, str]:
    """Tuple (tone ``"good"`` or ``"bad"``, text of the verdict).

    Good if the last model is adequate or within the tolerance. `check` is that of the first model.

    The text says whether the first model fits, which effects were added, and how the errors changed.
    """
    first, last = study.ladder[0].fit, study.fit
    start = first.model.name
    added = _added_effect_texts(study)
    if not added:
        if study.adequate:
            return "good", f"{start} describes this record; {_why_nothing_was_added(study)}."
        if study.verdict == "within tolerance":
            return "good", f"{start} describes this record {study.ending}."
        why = _early_end_clause(study) or "no effect of the catalog improves the model"
        return (
            "bad",
            f"{start} does not describe this record, and {why}. The unexplained misfit is listed below.",
        )
    # An effect may be missing although no averaging time, frequency or time stands out.
    fails = f"{start} does not describe this record"
    if not check.left:
        fails = f"{start} fails at no single τ, frequency or time" + (
            ", but an effect is significantly missing" if check.significant else ""
        )
    words = f"{fails}. {_sentences_on(added)} {_removed_sentence(study)}{_change_of_errors(first, last)}"
    if study.adequate:
        return "good", f"{words} No significant misfit remains."
    if study.verdict == "within tolerance":
        return "good", f"{words} The model is {study.ending}."
    why = _early_end_clause(study)
    remains = (
        f"A misfit remains: {why}"
        if why
        else "A misfit remains that no effect of the catalog explains"
    )
    return "bad", f"{words} {remains}."


def _early_end_clause(study: Any) -> str:
    """Clause that names the limit of steps, the time limit or the interruption that ended the search; empty without."""
    return study.ending if study.stopped_because in ("limit", "time", "interrupted") else ""


def _sentences_on(added: list[str]) -> str:
    """Text of sentences that name the added effects, at most `EFFECTS_PER_SENTENCE` in each: "Added: …. Also added: …."."""
    sentences = []
    for at in range(0, len(added), EFFECTS_PER_SENTENCE):
        *others, last = added[at : at + EFFECTS_PER_SENTENCE]
        names = f"{', '.join(others)} and {last}" if others else last
        sentences.append(f"{'Also added' if at else 'Added'}: {names}.")
    return " ".join(sentences)


def _why_nothing_was_added(study: Any) -> str:
    """Clause on why no effect was added to an adequate first model: too coarse a resolution, or nothing is missing."""
    if study.verdict == "limited by quantization":
        return "the resolution is too coarse to judge anything else"
    return "nothing is significantly missing"


def _removed_sentence(study: Any) -> str:
    """Sentence on effects that were removed because later effects made them unnecessary; empty if none."""
    there = {effect.kind for effect in study.fit.model}
    removed_kinds = dict.fromkeys(kind for step in study.ladder for kind in step.removed)
    kinds = [kind for kind in removed_kinds if kind not in there]
    names = ", ".join(map(title_of, kinds))
    return f"Removed as no longer needed: {names}. " if names else ""


def _added_effect_texts(study: Any) -> list[str]:
    """List of texts, one per kind of added effect: name and values, or ``2 × name`` for several that remain of one kind."""
    together: dict[str, list[tuple[Any, Any]]] = {}
    for step in study.ladder[1:]:
        for effect in step.new:
            together.setdefault(effect.kind, []).append((step.fit, effect))
    fits = study.fit, study.ladder[0].fit
    last, first = (Counter(effect.kind for effect in fit.model) for fit in fits)
    stay = last - first
    return [
        _effect_text(*same[-1]) if stay[kind] <= 1 else f"{stay[kind]} × {fit.display_name(effect)}"
        for kind, same in together.items()
        for fit, effect in same[:1]
    ]


def _effect_text(fit: Any, effect: Any) -> str:
    """Text of the name of an effect, followed by its fitted values in brackets if there are any.

    The values are those of the last effect of the same kind in `fit`. If the fit has none, only the title of the
    effect.
    """
    kinds = [e.kind for e in fit.model.effects]
    if effect.kind not in kinds:
        return str(effect.title)
    # Take the last effect of this kind, because there may be several.
    place = len(kinds) - 1 - kinds[::-1].index(effect.kind)
    numbers = values_text(fit.model.effects[place], fit.estimates[place])
    name = effect_text(fit, effect)
    return f"{name} ({numbers})" if numbers else name


def _change_of_errors(first: Any, last: Any) -> str:
    """Sentence on how Allan error and χ²/dof changed from the first to the last model.

    Names only χ²/dof if one of the two models has no Allan error.
    """
    before, after = first.error.adev_rms_percent, last.error.adev_rms_percent
    if before is None or after is None:
        return f"χ²/dof falls from {number(first.misfit.reduced)} to {number(last.misfit.reduced)}."
    chance = last.error.chance_rms_percent
    return (
        f"The error of the Allan deviation changes from {number(before, 2)} % to {number(after, 2)} % rms "
        f"(expected scatter: about {number(chance, 2)} %), χ²/dof from "
        f"{number(first.misfit.reduced)} to {number(last.misfit.reduced)}."
    )
