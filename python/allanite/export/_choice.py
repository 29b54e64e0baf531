"""What is written where a format holds white noise and one slow process: N and K, or N and a Gauss-Markov process."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import white_noise
from allanite.effects.gauss_markov import GaussMarkov
from allanite.export._held import Choice, lag, walk
from allanite.export._overbound import overbound_lag, overbound_walk

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from allanite.effects.model import Model
    from allanite.export._axis import Axis

__all__ = ["LIMIT", "choose", "choose_lag", "covering", "report"]

#: A slow process that is not in the model is chosen so that the Allan deviation is nowhere below this part of the model's.
NEARLY = 0.95
LIMIT = "not detected, this is the 95 % upper limit"


def choose(axis: Axis, *, overbound: bool = False) -> Choice:
    """N and K of an axis.

    What was fitted; where it was not detected its upper limit; where the model has none, N of the Allan deviation of one
    sample and the smallest K that keeps the Allan deviation within 5 % below the model's up to the longest τ of use (a
    bias instability is not a random walk: it is covered by one). A model of white noise alone gets the K that is as large
    as the white noise at the longest τ: a larger one would have been seen.
    """
    if overbound:
        return overbound_walk(axis)
    white, walk = axis.coefficients.get("N"), axis.coefficients.get("K")
    remarks: list[tuple[str, str]] = []
    holds = []
    if white is not None and (white > 0.0 or _limit(white) > 0.0):
        N = float(white) if white.detected else _limit(white)
        holds.append("N")
        words = [] if white.detected else [LIMIT]
        if axis.model.levels:
            N *= axis.model.mean_level(axis.span)
            words.append("the mean level over the record")
            changes = zip(axis.model.labels, axis.model, strict=True)
            holds += [label for label, effect in changes if effect in axis.model.levels]
        remarks.append(("N", "; ".join(words)))
    else:
        tau = axis.taus[:1]
        N = float(np.sqrt(_variance(axis, axis.broad, tau) * tau)[0])
        remarks.append(
            ("N", "the model has no white noise: this has its Allan deviation at one sample")
        )
    if walk is not None and (walk > 0.0 or _limit(walk) > 0.0):
        K = float(walk) if walk.detected else _limit(walk)
        holds.append("K")
        if not walk.detected:
            remarks.append(("K", LIMIT))
    else:
        K, remark = _covering_walk(axis, N)
        remarks.append(("K", remark))
    return Choice(N, K, remarks=tuple(remarks), holds=tuple(holds))


def choose_lag(axis: Axis, time: float | None = None, *, overbound: bool = False) -> Choice:
    """N and a Gauss-Markov process (of this time constant, if given): the model's own where it is all it has beside N."""
    if overbound:
        return overbound_lag(axis, time)
    first = choose(axis)
    remarks = [("N", first.remark("N"))]
    lags = [e for e in axis.model.stochastic if isinstance(e, GaussMarkov)]
    others = len(axis.steady()) - len(lags) - (axis.model.white is not None)
    if len(lags) == 1 and not others and time in (None, lags[0].correlation_time):
        q_c, own = float(lags[0].q_c or 0.0), float(lags[0].correlation_time or 0.0)
        if q_c > 0.0:
            holds = (*first.holds, lags[0].short)
            return Choice(first.N, 0.0, axis.scale * q_c, own, tuple(remarks), holds)
    tau = axis.taus
    model = _variance(axis, axis.slow, tau)
    white = white_noise(first.N).allan_variance(tau, axis.sampling)
    missing = NEARLY**2 * model - white
    if not (missing > 0.0).any():
        # A larger one would have been seen: as large as the white noise at the longest τ.
        missing = np.where(tau == tau[-1], white, 0.0)
    times = np.geomspace(4.0 * tau[0], 10.0 * tau[-1], 60) if time is None else np.array([time])
    best: tuple[float, float, float] | None = None
    for T in times:
        one = lag(1.0, T).allan_variance(tau, axis.sampling)
        size = max(0.0, float((missing / one).max()))
        excess = float(np.log((white + size * one) / np.maximum(model, white)).mean())
        if best is None or excess < best[0] - 1e-12:
            best = (excess, size, float(T))
    assert best is not None
    remark = (
        "the smallest whose Allan deviation, with N, is nowhere more than 5 % below that of the model without its"
        " lines, ramps, bands and what averages out faster than white noise"
    )
    return Choice(
        first.N,
        0.0,
        float(np.sqrt(best[1])),
        best[2],
        (*remarks, ("lag", remark)),
        tuple(h for h in first.holds if h != "K"),
    )


def _variance(axis: Axis, part: Model, tau: NDArray[np.float64]) -> NDArray[np.float64]:
    """Allan variance of a part of the axis's model, SI."""
    return axis.scale**2 * part.allan_variance(tau, axis.sampling)


def _limit(estimate: object) -> float:
    interval = getattr(estimate, "interval", None)
    return 0.0 if interval is None else float(interval[1])


def covering(axis: Axis, rest: Model) -> float:
    """Smallest K that, with the `rest` (SI), is nowhere more than 5 % below the Allan deviation of white and slow noise."""
    tau = axis.taus
    missing = NEARLY**2 * _variance(axis, axis.slow, tau) - rest.allan_variance(tau, axis.sampling)
    needed = float((missing / walk(1.0).allan_variance(tau, axis.sampling)).max())
    return float(np.sqrt(max(0.0, needed)))


def _covering_walk(axis: Axis, N: float) -> tuple[float, str]:
    last = axis.taus[-1:]
    needed = covering(axis, Choice(N).model)
    if needed > 0.0:
        return needed, (
            "no random walk in the model: the smallest that keeps the Allan deviation of N and K above 95 % of that of"
            f" its white and slow noise up to {last[0]:.3g} s"
        )
    white, unit = (e.allan_variance(last, axis.sampling)[0] for e in (white_noise(N), walk(1.0)))
    return float(np.sqrt(white / unit)), (
        f"no slow noise in the model: as large as the white noise at {last[0]:.3g} s, a larger one would have been seen"
    )


def report(axis: Axis, choice: Choice | None, written: Sequence[str] = ()) -> list[str]:
    """Lines that say what of an axis is in the file, what is not, and how much that is."""
    origin = f"fitted to {axis.source}" if axis.source != axis.name else "as given"
    if axis.assumptions:
        origin = f"from {axis.source}, no log"
    held = tuple(written) if choice is None else choice.holds
    labels = axis.model.labels
    missing = [
        f"{label} ({effect.kind})"
        for label, effect in zip(labels, axis.model.effects, strict=True)
        if label not in held
    ]
    inside = ", ".join(held) or "no effect as it was fitted"
    if choice is not None and choice.overbound:
        inside = "numbers above the model's upper limits in place of all its effects"
        missing = []
    if choice is not None and choice.others:
        of: dict[str, list[str]] = {}
        for name, other in choice.others:
            of.setdefault(other, []).append(name)
        donors = ", ".join(f"{' and '.join(names)} of {other}" for other, names in of.items())
        inside += f" (the largest of the axes: {donors})"
    lines = [f"{axis.name}: {origin}; model {axis.model.name}; in this file: {inside}"]
    if axis.warning:
        lines.append(f"  WARNING: {axis.warning}")
    lines += [f"  assumed: {assumption}" for assumption in axis.assumptions]
    if missing:
        lines.append(f"  left out, this format cannot hold it: {', '.join(missing)}")
    if choice is not None:
        tau = axis.taus
        ratio = np.sqrt(choice.model.allan_variance(tau, axis.sampling) / axis.allan(tau))
        low, high = int(np.argmin(ratio)), int(np.argmax(ratio))
        lines.append(
            f"  Allan deviation of what is written over the model's, {tau[0]:.3g} s to {tau[-1]:.3g} s:"
            f" {ratio[low]:.2f} (at {tau[low]:.3g} s) to {ratio[high]:.2f} (at {tau[high]:.3g} s)"
        )
    return lines
