"""Parse and convert the units of samples and of coefficients.

A unit expression is a product of symbols with powers (``deg/s``, ``µg/√Hz``, ``deg/h^1.5``, ``m/s/sqrt(h)``). The parser
reduces it to a scale and the powers of angle, length, time and magnetic field. A coefficient can only be converted to a
unit of the same dimension. Therefore a noise density in deg/s/√Hz is never taken for an angle random walk in deg/√h (a
factor of 60).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from allanite.common.errors import InputError
from allanite.common.plain import plain

STANDARD_GRAVITY = 9.80665  # m/s², CODATA

ANGULAR_RATE = "angular rate"
ACCELERATION = "acceleration"
FREQUENCY = "fractional frequency"
MAGNETIC_FIELD = "magnetic field"
#: Kind of sensor → SI unit of its samples.
SI_UNITS = {ANGULAR_RATE: "rad/s", ACCELERATION: "m/s^2", FREQUENCY: "1", MAGNETIC_FIELD: "T"}

# symbol: (scale to SI, powers of angle, length, time)
_DEGREE = math.pi / 180
_SYMBOLS: dict[str, tuple[float, int, int, int]] = {
    "rad": (1.0, 1, 0, 0), "mrad": (1e-3, 1, 0, 0), "urad": (1e-6, 1, 0, 0),
    "nrad": (1e-9, 1, 0, 0), "deg": (_DEGREE, 1, 0, 0), "mdeg": (_DEGREE * 1e-3, 1, 0, 0),
    "arcmin": (_DEGREE / 60, 1, 0, 0), "arcsec": (_DEGREE / 3600, 1, 0, 0),
    "rev": (2 * math.pi, 1, 0, 0), "dps": (_DEGREE, 1, 0, -1), "mdps": (_DEGREE * 1e-3, 1, 0, -1),
    "radps": (1.0, 1, 0, -1), "dph": (_DEGREE / 3600, 1, 0, -1),
    "rpm": (2 * math.pi / 60, 1, 0, -1), "m": (1.0, 0, 1, 0), "cm": (1e-2, 0, 1, 0),
    "mm": (1e-3, 0, 1, 0), "um": (1e-6, 0, 1, 0), "ft": (0.3048, 0, 1, 0), "g": (STANDARD_GRAVITY, 0, 1, -2),
    "mg": (STANDARD_GRAVITY * 1e-3, 0, 1, -2), "ug": (STANDARD_GRAVITY * 1e-6, 0, 1, -2),
    "ng": (STANDARD_GRAVITY * 1e-9, 0, 1, -2), "mgal": (1e-5, 0, 1, -2), "s": (1.0, 0, 0, 1),
    "ms": (1e-3, 0, 0, 1), "us": (1e-6, 0, 0, 1), "ns": (1e-9, 0, 0, 1), "min": (60.0, 0, 0, 1),
    "h": (3600.0, 0, 0, 1), "d": (86400.0, 0, 0, 1), "Hz": (1.0, 0, 0, -1),
    "kHz": (1e3, 0, 0, -1), "MHz": (1e6, 0, 0, -1), "GHz": (1e9, 0, 0, -1), "ppm": (1e-6, 0, 0, 0),
    "ppb": (1e-9, 0, 0, 0),
}  # fmt: skip
# symbol: scale to tesla. A single G (gauss) is missing, since it is also written for standard gravity.
_FIELDS = {"T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "pT": 1e-12, "gauss": 1e-4, "mgauss": 1e-7}
_ALIASES = {
    "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad", "sec": "s", "second": "s",
    "seconds": "s", "hr": "h", "hour": "h", "hours": "h", "hz": "Hz", "asec": "arcsec",
    "mGal": "mgal", "gn": "g", "g0": "g", "g_0": "g", "turn": "rev", "day": "d", "minute": "min",
    "as": "arcsec", "degps": "dps", "metre": "m", "meter": "m",
    "foot": "ft", "feet": "ft", "tesla": "T", "microtesla": "uT", "nanotesla": "nT",
}  # fmt: skip
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⋅", "0123456789-·")
# Powers of the dimensions; a Fraction equals an int of the same value, also as a key.
_KINDS: dict[tuple[float | Fraction, ...], str] = {
    (1, 0, -1, 0): ANGULAR_RATE,
    (0, 1, -2, 0): ACCELERATION,
    (0, 0, 0, 0): FREQUENCY,
    (0, 0, 0, 1): MAGNETIC_FIELD,
}
# Powers of the integrals of these quantities over time → noun for messages.
_INTEGRALS: dict[tuple[float | Fraction, ...], str] = {
    (1, 0, 0, 0): "an angle",
    (0, 1, -1, 0): "a velocity",
    (0, 0, 1, 0): "a time",
}
# Canonical names of usual units of samples. Any other unit keeps its own spelling.
_CANONICAL = (
    "rad/s", "mrad/s", "urad/s", "deg/s", "mdeg/s", "deg/min", "deg/h", "arcsec/s", "rpm",
    "m/s^2", "mm/s^2", "g", "mg", "ug", "mgal", "1", "ppm", "ppb",
    "T", "mT", "uT", "nT", "pT",
)  # fmt: skip
SAMPLE_UNITS = "rad/s deg/s deg/h m/s^2 g mg ug uT 1"

_TOKEN = re.compile(
    r"\s*(?:(?P<number>\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)|(?P<sqrt>sqrt\b|√)"
    r"|(?P<name>[A-Za-z][A-Za-z_]*0?)|(?P<op>\*\*|[*/·.^()\[\]-])|(?P<half>½))"
)
#: Maximum length of a unit, characters. The depth of nested brackets, and of the recursion, is therefore limited, too.
MAX_UNIT_LENGTH = 80
_SIDES = re.compile(r"[\s,(\[]*\b(one|single|two|double)[\s-]?sided\b[\s)\]]*", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit of samples: canonical `name`, `kind` of sensor, and `scale`, the SI units (rad/s, m/s², 1, T) in one of it."""

    name: str
    kind: str
    scale: float


@dataclass(frozen=True, slots=True)
class _Quantity:
    """Value of a unit in SI units, and the powers of its dimensions: angle, length, time and magnetic field."""

    scale: float
    powers: tuple[Fraction, ...] = (Fraction(0),) * 4

    def times(self, other: _Quantity, power: int = 1) -> _Quantity:
        """`_Quantity` of the product of this unit and a power of another unit."""
        powers = (a + power * b for a, b in zip(self.powers, other.powers, strict=True))
        return _Quantity(self.scale * other.scale**power, tuple(powers))

    def to_power(self, power: Fraction) -> _Quantity:
        """`_Quantity` (scale and powers of the dimensions) of a unit that is raised to a power."""
        return _Quantity(self.scale ** float(power), tuple(one * power for one in self.powers))


_ROOT = re.compile(r"(?<![A-Za-z])(?:square[\s-]*)?(?:rt|root)[\s-]*(?=[(A-Za-z])")
_PREFIX = re.compile(r"\b(micro|milli|nano)[\s-]*(?=(?:g|rad)\b)")
_NUMBER = r"\d[\d.]*(?:[eE][+-]?\d+)?"


def normalized(text: str) -> str:
    """Text of a unit in the parser's spelling: ``°`` becomes deg, ``µ`` u, a superscript ``^``, ``root h`` √h.

    A missing ``^`` after seconds is added (``m/s2``); nothing is checked.
    """
    text = _ROOT.sub("√", text)
    text = _PREFIX.sub(lambda m: {"micro": "u", "milli": "m", "nano": "n"}[m[1]], text)
    # Frequency relative to the nominal frequency of a counter: Hz/10 MHz, Hz/1e7.
    text = re.sub(rf"/\s*({_NUMBER})\s*([kMG]?Hz)\b", r"/(\1*\2)", text)
    text = re.sub(rf"^\s*Hz\s*/\s*({_NUMBER})\s*$", r"Hz/(\1*Hz)", text)
    text = text.replace("°", "deg").replace("º", "deg").replace("µ", "u").replace("μ", "u")
    text = text.replace("×", "*").replace("″", "arcsec").replace("−", "-")
    text = re.sub(r"\bmps(2|s)\b", "m/s^2", text)
    # Headers often omit the ^ of a power: m/s2, m s-2.
    text = re.sub(r"(?<![A-Za-z])(s|sec)(?=-\d\b|[23]\b)", r"\1^", text)
    text = re.sub(r"(?<=[A-Za-z)])([⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+)", r"^\1", text).translate(_SUPERSCRIPTS)
    return text.strip()


class _Parser:
    """Recursive descent parser of a unit: powers (``s^-2``) that are joined by ``*``, ``·``, ``.``, ``/`` or a space.

    Each method returns the quantity or exponent of the next part of the text, and consumes its tokens. It raises
    `ValueError` for a text that does not fit.
    """

    def __init__(self, text: str) -> None:
        if len(text) > MAX_UNIT_LENGTH:
            raise ValueError(plain(text, 40))
        text = normalized(text)
        self.tokens: list[tuple[str, str]] = []
        at = 0
        while at < len(text):
            if text[at:].isspace():
                break
            match = _TOKEN.match(text, at)
            if match is None or match.lastgroup is None:
                raise ValueError(text[at:])
            self.tokens.append((match.lastgroup, match.group(match.lastgroup)))
            at = match.end()
        self.at = 0

    def peek_token(self) -> tuple[str, str]:
        """Tuple (kind, text) of the next token, which is not consumed; ``("end", "")`` at the end."""
        return self.tokens[self.at] if self.at < len(self.tokens) else ("end", "")

    def next_token(self) -> tuple[str, str]:
        """Tuple (kind, text) of the next token, which is then consumed; ``("end", "")`` at the end."""
        token = self.peek_token()
        self.at += 1
        return token

    def parse_all(self) -> _Quantity:
        """`_Quantity` of the whole text.

        Raises `ValueError` also if the scale is 0 or ∞.
        """
        result = self.parse_product()
        if self.at < len(self.tokens):
            raise ValueError(self.tokens[self.at][1])
        if not 0.0 < result.scale < math.inf:
            raise ValueError(f"{result.scale:g}")
        return result

    def parse_product(self) -> _Quantity:
        """`_Quantity` of a product or quotient, such as ``deg/s``; symbols side by side are multiplied, as in ``N m``.

        Parsing stops before the first token that cannot continue the product.
        """
        result = self.parse_power()
        while True:
            kind, text = self.peek_token()
            if text in ("*", "·", ".", "/"):
                self.next_token()
                result = result.times(self.parse_power(), -1 if text == "/" else 1)
            elif kind in ("name", "sqrt"):
                result = result.times(self.parse_power())
            else:
                return result

    def parse_power(self) -> _Quantity:
        """`_Quantity` of a base with an optional exponent, such as ``h^1.5``."""
        base = self.parse_base()
        if self.peek_token()[1] in ("^", "**"):
            self.next_token()
            base = base.to_power(self.parse_exponent())
        return base

    def parse_base(self) -> _Quantity:
        """`_Quantity` of a symbol, a number, a root or a product in brackets."""
        kind, text = self.next_token()
        if kind == "sqrt":
            return self.parse_base().to_power(Fraction(1, 2))
        if text in ("(", "["):
            inner = self.parse_product()
            if self.next_token()[1] not in (")", "]"):
                raise ValueError("a bracket is not closed")
            return inner
        if kind == "number":
            return _Quantity(float(text))
        if kind == "name":
            return _quantity_of_symbol(text)
        raise ValueError(text)

    def parse_exponent(self) -> Fraction:
        """Exponent after ``^``, such as −2, 1.5, (3/2) or ½."""
        kind, text = self.next_token()
        if text == "-":
            return -self.parse_exponent()
        if text == "(":
            value = self.parse_exponent()
            if self.peek_token()[1] == "/":
                self.next_token()
                value /= self.parse_exponent()
            if self.next_token()[1] != ")":
                raise ValueError("a bracket is not closed")
            return value
        if kind == "half":
            return Fraction(1, 2)
        if kind == "number" and "e" not in text.lower():  # g^1e9999999 would take minutes
            if self.peek_token()[0] == "half":
                self.next_token()
                return Fraction(text) + Fraction(1, 2)
            return Fraction(text)
        raise ValueError(text)


def _quantity_of_symbol(name: str) -> _Quantity:
    """`_Quantity` of a unit symbol or one of its aliases; raises `ValueError` for an unknown symbol.

    Capital letters do not matter in aliases, in symbols of three or more letters, and in ``G``, which is ``g``. In
    other symbols they do: ``Mg`` is no milli-g, and ``S`` no second.
    """
    field = _ALIASES.get(name.lower(), name)
    field = field.lower() if field.lower().endswith("gauss") else field
    if field in _FIELDS:
        return _Quantity(_FIELDS[field], (*(Fraction(0),) * 3, Fraction(1)))
    for key in (name, _ALIASES.get(name, ""), name.lower(), _ALIASES.get(name.lower(), "")):
        # Prefixed symbols are case-sensitive: "Mg" is not a milli-g.
        if key in _SYMBOLS and (key != name.lower() or key == name or len(name) > 2 or key == "g"):
            scale, *powers = _SYMBOLS[key]
            return _Quantity(scale, (*map(Fraction, powers), Fraction(0)))
    raise ValueError(name)


@lru_cache(maxsize=512)
def _quantity(text: str) -> _Quantity:
    """`_Quantity` of a unit expression; cached. Raises `InputError` with the part that is not understood."""
    try:
        result = _Parser(text).parse_all()
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        problem = str(error) or "its end"
    else:
        return result
    part = "" if problem == text else f": {problem!r} is not understood"
    raise InputError(f"unknown unit {text!r}{part}; use one of {SAMPLE_UNITS} (1: no unit)")


def parse_unit(text: str) -> Unit:
    """`Unit` of samples from any usual spelling: ``deg/s``, ``°/s``, ``dps``, ``mrad/s``, ``m/s²``, ``µg``, ``1``, …

    Raises `InputError` unless it is a unit of an angular rate, acceleration, fractional frequency or magnetic field.
    """
    quantity = _quantity(text)
    kind = _KINDS.get(quantity.powers)
    if kind is None:
        integral = _INTEGRALS.get(quantity.powers)
        if integral is not None:
            raise InputError(
                f"unit {text!r} is the unit of {integral}, not of a rate",
                missing="quantity",
                remedy="; if the samples are integrals of the rate, add {quantity:angle} or {quantity:increment}",
            )
        raise InputError(
            f"unit {text!r} is none of an angular rate, an acceleration, a magnetic field or a fractional frequency (for"
            f" a counter in Hz write Hz/10MHz); use one of {SAMPLE_UNITS} (1: no unit)"
        )
    for name in _CANONICAL:
        known = _quantity(name)
        if known.powers == quantity.powers and math.isclose(
            known.scale, quantity.scale, rel_tol=1e-12
        ):
            return Unit(name, kind, known.scale)
    return Unit(normalized(text), kind, quantity.scale)


def unit_kind(text: str | None) -> str | None:
    """Kind of a unit, such as `ACCELERATION`; None for an unknown unit and for None."""
    try:
        return None if text is None else parse_unit(text).kind
    except InputError:
        return None


def is_frequency(text: str | None) -> bool:
    """True if a unit is that of a fractional frequency, such as ``1`` or ``ppm``; False for an unknown unit."""
    return unit_kind(text) == FREQUENCY


def rate_unit(text: str, quantity: str) -> Unit:
    """`Unit` of the rate of samples in the unit `text`: ``deg/s`` for an angle or increment in ``deg``.

    With the quantity ``"rate"``, or if `text` is already the unit of a rate, it is the unit `text` itself. Otherwise
    seconds, the phase of a clock, give ``1``. Raises `InputError` if `text` is no unit.
    """
    if quantity == "rate":
        return parse_unit(text)
    if _quantity(text).powers in _INTEGRALS:
        return parse_unit("1" if normalized(text) == "s" else f"({text})/s")
    return parse_unit(text)


def units_by_kind(text: str, quantity: str = "rate") -> dict[str, str]:
    """Units as written, by kind of sensor, from a text such as ``deg/s,m/s^2``.

    For the `quantity` ``angle`` or ``increment``, the kind is that of the rate. Raises `InputError` for two units of
    one kind, and for a text that is no unit of samples.
    """
    found = {rate_unit(one, quantity).kind: one.strip() for one in text.split(",")}
    if len(found) <= text.count(","):
        raise InputError(f"two units of one kind in {text}: give one unit per kind of sensor")
    return found


def coefficient_unit(unit: str, power_of_second: float) -> str:
    """Unit U·s^power of a coefficient: ``deg/s·s^½``; powers are 1 for Q, ½ for N, 0 for B, −½ for K, −1 for R.

    Raises `KeyError` for another power.
    """
    spelled = {
        1.0: f"{unit}·s",
        0.5: f"{unit}·s^½",
        0.0: unit,
        -0.5: f"{unit}/s^½",
        -1.0: f"{unit}/s",
    }
    return spelled[float(power_of_second)]


def conversion(from_unit: str, to_unit: str) -> float:
    """Factor that converts a number from one unit to another unit of the same dimension.

    A density in ``"… one-sided"`` is √2 times the two-sided N. Raises `InputError` if the dimensions differ, or if a
    unit that is no noise density is called one-sided or two-sided.
    """
    source, source_side = _without_sides(from_unit)
    target, target_side = _without_sides(to_unit)
    a, b = _quantity(source), _quantity(target)
    if a.powers != b.powers:
        raise InputError(
            f"cannot express {source} ({_dimension_text(a)}) in {target} ({_dimension_text(b)}):"
            " these are different quantities"
        )
    for text, quantity, side in ((to_unit, b, target_side), (from_unit, a, source_side)):
        if side != 1.0 and quantity.powers[2].denominator != 2:
            raise InputError(
                f"{text!r}: only a noise density can be one-sided or two-sided; delete the word"
            )
    return a.scale / b.scale * target_side / source_side


def _without_sides(text: str) -> tuple[str, float]:
    """Unit without the words one-sided or two-sided, and the factor √2 for one-sided, otherwise 1."""
    # A longer text is no unit, and a search in many brackets would take long.
    match = _SIDES.search(text) if len(text) <= 2 * MAX_UNIT_LENGTH else None
    if match is None:
        return text, 1.0
    factor = math.sqrt(2) if match.group(1).lower() in ("one", "single") else 1.0
    return (text[: match.start()] + " " + text[match.end() :]).strip(), factor


def _dimension_text(quantity: _Quantity) -> str:
    """Dimension for messages: kind of sensor and power of seconds, ``angular rate × s^1/2``, or all powers."""
    angle, length, time, field = quantity.powers
    for (a, l, t, b), kind in _KINDS.items():
        if angle == a and length == l and field == b:
            power = time - t
            return kind if power == 0 else f"{kind} × s^{power}"
    return f"angle^{angle} length^{length} time^{time}" + (f" field^{field}" if field else "")
