"""Texts of a report."""

from __future__ import annotations

from collections import Counter
from typing import Any

from allanite.common.numbers import number, with_readable_numbers
from allanite.effects import title_of
from allanite.plots.words import effect_text, values_text

#: Note for figures of fits with missing samples, whose points differ from the table that `adev` prints.
COMPLETED = (
    "Samples are missing: the points belong to the record completed under the model, while the plain Allan deviation uses "
    "only complete samples."
)

#: Maximum number of effects that one sentence names; four effects with their values have about 30 words.
EFFECTS_PER_SENTENCE = 4


def as_sentence(text: str) -> str:
    """The text as a sentence: with a capital letter and one full stop; ``1.3e-05`` becomes ``1.3·10⁻⁵``.

    A first word that ends in a colon is the name of a column, and is not changed.
    """
    first = text.split(" ", 1)[0]
    start = text[:1] if first.endswith(":") else text[:1].upper()
    return with_readable_numbers(f"{start}{text[1:].rstrip('.')}.")


def tone_and_verdict(study: Any, check: Any) -> tuple[str, str]:
    """(``"good"`` or ``"bad"``, verdict): whether the first model fits, which effects were added, how errors changed.

    Good if the last model is adequate or within the tolerance. `check` is that of the first model.
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
    """Name of an effect, followed by the fitted values of the last effect of its kind in brackets, if there are any."""
    kinds = [e.kind for e in fit.model.effects]
    if effect.kind not in kinds:
        return str(effect.title)
    # Take the last effect of this kind, because there may be several.
    place = len(kinds) - 1 - kinds[::-1].index(effect.kind)
    numbers = values_text(fit.model.effects[place], fit.estimates[place])
    name = effect_text(fit, effect)
    return f"{name} ({numbers})" if numbers else name


def _change_of_errors(first: Any, last: Any) -> str:
    """Sentence on how Allan error, if known, and χ²/dof changed from the first to the last model."""
    before, after = first.error.adev_rms_percent, last.error.adev_rms_percent
    if before is None or after is None:
        return f"χ²/dof falls from {number(first.misfit.reduced)} to {number(last.misfit.reduced)}."
    chance = last.error.chance_rms_percent
    return (
        f"The error of the Allan deviation changes from {number(before, 2)} % to {number(after, 2)} % rms "
        f"(expected scatter: about {number(chance, 2)} %), χ²/dof from "
        f"{number(first.misfit.reduced)} to {number(last.misfit.reduced)}."
    )
