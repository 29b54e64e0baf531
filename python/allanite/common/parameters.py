"""Fitted parameter: value, standard error, interval, unit, and whether it was detected."""

from __future__ import annotations

import math
from typing import Any

from allanite.common.documents import jsonable
from allanite.common.errors import InputError
from allanite.common.units import conversion

#: 97.5 % quantile of the normal distribution: half width of a 95 % interval in standard errors.
NORMAL = 1.959964


class Estimate(float):
    """A float with its standard error, 95 % interval and unit.

    Parameters
    ----------
    value : float
        The value, in `unit`.
    std_error : float, optional
        Standard error, in `unit`.
    interval : tuple of float, optional
        95 % interval (low, high), in `unit`. If `detected` is false for a coefficient, it includes 0, unless limits of the
        user forbid it.
    unit : str
        Unit, e.g. ``"deg/s·s^½"``.
    detected : bool
        Whether the value differs significantly from 0.
    name : str
        Name of the parameter, e.g. ``"N"``.

    Examples
    --------
    >>> N = al.Estimate(0.01, 0.0002, (0.0096, 0.0104), "deg/s/sqrt(Hz)", name="N")
    >>> N
    0.0100 ± 0.0002 deg/s/sqrt(Hz)
    >>> N.to("deg/sqrt(h)")
    0.600 ± 0.012 deg/sqrt(h)
    >>> N.to_dict()["interval"]
    [0.0096, 0.0104]
    >>> print(round(2 * N, 3))
    0.02
    """

    __slots__ = ("detected", "interval", "name", "std_error", "unit")

    std_error: float | None
    interval: tuple[float, float] | None
    unit: str
    detected: bool
    name: str

    def __new__(
        cls,
        value: float,
        std_error: float | None = None,
        interval: tuple[float, float] | None = None,
        unit: str = "",
        detected: bool = True,
        name: str = "",
    ) -> Estimate:
        """`Estimate` with these attributes, which cannot be changed later; the numbers become floats."""
        self = super().__new__(cls, value)
        fix = object.__setattr__
        fix(self, "std_error", None if std_error is None else float(std_error))
        fix(
            self, "interval", None if interval is None else (float(interval[0]), float(interval[1]))
        )
        fix(self, "unit", unit)
        fix(self, "detected", bool(detected))
        fix(self, "name", name)
        return self

    def __setattr__(self, name: str, value: object) -> None:
        """Raise `AttributeError`, because an estimate is immutable."""
        raise AttributeError(f"an Estimate is immutable: cannot set {name}")

    def __getnewargs__(self) -> tuple[Any, ...]:
        return (float(self), self.std_error, self.interval, self.unit, self.detected, self.name)

    def __reduce__(self) -> tuple[Any, ...]:
        return (Estimate, self.__getnewargs__())

    @property
    def value(self) -> float:
        """Value of the estimate as a plain float."""
        return float(self)

    @property
    def limit(self) -> float:
        """Largest magnitude in the 95 % interval, in `unit`: the limit of a value that was not detected; NaN if unknown."""
        return math.nan if self.interval is None else max(map(abs, self.interval))

    def to(self, unit: str) -> Estimate:
        """`Estimate` in another unit; the same object if the unit is unchanged.

        Parameters
        ----------
        unit : str
            Any spelling of a unit of the same dimension, e.g. ``"deg/sqrt(h)"`` or
            ``"deg/h/√Hz one-sided"``.

        Raises
        ------
        InputError
            The unit has another dimension.
        """
        if unit == self.unit:
            # Some units cannot be converted, such as those with a fitted power.
            return self
        try:
            factor = conversion(self.unit, unit)
        except InputError:
            # The unit of a logged column may be unknown: mrad/s/Temp.
            (own, _, column), (other, _, same) = (u.rpartition("/") for u in (self.unit, unit))
            if not own or column != same:
                raise
            factor = conversion(own, other)
        return scaled_estimate(self, factor, unit)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with the keys value, std_error, interval, unit and detected.

        Numbers that are unknown or not finite are None.
        """
        names = ("value", "std_error", "interval", "unit", "detected")
        return {name: jsonable(getattr(self, name)) for name in names}

    def __repr__(self) -> str:
        if not self.detected and math.isfinite(self.limit):
            return f"< {self.limit:.2g} {self.unit} (not detected, 95 % limit)".replace("  ", " ")
        return f"{_value_and_error_text(self.value, self.std_error)} {self.unit}".rstrip()

    __str__ = __repr__

    def __format__(self, spec: str) -> str:
        """Text of the plain float with a format specification, or `repr` without one."""
        return format(self.value, spec) if spec else repr(self)


def scaled_estimate(given: Estimate, factor: float, unit: str) -> Estimate:
    """`Estimate` in `unit`, whose value, standard error and interval are those of `given`, multiplied by a factor."""
    return Estimate(
        given.value * factor,
        None if given.std_error is None else given.std_error * factor,
        None
        if given.interval is None
        else (given.interval[0] * factor, given.interval[1] * factor),
        unit,
        given.detected,
        given.name,
    )


def _value_and_error_text(value: float, error: float | None) -> str:
    """Value and standard error with two significant figures, ``0.01263 ± 0.00012`` or ``(1.26 ± 0.12)e-07``.

    The error has one figure if the second is 0. Without a positive finite error, it is the value alone.
    """
    if error is None or not math.isfinite(error) or error <= 0 or not math.isfinite(value):
        return f"{value:.6g}"
    exponent = math.floor(math.log10(error))
    decimals = 1 - exponent
    if round(error * 10.0**decimals) % 10 == 0:
        decimals -= 1
    scale = math.floor(math.log10(max(abs(value), error)))
    # Plain digits, unless zeros of no meaning would fill them. A double has 16 digits.
    if -5 < scale < (16 if decimals >= 0 else 7):
        places = max(decimals, 0)
        return f"{value:.{places}f} ± {error:.{places}f}"
    places = max(decimals + scale, 0)
    power = 10.0**scale
    return f"({value / power:.{places}f} ± {error / power:.{places}f})e{scale:+03d}"
