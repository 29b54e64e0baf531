"""Parameter files of a thermal calibration: for PX4, ArduPilot and C, and as CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import dataclass
from itertools import chain, count
from typing import TYPE_CHECKING

from allanite.common.documents import plain_value
from allanite.common.errors import InputError
from allanite.common.numbers import number
from allanite.common.plain import spreadsheet_cell
from allanite.common.units import ACCELERATION, ANGULAR_RATE, SI_UNITS, conversion, parse_unit
from allanite.recording.axis_names import AXIS, axis_letter

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.calibration.law import AxisLaw
    from allanite.calibration.thermal import ThermalCalibration

#: Fixed reference temperature of ArduPilot, °C, and the factor between a coefficient and ArduPilot's parameter
#: (AP_InertialSensor_tempcal.cpp).
ARDUPILOT_REFERENCE, ARDUPILOT_SCALE = 35.0, 1e6
#: Maximum number of gyroscopes, and of accelerometers, in the parameters of PX4 (TemperatureCompensation.h) and ArduPilot.
PX4_SENSORS, ARDUPILOT_SENSORS = 4, 3
#: Columns of the table of the target ``csv``.
CSV_COLUMNS = (
    "axis", "unit", "reference_celsius", "x0", "x1", "x2", "x3", "low_celsius", "high_celsius", "band", "form",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Triad:
    """Thermal laws of the axes of one sensor, by their letters x, y and z."""

    kind: str
    axes: dict[str, AxisLaw]

    @property
    def low(self) -> float:
        """Lower end of the temperature range that all axes have in common, °C."""
        return max(axis.range[0] for axis in self.axes.values())

    @property
    def high(self) -> float:
        """Upper end of the temperature range that all axes have in common, °C."""
        return min(axis.range[1] for axis in self.axes.values())

    @property
    def reference(self) -> float:
        """Middle of the temperature range that all axes have in common, °C, rounded to 0.01."""
        return round(0.5 * (self.low + self.high), 2)

    def polynomials(self, reference: float) -> dict[str, list[float]]:
        """Bias polynomial [x0, x1, x2, x3] in SI units and in powers of T − `reference` (°C) of x, y and z."""
        out = {}
        for letter in "xyz":
            axis = self.axes.get(letter)
            factor = 1.0 if axis is None else conversion(axis.unit, SI_UNITS[self.kind])
            found = [0.0] * 4 if axis is None else (factor * axis.polynomial(reference)).tolist()
            out[letter] = found
        return out


def render(found: ThermalCalibration, target: str) -> str:
    """Text of a parameter file in a format of `TARGETS`; raises `InputError` if it has no parameters for these axes."""
    if target not in TARGETS:
        raise InputError(f"unknown format {target!r}; known formats: {', '.join(TARGETS)}")
    return TARGETS[target](found)


def _triads(found: ThermalCalibration, kind: str, most: int, consumer: str) -> list[_Triad]:
    """One `_Triad` per sensor of this kind in the order of the log; its axes differ only in the letter x, y or z.

    Raises `InputError` for more than `most` sensors; its message names `consumer`.
    """
    groups: dict[str, dict[str, AxisLaw]] = {}
    for axis in found:
        if parse_unit(axis.unit).kind == kind:
            own = groups.setdefault(AXIS.sub("", axis.name), {})
            own[axis_letter(axis.name) or "xyz"[len(own) % 3]] = axis
    if len(groups) > most:
        raise InputError(
            f"{consumer} has parameters for {most} sensors of {kind}, but the logs contain {len(groups)}",
            missing="column",
            remedy=": choose some with {column}",
        )
    return [_Triad(kind, own) for own in groups.values()]


def _gyroscopes_and_accelerometers(
    found: ThermalCalibration, most: int, consumer: str
) -> tuple[list[_Triad], list[_Triad]]:
    """Pair of lists: the gyroscopes and the accelerometers. One list may be empty.

    Raises `InputError` if both are, or if one has more than `most` sensors; the message names the `consumer` of the
    file.
    """
    sensors = tuple(_triads(found, kind, most, consumer) for kind in (ANGULAR_RATE, ACCELERATION))
    if not any(sensors):
        raise InputError(
            f"{consumer} has parameters for gyroscopes and accelerometers, but the logs contain neither"
        )
    return sensors[0], sensors[1]


def _axis_notes(axes: Sequence[AxisLaw]) -> list[str]:
    """List of texts: form and temperature range of each axis, and a warning if its law has a lag or hysteresis."""
    notes = []
    for axis in axes:
        low, high = axis.range
        notes.append(
            f"{axis.name}: {axis.form.name}, measured from {number(low, 3)} to {number(high, 3)} °C"
        )
        if axis.form.memory != "none":
            notes.append(
                f"{axis.name}: this polynomial is the bias at constant temperature;"
                " the dependence on earlier temperatures is not included"
            )
    return notes


def _comment_lines(found: ThermalCalibration, mark: str, *lines: str) -> list[str]:
    """List of comment lines that begin with `mark`: title, logs, the given `lines`, and notes on the axes."""
    logs = (
        ", ".join(re.sub(r"\s+", " ", str(p)) for p in found.paths if p) or "recordings in memory"
    )
    head = ["Thermal calibration, written by allanite", f"Calibrated from: {logs}"]
    return [f"{mark} {line}" for line in (*head, *lines, *_axis_notes(found.axes))]


def _px4(found: ThermalCalibration) -> str:
    """Text of PX4 shell commands ``param set TC_G…`` and ``TC_A…``, with comments; X0 of accelerometers is 0.

    Raises `InputError` for over 4 sensors of a kind, or none.
    """
    gyros, accels = _gyroscopes_and_accelerometers(found, PX4_SENSORS, "px4")
    lines = _comment_lines(
        found,
        "#",
        "PX4 computes corrected = raw - offset, offset = X0 + X1 dT + X2 dT^2 + X3 dT^3, dT = T - TREF.",
        "PX4 limits the temperature T to TMIN ... TMAX. Units: rad/s, m/s^2, degrees Celsius.",
        "X0 of accelerometers is set to 0, because the measured constant contains gravity.",
        "Before use, set each TC_*_ID to the device id of its sensor (param show CAL_GYRO0_ID, CAL_ACC0_ID).",
    )
    for letter, sensors in (("G", gyros), ("A", accels)):
        if sensors:
            lines.append(f"param set TC_{letter}_ENABLE 1")
        for k, triad in enumerate(sensors):
            key = f"TC_{letter}{k}"
            lines.append(f"# param set {key}_ID DEVICE_ID")
            rows = triad.polynomials(triad.reference)
            for place, axis in enumerate("xyz"):
                for power, value in enumerate(rows[axis]):
                    value = 0.0 if power == 0 and letter == "A" else value
                    lines.append(f"param set {key}_X{power}_{place} {value:.9g}")
            for name, value in (
                ("TREF", triad.reference),
                ("TMIN", triad.low),
                ("TMAX", triad.high),
            ):
                lines.append(f"param set {key}_{name} {value:.9g}")
    return "\n".join(lines) + "\n"


def _ardupilot(found: ThermalCalibration) -> str:
    """Text of an ArduPilot parameter file with lines ``INS_TCAL…,value``, with comments.

    Raises `InputError` for over 3 sensors of a kind, or none.
    """
    gyros, accels = _gyroscopes_and_accelerometers(found, ARDUPILOT_SENSORS, "ardupilot")
    lines = _comment_lines(
        found,
        "#",
        "ArduPilot computes corrected = raw - (P(T - 35) - P(Tcal - 35)), P(d) = 1e-6 (c1 d + c2 d^2 + c3 d^3).",
        "c1, c2, c3 of an axis are its parameters ACC1, ACC2, ACC3 or GYR1, GYR2, GYR3.",
        "T and Tcal are limited to TMIN ... TMAX, in degrees Celsius.",
        "Tcal is the temperature at which the offsets were calibrated (INS_GYRn_CALTEMP, INS_ACCn_CALTEMP).",
    )
    for k in range(max(len(gyros), len(accels))):
        own = [(n, s[k]) for n, s in (("ACC", accels), ("GYR", gyros)) if k < len(s)]
        key = f"INS_TCAL{k + 1}"
        lines.append(f"{key}_ENABLE,1")
        lines.append(f"{key}_TMIN,{max(t.low for _, t in own):.9g}")
        lines.append(f"{key}_TMAX,{min(t.high for _, t in own):.9g}")
        for name, triad in own:
            rows = triad.polynomials(ARDUPILOT_REFERENCE)
            lines += [
                f"{key}_{name}{power}_{axis.upper()},{ARDUPILOT_SCALE * rows[axis][power]:.9g}"
                for power in (1, 2, 3)
                for axis in "xyz"
            ]
    return "\n".join(lines) + "\n"


def _c_header(found: ThermalCalibration) -> str:
    """Text of a C header with a function ``NAME_bias(celsius)`` for each axis, clipped to the measured temperatures."""
    lines = _comment_lines(
        found,
        " *",
        "NAME_bias(T) returns the bias of an axis at the temperature T in °C: corrected = sample - NAME_bias(T).",
        "Temperatures outside of the measured range are limited to it.",
    )
    text = ["/*", *(line.replace("*/", "* /") for line in lines), " */", "#pragma once", ""]
    text += [
        "static inline double allanite_law(const double x[4], double reference, double low, double high, double t) {",
        "    if (t < low) t = low;",
        "    if (t > high) t = high;",
        "    t -= reference;",
        "    return x[0] + t * (x[1] + t * (x[2] + t * x[3]));",
        "}",
    ]
    for axis, name in zip(found, _identifiers(found), strict=True):
        low, high = axis.range
        reference = axis.curve.reference
        values = ", ".join(f"{v:.17g}" for v in axis.polynomial(reference))
        text += [
            "",
            f"/* bias in {axis.unit.replace('*/', '* /')} */",
            f"static inline double {name}_bias(double celsius) {{",
            f"    static const double x[4] = {{{values}}};",
            f"    return allanite_law(x, {reference:.17g}, {low:.17g}, {high:.17g}, celsius);",
            "}",
        ]
    return "\n".join(text) + "\n"


def _identifiers(found: ThermalCalibration) -> list[str]:
    """A valid C identifier for each axis, all different; a repeated name gets the first free number (``gx_1``)."""
    names: list[str] = []
    for axis in found:
        name = re.sub(r"\W+", "_", axis.name, flags=re.ASCII).strip("_") or "axis"
        name = f"axis_{name}" if name[0].isdigit() else name
        numbered = (f"{name}_{number}" for number in count(1))
        names.append(next(one for one in chain([name], numbered) if one not in names))
    return names


def _csv(found: ThermalCalibration) -> str:
    """CSV text with a header and one row for each axis; numbers have full precision."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for axis in found:
        low, high = axis.range
        reference = axis.curve.reference
        band = 0.5 * float((axis.curve.high - axis.curve.low).max())
        cells = [reference, *axis.polynomial(reference), low, high, band]
        writer.writerow(
            [spreadsheet_cell(axis.name), axis.unit, *(f"{v:.17g}" for v in cells), axis.form.name]
        )
    return stream.getvalue()


def _json(found: ThermalCalibration) -> str:
    """JSON text with the polynomial and the fitted coefficients of each axis."""
    axes = []
    for axis in found:
        low, high = axis.range
        reference = axis.curve.reference
        axes.append(
            {
                "column": axis.name,
                "unit": axis.unit,
                "reference_celsius": reference,
                "polynomial": axis.polynomial(reference).tolist(),
                "low_celsius": low,
                "high_celsius": high,
                "form": axis.form.name,
                "memory": axis.form.memory,
                "numbers": plain_value(axis.numbers),
            }
        )
    return json.dumps({"schema": "allanite/thermal-law/1", "axes": axes}, indent=1) + "\n"


#: Name of a format on the command line → function that returns the text of the file.
TARGETS: dict[str, Callable[[ThermalCalibration], str]] = {
    "px4": _px4,
    "ardupilot": _ardupilot,
    "c": _c_header,
    "csv": _csv,
    "json": _json,
}
