"""A suggestion in words: what it is, where it acts, how big."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.parameters import Estimate

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit.result import Fit

__all__ = ["explain"]


def explain(effect: Effect, found: Fit, before: Fit) -> str:
    """One or two sentences: name and numbers, where and how much of the deviation, physics."""
    values = found.estimates[-1]
    numbers = ", ".join(
        f"{n} = {float(v):.3g}{'' if v.unit == '1' else ' ' + v.unit}"
        for n, v in values.items()
        if isinstance(v, Estimate)
    )
    name = before.display_name(effect)
    text = f"{name} ({numbers})" if numbers else name
    curve = found.curve
    own = [k for k in curve.components if k.split(" ")[0] == effect.kind]
    if own:
        share = 100.0 * (curve.components[own[-1]] / curve.model) ** 2
        top = int(np.nanargmax(share))
        strong = share > max(5.0, 0.5 * float(share[top]))
        low, high = float(curve.tau[strong].min()) if strong.any() else 0.0, 0.0
        if strong.any():
            high = float(curve.tau[strong].max())
            text += (
                f": up to {share[top]:.2g} % of the Allan variance, at τ = {low:.3g}–{high:.3g} s"
            )
        else:
            text += (
                f": at most {share[top]:.2g} % of the Allan variance (τ = {curve.tau[top]:.3g} s)"
            )
    return f"{text}. Physically: {effect.physics}."
