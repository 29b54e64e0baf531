"""Read ArduPilot DataFlash logs (.bin) with pymavlink: one kind of message, one instance."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from allanite.common.errors import InputError
from allanite.readers._format import LogFormat
from allanite.readers._isolated import isolated, refused_as
from allanite.readers._lines import head_of
from allanite.readers._table import Picker, Table
from allanite.readers.topics._quiet import quiet

#: Messages with inertial samples, best first.
TOPICS = ("IMU", "GYR", "ACC", "IMU2", "IMU3")
#: Field → column name and unit, from ArduPilot's documentation of its log messages.
FIELDS = {f"Gyr{axis.upper()}": (f"gyro_{axis}", "rad/s") for axis in "xyz"}
FIELDS |= {f"Acc{axis.upper()}": (f"acc_{axis}", "m/s^2") for axis in "xyz"}
FIELDS |= {"T": ("temperature", "degC")}


@isolated("pymavlink", 1.4, ["pymavlink.DFReader"])
def read(path: Path, pick: Picker, topics: Sequence[str] = ()) -> Table:  # noqa: ARG001 - all are at hand
    """`Table` of one kind and instance of messages of an ArduPilot log: of the topic, or else the first inertial kind.

    The topic ``IMU.1`` is the second instance of ``IMU``. Without a topic, the kind is ``IMU`` if logged, or else
    ``GYR``, ``ACC``, …. Then only inertial fields and the temperature are columns, and for ``GYR`` the attribute
    `others` names the accelerometer's messages of the same instance. Raises `InputError` for several topics, without
    such messages, and for messages without a time.
    """
    if not head_of(path).startswith(b"\xa3\x95"):
        raise InputError("not an ArduPilot log: no message at its start")
    if len(topics) > 1:
        raise InputError("kinds of messages have different rates: give only one topic")
    from pymavlink import DFReader

    rows: dict[tuple[str, int], list[tuple[float, ...]]] = {}
    names: dict[str, tuple[str, ...]] = {}
    wanted = topics[0].partition(".")[0] if topics else None
    log = None
    try:
        with refused_as("an ArduPilot log"), quiet(DFReader):
            log = _safe_reader_class(DFReader.DFReader_binary)(str(path), zero_time_base=True)
            known = [name for name in log.name_to_id if name != "FMT"]
            kinds = [wanted] if wanted else [name for name in TOPICS if name in known]
            while kinds and (message := log.recv_match(type=kinds)) is not None:
                kind = message.get_type()
                names.setdefault(kind, tuple(message.get_fieldnames()))
                values = tuple(_number_or_nan(getattr(message, field)) for field in names[kind])
                at = names[kind].index("I") if "I" in names[kind] else None
                rows.setdefault((kind, 0 if at is None else int(values[at])), []).append(values)
    finally:
        if log is not None and hasattr(log, "close"):
            log.close()
    chosen = _chosen_messages(rows, topics)
    if chosen is None:
        what = f"no message {topics[0]}" if topics else "no inertial message"
        raise InputError(f"{what} among {', '.join(sorted(known)) or 'no messages'}")
    data = np.array(rows[chosen])
    fields = names[chosen[0]]
    stamp = next((fields.index(f) for f in ("SampleUS", "TimeUS") if f in fields), None)
    if stamp is None:
        raise InputError(f"messages {chosen[0]} have no time; their fields are {', '.join(fields)}")
    kept = [i for i, field in enumerate(fields) if field in FIELDS or (topics and i != stamp)]
    columns = []
    for i in kept:
        name, unit = FIELDS.get(fields[i], (fields[i], None))
        columns.append((name, np.ascontiguousarray(data[:, i]), unit))
    # Raw samples of gyroscope and accelerometer are separate messages with different rates.
    mate = ("ACC", chosen[1])
    apart = ("ACC." + str(chosen[1]),) if not topics and chosen[0] == "GYR" and mate in rows else ()
    others = sorted(
        f"{kind}.{at}" for kind, at in rows if (kind, at) != chosen and f"{kind}.{at}" not in apart
    )
    note = f"messages not read: {', '.join(others)} (name one as the topic)"
    return Table.of(
        columns,
        time=data[:, stamp].astype(np.int64).astype("datetime64[us]"),
        notes=(note,) * bool(others),
        others=apart,
    )


def _safe_reader_class(reader: type[Any]) -> type[Any]:
    """Subclass of a reader class of pymavlink that raises an error for a message of length 0.

    Such a message of a damaged log would cause an infinite loop.
    """

    class Forward(reader):  # type: ignore[misc]
        def __init__(self, *arguments: Any, **options: Any) -> None:
            try:
                super().__init__(*arguments, **options)
            except Exception:
                with suppress(AttributeError):  # the file was not opened
                    self.close()
                raise

        def init_arrays_fast(self, progress_callback: Any = None) -> None:
            """Index the messages in Python; the compiled indexer would write to standard error directly."""
            self.init_arrays(progress_callback=progress_callback)

        def _parse_next(self) -> Any:
            """The next message, or None at the end of the log; raises an error for a message of length 0."""
            begin = self.offset
            message = super()._parse_next()
            if message is not None and self.offset <= begin:
                raise ValueError(f"a message of length 0 at byte {begin}")
            return message

    return Forward


def _number_or_nan(value: Any) -> float:
    """Value of a message field as a float; NaN if it is no number."""
    return float(value) if isinstance(value, int | float) else float("nan")


def _chosen_messages(
    rows: dict[tuple[str, int], list[tuple[float, ...]]], topics: Sequence[str]
) -> tuple[str, int] | None:
    """Kind and instance of the messages to read: those of the first topic, or of the first logged kind in `TOPICS`.

    Without a number in the topic, the instance is 0; without a topic, the lowest one. None if `rows` has no such
    messages.
    """
    if topics:
        kind, _, at = topics[0].partition(".")
        found = (kind, int(at) if at.isdigit() else 0)
        return found if found in rows else None
    return next((key for kind in TOPICS for key in sorted(rows) if key[0] == kind), None)


FORMAT = LogFormat(
    "ArduPilot DataFlash log",
    read,
    suffixes=(".bin",),
    has_topics=True,
    reads="gyroscope and accelerometer of one instance",
)
