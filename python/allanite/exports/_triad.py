"""Assign the numbers of axes to x, y and z."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.recording.axis_names import axis_letter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.exports._axis import Axis

PLACES = ("x", "y", "z")


def numbers_in_xyz(
    axes: Sequence[Axis], numbers: Sequence[tuple[float, ...]]
) -> tuple[list[tuple[float, ...]], list[str]]:
    """Pair: list of the numbers (tuples) of x, y and z in this order, and list of remarks on axes without an own model.

    The letter in its name assigns an axis. If any of exactly three axes has no letter, they are taken in their order.
    An axis without a model gets the largest of each number. All three get the largest numbers if a letter is repeated,
    or if it is missing and the number of axes is not three.

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
