"""Head of a parameter file: whether to use the file, what its numbers mean, and which effects it does not hold."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from allanite.effects import Deterministic, Effect, Stochastic
from allanite.exports._axis import HORIZON, Axis
from allanite.exports._follow import Quality, quality
from allanite.exports._held import NoiseParameters

Pair = tuple[Axis, NoiseParameters]

GENERAL = "Densities are two-sided: white noise has S(f) = N^2, sigma^2(tau) = N^2/tau."
#: NEES above which a filter is called overconfident; also the acceptance limit of the tests of every format. Chosen by
#: judgment; not measured.
MAX_NEES = 1.2
#: Maximum number of effects that are listed one by one. Above, only the number of each kind is stated.
MAX_LISTED_EFFECTS = 8
#: Minimum distance between the ends of the interval over alternative models and of the own interval, relative to the width
#: of the own interval. Below, the alternative interval is not stated. Chosen by judgment; not measured.
MIN_WIDENING = 0.1


def head_comments(
    pairs: Sequence[Pair],
    convention: Sequence[str],
    *,
    simulator: bool = False,
    samples: bool = False,
) -> list[str]:
    """List of comment lines for the head of a file.

    The first three lines say what the file holds, where its numbers come from, and whether to use it. A file with
    numbers per sample (`samples`), or for a simulator, states no NEES.
    """
    no_filter = simulator or samples
    return [
        f"Noise parameters of {', '.join(axis.name for axis, _ in pairs)}, written by allanite.",
        f"Source: {', '.join(dict.fromkeys(_source_text(axis) for axis, _ in pairs))}.",
        _verdict_comment(pairs, simulator=no_filter),
        "Details:",
        *(line for a, c in pairs for line in _axis_comments(a, c, simulator=simulator)),
        *([] if no_filter else _nees_sentences(pairs)),
        GENERAL,
        *convention,
    ]


def _source_text(axis: Axis) -> str:
    """Origin of an axis: ``fit to`` its log or file, ``a given model``, or a source ``without a log``."""
    if axis.assumptions:
        return f"{axis.source}, without a log"
    return f"fit to {axis.source}" if axis.source != axis.name else "a given model"


def _verdict_comment(pairs: Sequence[Pair], *, simulator: bool) -> str:
    """Comment that says whether to use the file, gives reasons against it, and states its largest error.

    The text is ASCII, because some programs refuse other characters in a comment.
    """
    found = [(axis, quality(axis, choice)) for axis, choice in pairs]
    reasons = [f"{axis.name}: {axis.warning}" for axis, _ in pairs if axis.warning]
    filters = [(a, c, q) for (a, c), (_, q) in zip(pairs, found, strict=True) if not c.B]
    if not simulator:
        reasons += [_overconfidence_text(*one) for one in filters if one[2].nees > MAX_NEES]
    axis, worst = max(found, key=lambda one: abs(np.log(one[1].ratio)))
    where = f" ({axis.name})" if len(found) > 1 else ""
    horizon = max(a.horizon for a, _ in pairs)
    use = f"Use: no. {'; '.join(reasons)}." if reasons else "Use: yes."
    farthest = (
        f"Allan deviation of this file up to {horizon:.4g} s: {_bound(worst.ratio)} times the model's, at"
        f" {worst.tau:.4g} s{where}."
    )
    sentences = [use, farthest]
    unstated = [
        axis.name
        for axis, _ in pairs
        if axis.assumptions and not any(e.wanders for e in axis.slow_model.stochastic)
    ]
    if unstated and not simulator:
        sentences.append(f"The source states no slow noise of {', '.join(unstated)}: K is a guess.")
    sentences += _short_log_sentences([axis for axis, _ in pairs])
    short = [a for a, _ in pairs if a.horizon > 1.001 * a.until]
    if short:
        sentences.append(
            f"The log of {short[0].name} only shows the noise up to tau = {short[0].until:.3g} s."
        )
    return " ".join(sentences)


def _nees_sentences(pairs: Sequence[Pair]) -> list[str]:
    """List with one sentence on the NEES (true over predicted error variance) of bias filters that use the written numbers.

    Axes with a bias instability B are left out, because such a filter has no state for B; the list may be empty.
    """
    filters = [quality(axis, choice) for axis, choice in pairs if not choice.B]
    if not filters:
        return []
    horizon = max(axis.horizon for axis, _ in pairs)
    low, high = (f(q.at_horizon for q in filters) for f in (min, max))
    spread = f"{low:.2f}" if f"{low:.2f}" == f"{high:.2f}" else f"{low:.2f} to {high:.2f}"
    most, early = (
        max(values) for values in zip(*((q.nees, q.early) for q in filters), strict=True)
    )
    fast = f", {early:.2f} at shorter times due to fast noise" if early > MAX_NEES else ""
    return [
        (
            f"NEES of a bias filter (true over predicted variance, 1 is ideal): {spread} after {horizon:.4g} s without"
            f" aiding, at most {most:.2f} from {horizon / 10:.4g} s on{fast}."
        )
    ]


def _short_log_sentences(axes: Sequence[Axis]) -> list[str]:
    """Sentences about slow effects that a log was too short to detect: a tenth of its length is below 100 s.

    Axes whose numbers are assumptions are skipped.
    """
    of: dict[tuple[str, float], list[str]] = {}
    for axis in axes:
        if axis.assumptions or axis.until >= HORIZON:
            continue
        hidden = [
            one.label
            for one in axis.fitted.effects
            if isinstance(one.effect, Stochastic) and one.effect.wanders and one.hidden
        ]
        if hidden:
            of.setdefault((", ".join(hidden), axis.span[1]), []).append(axis.name)
    return [
        f"Record too short for {hidden} of {', '.join(names)}: a record of {duration:.3g} s shows tau up to"
        f" {0.1 * duration:.3g} s, and {hidden} {'were' if ', ' in hidden else 'was'} not detected there. This file"
        f" counts {hidden} with values derived from upper limits."
        for (hidden, duration), names in of.items()
    ]


def _overconfidence_text(axis: Axis, choice: NoiseParameters, found: Quality) -> str:
    """Text that a filter with the written numbers of an axis is overconfident, with its NEES and the omitted effects."""
    left = [label for label, _ in _omitted_effects(axis, choice, simulator=False)]
    what = ", ".join(left) or "a part of the model"
    return (
        f"{axis.name}: a bias filter is overconfident, its NEES is {found.nees:.3g} after {found.at:.3g} s,"
        f" because the numbers do not hold {what}"
    )


def _axis_comments(axis: Axis, choice: NoiseParameters, *, simulator: bool) -> list[str]:
    """Comment lines on one axis: its model, notes, assumptions, and the effects that the numbers cover or omit."""
    covered = _covered_text(axis, choice, simulator=simulator)
    name = "+".join(_names_with_counts(e.short for e in axis.model))
    omitted = _omitted_effects(axis, choice, simulator=simulator)
    left = _listed_or_counted({f"{label} ({e.kind})": e.kind for label, e in omitted})
    lines = [f"{axis.name}: model {name}; in this file: {covered}"]
    lines += [f"  {note}" for note in axis.notes]
    lines += [f"  assumed: {assumption}" for assumption in axis.assumptions]
    if choice.overbound and axis.loudest_segment is not None:
        begin, end = axis.loudest_segment
        lines.append(
            f"  N covers the loudest segment of the log, from about {begin:.4g} s to {end:.4g} s"
        )
    lines += [f"  {line}" for line in _alternative_intervals(axis)]
    if left:
        lines.append(f"  not in this file: {', '.join(left)}")
    return lines


def _names_with_counts(names: Iterable[str]) -> list[str]:
    """List of the different names in order of appearance, each with its count if it is larger than 1: ``12 SIN``."""
    return [name if n == 1 else f"{n} {name}" for name, n in Counter(names).items()]


def _bound(ratio: float) -> str:
    """Text of a ratio of two curves that is furthest from 1: ``at most 1.27`` or ``at least 0.93``; ``1.00`` if equal."""
    text = f"{ratio:.2f}"
    if text == "1.00":
        return text
    return f"at {'most' if ratio > 1.0 else 'least'} {text}"


def _listed_or_counted(kinds: Mapping[str, str]) -> list[str]:
    """Labels of effects, the keys of `kinds`; more than 8 are counted by kind: ``12 SIN``."""
    return list(kinds) if len(kinds) <= MAX_LISTED_EFFECTS else _names_with_counts(kinds.values())


def _alternative_intervals(axis: Axis) -> Iterator[str]:
    """Yield a line for each coefficient whose 95 % interval is over 10 % wider at one end under an alternative model.

    Example: ``K 115 (95 ... 137); 0 ... 190 if alternatives are counted: gauss_markov``.
    """
    for one in axis.fitted.effects:
        for name, (lower, upper) in one.over_rivals.items():
            given = one.parameter(name)
            low, high = given.interval
            if low is None or high is None or lower is None or upper is None:
                continue
            if not isinstance(given.value, float):
                continue
            if max(low - lower, upper - high) <= MIN_WIDENING * (high - low):
                continue
            key = one.label if name == one.label else f"{one.label} {name}"
            kinds = ", ".join(one.rivals) or "another effect"
            yield (
                f"{key} {given.value:.3g} ({low:.3g} ... {high:.3g}) {given.unit};".rstrip()
                + f" {lower:.3g} ... {upper:.3g} if alternatives are counted: {kinds}"
            )


def _covered_text(axis: Axis, choice: NoiseParameters, *, simulator: bool) -> str:
    """Text that names the effects that the numbers of a file cover, and the axes from which shared numbers come."""
    if choice.overbound:
        covered = "the upper limits of all its effects"
    elif choice.holds is not None:
        covered = f"{', '.join(choice.holds)} as fitted"
    else:
        omitted = dict(_omitted_effects(axis, choice, simulator=simulator))
        shorts = {label: e.short for label, e in _labeled_effects(axis) if label not in omitted}
        covered = "numbers that cover " + ", ".join(_listed_or_counted(shorts))
    if choice.others:
        of: dict[str, list[str]] = {}
        for name, other in choice.others:
            of.setdefault(other, []).append(name)
        donors = ", ".join(f"{' and '.join(names)} of {other}" for other, names in of.items())
        covered += f" (the largest of the axes: {donors})"
    return covered


def _labeled_effects(axis: Axis) -> Iterator[tuple[str, Effect]]:
    """Iterator over pairs (label in the model, `Effect`) of all effects of the model of an axis."""
    return zip(axis.model.labels, axis.model.effects, strict=True)


def _omitted_effects(
    axis: Axis, choice: NoiseParameters, *, simulator: bool
) -> list[tuple[str, Effect]]:
    """Pairs (label, effect) of the effects that the numbers of a file omit, mainly known functions such as steps."""
    if choice.holds is not None:
        return [(label, e) for label, e in _labeled_effects(axis) if label not in choice.holds]
    return [
        (label, e) for label, e in _labeled_effects(axis) if not _is_covered(e, axis, simulator)
    ]


def _is_covered(effect: Effect, axis: Axis, simulator: bool) -> bool:
    """True if exported numbers, such as N and K, can represent this effect.

    A known function with an Allan variance of its own, such as a ramp, counts. Numbers for a simulator do not represent
    lines and narrow bands.
    """
    if isinstance(effect, Stochastic):
        return not simulator or effect.occupies is None
    if effect.periodic:
        return not simulator
    if isinstance(effect, Deterministic):
        return bool(effect.own_allan_variance(np.ones(1), axis.sampling)[0] > 0.0)
    return True
