"""Degrees of freedom and published bias of each estimator."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.deviation.confidence import degrees_of_freedom

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["corrected", "freedom"]

#: edf = b T/τ − c by power law; NIST SP 1065 tables 8 and 10.
TOTAL = {0: (1.50, 0.0), -1: (1.17, 0.22), -2: (0.93, 0.36)}
MODIFIED_TOTAL = {
    2: (1.90, 2.1),
    1: (1.20, 1.40),
    0: (1.10, 1.2),
    -1: (0.85, 0.50),
    -2: (0.75, 0.31),
}
#: edf = (T/τ)/(b0 + b1 τ/T); NIST SP 1065 table 11.
HADAMARD_TOTAL = {0: (0.559, 1.004), -1: (0.868, 1.140), -2: (0.938, 1.696)}
#: Variance of the estimator over the true one: total 1 − a τ/T, the others a factor.
TOTAL_BIAS = {-1: 1.0 / (3.0 * np.log(2.0)), -2: 0.75}
MODIFIED_TOTAL_BIAS = {2: 0.94, 1: 0.83, 0: 0.73, -1: 0.70, -2: 0.69}
HADAMARD_TOTAL_BIAS = {0: 0.995, -1: 0.851, -2: 0.771}


def corrected(
    kind: str,
    variance: NDArray[np.float64],
    alpha: NDArray[np.float64],
    m: NDArray[np.int64],
    points: int,
    unbiased: bool,
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Variance with or without the published bias of the total estimators, and a word about it.

    Parameters
    ----------
    kind : str
        Estimator; those without a published bias come back as they are.
    variance, alpha, m : ndarray of shape (k,)
        Estimates, exponents of the noise and averaging factors.
    points : int
        Phase points of the record.
    unbiased : bool
        Whether to divide the bias out.
    """
    if kind not in ("totdev", "mtotdev", "htotdev"):
        return variance, ()
    bias = np.array([_bias(kind, int(a), int(f), points) for a, f in zip(alpha, m, strict=True)])
    if (bias == 1.0).all():
        return variance, ()
    if not unbiased:
        note = f"published bias of {kind} left in: {bias.min():.3g} to {bias.max():.3g} in variance"
        return variance, (note,)
    note = f"published bias of {kind} for the noise identified at each τ has been divided out"
    return variance / bias, (note,)


def _bias(kind: str, alpha: int, m: int, points: int) -> float:
    if kind == "totdev":
        # Published for τ up to half of the record.
        share = m / (points - 1)
        return 1.0 - TOTAL_BIAS.get(alpha, 0.0) * share if share <= 0.5 else 1.0
    if kind == "mtotdev":
        return MODIFIED_TOTAL_BIAS[min(max(alpha, -2), 2)]
    return 1.0 if m == 1 else HADAMARD_TOTAL_BIAS[min(max(alpha, -2), 0)]


def freedom(
    kind: str,
    alpha: NDArray[np.float64],
    m: NDArray[np.int64],
    n: NDArray[np.int64],
    points: int,
) -> NDArray[np.float64]:
    """Equivalent degrees of freedom at each τ; NaN without an estimate or where none are known."""
    return np.array(
        [
            _freedom(kind, float(a), int(f), int(c), points) if c else np.nan
            for a, f, c in zip(alpha, m, n, strict=True)
        ]
    )


def _freedom(kind: str, alpha: float, m: int, count: int, points: int) -> float:
    ratio = (points - 1) / m
    law = round(alpha)
    if kind in ("oadev", "adev"):
        return degrees_of_freedom(alpha, m, count, stride=m if kind == "adev" else 1)
    if kind in ("ohdev", "hdev") or (kind == "htotdev" and m == 1):
        return degrees_of_freedom(alpha, m, count, order=3, stride=m if kind == "hdev" else 1)
    if kind in ("mdev", "pdev"):
        return degrees_of_freedom(alpha, m, count, summed=True)
    if kind == "theo1":
        return _theo1_freedom(min(max(law, -2), 2), points, 0.75 * m)
    if kind == "totdev":
        if law > 0:
            return degrees_of_freedom(alpha, m, max(points - 2 * m, 1))
        b, c = TOTAL[max(law, -2)]
    elif kind == "mtotdev":
        b, c = MODIFIED_TOTAL[min(max(law, -2), 2)]
    elif kind == "htotdev":
        b0, b1 = HADAMARD_TOTAL[min(max(law, -2), 0)]
        return max(1.0, ratio / (b0 + b1 / ratio))
    else:
        return float("nan")
    # The published line is for long τ; at short ones reflection adds nothing to the terms.
    most = degrees_of_freedom(alpha, m, points - 2, summed=kind == "mtotdev")
    return max(1.0, min(b * ratio - c, most))


def _theo1_freedom(law: int, n: int, tau: float) -> float:
    """NIST SP 1065 table 12: of n phase points, effective τ in samples."""
    if law == 2:
        edf = 0.86 * (n + 1) * (n - 4 * tau / 3) / (n - tau) * tau / (tau + 1.14)
    elif law == 1:
        edf = 4.798 * n**2 - 6.374 * n * tau + 12.387 * tau
        edf *= tau / (tau + 0.3) / (np.sqrt(tau + 36.6) * (n - tau))
    elif law == 0:
        edf = ((4.1 * n + 0.8) / tau - (3.1 * n + 6.5) / n) * tau**1.5 / (tau**1.5 + 5.2)
    elif law == -1:
        edf = (2.0 * n**2 - 1.3 * n * tau - 3.5 * tau) / (n * tau) * tau**3 / (tau**3 + 2.3)
    else:
        edf = (4.4 * n - 2.0) / (2.9 * tau)
        edf *= (4.4 * n - 1.0) ** 2 - 8.6 * tau * (4.4 * n - 1.0) + 11.4 * tau**2
        edf /= (4.4 * n - 3.0) ** 2
    return float(max(1.0, edf))
