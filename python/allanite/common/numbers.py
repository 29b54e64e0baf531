"""Format numbers for readers: 0.0126, 1.9·10⁻⁵, 2370."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Sequence

#: Length of a Julian year, s.
YEAR = 31557600.0
_DIGITS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<![\w.])([-−]?\d+(?:\.\d+)?)e([+-]\d+)")
_COMMON_POWER = re.compile(r"\)e([+-]\d+)")
_MINUS = re.compile(r"(?<=[\s(=])-(?=\d)")
#: Smallest p-value that is printed. The laws of the tests are approximations, whose far tails mean nothing.
MIN_PRINTED_P = 1e-6
#: Maximum number of values that are listed one by one: times, and other parameters. Chosen by judgment; not measured.
MAX_LISTED_TIMES, MAX_LISTED = 3, 12
#: Units of time in a record: the record's shortest duration in s, size of the unit in s, name.
TIME_UNITS = ((2 * 86400.0, 86400.0, "d"), (2 * 3600.0, 3600.0, "h"), (240.0, 60.0, "min"))


def number(value: float, figures: int = 3, *, power: bool = False) -> str:
    """Text of a number with `figures` significant digits: 0.0126, 1.9·10⁻⁵, 12000; a minus sign is −.

    A power of ten is used for magnitudes below 10⁻⁴ (with `power` below 0.1). It is also used from 10⁶ on, unless
    `figures` digits show the integer part.
    """
    text = f"{value:.{figures}g}"
    if power and "e" not in text and 0.0 < abs(value) < 0.1:
        digits, exponent = f"{value:.{figures - 1}e}".split("e")
        text = f"{float(digits):.{figures}g}e{exponent}"
    if "e" not in text:
        return text.replace("-", "−")
    mantissa, exponent = text.split("e")
    ten = "10" + str(int(exponent)).translate(_DIGITS)
    # 12300 is easier to read than 1.23·10⁴.
    if 0 < int(exponent) < 6:
        return f"{float(text):.0f}".replace("-", "−")
    if float(mantissa) == 1:
        return ten
    return f"{mantissa}·{ten}".replace("-", "−")


def percent_text(share: float, decimals: int = 0) -> str:
    """Text of a fraction in percent with a fixed number of decimals: ``0.47 %`` for 0.0047 and two decimals."""
    return f"{100.0 * share:.{decimals}f} %"


def time_scale(span: float) -> tuple[float, str]:
    """Size in s, and name, of the unit in which times of a record of `span` seconds are shown: d, h, min or s."""
    return next(((s, n) for above, s, n in TIME_UNITS if span >= above), (1.0, "s"))


def count_text(value: float) -> str:
    """Text of a count, rounded to an integer, with thousands separated by narrow no-break spaces: ``180 000``."""
    return f"{value:,.0f}".replace(",", "\u202f")


def duration_text(seconds: float) -> str:
    """Text of a duration with up to three significant digits: ``40 s``, ``90 min``, ``2 h``, ``3 d``, ``2 years``.

    The unit is the largest one in which the duration is at least 2, or exactly 1, as in ``1 h``; otherwise s.
    """
    for size, name in ((YEAR, "years"), (86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size or seconds == size:
            return f"{number(seconds / size)} {name}"
    return f"{number(seconds)} s"


def numbers_text(values: Iterable[float], *, times: bool) -> str:
    """Values of one parameter, separated by spaces, or for more than 12 (`times`: 3) a summary: ``20: 0.1 … 3``."""
    found = list(values)
    if len(found) <= (MAX_LISTED_TIMES if times else MAX_LISTED):
        return " ".join(number(v, 5 if times else 3) for v in found)
    return f"{len(found)}: {number(min(found), 5)} … {number(max(found), 5)}"


#: Maximum deviation of the distances of evenly spaced lines from multiples of the smallest one. Chosen by judgment; not
#: measured.
MAX_STEP_ERROR = 0.1
#: The same for lines on both sides of multiples. Chosen by judgment: about 2 in 1000 random sets of five lines meet it by
#: chance (tests/python/unit/effects/test_spaced_lines.py).
MAX_SIDE_ERROR = 0.02
#: Fewest lines on both sides of multiples of a spacing. Chosen by judgment; not measured.
MIN_SIDE_LINES = 5
#: Most harmonics of a line that are listed one by one. Chosen by judgment; not measured.
MAX_LISTED_HARMONICS = 12


def common_step(values: Sequence[float]) -> float | None:
    """Spacing of the ascending `values` if they are evenly spaced, or lie on both sides of its multiples; None for others.

    Values are evenly spaced if every distance between neighbors is nearly a multiple of the smallest one. Five or more
    values lie on both sides of multiples if each is nearly a multiple plus or minus the first value. If both holds, the
    larger spacing counts if it is more than twice the other (2.5 times): it leaves fewer gaps.
    """
    first, apart = values[0], [b - a for a, b in itertools.pairwise(values)]
    least = min(apart)
    if least <= 0.0:
        return None
    is_even = all(_is_multiple(d, least, MAX_STEP_ERROR) for d in apart)
    if len(values) < MIN_SIDE_LINES:
        return least if is_even else None

    def is_beside_multiples(step: float) -> bool:
        """True if all values lie on either side of multiples of `step`, as far away as the first value."""
        offsets = ((v - first, v + first) for v in values)
        return all(any(_is_multiple(o, step, MAX_SIDE_ERROR) for o in pair) for pair in offsets)

    for step in sorted((v + sign * first for v in values[1:3] for sign in (1, -1)), reverse=True):
        if is_even and step < 2.5 * least:
            break
        if is_beside_multiples(step):
            return step
    return least if is_even else None


def spacing_text(frequency: float, multiples: Sequence[float]) -> str:
    """Text of the spacing of lines: ``1.52 Hz apart``, ``on both sides of multiples of 1.52 Hz``, or "" without one.

    `multiples` are the lines, ascending, divided by the `frequency` of the lowest one, Hz.
    """
    step = common_step(multiples)
    if step is None:
        return ""
    each = f"{number(step * frequency, 4)} Hz"
    is_even = step <= min(b - a for a, b in itertools.pairwise(multiples))
    return f"{each} apart" if is_even else f"on both sides of multiples of {each}"


def _is_multiple(value: float, step: float, error: float) -> bool:
    """True if a value is a multiple of `step`, up to the fraction `error` of `step`."""
    return abs(value / step - round(value / step)) <= error


def harmonics_text(
    frequency: float, overtones: Iterable[float], unit: str, factor: float = 1.0
) -> str:
    """Text of the harmonics of a spectral line: ``34.6 Hz 28.6 °/h (harmonic 2)``, separated by commas.

    `frequency` is that of the line, Hz. `overtones` is a flat sequence of multiple, amplitude and phase of each.
    Amplitudes times `factor` are in `unit`. If a multiple is no integer, or for more than 12 harmonics, the text is a
    summary.
    """
    given = list(overtones)
    multiples, amplitudes = given[::3], [factor * a for a in given[1::3]]
    spaced = any(m != round(m) for m in multiples)
    if spaced or len(multiples) > MAX_LISTED_HARMONICS:
        apart = f" {spacing_text(frequency, sorted([1.0, *multiples]))}" if spaced else ""
        sizes = f"{number(min(amplitudes))} … {number(max(amplitudes))} {unit}".rstrip()
        what = f"further lines{apart}".rstrip() if spaced else "harmonics"
        return f"{len(multiples)} {what}, up to {number(max(multiples) * frequency, 4)} Hz, {sizes}"
    return ", ".join(
        f"{number(multiple * frequency, 4)} Hz {number(amplitude)} {unit}".rstrip()
        + f" (harmonic {multiple:.0f})"
        for multiple, amplitude in zip(multiples, amplitudes, strict=True)
    )


def log10_probability_text(log10_p: float) -> str:
    """Probability with one significant digit, from its logarithm to base 10: ``0.003``, ``2·10⁻⁵`` or ``< 10⁻⁶``."""
    return probability_text(10.0 ** max(log10_p, -99.0), 1)


def probability_text(p: float, figures: int = 2) -> str:
    """Text of a probability with `figures` significant digits: ``0.12``; below 10⁻⁶ it is ``< 10⁻⁶``."""
    return number(p, figures) if p >= MIN_PRINTED_P else f"< {number(MIN_PRINTED_P, 1)}"


def p_text(p: float, figures: int = 2) -> str:
    """Text of a p-value with `figures` significant digits: ``p = 0.12``; below 10⁻⁶ it is ``p < 10⁻⁶``."""
    return f"p {'= ' if p >= MIN_PRINTED_P else ''}{probability_text(p, figures)}"


def trials_text(trials: float) -> str:
    """Number of trials with two significant digits: ``a single trial``, ``120 trials``, ``more than 10¹⁵ trials``."""
    if trials >= 1e15:
        return "more than 10¹⁵ trials"
    return "a single trial" if trials < 1.5 else f"{number(trials, 2)} trials"


def with_readable_numbers(sentence: str) -> str:
    """Sentence with readable numbers: 2370 instead of 2.37e+03, 3·10⁻⁵ instead of 3e-05, − instead of -."""
    sentence = _COMMON_POWER.sub(lambda m: f")·10{str(int(m[1])).translate(_DIGITS)}", sentence)
    words = _POWER.sub(lambda m: number(float(m[0].replace("−", "-")), 3), sentence)
    return _MINUS.sub("−", words)


def figures_for_interval(interval: tuple[float, float], least: int) -> int:
    """Number of significant digits, from `least` to 12, that shows how the two ends of an interval differ.

    It is `least` if both ends are equal.
    """
    low, high = interval
    size, width = max(abs(low), abs(high)), high - low
    if width > 0.0 and size > 0.0:
        return min(max(least, 1 + math.ceil(math.log10(2.0 * size / width))), 12)
    return least


def value_and_interval_text(value: float, interval: tuple[float, float]) -> str:
    """Text of a value and its interval, ``0.5998 (0.594 … 0.606)``, with enough significant digits to show the interval."""
    middle, first, last = value_and_interval_texts(value, interval)
    return f"{middle} ({first} … {last})"


def value_and_interval_texts(value: float, interval: tuple[float, float]) -> tuple[str, str, str]:
    """Texts of a value and the two ends of its interval, all with or all without a power of ten.

    A lower end of less than a millionth of the upper one is 0: the record does not exclude any small value. There are
    at least 4 significant digits for the value and 3 for the ends.
    """
    low, high = interval
    low = 0.0 if 0.0 < low < 1e-6 * high else low
    figures = figures_for_interval(interval, 3)
    shown = [(value, max(4, figures)), (low, figures), (high, figures)]
    # All three numbers get the same notation: not 9.925·10⁻⁵ and 0.00010004 side by side.
    power = any("e-" in f"{v:.{f}g}" for v, f in shown)
    middle, first, last = (number(v, f, power=power) for v, f in shown)
    return middle, first, last
