"""Explanation of a suggestion in words: name, values, share of the Allan variance, physics."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.numbers import number, spacing_text, with_readable_numbers
from allanite.common.parameters import Estimate
from allanite.common.printing import printed
from allanite.effects import Deterministic, Effect
from allanite.effects.sheet_units import in_sheet_unit
from allanite.fit.rivals.columns import column_slopes

if TYPE_CHECKING:
    from allanite.fit.result import Fit
    from allanite.suggestion.suggest import Suggestion


def explain(suggestion: Suggestion) -> str:
    """Text of sentences: name and values of the effect, its share of the Allan variance and at which τ, its physics.

    The share is left out for modifiers. The note of the suggestion precedes the physics; without a note, differing slopes
    of a followed column do.
    """
    effect, before = suggestion.effect, suggestion.before
    numbers = ", ".join(
        _value_text(n, in_sheet_unit(v, p))
        for n, v in suggestion.estimates.items()
        for p in [effect.parameter(n)]
        if isinstance(v, Estimate)
    )
    name = name_with_lines(effect, before)
    text = f"{name} ({numbers})" if numbers else name
    curve = suggestion.found.curve
    own = [k for k in curve.components if k.split(" ")[0] == effect.kind]
    if own:
        share = 100.0 * (curve.components[own[-1]] / curve.model) ** 2
        top = int(np.nanargmax(share))
        strong = share > max(5.0, 0.5 * float(share[top]))
        if strong.any():
            ends = (curve.tau[strong].min(), curve.tau[strong].max())
            span = "–".join(dict.fromkeys(f"{tau:.3g}" for tau in ends))
            text += f": up to {number(share[top], 2)} % of the Allan variance, at τ = {span} s"
        else:
            text += f": at most {number(share[top], 2)} % of the Allan variance (τ = {curve.tau[top]:.3g} s)"
    note = f"{suggestion.note}. " if suggestion.note else _slopes_sentence(suggestion)
    return with_readable_numbers(f"{text}. {note}Physically: {before.text_of(effect, 'physics')}.")


def name_with_lines(effect: Effect, fit: Fit) -> str:
    """Display name of an effect, followed by its harmonics if it has several lines: ``sinusoid with harmonics 2, 3``.

    If not all frequencies are multiples of the first, the smallest spacing follows instead: ``…, 2.5 Hz apart``. For
    unevenly spaced lines it is the range: ``…, 0.2 to 13 Hz``.
    """
    name = fit.display_name(effect)
    if isinstance(effect, Deterministic) and len(effect.lines) > 1:
        further = [m for m, _, _ in effect.lines[1:]]
        if all(m == round(m) for m in further):
            name += f" with harmonics {', '.join(map(str, further))}"
        else:
            base = effect.base_frequency or 0.0
            spacing = spacing_text(base, [1.0, *further])
            name += f", {spacing or f'{number(base, 3)} to {number(max(further) * base, 3)} Hz'}"
    return name


def _value_text(name: str, value: Estimate) -> str:
    """Text of a value with its name and unit, three digits: ``K = 12.3 °/h/√h``; no unit if it is 1."""
    return (
        f"{name} = {float(value):.3g} {'' if value.unit == '1' else printed(value.unit)}".rstrip()
    )


def _slopes_sentence(suggestion: Suggestion) -> str:
    """Sentence that an effect which follows a logged column has different slopes at slow and fast time scales; or ""."""
    found = suggestion.found
    if suggestion.effect.follows is None:
        return ""
    last = found.model.deterministic[-1]
    fitted = last.amplitudes()
    slopes = column_slopes(last, found.solution, found.data) if fitted.size == 1 else None
    if slopes is None or abs(slopes[0][0] - slopes[0][1]) < 2.0 * slopes[1]:
        return ""
    slow, fast = (share * float(fitted[0]) for share in slopes[0])
    unit = printed(suggestion.estimates["coefficient"].unit)
    return (
        f"The slope is {slow:.3g} {unit} at slow and {fast:.3g} at fast time scales: "
        "more than one lag, hysteresis, or a thermometer in another place. "
    )
