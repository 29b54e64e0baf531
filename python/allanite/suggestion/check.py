"""Check of a fit: where the model differs from the recording, and which effects it lacks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from allanite.common.former import Former
from allanite.common.numbers import (
    log10_probability_text,
    number,
    trials_text,
    with_readable_numbers,
)
from allanite.common.showing import html_list, html_table
from allanite.criticism import Where, criticize
from allanite.effects import title_of
from allanite.fit.kept import kept_with_fit
from allanite.fit.likelihood.whitened import whiten
from allanite.fit.table import fit_table
from allanite.suggestion.constants import FALSE_ALARM_PROBABILITY
from allanite.suggestion.suggest import Suggestion, explain_same_misfit, suggest
from allanite.suggestion.unexplained_shape import UnexplainedShape, unexplained_shape

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from allanite.fit.result import Fit
    from allanite.plots import Figure


@dataclass(frozen=True, eq=False)
class Check:
    """Comparison of a fitted model with its recording.

    Attributes
    ----------
    fit : Fit
        The fit that was checked.
    where : Where
        Residuals over τ, frequency and time.
    suggestions : tuple of Suggestion
        Effects that may be missing, best first.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.01)+SIN(f=2.5,A=0.01)")
    >>> check = al.AngleRandomWalk().fit(truth.simulate(duration=300, rate=10, seed=1)).check()
    >>> check.adequate, check.significant[0].kind
    (False, 'sinusoid')
    >>> check.to_dict()["verdict"]
    'unexplained'
    >>> figure = check.plot("check.svg")
    """

    fit: Fit
    where: Where
    suggestions: tuple[Suggestion, ...]

    @property
    def significant(self) -> tuple[Suggestion, ...]:
        """Tuple of the suggestions with a p-value below 1 %, corrected for all searches, that explain more than they cost.

        Their `score` plus `surplus` is above 0.5 nats. Exclusions and changes of level have no minimum.
        """
        return tuple(s for s in self.suggestions if s.significant)

    @property
    def adequate(self) -> bool:
        """True if `fit.adequate` is True, the model fails at no τ, frequency or time, and no significant effect is missing.

        For a correct model, the probability of False is at most 1 % over all these tests together.
        """
        return self.fit.adequate and not self.where.fails and not self.significant

    @property
    def verdict(self) -> str:
        """Text: ``unexplained`` unless the check is adequate, else ``limited by quantization`` or ``adequate``."""
        if not self.adequate:
            return "unexplained"
        return "limited by quantization" if self.fit.limited_by_quantization else "adequate"

    def to_dict(self) -> dict[str, Any]:
        """JSON record (dict) of the check, schema ``allanite/check/2``."""
        return {
            **self.fit.to_dict(),
            "schema": "allanite/check/2",
            "adequate": self.verdict == "adequate",
            "verdict": self.verdict,
            "where": self.where.to_dict(),
            "suggestions": [s.to_dict() for s in self.suggestions],
        }

    rest = Former("unexplained_shape")

    @cached_property
    def unexplained_shape(self) -> UnexplainedShape | None:
        """`UnexplainedShape`: a smooth hump or dip of the spectrum that no effect of the catalog explains; or None. Cached.

        None if the model is adequate, if a suggestion is significant, or if the model already has such a shape. None as
        well if the shape raises logL by less than the BIC cost of its parameters.
        """
        return None if self.adequate or self.significant else unexplained_shape(self.fit)

    @property
    def left(self) -> list[str]:
        """List of sentences on what the model does not explain; empty if there is nothing.

        One or two sentences for each failure by τ, by frequency or over time, one for an unexplained shape of the
        spectrum, and one for values with a dead zone or dead band.
        """
        return [
            *self.where.sentences(),
            *([] if self.unexplained_shape is None else [str(self.unexplained_shape)]),
            *filter(None, [self.fit.distortion]),
        ]

    @property
    def nowhere(self) -> str:
        """Sentence for a check whose list of failures by τ, frequency and time is empty.

        It says that nothing fails, which effects are missing, or that only the whole curve differs.
        """
        if self.adequate:
            return "no view fails significantly"
        if self.significant:
            names = dict.fromkeys(self.fit.display_name(s.effect) for s in self.significant)
            return f"significantly missing: {', '.join(names)}"
        return (
            "no single τ, frequency or time stands out, but the whole curve differs significantly"
        )

    @cached_property
    def grouped(self) -> list[tuple[str, list[tuple[int, Suggestion]]]]:
        """List of (title, [(rank, suggestion), …]): what is missing most, its alternatives, and additional effects.

        These are the best significant suggestion, those that explain the same misfit, and the other significant ones.
        Ranks count all suggestions from 1, the best. Empty groups are omitted. If no suggestion is significant, the
        best two form the only group, "closest candidates". The list is empty without suggestions.
        """
        ranked = [(rank, s) for rank, s in enumerate(self.suggestions, 1) if s.significant]
        if not ranked:
            best = list(enumerate(self.suggestions[:2], 1))
            return [("closest candidates", best)] if best else []
        first = ranked[0]
        instead = [one for one in ranked[1:] if explain_same_misfit(first[1], one[1])]
        further = [one for one in ranked[1:] if one not in instead]
        groups = [("what is missing", [first]), (f"instead of {first[0]}", instead)]
        return [group for group in (*groups, (f"in addition to {first[0]}", further)) if group[1]]

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the fit in which the ranges where the model fails are shaded.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        return al.plots.plot_check(self, path, theme)

    def __str__(self) -> str:
        lines = [fit_table(self.fit, remedy="", whole=self.adequate), ""]
        sentences = self.left
        lines += ["where it fails:"] if sentences else [self.nowhere]
        lines += [f"  {s}" for s in sentences]
        lines.append("")
        if not self.significant:
            lines.append("nothing in the catalog is significantly missing")
        for title, group in self.grouped:
            lines.append(f"{title}:")
            for rank, s in group:
                lines += _suggestion_lines(rank, s)
        return "\n".join(lines)

    def __repr__(self) -> str:
        missing = ", ".join(s.kind for s in self.significant)
        words = self.verdict if self.adequate else f"missing: {missing or 'nothing known'}"
        return f"Check({self.fit.recording.columns[0]}, {self.fit.model.name}: {words})"

    def _repr_html_(self) -> str:
        """HTML of the fit, where it fails, and the significant suggestions, or else the best two, for notebooks."""
        where = self.left or [self.nowhere]
        shown = list(self.significant) or list(self.suggestions[:2])
        rows = [
            (
                self.fit.display_name(s.effect),
                "" if s.significant else "not significant",
                f"{s.delta_log_likelihood:.1f}",
                log10_probability_text(s.log10_p),
                f"{number(s.removes_percent, 2)} %" if s.significant else "",
                s.explanation,
                s.check_by,
            )
            for s in shown
        ]
        head = ("effect", "", "ΔlogL", "p", "of the unexplained misfit", "what it is", "to confirm")
        title = "what is missing" if self.significant else "nothing is significantly missing"
        return self.fit._repr_html_() + html_list(where) + html_table(title, head, rows, (2, 3, 4))


def evidence_text(s: Suggestion) -> str:
    """Text of the evidence for a suggested effect: ΔlogL, ΔBIC, p-value and number of trials."""
    return with_readable_numbers(
        f"ΔlogL {s.delta_log_likelihood:.1f}, ΔBIC {s.delta_bic:.1f}, p {log10_probability_text(s.log10_p)}"
        f" after {trials_text(s.trials)}"
    )


def _suggestion_lines(rank: int, s: Suggestion) -> list[str]:
    """List of the lines of one suggestion in the printed check: explanation, evidence, alternatives, how to confirm it."""
    costly = s.p_value < FALSE_ALARM_PROBABILITY
    mark = " (its parameters cost more than it explains)" if costly else " (not significant)"
    mark = "" if s.significant else mark
    evidence = evidence_text(s) + (f", {s.removes_text}" if s.significant else "")
    lines = [f"  {rank}. {s.explanation}{mark}", f"     {evidence}"]
    if s.rivals:
        names = ", ".join(map(title_of, s.rivals))
        lines.append(f"     not distinguishable on this record from: {names}")
    return [*lines, f"     confirm: {s.check_by}"]


def check_fit(fit: Fit, on_progress: Callable[[int, int], None] | None = None) -> Check:
    """`Check` of a fit: where the model fails (by τ, frequency and time), and ranked suggestions of missing effects.

    `on_progress` is called with (stages done, number of stages).
    """
    whitened = whiten(fit.solution, fit.data)
    return Check(fit, criticize(fit, whitened), suggest(fit, whitened, on_progress))


@kept_with_fit
def last_check(fit: Fit) -> Check:
    """`Check` of a fit, computed once and kept with the fit."""
    return fit.check()
