"""Which columns of a log are the samples, the time stamps and the covariates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.common.units import rate_unit, units_by_kind
from allanite.readers._split_time import seconds_and_rest
from allanite.readers.sensor_names import role_of, sensor_kind
from allanite.readers.unit_names import of_no_sensor
from allanite.recording import find_column
from allanite.recording.samples import distinct

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["Choice", "Request", "choose", "unit_of"]


@dataclass(frozen=True, slots=True)
class Request:
    """What the caller said about a log."""

    rate: float | None
    unit: str | None
    quantity: str | None
    columns: tuple[str | int, ...]
    covariates: tuple[str, ...]
    time_column: str | int | None
    piece: int | None = None
    topics: tuple[str, ...] = ()

    @property
    def kinds(self) -> dict[str, str]:
        """The unit that was given, by the kind of sensor that has it; of several one each."""
        if self.unit in (None, "1"):
            return {}
        assert self.unit is not None
        return units_by_kind(self.unit, self.quantity or "rate")

    @property
    def timeless(self) -> bool:
        """Whether the time column is to be left out."""
        return self.time_column == "none"

    def __post_init__(self) -> None:
        # As the names of the log are shown.
        fix = object.__setattr__
        fix(self, "columns", tuple(c if isinstance(c, int) else plain(c) for c in self.columns))
        fix(self, "covariates", tuple(map(plain, self.covariates)))
        if isinstance(self.time_column, str):
            fix(self, "time_column", plain(self.time_column))


@dataclass(frozen=True, slots=True)
class Choice:
    """Indices of the columns to use."""

    samples: tuple[int, ...]
    covariates: tuple[int, ...]
    time: int | None
    clocks: tuple[int, ...] = ()
    """Other columns of time stamps."""
    rest: int | None = None
    """Column of the rest of the second, where that of the time may hold whole seconds."""

    @property
    def all(self) -> list[int]:
        """All of them."""
        time = [] if self.time is None else [self.time]
        rest = [] if self.rest is None else [self.rest]
        return [*self.samples, *self.covariates, *time, *rest, *self.clocks]


def choose(
    names: Sequence[str],
    units: Sequence[str | None],
    request: Request,
    *,
    stamped: bool = False,
    time_at: int | None = None,
) -> Choice:
    """Choose columns by their names and units.

    Parameters
    ----------
    names, units : sequence
        Of all columns of the log.
    request : Request
        What the caller said.
    stamped : bool
        The log keeps its time stamps apart from the columns.
    time_at : int, optional
        Column of time stamps, found by its numbers.

    Raises
    ------
    InputError
        An unknown column, or no sensor among them; the columns are listed.
    """
    names = distinct(names)
    roles = [role_of(name, unit) for name, unit in zip(names, units, strict=True)]
    pair = seconds_and_rest(names)
    if pair is not None and not stamped:
        roles = ["time" if i in pair else role for i, role in enumerate(roles)]
    apart = stamped and request.time_column in (None, "t", "time")
    if request.timeless:
        time_at, roles = None, ["other" if role == "time" else role for role in roles]
    elif request.time_column is not None and not apart:
        time_at = find_column(request.time_column, names)
    elif time_at is None and not apart and "time" in roles:
        time_at = roles.index("time") if pair is None else pair[0]
    rest = pair[1] if pair is not None and time_at in pair and not stamped else None
    if rest is not None and pair is not None:
        time_at = pair[0]
    if request.columns:
        found = dict.fromkeys(find_column(name, names) for name in request.columns)
        samples = tuple(found)
    else:
        samples = _sensors(names, units, roles, request.kinds, time_at)
    covariates = [i for i, role in enumerate(roles) if role == "temperature" and i not in samples]
    for name in request.covariates:
        at = find_column(name, names)
        if at not in covariates and at not in samples:
            covariates.append(at)
    taken = {*samples, *covariates, time_at, rest}
    clocks = [i for i, role in enumerate(roles) if role == "time" and i not in taken]
    others = () if time_at is None else tuple(clocks)
    return Choice(samples, tuple(covariates), time_at, others, rest)


def _sensors(
    names: Sequence[str],
    units: Sequence[str | None],
    roles: Sequence[str],
    given: Mapping[str, str],
    time_at: int | None,
) -> tuple[int, ...]:
    found = [i for i, role in enumerate(roles) if role == "sensor" and i != time_at]
    # Gyroscopes and accelerometers in one file: a unit given for one kind chooses it.
    chosen = [i for i in found if sensor_kind(names[i]) in given]
    found = chosen or found
    foreign = of_no_sensor(names, units)
    if not found and foreign:
        counter = ", of a counter Hz/10MHz" if any("Hz" in one for one in foreign) else ""
        raise InputError(
            f"no sensor column found: {', '.join(foreign)} is in no unit of a sensor",
            missing="column",
            remedy=": name it with {column} and give {unit}" + counter,
        )
    if not found:
        raise InputError(
            f"no sensor column found among {', '.join(names) or 'none at all'}",
            missing="column",
            remedy=": name it with {column}",
        )
    return tuple(found)


def _given_for(name: str, own: str | None, request: Request) -> str | None:
    """The unit that the caller gave for a column: of several that of its kind."""
    if len(request.kinds) < 2:
        return request.unit
    kind = sensor_kind(name)
    if own is not None:
        try:
            kind = rate_unit(own, request.quantity or "rate").kind
        except InputError:
            return None
    if kind not in request.kinds:
        raise InputError(
            f"column {name}: its name does not say which of {request.unit} it is in",
            missing="column",
            remedy=": take the columns of one unit at a time with {column}",
        )
    return request.kinds[kind]


def unit_of(name: str, own: str | None, request: Request, quantity: str) -> str:
    """Return the unit of a column: the file's and the caller's must not contradict each other."""
    given = _given_for(name, own, request)
    if given is None:
        if own == "s" and quantity == "rate":
            raise InputError(
                f"column {name} is in s",
                missing="quantity",
                remedy=": give {quantity:angle} for a phase",
            )
        return own or "1"
    if own is None:
        return given
    try:
        said = rate_unit(own, quantity)
    except InputError:
        return given
    if said.name != rate_unit(given, quantity).name:
        raise InputError(
            f"column {name} is in {own} by the file",
            missing="unit",
            remedy=f", {given} by {{unit}}: leave it out, or convert by {{to}}",
        )
    return given
