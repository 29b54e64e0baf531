"""Assign the numbers of axes to x, y and z."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._held import NoiseParameters
from allanite.recording.axis_names import axis_letter

PLACES = ("x", "y", "z")


def numbers_in_xyz(
    axes: Sequence[Axis], numbers: Sequence[tuple[float, ...]]
) -> tuple[list[tuple[float, ...]], list[str]]:
    """Pair (numbers of x, y and z, remarks) of the axes of one sensor; the letter in the name of an axis says which it is.

    An axis without a model gets the largest of each number, and a text says so. This is safe: density and Allan
    variance of a Gauss-Markov process rise with strength and time. All three get the largest numbers if letters do not
    tell the axes apart; but three axes, some without a letter, are taken in their order.
    """
    letters = [axis_letter(axis.name) for axis in axes]
    if len(axes) == 3 and None in letters:
        letters = list(PLACES)
    known = None not in letters and len(set(letters)) == len(letters)
    given = dict(zip(letters, numbers, strict=True)) if known else {}
    most = tuple(max(column) for column in zip(*numbers, strict=True))
    bare = [place for place in PLACES if place not in given]
    rule = "each number is the largest of" if len(axes) > 1 else "the numbers are those of"
    names = ", ".join(axis.name for axis in axes)
    remark = f"{', '.join(bare)}: no own model was given; {rule} {names}"
    return [given.get(place, most) for place in PLACES], [remark] if bare else []


@dataclass(frozen=True, slots=True)
class Triads:
    """Numbers of a gyroscope and an accelerometer for x, y and z, and all axes with their parameters, gyroscopes first.

    `numbers` maps the label of a sensor to a dict from an attribute of `NoiseParameters` to its values for x, y and z.
    `remarks` are texts on axes without an own model; each begins with the label of its sensor.
    """

    pairs: list[tuple[Axis, NoiseParameters]]
    numbers: dict[str, dict[str, tuple[float, ...]]]
    remarks: list[str]


def triads_of(
    axes: Sequence[Axis],
    labels: Iterable[str],
    choose: Callable[[Axis], NoiseParameters],
    names: Sequence[str],
) -> Triads:
    """`Triads` with the attributes `names` of the `NoiseParameters` that ``choose(axis)`` returns for each axis.

    A sensor without axes has no entry. Raises `InputError` for an axis of another kind of sensor.
    """
    found = Triads([], {}, [])
    for own, label in zip(gyro_and_accel_axes(axes), labels, strict=True):
        if own:
            choices = [choose(axis) for axis in own]
            values = [tuple(getattr(choice, name) for name in names) for choice in choices]
            places, remarks = numbers_in_xyz(own, values)
            found.numbers[label] = dict(zip(names, zip(*places, strict=True), strict=True))
            found.pairs.extend(zip(own, choices, strict=True))
            found.remarks.extend(f"{label} {remark}" for remark in remarks)
    return found
