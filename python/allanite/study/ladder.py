"""Result of a search: the steps from the first model to the last, and what remains unexplained."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from math import exp
from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.common.numbers import number
from allanite.common.showing import html_list, html_table
from allanite.effects import Effect, title_of
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.fit.rivals.undecided import Undecided, undecided
from allanite.fit.table import fit_table, undecided_sentence
from allanite.study.judgement import refusal_reason
from allanite.suggestion.constants import MAX_ALLAN_ERROR_SCATTERS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from allanite.fit.result import Fit
    from allanite.plots import Figure
    from allanite.recording import Recording
    from allanite.study.state import State
    from allanite.suggestion import Check
    from allanite.summary import Summary


@dataclass(frozen=True, eq=False)
class Rung:
    """One step of the model building, which `added` an effect and `removed` those that it makes needless or replaces.

    `risen` is ΔlogL of this step; None if it is the difference of the two fits. `dropped_start` is the number of `removed`
    effects that were in the first model. `brought` are further effects: replacements of `removed`, or effects that `added`
    needs. `trials` is the number of independent tests of its search. `numbers` has the number of each effect of the model,
    the same in all steps that have the effect; empty for steps made by hand.
    """

    fit: Fit
    added: Effect | None = None
    removed: tuple[str, ...] = ()
    risen: float | None = None
    dropped_start: int = 0
    brought: tuple[Effect, ...] = ()
    trials: float | None = None
    numbers: tuple[int, ...] = ()

    @property
    def new(self) -> tuple[Effect, ...]:
        """Tuple of the effects that this step put into the model, `added` first; empty for the first step."""
        return () if self.added is None else (self.added, *self.brought)

    def risen_since(self, before: Rung) -> float:
        """ΔlogL of this step, nats: `risen`, or, if that is None, logL of this fit minus logL of the fit of `before`."""
        if self.risen is not None:
            return self.risen
        return self.fit.solution.log_likelihood - before.fit.solution.log_likelihood

    @property
    def changes(self) -> tuple[str, ...]:
        """Texts of the changes: ``+ sinusoid``, ``− rate random walk``, ``− 2 × resonance``; empty for the first step.

        Effects that left and came back in the same step are omitted.
        """
        further = {e.kind for e in self.new if e.further} & set(self.removed)
        # An effect that left and came back with another one has not changed.
        back = Counter(self.removed) & Counter(e.kind for e in self.brought if not e.further)
        left = Counter(self.removed) - back - Counter(further)
        sensor = self.fit.sensor
        removals = tuple(
            f"− {title_of(kind, sensor)}" if count == 1 else f"− {count} × {title_of(kind, sensor)}"
            for kind, count in left.items()
        )
        additions = []
        for effect in self.new:
            if effect is not self.added and back[effect.kind]:
                back[effect.kind] -= 1
                continue
            more = effect.kind in further
            additions.append(f"+ {effect.further if more else self.fit.display_name(effect)}")
        return (*additions, *removals)

    def __repr__(self) -> str:
        added = "start" if self.added is None else f"+ {self.added.kind}"
        return f"Rung({added}: {self.fit.model.name})"

    def to_dict(
        self, misfit_left: float, last: bool = True, over_rivals: Undecided | None = None
    ) -> dict[str, Any]:
        """JSON record (dict) of the step; `misfit_left` is the unexplained misfit, % of the largest of all steps.

        Alternatives of its effects and correlations of its parameters are given only if `last`, since earlier models are
        wrong. Intervals over alternative models are given only with `over_rivals`.
        """
        body = self.fit.body(searched=last)
        if last:
            body["correlations"] = self.fit.correlations.to_dict()
        if over_rivals is not None:
            for effect, intervals in zip(body["effects"], over_rivals.intervals, strict=True):
                effect["over_rivals"] = {name: list(ends) for name, ends in intervals.items()}
        return {
            "added": None if self.added is None else self.added.kind,
            "removed": list(self.removed),
            "brought": [effect.kind for effect in self.brought],
            **body,
            "error": {"misfit_left_percent": misfit_left, **body["error"]},
        }


def rung_of(
    before: State,
    after: State,
    named: str = "",
    risen: float | None = None,
    trials: float | None = None,
) -> Rung:
    """Step (`Rung`) from one state of a search to another.

    Its `added` is the first new effect of the kind `named`, else the first whose kind was not removed in the step, else the
    first new effect; None without new effects. `risen` is the ΔlogL of the step; by default that of the two fits. `trials`
    is the number of independent tests of the search, if known.
    """
    lost = after.lost_since(before)
    removed = tuple(before.fit.model.effects[place].kind for place in lost)
    new = [after.fit.model.effects[place] for place in after.new_since(before)]
    new.sort(key=lambda effect: (effect.kind != named, effect.kind in removed))
    if risen is None:
        risen = after.fit.solution.log_likelihood - before.fit.solution.log_likelihood
    start = sum(map(before.is_given, lost))
    added = new[0] if new else None
    return Rung(
        after.fit,
        added=added,
        removed=removed,
        risen=risen,
        dropped_start=start,
        brought=tuple(new[1:]),
        trials=trials,
        numbers=after.numbers,
    )


def kinds_added_again(ladder: Sequence[Rung]) -> set[str]:
    """Set of the kinds that a step removed and a later step added again, and that are therefore needed."""
    removed: set[str] = set()
    back: set[str] = set()
    for rung in ladder:
        back |= removed & {effect.kind for effect in rung.new}
        removed |= set(rung.removed)
    return back


@dataclass(frozen=True, eq=False)
class Study:
    """Stepwise models of one recording, and the check of the last one.

    Attributes
    ----------
    ladder : tuple of Rung
    check : Check
        Check of the last model.
    stopped_because : str
        ``adequate``, ``within tolerance``, ``nothing helps``, ``limit``, ``time`` or ``interrupted``.
    tolerance : float or None
        Requested limit of the model discrepancy, % of the deviation.
    tried : tuple of Effect
        Effects that the search added and dropped again, of kinds that the last model lacks.
    first_check : Check or None
        Check of the first model, if the search made it.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.01)+SIN(f=2.5,A=0.01)")
    >>> study = al.improve(truth.simulate(duration=300, rate=10, seed=1), "N")
    >>> study.verdict, study.fit.model.name, [rung.changes for rung in study.ladder]
    ('adequate', 'N+SIN', [(), ('+ sinusoid',)])
    >>> len(study.rows()), study.to_dict()["schema"]
    (2, 'allanite/improve/2')
    >>> figure = study.plot("ladder.svg")
    """

    recording: Recording | Summary
    ladder: tuple[Rung, ...]
    check: Check
    stopped_because: str
    tolerance: float | None = None
    tried: tuple[Effect, ...] = ()
    first_check: Check | None = None

    @property
    def fit(self) -> Fit:
        """`Fit` of the last step."""
        return self.ladder[-1].fit

    @property
    def adequate(self) -> bool:
        """True if the check of the last model is adequate and `doubts` is empty."""
        return self.check.adequate and not self.doubts

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Tuple of clauses that say why the last model is not adequate although its check is; empty without doubts.

        Possible doubts: the Allan error is more than twice its expected scatter, or another model explains the record
        better by more than 3 nats.
        """
        found = []
        error = self.fit.error
        off, expected = error.adev_rms_percent, error.chance_rms_percent
        if off is not None and expected is not None and off > MAX_ALLAN_ERROR_SCATTERS * expected:
            found.append(
                f"the Allan deviation differs by {number(off, 2)} % rms from the model,"
                f" where {number(expected, 2)} % are expected"
            )
        if self.undecided is not None:
            (own, share), *others = self.undecided.models
            name, best = max(others, key=lambda model: model[1])
            if best > exp(MAX_RIVAL_LOG_EVIDENCE) * share:
                found.append(f"{name} explains the record better than {own}")
        return tuple(found)

    @property
    def verdict(self) -> str:
        """Text: ``within tolerance``, ``unexplained`` (also with `doubts`), ``limited by quantization`` or ``adequate``."""
        if self.stopped_because == "within tolerance":
            return self.stopped_because
        # Doubts take many fits, and matter only if the check is adequate.
        return "unexplained" if self.check.adequate and self.doubts else self.check.verdict

    @property
    def reason(self) -> str:
        """Text why the search ended: `stopped_because`, but the `verdict` if `stopped_because` is "adequate"."""
        return self.verdict if self.stopped_because == "adequate" else self.stopped_because

    @property
    def _is_good_enough(self) -> bool:
        """True if the search ended because the last model is adequate, or its discrepancy is within the tolerance."""
        return self.stopped_because in {"adequate", "within tolerance"}

    @property
    def misfit_left(self) -> tuple[float, ...]:
        """Tuple with the unexplained misfit of each step, in % of the largest of all steps (usually the first).

        The last value is 0 if the last model is adequate: its remaining misfit is chance.
        """
        left = misfit_left(self.ladder)
        return (*left[:-1], 0.0) if self.adequate else left

    @property
    def undecided(self) -> Undecided | None:
        """`Undecided`: other models that explain the record as well as the last, and intervals averaged over them.

        None if there are none.
        """
        return undecided(self.fit)

    @property
    def left(self) -> list[str]:
        """List of sentences on what the last model does not explain; empty if the search ended with a sufficient model.

        The sentences are the failures of the check (by τ, frequency or time), then the doubts. One more sentence says
        what is missing if there are no failures and doubts. It also comes if significant suggestions remain and the
        search ended for another reason than "nothing helps".
        """
        if self._is_good_enough:
            return []
        found = [*self.check.left, *self.doubts]
        unnamed = self.check.significant and self.stopped_because != "nothing helps"
        return [*found, self.check.nowhere] if unnamed or not found else found

    @property
    def unexplained(self) -> dict[str, Any]:
        """Dict with the keys ``tau``, ``frequency`` and ``time``: interval where the last model fails most, or None.

        An interval is a list [low, high] in s, Hz and s. None if the model fails nowhere in τ, in frequency or in time.
        """
        return self.check.where.worst()

    def to_dict(self) -> dict[str, Any]:
        """JSON record (dict) of the study, schema ``allanite/improve/2``."""
        return {
            "schema": "allanite/improve/2",
            "version": _kernels.version(),
            "recording": self.recording.describe(),
            "ladder": [
                (
                    rung.to_dict(left, over_rivals=self.undecided)
                    if rung is self.ladder[-1]
                    else rung.to_dict(left, last=False)
                )
                for rung, left in zip(self.ladder, self.misfit_left, strict=True)
            ],
            "adequate": self.adequate and not self.fit.limited_by_quantization,
            "verdict": self.verdict,
            "stopped_because": self.reason,
            "tried": [effect.kind for effect in self.tried],
            "unexplained": self.unexplained,
        }

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the errors of each step, with the first and the last model.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        return al.plots.plot_study(self, path, theme)

    def __str__(self) -> str:
        rows = self.rows()
        wide = max(22, *(len(cells[0]) for cells in rows))
        lines = [
            (
                f"{'':>2}  {'added':{wide}} {'unexplained':>11} {'discrepancy':>11} {'ADEV rms':>9} "
                f"{'worst':>20} {'prediction':>11}  model"
            )
        ]
        for i, cells in enumerate(rows):
            added, left, discrepancy, rms, worst, predictive, model = cells
            lines.append(
                f"{i:>2}  {added:{wide}} {left:>11} {discrepancy:>11} {rms:>9} {worst:>20} {predictive:>11}  {model}"
            )
        lines.append(f"stopped: {self.ending}")
        if not self._is_good_enough:
            lines += ["left unexplained:", *(f"  {s}" for s in self.left)]
        if self.tried:
            titles = dict.fromkeys(self.fit.display_name(effect) for effect in self.tried)
            lines.append(f"tried and dropped: {', '.join(titles)}")
        lines += ["", fit_table(self.fit, "", self._is_good_enough, self.undecided)]
        if self.undecided is not None:
            lines.append(f"! {undecided_sentence(self.fit, self.undecided)}")
        return "\n".join(lines)

    def rows(self) -> list[tuple[str, ...]]:
        """List of tuples of texts, the rows of the table: one row of seven texts for each step.

        The texts are: changes, unexplained misfit, discrepancy, Allan error, worst τ, prediction, name of the model.
        """
        out: list[tuple[str, ...]] = []
        for rung, left in zip(self.ladder, self.misfit_left, strict=True):
            e = rung.fit.error
            added = " ".join(rung.changes) or ("(values changed by hand)" if out else "(start)")
            worst = (
                "–"
                if e.adev_worst is None
                else f"×{number(e.adev_worst[0])} at {number(e.adev_worst[1])} s"
            )
            out.append(
                (
                    added,
                    f"{number(left)} %",
                    f"{number(rung.fit.discrepancy.percent, 2)} %",
                    "–" if e.adev_rms_percent is None else f"{number(e.adev_rms_percent)} %",
                    worst,
                    _number_text(e.predictive_score),
                    rung.fit.model.name,
                )
            )
        return out

    @cached_property
    def ending(self) -> str:
        """Phrase that states why the search ended, for example ``no further effect helps``. Cached.

        If nothing helped, the phrase lists the significant suggestions that were refused. If a limit or the user ended
        the search, the phrase gives the number of steps. If the search ended with an adequate model, it is the verdict.
        """
        if self.stopped_because == "within tolerance":
            return f"within {self.tolerance:g} % (discrepancy {number(self.fit.discrepancy.percent, 2)} %)"
        if self.stopped_because == "nothing helps" and self.adequate:
            return self.verdict  # a study of single steps made by hand
        if self.stopped_because == "nothing helps":
            why: dict[str, str] = {}
            for s in self.check.significant:
                why.setdefault(s.kind, refusal_reason(self.fit, s.found, s))
            refusals = ", ".join(
                f"{title_of(kind, self.fit.sensor)} {reason}" for kind, reason in why.items()
            )
            refused = f" (significant, but refused: {refusals})" if refusals else ""
            return f"no further effect helps{refused}"
        steps = len(self.ladder) - 1
        ended = {
            "limit": "the limit of steps was reached",
            "time": "the time limit was reached",
            "interrupted": "the search was interrupted",
        }.get(self.stopped_because)
        if ended is not None:
            count = f"{steps} step{'' if steps == 1 else 's'}"
            return f"{ended} after {count}; further effects were not examined"
        return self.reason

    def __repr__(self) -> str:
        first, last = self.ladder[0].fit.model.name, self.fit.model.name
        words = self.verdict if self.adequate else self.stopped_because
        return f"Study({self.recording.columns[0]}: {first} → {last}, {words})"

    def _repr_html_(self) -> str:
        """HTML table of the steps for notebooks, with the ending and the last fit."""
        head = (
            "step",
            "unexplained misfit",
            "discrepancy",
            "ADEV rms",
            "worst",
            "prediction",
            "model",
        )
        title = f"{self.recording.path or 'recording'} · {self.recording.columns[0]}"
        ending = [f"stopped: {self.ending}", *self.left]
        if self.undecided is not None:
            ending.append(undecided_sentence(self.fit, self.undecided))
        table = html_table(title, head, self.rows(), (1, 2, 3, 5))
        return table + html_list(ending) + self.fit._repr_html_()


def _number_text(value: float | None) -> str:
    """Text of a number with four digits; "–" for None."""
    return "–" if value is None else f"{value:.4g}"


def misfit_left(ladder: Sequence[Rung]) -> tuple[float, ...]:
    """Tuple with the unexplained misfit of each step, in % of the largest of all steps (usually the first).

    The misfit of the last step is the logL that is still to be gained: that of a model with its own power for each bin,
    minus its expectation for a true model. An earlier step adds the ΔlogL of all later steps.
    """
    left = [max(ladder[-1].fit.unexplained_misfit, 0.0)]
    for before, rung in reversed(list(itertools.pairwise(ladder))):
        left.append(left[-1] + rung.risen_since(before))
    whole = max(left)
    return tuple(
        100.0 * max(value, 0.0) / whole if whole > 0.0 else 100.0 for value in reversed(left)
    )


class SearchInterrupted(KeyboardInterrupt):
    """`KeyboardInterrupt` for Ctrl-C during a search; `study` holds the steps up to the last one that was checked."""

    def __init__(self, study: Study) -> None:
        super().__init__()
        self.study = study
