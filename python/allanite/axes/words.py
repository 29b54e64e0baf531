"""Sentences about all axes: what was read, what agrees, what to know before trusting the numbers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.errors import CALL
from allanite.common.numbers import tidy, with_interval
from allanite.common.parameters import Estimate
from allanite.common.printing import in_table, printed
from allanite.fit.table import undecided_sentence
from allanite.recording.findings import merged

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.axes.characterization import Characterization, Common, Sensor
    from allanite.axes.forms import Agreement, Form

__all__ = ["at_work", "in_common", "remarks", "seen_by_several", "switched_on", "title"]


def title(found: Characterization) -> str:
    """``imu.csv · 6 columns of 360000 samples at 100 Hz (3600 s) · covariate temperature``."""
    path = found.recording.path
    parts = [Path(path).name if path else "recording"]
    for r in found.recordings:
        count = len(r.columns)
        parts.append(
            f"{count} column{'s' if count > 1 else ''} of {r.n} samples at {r.rate:g} Hz ({r.duration:.6g} s)"
        )
    names = list(dict.fromkeys(name for r in found.recordings for name in r.covariates))
    if names:
        parts.append(f"covariate{'s' if len(names) > 1 else ''} {', '.join(names)}")
    return " · ".join(parts)


def in_common(sensor: Sensor) -> list[str]:
    """What holds for all axes, which numbers agree, and whether the axes share noise."""
    if len(sensor.columns) < 2:
        return []
    if sensor.form is None:
        out = ["no one model form holds for all axes"]
    else:
        out = [f"every axis shows {sensor.form.model} or cannot exclude it{_besides(sensor.form)}"]
        agree = [_value(n, sensor) for n in sensor.form.numbers if n.pooled.agree]
        apart = [_apart(n, sensor) for n in sensor.form.numbers if not n.pooled.agree]
        if agree:
            out.append(f"the axes agree in {', '.join(agree)}")
        if apart:
            out.append(f"the axes differ in {', '.join(apart)}")
    if sensor.cross and not any(cross.significant for cross in sensor.cross):
        out.append("what the models leave is independent between axes")
    return [tidy(sentence) for sentence in out]


def seen_by_several(common: Common) -> list[str]:
    """Lines, events and noise that axes of one sensor or of several have in common, each once."""
    of_lines = {one.line: one for one in common.shared if one.line is not None}
    rest = [one for one in common.shared if one.line is None]
    lines = [of_lines.get(line, line) for line in common.lines]
    return [tidy(str(one)) for one in (*lines, *common.events, *rest)]


def at_work(found: Characterization) -> list[str]:
    """What the working log adds to the noise of each column."""
    return [tidy(f"{name}: {'; '.join(w.reasons)}") for name, w in found.working.items()]


def switched_on(found: Characterization) -> list[str]:
    """The bias at switch-on of each column."""
    return [tidy(f"{name}: {bias}") for name, bias in found.turn_on.items()]


def _besides(form: Form) -> str:
    """What axes show beside the form: ``; besides, acc_x has SIN, acc_z has SIN+RES``."""
    own = [f"{name} has {'+'.join(shorts)}" for name, shorts in form.besides.items() if shorts]
    return f"; besides, {', '.join(own)}" if own else ""


def _listed(words: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _p(value: float) -> str:
    return f"{value:.1g}" if value >= 1e-99 else "below 1e-99"


def _over(number: Agreement, sensor: Sensor) -> str:
    """Over which axes, where not all have a value."""
    return "" if len(number.columns) == len(sensor.columns) else f" over {_listed(number.columns)}"


def _apart(number: Agreement, sensor: Sensor) -> str:
    return f"{number.pooled.name} (p {_p(number.pooled.p_value)}{_over(number, sensor)})"


def _value(number: Agreement, sensor: Sensor) -> str:
    pooled, declared = number.pooled, number.parameter
    value = Estimate(pooled.value, None, pooled.interval, pooled.unit)
    value = in_table(value, declared.unit, declared.sheet, number.sample_unit)
    unit = "" if value.unit in ("", "1") else f" {printed(value.unit)}"
    assert value.interval is not None
    text = with_interval(float(value), value.interval)
    return f"{pooled.name} = {text}{unit}, p {_p(pooled.p_value)}{_over(number, sensor)}"


def remarks(found: Characterization, words: Mapping[str, str] = CALL) -> list[str]:
    """Columns that failed, what the audits warn of or miss, what is left unexplained, and alternative explanations."""
    out = [f"{name}: not characterised: {why}" for name, why in found.failed.items()]
    warned = merged(f for study in found.studies.values() for f in study.recording.audit)
    # A column without a unit may be a clock's, and then lacks none.
    out += [f.worded(words) for f in warned if f.severity == "warning" or f.kind == "no_unit"]
    for name, study in found.studies.items():
        if not study.adequate:
            why = [*study.check.where.sentences(), *study.doubts][:1]
            out.append(f"{name}: {'; '.join([study.ending, *why])}")
        if study.undecided is not None:
            out.append(f"{name}: {undecided_sentence(study.fit, study.undecided)}")
    return [tidy(text) for text in out]
