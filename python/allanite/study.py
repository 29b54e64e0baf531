"""The ladder: check, add the best effect, refit, until nothing helps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.common import verbs
from allanite.fit import fit_model
from allanite.suggestion import Check, check_fit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.effects import Effect, Model
    from allanite.fit.result import Fit
    from allanite.recording import Recording

__all__ = ["LIMIT", "Rung", "Study", "improve", "next_rung"]

#: No sensor record supports more additions than this.
LIMIT = 8
#: What logL may lose by an effect that is taken out: an effect that is not there explains this much by chance.
NEEDLESS = 0.5


@dataclass(frozen=True, eq=False)
class Rung:
    """One step of the ladder: the fit, and what was added (None on the first) or removed."""

    fit: Fit
    added: Effect | None = None
    removed: tuple[str, ...] = ()

    def __repr__(self) -> str:
        added = "start" if self.added is None else f"+ {self.added.kind}"
        return f"Rung({added}: {self.fit.model.name})"

    def to_dict(self) -> dict[str, Any]:
        """The contract's record of a rung."""
        return {
            "added": None if self.added is None else self.added.kind,
            "removed": list(self.removed),
            **self.fit.body(),
        }


@dataclass(frozen=True, eq=False)
class Study:
    """A ladder of ever better models of one recording.

    Attributes
    ----------
    ladder : tuple of Rung
    check : Check
        Of the last rung: what is left unexplained.
    stopped_because : str
        ``adequate``, ``nothing helps`` or ``limit``.
    """

    recording: Recording
    ladder: tuple[Rung, ...]
    check: Check
    stopped_because: str

    @property
    def fit(self) -> Fit:
        """The last fit."""
        return self.ladder[-1].fit

    @property
    def adequate(self) -> bool:
        """Whether the last model leaves nothing unexplained."""
        return self.check.adequate

    @property
    def unexplained(self) -> dict[str, Any]:
        """Worst intervals that remain, as in the contract."""
        return self.check.where.worst()

    def to_dict(self) -> dict[str, Any]:
        """``allanite/improve/1`` of the contract."""
        return {
            "schema": "allanite/improve/1",
            "version": _kernels.version(),
            "recording": self.recording.describe(),
            "ladder": [rung.to_dict() for rung in self.ladder],
            "adequate": self.adequate,
            "stopped_because": self.stopped_because,
            "unexplained": self.unexplained,
        }

    plot = verbs.study_plot

    def __str__(self) -> str:
        lines = [
            f"{'':>2}  {'added':22} {'χ²/dof':>8} {'p':>9} {'ADEV rms %':>11} {'max %':>7} {'held out':>9}  model"
        ]
        for i, rung in enumerate(self.ladder):
            m, e = rung.fit.misfit, rung.fit.error
            added = "(start)" if rung.added is None else "+ " + rung.fit.display_name(rung.added)
            added += "".join(f" − {kind}" for kind in rung.removed)
            lines.append(
                f"{i:>2}  {added:22} {m.reduced:8.2f} {m.p_value:9.2g} {_number(e.adev_rms_percent):>11} "
                f"{_number(e.adev_max_percent):>7} {_number(e.held_out):>9}  {rung.fit.model.name}"
            )
        lines.append(f"stopped: {self.stopped_because}")
        if self.stopped_because == "nothing helps" and self.check.significant:
            kinds = ", ".join(dict.fromkeys(s.kind for s in self.check.significant))
            lines.append(f"significant, but worse on the half that was not fitted: {kinds}")
        left = self.check.where.sentences()
        if not self.adequate:
            lines += ["left unexplained:", *(f"  {s}" for s in left)] if left else []
        return "\n".join([*lines, "", str(self.fit)])

    def __repr__(self) -> str:
        first, last = self.ladder[0].fit.model.name, self.fit.model.name
        words = "adequate" if self.adequate else self.stopped_because
        return f"Study({self.recording.columns[0]}: {first} → {last}, {words})"

    def _repr_html_(self) -> str:
        from allanite.common.showing import html_list, html_table

        rows = []
        for rung in self.ladder:
            m, e = rung.fit.misfit, rung.fit.error
            added = "start" if rung.added is None else f"+ {rung.fit.display_name(rung.added)}"
            added += "".join(f", − {kind}" for kind in rung.removed)
            errors = (e.adev_rms_percent, e.adev_max_percent, e.held_out)
            rows.append(
                (
                    added,
                    rung.fit.model.name,
                    f"{m.reduced:.2f}",
                    f"{m.p_value:.2g}",
                    *(_number(value) for value in errors),
                )
            )
        head = ("rung", "model", "χ²/dof", "p", "ADEV rms %", "max %", "held out")
        title = f"{self.recording.path or 'recording'} · {self.recording.columns[0]}"
        left = [] if self.adequate else self.check.where.sentences()
        ending = [f"stopped: {self.stopped_because}", *left]
        table = html_table(title, head, rows, (2, 3, 4, 5, 6))
        return table + html_list(ending) + self.fit._repr_html_()


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


def improve(
    recording: Recording,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    limit: int = LIMIT,
) -> Study:
    """Add the best missing effect until nothing significant is left.

    Parameters
    ----------
    recording : Recording
        One column.
    model : Model, Effect or str
        Where to start.
    on_progress : callable, optional
        Called with (rungs done, most rungs).
    limit : int
        Most additions.

    Returns
    -------
    Study
    """
    fit = fit_model(recording, model)
    ladder = [Rung(fit)]
    while True:
        check = check_fit(fit)
        if on_progress is not None:
            on_progress(len(ladder), limit + 1)
        if check.adequate:
            return Study(recording, tuple(ladder), check, "adequate")
        better = next_rung(ladder, check)
        if better is None:
            return Study(recording, tuple(ladder), check, "nothing helps")
        if len(ladder) > limit:
            return Study(recording, tuple(ladder), check, "limit")
        ladder.append(better)
        fit = better.fit


def next_rung(ladder: Sequence[Rung], check: Check) -> Rung | None:
    """The rung that `improve` puts on a ladder whose last fit was checked, or None if nothing helps."""
    fit = ladder[-1].fit
    better = _next(fit, check)
    if better is None:
        return None
    # What was taken out once and came back is needed.
    gone = {kind for rung in ladder for kind in rung.removed}
    return _without_needless(better, fit, gone)


def _next(fit: Fit, check: Check) -> Rung | None:
    """The best significant suggestion whose addition lowers the held-out score."""
    for suggestion in check.significant:
        added = fit.add(suggestion)
        before, after = fit.error.held_out, added.error.held_out
        if before is None or after is None or after < before:
            return Rung(added, suggestion.effect)
    return None


def _without_needless(rung: Rung, before: Fit, gone: set[str]) -> Rung:
    """The rung without effects that the record showed before the addition and no longer does (a B that was a sum of lags).

    What it never showed stays, as an upper limit: it was asked for. So does what still explains something, though less than
    would be detected: without it the others would take its part and be too large.
    """
    fit, removed = rung.fit, []
    places = [
        place
        for place, effect in enumerate(before.model)
        if _shown(before, place) and not _shown(fit, place) and effect.kind not in gone
    ]
    for place in reversed(places):
        without = fit.remove(place)
        lost = fit.solution.log_likelihood - without.solution.log_likelihood
        old, new = fit.error.held_out, without.error.held_out
        if lost < NEEDLESS and (old is None or new is None or new <= old):
            removed.append(fit.model.effects[place].kind)
            fit = without
    return Rung(fit, rung.added, tuple(reversed(removed)))


def _shown(fit: Fit, place: int) -> bool:
    """Whether the record distinguishes the coefficient of an effect from 0."""
    effect = fit.model.effects[place]
    values = fit.estimates[place]
    return all(
        getattr(values[p.name], "detected", True)
        for p in effect.parameters
        if p.role == "coefficient"
    )
