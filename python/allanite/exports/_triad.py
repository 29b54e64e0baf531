"""Assign the numbers of axes to x, y and z."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._held import NoiseParameters
from allanite.recording.axis_names import axis_letter

PLACES = ("x", "y", "z")


def numbers_in_xyz(
    axes: Sequence[Axis], numbers: Sequence[tuple[float, ...]]
) -> tuple[list[tuple[float, ...]], list[str]]:
    """Pair (numbers, remarks) for the axes of one sensor: list with the tuple of numbers of x, y and z; list of texts.

    The letter in its name says which axis it is. Three axes are taken in their order if any of them has no letter. An
    axis without a model gets the largest of each number, and a text says so. All three get the largest numbers if a
    letter is repeated, or if it is missing and the number of axes is not three.

    Notes
    -----
    The largest numbers are safe: density and Allan variance of a Gauss-Markov process rise with strength and time.
    """
    letters = [axis_letter(axis.name) for axis in axes]
    if len(axes) == 3 and None in letters:
        letters = list(PLACES)
    known = None not in letters and len(set(letters)) == len(letters)
    given = dict(zip(letters, numbers, strict=True)) if known else {}
    most = tuple(max(column) for column in zip(*numbers, strict=True))
    bare = [place for place in PLACES if place not in given]
    axis_remarks = []
    if bare and len(axes) > 1:
        names = ", ".join(axis.name for axis in axes)
        axis_remarks = [
            f"{', '.join(bare)}: no own model was given; each number is the largest of {names}"
        ]
    elif bare:
        axis_remarks = [
            f"{', '.join(bare)}: no own model was given; the numbers are those of {axes[0].name}"
        ]
    return [given.get(place, most) for place in PLACES], axis_remarks


def sensors_in_xyz(
    axes: Sequence[Axis],
    labels: Iterable[str],
    choose: Callable[[Axis], NoiseParameters],
    names: Sequence[str],
) -> Iterator[tuple[str, list[tuple[Axis, NoiseParameters]], list[tuple[float, ...]], list[str]]]:
    """Yield a tuple (label, pairs, numbers, remarks) for the gyroscope, then one for the accelerometer.

    A sensor without axes is left out.

    Parameters
    ----------
    axes : sequence of Axis
        Axes of gyroscopes and accelerometers. `pairs` has the tuple (axis, ``choose(axis)``) of each axis of the sensor.
    labels : iterable of str
        Names of the gyroscope and of the accelerometer in the file. Each remark begins with the label of its sensor.
    choose : callable
        Returns the `NoiseParameters` of an axis.
    names : sequence of str
        Attributes of `NoiseParameters`. `numbers` holds their values for x, y and z: a list of three tuples.
    """
    for own, label in zip(gyro_and_accel_axes(axes), labels, strict=True):
        if own:
            pairs = [(axis, choose(axis)) for axis in own]
            values = [tuple(getattr(found, name) for name in names) for _, found in pairs]
            numbers, remarks = numbers_in_xyz(own, values)
            yield label, pairs, numbers, [f"{label} {remark}" for remark in remarks]
