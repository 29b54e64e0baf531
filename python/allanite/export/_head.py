"""The head of a file: whether to use it, what its numbers are, and what they leave out."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects._base import Stochastic
from allanite.effects._known import Deterministic, Periodic
from allanite.export._axis import HORIZON
from allanite.export._follow import Quality, quality

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from allanite.effects import Effect
    from allanite.export._axis import Axis
    from allanite.export._held import Choice

    Pair = tuple[Axis, Choice]

__all__ = ["GENERAL", "about", "head", "verdict"]

GENERAL = "Written by allanite. Densities are two-sided: white noise has S(f) = N^2, sigma^2(tau) = N^2/tau."
#: NEES from which on a filter is called overconfident, and the acceptance limit of every consumer.
OVERCONFIDENT = 1.2
#: Effects that are listed one by one; of more their kinds are counted.
MANY = 8
#: An interval over all models is named if an end lies farther out by this share of the own interval's width.
WIDER = 0.1


def head(
    pairs: Sequence[Pair],
    convention: Sequence[str],
    *,
    simulator: bool = False,
    samples: bool = False,
) -> list[str]:
    """Lines of a head: whether to use the file, the convention, and what of each axis is in it."""
    return [
        verdict(pairs, simulator=simulator or samples),
        GENERAL,
        *convention,
        *(line for a, c in pairs for line in about(a, c, simulator=simulator)),
    ]


def verdict(pairs: Sequence[Pair], *, simulator: bool = False) -> str:
    """The first line: whether to use the file, why not, and where its numbers are farthest from the model.

    ASCII, as not every reader of a comment takes more.
    """
    found = [(axis, quality(axis, choice)) for axis, choice in pairs]
    reasons = [f"{axis.name}: {axis.warning}" for axis, _ in pairs if axis.warning]
    filters = [(a, c, q) for (a, c), (_, q) in zip(pairs, found, strict=True) if not c.B]
    if not simulator:
        reasons += [_overconfident(*one) for one in filters if one[2].nees > OVERCONFIDENT]
    axis, worst = max(found, key=lambda one: abs(one[1].log_ratio))
    where = f" ({axis.name})" if len(found) > 1 else ""
    horizon = max(a.horizon for a, _ in pairs)
    use = f"Use: no. {'; '.join(reasons)}." if reasons else "Use: yes."
    farthest = (
        f"Up to {horizon:.4g} s the Allan deviation of the numbers is farthest from the model's at"
        f" {worst.tau:.4g} s: ratio {worst.ratio:.2f}{where}."
    )
    sentences = [use, farthest]
    if filters and not simulator:
        low, high = (f(q.at_horizon for _, _, q in filters) for f in (min, max))
        spread = f"{low:.2f}" if f"{low:.2f}" == f"{high:.2f}" else f"{low:.2f} to {high:.2f}"
        most = max(q.nees for _, _, q in filters)
        early = max(q.early for _, _, q in filters)
        fast = f", {early:.2f} at shorter times by fast noise" if early > OVERCONFIDENT else ""
        sentences.append(
            f"NEES of a bias filter (1 is ideal): {spread} after {horizon:.4g} s without aiding,"
            f" {most:.2f} at most from {horizon / 10:.4g} s on{fast}."
        )
    sentences += _too_short([axis for axis, _ in pairs])
    short = [a for a, _ in pairs if a.horizon > 1.001 * a.until]
    if short:
        sentences.append(
            f"The log of {short[0].name} shows tau up to {short[0].until:.3g} s alone."
        )
    return " ".join(sentences)


def _too_short(axes: Sequence[Axis]) -> list[str]:
    """A sentence on slow coefficients that a short log does not show; none where all logs are long or show them.

    A log is short if a tenth of it, the longest tau that it tells well, is below the horizon of most files.
    """
    of: dict[tuple[str, float], list[str]] = {}
    for axis in axes:
        if axis.assumptions or axis.until >= HORIZON:
            continue
        entries = zip(_all(axis), axis.document["effects"], strict=True)
        hidden = [
            label
            for (label, effect), entry in entries
            if isinstance(effect, Stochastic)
            and effect.wanders
            and entry["parameters"][effect.coefficient].get("detected") is False
        ]
        if hidden:
            of.setdefault((", ".join(hidden), axis.span[1]), []).append(axis.name)
    return [
        f"Record too short for {hidden} of {', '.join(names)}: {duration:.3g} s show tau up to {0.1 * duration:.3g} s,"
        f" where {hidden} {'were' if ', ' in hidden else 'was'} not detected; slow noise in this file is from upper limits."
        for (hidden, duration), names in of.items()
    ]


def _overconfident(axis: Axis, choice: Choice, found: Quality) -> str:
    left = [label for label, _ in _left_out(axis, choice, simulator=False)]
    what = ", ".join(left) or "a part of the model"
    return (
        f"{axis.name}: a bias filter is overconfident, its NEES is {found.nees:.3g} after {found.at:.3g} s,"
        f" as the numbers leave out {what}"
    )


def about(axis: Axis, choice: Choice | None, *, simulator: bool = False) -> list[str]:
    """Lines on one axis: its model, what the numbers cover and what not."""
    origin = f"fitted to {axis.source}" if axis.source != axis.name else "as given"
    if axis.assumptions:
        origin = f"from {axis.source}, no log"
    covered = _covered(axis, choice, simulator=simulator)
    name = "+".join(_counted(e.short for e in axis.model))
    line = f"{axis.name}: {origin}; model {name}; in this file: {covered}"
    left = [f"{label} ({e.kind})" for label, e in _left_out(axis, choice, simulator=simulator)]
    if len(left) > MANY:
        left = _counted(e.kind for _, e in _left_out(axis, choice, simulator=simulator))
    lines = [line, *(f"  {note}" for note in axis.notes)]
    lines += [f"  assumed: {assumption}" for assumption in axis.assumptions]
    if choice is not None and choice.overbound and axis.loudest is not None:
        begin, end = axis.loudest
        lines.append(
            f"  N covers the loudest stretch of the log, about {begin:.4g} s to {end:.4g} s"
        )
    lines += [f"  {line}" for line in _alternatives(axis)]
    if left:
        lines.append(f"  not in this file: {', '.join(left)}")
    return lines


def _counted(names: Iterable[str]) -> list[str]:
    """Each name once, with how often it is there: ``12 SIN``."""
    return [name if n == 1 else f"{n} {name}" for name, n in Counter(names).items()]


def _alternatives(axis: Axis) -> Iterator[str]:
    """``K 115 (95 ... 137); 0 ... 190 if it is a gauss_markov``: what other models of the log say of a coefficient."""
    for (label, _), entry in zip(_all(axis), axis.document["effects"], strict=True):
        for name, ends in (entry.get("over_rivals") or {}).items():
            given = entry["parameters"].get(name) or {}
            own, value = given.get("interval"), given.get("value")
            if value is None or not own or None in own or None in ends:
                continue
            if max(own[0] - ends[0], ends[1] - own[1]) <= WIDER * (own[1] - own[0]):
                continue
            key = label if name == label else f"{label} {name}"
            kinds = " or ".join(entry.get("rivals") or ()) or "another effect"
            numbers = [f"{float(v):.3g}" for v in (value, *own, *ends)]
            yield (
                f"{key} {numbers[0]} ({numbers[1]} ... {numbers[2]}) {given.get('unit', '')};".rstrip()
                + f" {numbers[3]} ... {numbers[4]} if it is {kinds}"
            )


def _covered(axis: Axis, choice: Choice | None, *, simulator: bool) -> str:
    if choice is None:
        covered = ", ".join(label for label, _ in _all(axis))
    elif choice.overbound:
        covered = "the upper limits of all its effects"
    elif choice.holds is not None:
        covered = f"{', '.join(choice.holds)} as fitted"
    else:
        missing = {label for label, _ in _left_out(axis, choice, simulator=simulator)}
        own = (label for label, _ in _all(axis) if label not in missing)
        labels = tuple(own)
        shorts = (e.short for label, e in _all(axis) if label in labels)
        covered = "numbers that cover " + ", ".join(
            labels if len(labels) <= MANY else _counted(shorts)
        )
    if choice is not None and choice.others:
        of: dict[str, list[str]] = {}
        for name, other in choice.others:
            of.setdefault(other, []).append(name)
        donors = ", ".join(f"{' and '.join(names)} of {other}" for other, names in of.items())
        covered += f" (the largest of the axes: {donors})"
    return covered


def _all(axis: Axis) -> Iterator[tuple[str, Effect]]:
    return zip(axis.model.labels, axis.model.effects, strict=True)


def _left_out(axis: Axis, choice: Choice | None, *, simulator: bool) -> list[tuple[str, Effect]]:
    """Effects that the numbers do not stand for."""
    if choice is not None and choice.holds is not None:
        return [(label, e) for label, e in _all(axis) if label not in choice.holds]
    return [(label, e) for label, e in _all(axis) if not _is_covered(e, axis, simulator)]


def _is_covered(effect: Effect, axis: Axis, simulator: bool) -> bool:
    """Whether numbers that follow the model stand for this effect: not for known functions of time.

    A simulator has no place for lines and narrow bands either.
    """
    if isinstance(effect, Stochastic):
        return not simulator or effect.occupies is None
    if isinstance(effect, Periodic):
        return not simulator
    if isinstance(effect, Deterministic):
        return bool(effect.own_allan_variance(np.ones(1), axis.sampling)[0] > 0.0)
    return True
