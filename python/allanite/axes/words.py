"""Sentences about all axes: what was read, what agrees, what to know before trusting the numbers."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.common.errors import CALL
from allanite.common.numbers import tidy, with_interval
from allanite.common.parameters import Estimate
from allanite.common.printing import in_table, printed
from allanite.recording.findings import merged

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.axes.characterization import Characterization, Sensor
    from allanite.axes.forms import Form
    from allanite.fit.several.many import Pooled

__all__ = ["in_common", "remarks", "title"]


def title(found: Characterization) -> str:
    """``imu.csv · 6 columns of 360000 samples at 100 Hz (3600 s) · covariate temperature``."""
    r = found.recording
    count = len(r.columns)
    parts = [
        Path(r.path).name if r.path else "recording",
        f"{count} column{'s' if count > 1 else ''} of {r.n} samples at {r.rate:g} Hz ({r.duration:.6g} s)",
    ]
    if r.covariates:
        parts.append(f"covariate{'s' if len(r.covariates) > 1 else ''} {', '.join(r.covariates)}")
    return " · ".join(parts)


def in_common(sensor: Sensor) -> list[str]:
    """Whether one form holds for all axes, which numbers agree, and which axes share noise."""
    if len(sensor.columns) < 2:
        return []
    if sensor.form is None:
        out = ["no one model form holds for all axes"]
    else:
        out = [f"one form of the noise holds for all axes: {sensor.form.model}{_own(sensor.form)}"]
        agree = [_value(p, sensor) for p in sensor.form.pooled if p.agree]
        apart = [f"{p.name} (p {_p(p.p_value)})" for p in sensor.form.pooled if not p.agree]
        if agree:
            out.append(f"the axes agree in {', '.join(agree)}")
        if apart:
            out.append(f"the axes differ in {', '.join(apart)}")
    shared = [str(cross) for cross in sensor.cross if cross.significant]
    if shared:
        out += [f"shared noise: {text}" for text in shared]
    elif sensor.cross:
        out.append("what the models leave is independent between axes")
    return [tidy(sentence) for sentence in out]


def _own(form: Form) -> str:
    """What an axis has beside the form: `` (besides, GyrZ has COV)``."""
    common = Counter(form.model.split("+"))
    own = {
        name: list((Counter(e.short for e in fit.model) - common).elements())
        for name, fit in form.fits.items()
    }
    words = [f"{name} has {', '.join(shorts)}" for name, shorts in own.items() if shorts]
    return f" (besides, {'; '.join(words)})" if words else ""


def _p(value: float) -> str:
    return f"{value:.1g}" if value >= 1e-99 else "below 1e-99"


def _value(pooled: Pooled, sensor: Sensor) -> str:
    assert sensor.form is not None
    fit = next(iter(sensor.form.fits.values()))
    value = Estimate(pooled.value, None, pooled.interval, pooled.unit)
    label, _, name = pooled.name.rpartition(".")
    for effect, own in zip(fit.model, fit.model.labels, strict=True):
        if own == (label or name) or (not label and own == name):
            declared = effect.parameter(name)
            value = in_table(value, declared.unit, declared.sheet, fit.recording.unit)
    unit = "" if value.unit in ("", "1") else f" {printed(value.unit)}"
    assert value.interval is not None
    text = with_interval(float(value), value.interval)
    return f"{pooled.name} = {text}{unit}, p {_p(pooled.p_value)}"


def remarks(found: Characterization, words: Mapping[str, str] = CALL) -> list[str]:
    """Columns that failed, what the audits warn of or miss, and what is left unexplained, each once."""
    out = [f"{name}: not characterised: {why}" for name, why in found.failed.items()]
    warned = merged(f for study in found.studies.values() for f in study.recording.audit)
    # A column without a unit may be a clock's, and then lacks none.
    out += [f.worded(words) for f in warned if f.severity == "warning" or f.kind == "no_unit"]
    for name, study in found.studies.items():
        if not study.adequate:
            why = (
                "stopped at the limit of steps"
                if study.stopped_because == "limit"
                else study.ending
            )
            out.append(f"{name}: {'; '.join([why, *study.check.where.sentences()[:1]])}")
    return [tidy(text) for text in out]
