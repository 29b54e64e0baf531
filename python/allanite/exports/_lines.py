"""Lines of formats with one N and one K per sensor."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.exports._axis import split
from allanite.exports._choice import choose
from allanite.exports._head import head
from allanite.exports._text import comments

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from allanite.exports._axis import Axis
    from allanite.exports._held import Choice


def needs_both(axes: Iterable[Axis], target: str) -> None:
    """Raise an error if the gyroscope or the accelerometer is missing, because the program reads the keys of both."""
    if not all(split(axes)):
        raise InputError(
            f"{target} needs models of both a gyroscope and an accelerometer: add the missing one"
        )


def chosen(
    axes: Iterable[Axis], *, overbound: bool, simulator: bool = False
) -> list[tuple[Axis, Choice]]:
    """Pairs of each axis and the numbers N and K to be written for it."""
    return [(axis, choose(axis, overbound=overbound, simulator=simulator)) for axis in axes]


def shared(pairs: Sequence[tuple[Axis, Choice]]) -> list[tuple[Axis, Choice]]:
    """Pairs of each axis and its numbers, with N and K replaced by the largest of all axes.

    This is for formats with one number per sensor.
    """
    if not pairs:
        return []
    donors = {name: _donor(pairs, name) for name in ("N", "K")}
    numbers = {name: getattr(choice, name) for name, (_, choice) in donors.items()}
    out = []
    for axis, own in pairs:
        smaller = [name for name, value in numbers.items() if getattr(own, name) < value]
        others = tuple((name, donors[name][0].name) for name in smaller)
        out.append((axis, replace(own, **numbers, others=others)))
    return out


def _donor(pairs: Sequence[tuple[Axis, Choice]], name: str) -> tuple[Axis, Choice]:
    """The pair (axis, numbers) with the largest number called `name`."""
    return max(pairs, key=lambda pair: getattr(pair[1], name))


def largest(pairs: Sequence[tuple[Axis, Choice]], name: str) -> tuple[float, str]:
    """Largest number called `name` (N or K) of several axes, and a remark that states its axis.

    This is for formats with one number per sensor.
    """
    axis, choice = _donor(pairs, name)
    value = getattr(choice, name)
    if not value > 0.0:
        raise InputError(
            f"{axis.name}: {name} is 0, but filters need a positive number: fit a model with noise"
        )
    words = [choice.remark(name)] if choice.remark(name) else []
    if len(pairs) > 1:
        words.append(f"largest of {len(pairs)} axes: {axis.name}")
    return float(value), "; ".join(words)


def value_lines(
    axes: Sequence[Axis],
    rows: Sequence[tuple[str, str, str, str]],
    convert: Mapping[str, Callable[[float], float]],
    convention: Sequence[str],
    *,
    overbound: bool,
    form: str = "{key}: {value:.6e}  {note}",
    mark: str = "#",
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> str:
    """Text of a file with a head and lines ``key: value``.

    Parameters
    ----------
    axes : sequence of Axis
        Axes of gyroscopes and accelerometers.
    rows : sequence of (key, sensor, name, unit)
        One tuple per line; sensor is ``gyro`` or ``accel``, name is ``N`` or ``K``.
    convert : dict of str to callable
        Functions that convert N and K in SI to the numbers of the format.
    convention : sequence of str
        Lines of the head about conventions: continuous time or per sample, variance or deviation.
    overbound : bool
        Whether N and K cover the upper limits.
    form, mark : str
        Format of a line with ``key``, ``value`` and ``note``, and the beginning of a comment.
    ranges : dict of str to (float, float), optional
        Documented minimum and maximum of a key. A number outside is written, with a note.
    """
    gyro, accel = split(axes)
    pairs = {"gyro": chosen(gyro, overbound=overbound), "accel": chosen(accel, overbound=overbound)}
    held = [pair for own in pairs.values() for pair in shared(own)]
    lines = [comments(head(held, convention), mark)]
    for sensor, own in pairs.items():
        if not own:
            lines.append(f"{mark} {sensor}: no model given, so its keys are missing\n")
    for key, sensor, name, unit in rows:
        if pairs[sensor]:
            value, remark = largest(pairs[sensor], name)
            written = convert[name](value)
            low, high = (ranges or {}).get(key, (-math.inf, math.inf))
            limit = f"below its documented minimum {low:g}" if written < low else ""
            limit = f"above its documented maximum {high:g}" if written > high else limit
            note = "; ".join([f"{mark} {unit}", *filter(None, (remark, limit))])
            lines.append(form.format(key=key, value=written, note=note) + "\n")
    return "".join(lines)
