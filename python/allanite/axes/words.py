"""Sentences about all axes: what was read, what agrees, and what to know before using the values."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.errors import CALL
from allanite.common.numbers import probability_text, value_and_interval_text, with_readable_numbers
from allanite.common.parameters import Estimate
from allanite.common.printing import printed
from allanite.effects.sheet_units import in_sheet_unit
from allanite.fit.table import undecided_sentence
from allanite.recording.findings import merged

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.axes.characterization import Characterization, Common, Sensor
    from allanite.axes.forms import Agreement, Form


def title(found: Characterization) -> str:
    """Text of one line: ``imu.csv · 6 columns of 360000 samples at 100 Hz (3600 s) · logged column temperature``."""
    path = found.recording.path
    parts = [Path(path).name if path else "recording"]
    for r in found.recordings:
        count = len(r.columns)
        parts.append(
            f"{count} column{'s' if count > 1 else ''} of {r.n} samples at {r.rate:g} Hz ({r.duration:.6g} s)"
        )
    names = list(dict.fromkeys(name for r in found.recordings for name in r.covariates))
    if names:
        parts.append(f"logged column{'s' if len(names) > 1 else ''} {', '.join(names)}")
    return " · ".join(parts)


def common_form_sentences(sensor: Sensor) -> list[str]:
    """Sentences on the axes of one sensor: their common effects, and parameters that agree or differ."""
    if len(sensor.columns) < 2:
        return []
    if sensor.form is None:
        out = ["no noise model is common to all axes"]
    else:
        out = [f"{sensor.form.model} is common to all axes{_clause_on_single_axes(sensor.form)}"]
        agree = [_agreement_text(n, sensor) for n in sensor.form.numbers if n.pooled.agree]
        differing = [_difference_text(n, sensor) for n in sensor.form.numbers if not n.pooled.agree]
        if agree:
            out.append(f"the axes agree in {', '.join(agree)}")
        if differing:
            out.append(f"the axes differ in {', '.join(differing)}")
    if sensor.cross and not any(cross.significant for cross in sensor.cross):
        out.append("the residuals of the axes are uncorrelated")
    return [with_readable_numbers(sentence) for sentence in out]


def shared_effect_sentences(common: Common) -> list[str]:
    """List of sentences, one for each spectral line, event and noise that several axes share; empty without any."""
    of_lines = {one.line: one for one in common.shared if one.line is not None}
    without_line = [one for one in common.shared if one.line is None]
    lines = [of_lines.get(line, line) for line in common.lines]
    return [with_readable_numbers(str(one)) for one in (*lines, *common.events, *without_line)]


def _clause_on_single_axes(form: Form) -> str:
    """Clause such as ``; acc_x also has SIN`` on effects that not all axes have; empty without any."""
    own = [f"{name} also has {'+'.join(shorts)}" for name, shorts in form.besides.items() if shorts]
    return f"; {', '.join(own)}" if own else ""


def _list_text(words: Sequence[str]) -> str:
    """Text ``a, b and c`` of at least one word."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _compared_axes_text(number: Agreement, sensor: Sensor) -> str:
    """Text `` over gyro_x and gyro_y`` that names the compared axes; empty if they are all axes of the sensor."""
    return (
        "" if len(number.columns) == len(sensor.columns) else f" over {_list_text(number.columns)}"
    )


def _difference_text(number: Agreement, sensor: Sensor) -> str:
    """Item ``N (p 0.01)`` or ``N (p 0.01 over gyro_x and gyro_y)`` for a list of parameters that differ between axes."""
    return f"{number.pooled.name} (p {probability_text(number.pooled.p_value, 1)}{_compared_axes_text(number, sensor)})"


def _agreement_text(number: Agreement, sensor: Sensor) -> str:
    """Text ``N = 0.3 (0.2 … 0.4) °/√h, p 0.4``: mean over the axes, its interval, and p-value of equality."""
    pooled, declared = number.pooled, number.parameter
    value = Estimate(pooled.value, None, pooled.interval, pooled.unit)
    value = in_sheet_unit(value, declared)
    unit = "" if value.unit in ("", "1") else f" {printed(value.unit)}"
    assert value.interval is not None
    text = value_and_interval_text(float(value), value.interval)
    return f"{pooled.name} = {text}{unit}, p {probability_text(pooled.p_value, 1)}{_compared_axes_text(number, sensor)}"


def remarks(found: Characterization, words: Mapping[str, str] = CALL) -> list[str]:
    """Texts below a table: failed columns, warnings of the audit, inadequate models, alternative explanations.

    For an inadequate model, only its first failing range or doubt is stated.
    """
    out = [f"{name}: not characterized: {why}" for name, why in found.failed.items()]
    warned = merged(f for study in found.studies.values() for f in study.recording.audit)
    # A missing unit is no warning, since the column may be a clock's, but it is a remark.
    out += [f.worded(words) for f in warned if f.severity == "warning" or f.kind == "no_unit"]
    for name, study in found.studies.items():
        if not study.adequate:
            why = [*study.check.where.sentences(), *study.doubts][:1]
            out.append(f"{name}: {'; '.join([study.ending, *why])}")
        if study.undecided is not None:
            out.append(f"{name}: {undecided_sentence(study.fit, study.undecided)}")
    return [with_readable_numbers(text) for text in out]
