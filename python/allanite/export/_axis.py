"""What a target needs of a model: the coefficients of each axis in SI, and what it cannot hold."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import ACCELERATION, ANGULAR_RATE, coefficient_unit, parse_unit
from allanite.common.validation import positive_rate

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

__all__ = ["Axis", "axes_of", "documents_of", "header", "needed", "rate_of", "split", "worst"]

SI = {ANGULAR_RATE: "rad/s", ACCELERATION: "m/s^2", "fractional frequency": "1"}
# Coefficient → its effect and the power of seconds of its unit (CONTRACT's table).
COEFFICIENTS = {
    "Q": ("quantization", 1.0),
    "N": ("angle_random_walk", 0.5),
    "B": ("bias_instability", 0.0),
    "K": ("rate_random_walk", -0.5),
    "R": ("rate_ramp", -1.0),
}
NAMES = {kind: name for name, (kind, _) in COEFFICIENTS.items()}


@dataclass(frozen=True, slots=True)
class Axis:
    """One fitted axis.

    Attributes
    ----------
    name : str
        Column of the recording, or the source.
    kind : str
        Kind of sensor: ``"angular rate"``, ``"acceleration"``, …
    unit : str
        SI unit of the samples.
    rate : float or None
        Sampling rate of the recording, Hz.
    coefficients : mapping of str to Estimate
        Q, N, B, K, R as far as the model has them, in SI units (densities two-sided).
    others : tuple of str
        Effects of the model beside these five.
    source : str
        Where the numbers came from.
    """

    name: str
    kind: str
    unit: str
    rate: float | None
    coefficients: Mapping[str, Estimate]
    others: tuple[str, ...]
    source: str


def documents_of(path: str | Path) -> list[dict[str, Any]]:
    """Fit, check, improve or model documents of a JSON file, one a column."""
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{path}: not a model file ({error})") from None
    if not isinstance(document, dict) or not str(document.get("schema")).startswith("allanite/"):
        raise InputError(f"{path}: not a model file: no allanite schema in it")
    documents = document.get("columns", [document])
    return [_last_rung(document) for document in documents]


def _last_rung(document: dict[str, Any]) -> dict[str, Any]:
    ladder = document.get("ladder")
    if not ladder:
        return document
    return {**ladder[-1], "recording": document.get("recording"), "schema": "allanite/fit/1"}


def axes_of(
    documents: Iterable[dict[str, Any]], unit: str | None = None, source: str = "model"
) -> list[Axis]:
    """Axes of model documents.

    Parameters
    ----------
    documents : iterable of dict
        ``allanite/fit/1`` and its relatives, or ``allanite/model/1``.
    unit : str, optional
        Unit of the samples, for models that came without a recording.
    source : str
        Name of the file, for messages.

    Raises
    ------
    InputError
        No effects, no unit, or a coefficient without a value.
    """
    return [_axis(document, unit, source) for document in documents]


def _axis(document: dict[str, Any], unit: str | None, source: str) -> Axis:
    recording = document.get("recording") or {}
    own = recording.get("unit") or unit
    effects = document.get("effects")
    if not effects:
        raise InputError(f"{source}: the document holds no effects")
    if own is None:
        raise InputError(
            f"{source}: the model has no unit",
            missing="unit",
            remedy=": say with {unit} what its samples are in",
        )
    parsed = parse_unit(own)
    target = SI[parsed.kind]
    coefficients = {}
    others = []
    for effect in effects:
        name = NAMES.get(effect["kind"])
        if name is None:
            others.append(effect["kind"])
            continue
        given = effect["parameters"][name]
        if given.get("value") is None:
            raise InputError(f"{source}: {effect['kind']} has no value: fit it first")
        power = COEFFICIENTS[name][1]
        estimate = Estimate(
            given["value"],
            given.get("std_error"),
            _interval(given.get("interval")),
            given.get("unit") or coefficient_unit(parsed.name, power),
            given.get("detected", True),
            name,
        )
        coefficients[name] = estimate.to(coefficient_unit(target, power))
    return Axis(
        recording.get("column") or source,
        parsed.kind,
        target,
        recording.get("rate_hz"),
        coefficients,
        tuple(others),
        recording.get("path") or source,
    )


def _interval(bounds: list[float | None] | None) -> tuple[float, float] | None:
    if bounds is None or None in bounds:
        return None
    return float(bounds[0] or 0.0), float(bounds[1] or 0.0)


def needed(axis: Axis, name: str, target: str) -> tuple[float, str]:
    """Return a coefficient and a remark: undetected its upper limit, absent an error.

    A random walk is never made up from a bias instability: they are different processes.
    """
    estimate = axis.coefficients.get(name)
    if estimate is None:
        kind = COEFFICIENTS[name][0]
        raise InputError(
            f"{target} needs {name} ({kind}) and the model of {axis.name} has none: fit one"
            f" with {name} (a bias instability is not a random walk)"
        )
    if not estimate.detected:
        if estimate.interval is None:
            raise InputError(
                f"{axis.name}: {name} was not detected and has no upper limit to export"
            )
        return estimate.interval[1], "not detected: this is the 95 % upper limit"
    return estimate.value, ""


def worst(axes: Iterable[Axis], name: str, target: str) -> tuple[float, str]:
    """Largest value over the axes, for a target that has one number for all of them."""
    found = [(*needed(axis, name, target), axis.name) for axis in axes]
    value, remark, where = max(found)
    words = [remark] if remark else []
    if len(found) > 1:
        words.append(f"largest of {len(found)} axes, {where}")
    return value, "; ".join(words)


def header(axes: Iterable[Axis], comment: str, holds: str) -> str:
    """Comment lines: where the numbers came from, and what the target leaves out.

    `holds` names the coefficients that the target has room for.
    """
    lines = [
        (
            "Written by allanite. Densities are two-sided: white noise has S(f) = N^2,"
            " sigma^2(tau) = N^2/tau."
        )
    ]
    for axis in axes:
        origin = f"fitted to {axis.source}" if axis.source != axis.name else "as given"
        lines.append(f"{axis.name}: {origin}")
        left_out = [*(n for n in axis.coefficients if n not in holds), *axis.others]
        if left_out:
            lines.append(f"  left out, this format cannot hold it: {', '.join(left_out)}")
    return "".join(f"{comment} {line}\n" for line in lines)


def split(axes: Iterable[Axis]) -> tuple[list[Axis], list[Axis]]:
    """Gyroscope and accelerometer axes; anything else has no place in an inertial format."""
    axes = list(axes)
    for axis in axes:
        if axis.kind not in (ANGULAR_RATE, ACCELERATION):
            raise InputError(
                f"{axis.name} is a {axis.kind}: this format holds gyroscopes and accelerometers"
            )
    return (
        [axis for axis in axes if axis.kind == ANGULAR_RATE],
        [axis for axis in axes if axis.kind == ACCELERATION],
    )


def rate_of(axes: Iterable[Axis], rate: float | None, target: str) -> float:
    """Return the sampling rate for a target whose numbers hold for one rate."""
    rates = {axis.rate for axis in axes if axis.rate is not None} if rate is None else {rate}
    if len(rates) != 1:
        found = ", ".join(f"{r:g}" for r in sorted(rates)) or "none"
        raise InputError(
            f"{target} holds for one sampling rate, found {found}",
            missing="rate",
            remedy=": give {rate}",
        )
    return positive_rate(rates.pop())
