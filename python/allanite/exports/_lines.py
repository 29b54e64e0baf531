"""Lines of formats with one N and one K per sensor."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from allanite.common.errors import InputError
from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._choice import choose
from allanite.exports._head import head_comments
from allanite.exports._held import NoiseParameters
from allanite.exports._text import as_comments


def choose_all(
    axes: Iterable[Axis], *, overbound: bool, simulator: bool = False
) -> list[tuple[Axis, NoiseParameters]]:
    """List of pairs (axis, `NoiseParameters`) with the N and K that a file states for each axis; see `choose`."""
    return [(axis, choose(axis, overbound=overbound, simulator=simulator)) for axis in axes]


def with_shared_numbers(
    *sensors: Sequence[tuple[Axis, NoiseParameters]],
) -> list[tuple[Axis, NoiseParameters]]:
    """Pairs (axis, new `NoiseParameters`), in which N and K are the largest of all axes of a sensor.

    In `others`, each axis whose own N or K is smaller names the axis from which the number comes.
    """
    out = []
    for pairs in sensors:
        for axis, own in pairs:
            largest = {name: _axis_with_largest(pairs, name) for name in ("N", "K")}
            numbers = {name: getattr(choice, name) for name, (_, choice) in largest.items()}
            others = tuple(
                (name, donor.name)
                for name, (donor, _) in largest.items()
                if getattr(own, name) < numbers[name]
            )
            out.append((axis, replace(own, **numbers, others=others)))
    return out


def _axis_with_largest(
    pairs: Sequence[tuple[Axis, NoiseParameters]], name: str
) -> tuple[Axis, NoiseParameters]:
    """Pair (axis, `NoiseParameters`) with the largest N or K (`name`)."""
    return max(pairs, key=lambda pair: getattr(pair[1], name))


def largest_number(pairs: Sequence[tuple[Axis, NoiseParameters]], name: str) -> tuple[float, str]:
    """Pair (value, remark): the largest N or K (`name`) of the axes, and a text that names the axis with this value.

    The text begins with the remark on the number, if there is one. It does not name a single axis. Raises `InputError`
    unless the value is positive.
    """
    axis, choice = _axis_with_largest(pairs, name)
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
    ranges: Mapping[str, tuple[float, float]] | None = None,
    node: str = "",
) -> str:
    """Text of a file with a head and lines ``key: value``; each value is the largest of the axes of its sensor.

    A sensor without axes has a comment instead of its lines. Raises `InputError` unless every value is positive.

    Parameters
    ----------
    axes : sequence of Axis
        Axes of gyroscopes and accelerometers.
    rows : sequence of (key, sensor, name, unit)
        One tuple per line; sensor is ``gyro`` or ``accel``, name is ``N`` or ``K``.
    convert : dict of str to callable
        Functions that convert N and K in SI to the numbers of the format. Without a function, the number is in SI.
    convention : sequence of str
        Lines of the head about conventions: continuous time or per sample, variance or deviation.
    overbound : bool
        Whether N and K cover the upper limits.
    form : str
        Format of a line with ``key``, ``value`` and ``note``.
    ranges : dict of str to (float, float), optional
        Documented minimum and maximum of a key. A number outside is written, with a note.
    node : str
        Text between the head and the lines, such as the name of the YAML node that contains them.
    """
    gyro, accel = gyro_and_accel_axes(axes)
    pairs = {
        "gyro": choose_all(gyro, overbound=overbound),
        "accel": choose_all(accel, overbound=overbound),
    }
    lines = [as_comments(head_comments(with_shared_numbers(*pairs.values()), convention))]
    for sensor, own in pairs.items():
        if not own:
            lines.append(f"# {sensor}: no model given, so its keys are missing\n")
    lines.append(node)
    for key, sensor, name, unit in rows:
        if pairs[sensor]:
            value, remark = largest_number(pairs[sensor], name)
            written = convert.get(name, float)(value)
            low, high = (ranges or {}).get(key, (-math.inf, math.inf))
            limit = f"below its documented minimum {low:g}" if written < low else ""
            limit = f"above its documented maximum {high:g}" if written > high else limit
            note = "; ".join([f"# {unit}", *filter(None, (remark, limit))])
            lines.append(form.format(key=key, value=written, note=note) + "\n")
    return "".join(lines)
