"""Units in the suffixes of column names, and usual units of sensors."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from allanite.common.units import ACCELERATION, ANGULAR_RATE, parse_unit, unit_kind
from allanite.recording.findings import Finding, names_text
from allanite.recording.sensor_names import sensor_kind, words_in

#: Most common unit of each kind of sensor, in the order of the option `unit`.
USUAL = {ANGULAR_RATE: "deg/s", ACCELERATION: "m/s^2"}
#: Suffix of a name (without slash and power) → unit.
SUFFIXES = {
    "dps": "deg/s", "degps": "deg/s", "degs": "deg/s", "deg_s": "deg/s", "deg_per_s": "deg/s",
    "deg_sec": "deg/s", "mdps": "mdeg/s", "dph": "deg/h", "degph": "deg/h", "deg_h": "deg/h",
    "radps": "rad/s", "rads": "rad/s", "rad_s": "rad/s", "rad_per_s": "rad/s", "rad_sec": "rad/s",
    "mrad_s": "mrad/s", "mps2": "m/s^2", "mpss": "m/s^2", "ms2": "m/s^2", "m_s2": "m/s^2",
    "m_per_s2": "m/s^2", "m_s_2": "m/s^2", "mm_s2": "mm/s^2", "g": "g", "mg": "mg", "ug": "ug",
}  # fmt: skip
#: A suffix of `SUFFIXES` at the end of a name, after an underscore.
_SUFFIX = re.compile(rf"_({'|'.join(sorted(SUFFIXES, key=len, reverse=True))})$")
#: The phase of a clock with its unit: clock_bias_s, offset_ns.
_PHASE = re.compile(
    r"(^|_)(phase|offset|bias|time_?error|tie|clock_?error|clk|clock)(_\w+)?_(?P<unit>s|ms|us|ns|ps)$"
)
#: A unit with a slash, behind an underscore or a space.
_WITH_SLASH = re.compile(r"(?P<name>.+)[_\s](?P<unit>[^_\s]+/[^_\s]+)$")


def unit_in_name(name: str) -> str | None:
    """Unit at the end of a column's name: ``deg/s`` for ``GyrX_dps``, ``ns`` for ``offset_ns``; else None.

    None also if the unit contradicts the sensor that the name states, as in ``gyro_x_mg``.
    """
    stated = _WITH_SLASH.match(name.strip())
    if stated is not None:
        kind = unit_kind(stated["unit"])
        return stated["unit"] if kind and kind == sensor_kind(stated["name"]) else None
    kind = sensor_kind(name)
    if kind is None and (phase := _PHASE.search(words_in(name))) is not None:
        return phase["unit"]
    # In accelerometer_m_s2[0], an index follows the unit.
    words = re.sub(r"[\s.\-]+", "_", re.sub(r"\s*\[\d+\]$", "", name.strip()).lower())
    match = _SUFFIX.search(words)
    if kind is None or match is None:
        return None
    unit_name = SUFFIXES[match[1]]
    return unit_name if parse_unit(unit_name).kind == kind else None


def usual_units(names: Iterable[str]) -> str:
    """``deg/s``, ``m/s^2`` or ``deg/s,m/s^2`` for names of gyroscopes, accelerometers, or both; else empty."""
    kinds = [sensor_kind(name) for name in names]
    return "" if None in kinds else ",".join(unit for kind, unit in USUAL.items() if kind in kinds)


def unit_remedy(names: Sequence[str]) -> str:
    """Remedy of an `InputError`: to add the usual units of the named sensors, or a unit if a name states no sensor."""
    usual = usual_units(names)
    return f"add {{this_unit:{usual}}}, or the true unit" if usual else "add {unit}"


def no_unit_findings(names: Sequence[str]) -> list[Finding]:
    """At most one finding that the named columns have no unit; a warning if a name states an inertial sensor."""
    if not names:
        return []
    inertial = any(sensor_kind(name) for name in names)
    return [
        Finding(
            "no_unit",
            "warning" if inertial else "info",
            f"no unit given for {names_text(names)}: values are treated as dimensionless"
            " (fractional frequency of a clock)",
            values={"count": len(names)},
            remedy="; " + unit_remedy(names),
        )
    ]
