"""The catalog of effects for the page, with a small picture of each effect."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import AllaniteError
from allanite.deviation import oadev
from allanite.effects import CATALOG, Deterministic, Model, Modifier, Stochastic, white_noise

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.effects import Effect

    Array = NDArray[np.float64]

#: Length of the record of a picture at 1 Hz; each effect is added to white noise of density 1.
N = 1 << 14
#: Averaging times (s) and frequencies (Hz) of the pictures.
TAU = np.unique(np.round(2.0 ** np.arange(0, 13, 0.5)))
FREQUENCY = np.geomspace(2.0 / N, 0.5, 40)
#: Shape values that put an effect into the middle of its picture; others use the middle of their grid.
SHAPES: dict[str, Any] = {
    "correlation_time": 60.0,
    "frequency": 0.02,
    "damping": 0.03,
    "dwell_time": 100.0,
    "cutoff": 0.05,
    "exponent": -1.5,
    "time": N / 2,
    "time_constant": N / 6,
    "lag": 0.0,
    "start": N / 3,
    "end": N / 2,
    "factor": 4.0,
    "column": "temperature",
    "order": 2,
}
#: Maximum ratio of the power of an effect to that of white noise.
ABOVE = 300.0


#: Groups of effects in the order of the page, with their families.
GROUPS = (
    ("Noise and drift", ("coefficient", "spectral", "drift")),
    ("Lines and bands", ("line", "band", "course")),
    ("Filters", ("filter",)),
    ("Events", ("step", "event", "hump", "transition", "stretch", "outlier")),
    ("Temperature and other columns", ("covariate",)),
    ("Noise level", ("level",)),
)


def _group_name(cls: type[Effect]) -> str:
    """Name of the group of an effect; the first group for unknown families."""
    return next((name for name, families in GROUPS if cls.family in families), GROUPS[0][0])


def catalogue(kind: str) -> list[dict[str, Any]]:
    """One dict per effect of the catalog, sorted by group, common ones first; names are those for a `kind` of sensor."""
    places = {name: place for place, (name, _) in enumerate(GROUPS)}
    return [
        {
            "kind": cls.kind,
            "short": cls.short,
            "group": _group_name(cls),
            "common": cls.common,
            "name": cls.titles.get(kind, cls.title),
            "physics": cls.text_for("physics", kind),
            "looks_like": cls.text_for("looks_like", kind),
            "check_by": cls.text_for("check_by", kind),
            "single": cls.single,
            "needs": [p.name for p in cls.parameters if p.role == "choice" and p.name == "column"],
            "pictures": _svg_pictures(cls),  # type: ignore[arg-type]
        }
        for cls in sorted(CATALOG, key=lambda c: (places[_group_name(c)], not c.common))
    ]


@cache
def _svg_pictures(cls: type[Effect]) -> dict[str, list[str] | None]:
    """Dict with ``curve`` (Allan deviation) and ``spectrum``: SVG paths, 100 × 60, with and without the effect, or None."""
    try:
        variance, power = _variance_and_density(cls)
    except (AllaniteError, ValueError, TypeError, NotImplementedError):
        return {"curve": None, "spectrum": None}
    white = 1.0 / TAU
    return {
        "curve": _svg_paths(TAU, np.sqrt(variance), np.sqrt(white)),
        "spectrum": _svg_paths(FREQUENCY, power, np.ones(FREQUENCY.size)),
    }


def _variance_and_density(cls: type[Effect]) -> tuple[Array, Array]:
    """Pair (Allan variance at `TAU`, density at `FREQUENCY`) of white noise of density 1 plus an example effect.

    The effect is scaled so that the largest ratio of its Allan variance to that of the white noise is 300. A `Modifier`
    changes the white noise instead.
    """
    if issubclass(cls, Stochastic) and cls.white:
        return 1.0 / TAU, np.ones(FREQUENCY.size)
    effect = _example_effect(cls)
    if issubclass(cls, Modifier):
        model = Model((white_noise(1.0), effect))
        return model.allan_variance(TAU, 1.0), model.psd(FREQUENCY, 1.0)
    if issubclass(cls, Stochastic):
        variance, power = effect.allan_variance(TAU, 1.0), effect.psd(FREQUENCY, 1.0)
    else:
        assert isinstance(effect, Deterministic)
        time = np.arange(N, dtype=float)
        slow = np.cos(2 * np.pi * time / N * 1.5)
        variance, power = _variance_and_power_of_signal(effect.signal(time, {"temperature": slow}))
    scale = ABOVE / max(float(np.max(variance * TAU)), 1e-300)
    return 1.0 / TAU + scale * variance, 1.0 + scale * power


def _example_effect(cls: type[Effect]) -> Effect:
    """`Effect` of a class with values that suit a picture; optional ones without an entry in `SHAPES` are left out."""
    values: dict[str, Any] = {}
    for p in cls.parameters:
        shown = SHAPES.get(p.name)
        if shown is not None and (isinstance(shown, str) or p.low <= shown <= p.high):
            values[p.name] = shown
        elif p.role == "coefficient" and not p.optional:
            values[p.name] = 1.0
        elif p.role == "shape" and not p.optional:
            grid = cls().grid(p.name, N, 1.0)
            values[p.name] = float(grid[grid.size // 2])
    return cls(**values)


def _variance_and_power_of_signal(signal: Array) -> tuple[Array, Array]:
    """Pair (Allan variance at `TAU`, spectral density) of `N` samples of a signal at 1 Hz.

    The density is the largest value of the periodogram (Hann window) in each of `FREQUENCY.size` bins of frequency, or
    0.
    """
    variance = oadev(signal, rate=1.0, taus=TAU).deviation ** 2
    power = np.abs(np.fft.rfft(signal * np.hanning(N))) ** 2 / N * 8.0 / 3.0
    frequency = np.fft.rfftfreq(N)
    edges = np.geomspace(FREQUENCY[0] / 1.1, 0.5, FREQUENCY.size + 1)
    found = [
        float(power[(frequency >= a) & (frequency <= b)].max(initial=0.0))
        for a, b in pairwise(edges)
    ]
    return variance, np.array(found)


def _svg_paths(x: Array, *lines: Array) -> list[str]:
    """One SVG path per line, in a picture of 100 × 60 pixels with the same logarithmic axes for all lines.

    The y axis covers all lines and at least two decades; values below 10⁻⁴ are drawn at 10⁻⁴.
    """
    across = 100.0 * np.log10(x / x[0]) / np.log10(x[-1] / x[0])
    logs = [np.log10(np.maximum(y, 1e-4)) for y in lines]
    top, bottom = max(y.max() for y in logs), min(y.min() for y in logs)
    height = max(2.0, top - bottom)
    middle = (top + bottom) / 2.0
    return [
        "M"
        + "L".join(
            f"{a:.1f},{b:.1f}"
            for a, b in zip(across, 30.0 - 54.0 * (y - middle) / height, strict=True)
        )
        for y in logs
    ]
