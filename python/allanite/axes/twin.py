"""Simulated sensor with the models of a characterized one: every axis, with its mean, steps and range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import invalid_as_input_error
from allanite.common.errors import InputError
from allanite.effects import CATALOG, Deterministic, Model
from allanite.effects.files import model_from_dict
from allanite.recording import Recording
from allanite.simulate import simulate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike

    from allanite.common.arrays import Array
    from allanite.study import Study

#: Rounding is simulated separately if its variance is at most this share of the variance of the white noise. Above, the
#: samples take few values. Chosen by judgment; not measured.
MAX_ROUNDING_SHARE = 0.5
#: Sentence about errors that no noise model contains.
ABSENT_ERRORS = (
    "scale factor, misalignment, cross-axis and g-sensitivity: this log at rest does not show them"
)


@dataclass(frozen=True, slots=True, eq=False)
class Twin:
    """Simulated recording of all axes, and sentences about what it lacks.

    Attributes
    ----------
    recording : Recording
    left_out : tuple of str
        One sentence for each property of the sensor that is not simulated.
    """

    recording: Recording
    left_out: tuple[str, ...]


def sample_statistics(study: Study) -> dict[str, Any]:
    """Dict for JSON of a column's samples, converted to rates: mean, minimum, maximum, step, clipped and references.

    `step` is the quantization step; `clipped` lists the values at which samples were clipped. For increments and angles,
    `step` is None and `clipped` is empty. `references` maps each logged column to its mean.
    """
    recording = study.recording
    x = recording.rate_samples()
    found: dict[str, Any] = {
        "mean": float(np.nanmean(x)),
        "minimum": float(np.nanmin(x)),
        "maximum": float(np.nanmax(x)),
        "step": None,
        "clipped": [],
        # Effects of a column are fitted relative to its mean.
        "references": {k: float(np.nanmean(v)) for k, v in recording.covariates.items()},
    }
    if recording.quantity == "rate":
        for finding in recording.audit:
            if finding.kind == "quantisation":
                found["step"] = finding.values["step"]
            if finding.kind == "clipping":
                found["clipped"].append(float(finding.values["value"]))
    return found


@invalid_as_input_error("not a characterization as `save` writes it")
def twin(
    document: Mapping[str, Any],
    *,
    duration: float | None = None,
    n: int | None = None,
    rate: float | None = None,
    seed: int = 0,
    covariates: Mapping[str, ArrayLike] | None = None,
) -> Twin:
    """`Twin`: simulated recording of every axis of a saved characterization, and what the simulation lacks.

    The axes are simulated independently; `seed` and the number of the axis determine its noise. Each axis has the mean
    of the measured axis and is clipped where that axis was. It is rounded to the measured step, unless its noise
    contains the rounding. Filters, lines, drifts and steps are those of its model.

    `document` is a `Characterization.to_dict`. The length is `duration` (s) or `n`, by default that of the measured
    record. `covariates` are columns that the models follow, shape (n,); effects of other columns are omitted. Raises
    `InputError` for another document, and for axes with different rates and no `rate` (Hz).
    """
    if document.get("schema") != "allanite/characterize/1":
        raise InputError(
            f"schema {document.get('schema')!r} is not of all axes: expected 'allanite/characterize/1'"
        )
    columns, left_out = [], [ABSENT_ERRORS]
    for axis, one in enumerate(document["columns"]):
        recorded = one["recording"]
        name = recorded["column"]
        fit = {"schema": "allanite/fit/1", "effects": one["ladder"][-1]["effects"]}
        model = model_from_dict(fit, name)
        at = float(rate or recorded["rate_hz"])
        size = {"duration": duration} if n is None else {"n": n}
        if duration is None and n is None:
            size = {"n": round(recorded["duration_s"] * at)}
        kept, without = _simulatable_model(model, covariates or {})
        left_out += [f"{name}: {what}" for what in without]
        known = document.get("samples", {}).get(name, {})
        kept, step = _without_rounding(kept, known.get("step"), at)
        if known.get("step") and step is None:
            left_out.append(
                f"{name}: rounding to {known['step']:.3g} {recorded['unit']}: the fitted noise already contains it"
            )
        record = simulate(
            kept,
            **size,
            rate=at,
            seed=seed,
            unit=recorded["unit"],
            covariates=covariates,
            axis=axis,
        )
        columns.append((name, record, _as_recorded(record.samples, known, step)))
    first = columns[0][1]
    if len({record.rate for _, record, _ in columns}) > 1:
        raise InputError("the axes have different rates", missing="rate", remedy=": give {rate}")
    recording = Recording(
        np.column_stack([samples for *_, samples in columns]),
        first.rate,
        unit=[record.unit for _, record, _ in columns],
        columns=[name for name, *_ in columns],
        covariates=first.covariates,
    )
    left_out += _unsimulated_shared_noise(document.get("common", {}))
    left_out += [f"{name}: {why}" for name, why in document.get("failed", {}).items()]
    return Twin(recording, tuple(left_out))


def _unsimulated_shared_noise(common: Mapping[str, Any]) -> list[str]:
    """Sentences on the noise that several axes share, from the entry ``common``; independent axes cannot contain it.

    Shared noise that is due to a common sinusoid is left out.
    """
    steady = {cls.kind for cls in CATALOG if issubclass(cls, Deterministic)}
    lines = {line["frequency_hz"] for line in common.get("lines", ()) if steady >= {*line["kinds"]}}
    return [
        f"noise that {', '.join(one['columns'])} share at {one['low_hz']:.3g}–{one['high_hz']:.3g} Hz"
        f" (coherence {one['coherence']:.2f}): the axes are simulated independently"
        for one in common.get("shared_noise", ())
        if one["line_hz"] not in lines
    ]


def _simulatable_model(
    model: Model, covariates: Mapping[str, ArrayLike]
) -> tuple[Model, list[str]]:
    """(model of the effects that can be simulated, a sentence on each omitted effect).

    Omitted are outliers (excluded samples), and effects of logged columns that are not given.
    """
    kept = [e for e in model if e.follows is None or e.follows in covariates]
    omitted = [
        f"the effect of {e.follows}: no values of this column are given"
        for e in model
        if e not in kept
    ]
    outliers = [e for e in kept if getattr(e, "removes", False)]
    omitted += [
        f"{e.kind.replace('_', ' ')}: a property of one record, not of the sensor" for e in outliers
    ]
    return Model(tuple(e for e in kept if e not in outliers)), omitted


def _without_rounding(model: Model, step: float | None, rate: float) -> tuple[Model, float | None]:
    """(model, step): simulate this model and round to this quantization step; step None means no rounding.

    Rounding adds white noise of variance step²/12, so the white noise of the returned model is smaller by this amount.
    If that is more than half of the white noise, or with a filter, the result is (`model`, None).
    """
    white = model.white
    filtered = any(not (e.changes_level or e.removes) for e in model.modifiers)
    if not step or white is None or filtered:
        return model, None
    level = getattr(white, white.coefficient) ** 2
    rounding = step**2 / 12.0 / rate
    if rounding > MAX_ROUNDING_SHARE * level:
        return model, None
    place = model.effects.index(white)
    less = float(np.sqrt(level - rounding))
    return model.replaced(place, **{white.coefficient: less}), step


def _as_recorded(samples: Array, known: Mapping[str, Any], step: float | None) -> Array:
    """Simulated `samples` as the sensor of `known` (`sample_statistics`) would record them.

    The mean is added, the samples are rounded to multiples of `step` unless it is None, and then clipped.
    """
    out = samples + float(known.get("mean", 0.0))
    if step is not None:
        # A mean beyond all sensors gives infinite samples, which a recording refuses.
        with np.errstate(over="ignore", invalid="ignore"):
            out = np.round(out / float(step)) * step
    for edge in known.get("clipped", ()):
        below = edge < known["mean"]
        out = np.maximum(out, edge) if below else np.minimum(out, edge)
    return out
