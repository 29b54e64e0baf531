"""Read statistics of ntpd: loopstats and peerstats."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.readers._format import LogFormat
from allanite.readers._table import Picker, Table
from allanite.readers.texts._lines import (
    MJD_OF_1970,
    chosen_source,
    date_times,
    first_lines,
    numbered_lines,
    spacing_notes,
)

# Source: ntp.org, "Monitoring Commands and Options". Both begin with the MJD and the seconds past UTC midnight.
#   loopstats: 50935 75440.031 0.000006019 13.778190 0.000351733 0.0133806 6
#              offset s, frequency ppm, jitter s, wander ppm, poll exponent
#   peerstats: 48773 10847.650 127.127.4.1 9714 -0.001605376 0.000000000 0.001424877 0.000958674
#              address, status (hexadecimal), offset s, delay s, dispersion s, jitter s
_NUMBER = r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?"
_DAY = r"(?P<day>[4-9]\d{4})\s+(?P<second>\d{1,5}(?:\.\d+)?)"
_LOOP = re.compile(
    rf"^{_DAY}\s+(?P<offset>{_NUMBER})\s+(?P<frequency>{_NUMBER})\s+{_NUMBER}\s+{_NUMBER}\s+\d{{1,2}}$"
)
_PEER = re.compile(
    rf"^{_DAY}\s+(?P<peer>[\w.:()]*[.:(][\w.:()]*)\s+[0-9a-fA-F]{{3,8}}\s+(?P<offset>{_NUMBER})\s+(?P<delay>{_NUMBER})\s"
)


def recognizes(head: bytes) -> bool:
    """True if all first lines are statistics of ntpd: all of loopstats, or all of peerstats."""
    lines = first_lines(head)
    return bool(lines) and any(all(map(form.match, lines)) for form in (_LOOP, _PEER))


def read(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of a log of ntpd: offset in s, and frequency in ppm (loopstats) or delay in s of one peer (peerstats).

    The peer in `topics` is read, or the one with most rows. The first line decides between the two forms. Raises
    `InputError` for a row of another form, for several topics, and for an unknown one.
    """
    rows: dict[str, list[tuple[float, float, float]]] = {}
    form = _LOOP if _LOOP.match(next(numbered_lines(path), (0, ""))[1]) else _PEER
    for number, text in numbered_lines(path):
        found = form.match(text)
        if found is None:
            raise InputError(f"row {number} is not a row of ntpd's statistics: {plain(text, 60)}")
        seconds = 86400.0 * (int(found["day"]) - MJD_OF_1970) + float(found["second"])
        second_value = float(found["frequency" if form is _LOOP else "delay"])
        peer = "" if form is _LOOP else found["peer"]
        rows.setdefault(peer, []).append((seconds, float(found["offset"]), second_value))
    chosen, others = chosen_source(rows, topics, "peer")
    of = f" of {plain(chosen)}" if chosen else ""
    notes = [f"the offset{of} is the phase", *others]
    time, offset, second_values = np.array(rows[chosen]).T
    notes += spacing_notes(time)
    name, unit = ("frequency", "ppm") if form is _LOOP else ("delay", "s")
    return Table(
        ("offset", name),
        (offset, second_values),
        ("s", unit),
        time=date_times(time),
        notes=tuple(notes),
    )


FORMAT = LogFormat(
    "ntpd: loopstats and peerstats",
    read,
    recognizes=recognizes,
    has_topics=True,
    reads="the offset as the phase of the clock",
)
