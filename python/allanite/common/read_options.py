"""Options of `allanite.read`, in the form in which the readers, the commands and the page pass them on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ParamSpec, TypeVar

from allanite.common.errors import InputError
from allanite.common.plain import plain
from allanite.common.unit_kinds import PHASE, kind_of_unit
from allanite.common.units import units_by_kind

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """Options of `allanite.read`: the fields are its parameters as given, and the properties have one type each.

    Raises `InputError` if the rate is a text that is not a number.
    """

    rate: float | str | None = None
    unit: str | None = None
    quantity: str | None = None
    column: str | int | Sequence[str | int] | None = None
    covariate: str | Sequence[str] | None = None
    time_column: str | int | None = None
    piece: int | None = None
    topic: str | Sequence[str] | None = None
    scale: Mapping[str, float] | None = None

    def __post_init__(self) -> None:
        """Raise `InputError` for a rate that is not a number."""
        _ = self.rate_hz

    @property
    def rate_hz(self) -> float | None:
        """Sampling rate, Hz, also if it has an exclamation mark (``100!``); None without a rate."""
        if not isinstance(self.rate, str):
            return self.rate
        try:
            return float(self.rate.strip().removesuffix("!"))
        except ValueError:
            raise InputError(
                f"the rate {self.rate!r} is not a number in Hz: write 100, or '100!' to override the file"
            ) from None

    @property
    def overrides_rate(self) -> bool:
        """True if the rate overrides the rate in the log: a text such as ``100!``."""
        return isinstance(self.rate, str) and self.rate.strip().endswith("!")

    @property
    def meaning(self) -> str | None:
        """Meaning of the samples: the given quantity, ``"angle"`` for a unit of time (phase of a clock), otherwise None."""
        if self.quantity is None and kind_of_unit(self.unit) == PHASE:
            return "angle"
        return self.quantity

    @property
    def unit_by_kind(self) -> dict[str, str]:
        """Unit that the caller gave, by kind of sensor; empty without a unit and for the unit ``"1"``.

        Raises `InputError` for an unknown unit.
        """
        if self.unit is None or self.unit == "1":
            return {}
        return units_by_kind(self.unit, self.meaning or "rate")

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Tuple of the names or indices of the columns to read as samples; empty for all sensors."""
        if self.column is None:
            return ()
        given = (self.column,) if isinstance(self.column, str | int) else self.column
        return tuple(one if isinstance(one, int) else plain(one) for one in given)

    @property
    def covariates(self) -> tuple[str, ...]:
        """Tuple of the names of the logged columns that the sensor may depend on."""
        return tuple(map(plain, _texts(self.covariate)))

    @property
    def time(self) -> str | int | None:
        """Name or index of the column of time stamps; None to find it."""
        return plain(self.time_column) if isinstance(self.time_column, str) else self.time_column

    @property
    def ignores_time(self) -> bool:
        """True if time columns must be ignored (``time_column="none"``)."""
        return self.time_column == "none"

    @property
    def topics(self) -> tuple[str, ...]:
        """Tuple of the names of the topics to read; empty for the default."""
        return _texts(self.topic)

    @property
    def scales(self) -> Mapping[str, float]:
        """Mapping from the name of a column to its factor."""
        return self.scale or {}


def _texts(given: str | Sequence[str] | None) -> tuple[str, ...]:
    """Tuple of one or several texts; empty for None."""
    return (given,) if isinstance(given, str) else tuple(given or ())


def takes_parameters_of(
    _model: Callable[Parameters, Any],
) -> Callable[[Callable[..., Result]], Callable[Parameters, Result]]:
    """Decorator that returns a function unchanged; type checkers give the function the parameters of `_model`."""
    return lambda function: function
