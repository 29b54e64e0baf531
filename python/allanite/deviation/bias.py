"""Degrees of freedom and published bias of each estimator."""

from __future__ import annotations

import numpy as np

from allanite.deviation.confidence import degrees_of_freedom

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
#: Variance of the estimator over the true one: total 1 − a τ/T, the others a factor. NIST SP 1065: the bias functions of
#: TOTVAR and MTOT; of the Hadamard total variance −0.5, −14.9 and −22.9 % (Howe et al. 2000).
TOTAL_BIAS = {-1: 1.0 / (3.0 * np.log(2.0)), -2: 0.75}
MODIFIED_TOTAL_BIAS = {2: 0.94, 1: 0.83, 0: 0.73, -1: 0.70, -2: 0.69}
HADAMARD_TOTAL_BIAS = {0: 0.995, -1: 0.851, -2: 0.771}


def allan_edf(alpha: float, m: int, count: int, points: int, stride: int = 1) -> float:
    """Equivalent degrees of freedom of an Allan variance: `count` second differences, `stride` points apart."""
    return degrees_of_freedom(alpha, m, count, stride=stride)


def hadamard_edf(alpha: float, m: int, count: int, points: int, stride: int = 1) -> float:
    """Equivalent degrees of freedom of a Hadamard variance: `count` third differences, `stride` points apart."""
    return degrees_of_freedom(alpha, m, count, order=3, stride=stride)


def modified_edf(alpha: float, m: int, count: int, points: int) -> float:
    """Equivalent degrees of freedom of a modified Allan variance from `count` second differences of phase averages."""
    return degrees_of_freedom(alpha, m, count, summed=True)


def total_edf(alpha: float, m: int, count: int, points: int) -> float:
    """Equivalent degrees of freedom of the total variance (NIST SP 1065 table 8).

    For phase noise (rounded α > 0) they are those of the overlapping Allan variance. Otherwise they lie between 1 and
    those of an Allan variance of `points` − 2 differences. α is rounded, at least −2.
    """
    if round(alpha) > 0:
        return degrees_of_freedom(alpha, m, max(points - 2 * m, 1))
    b, c = TOTAL[max(round(alpha), -2)]
    return _published_edf(b, c, alpha, m, points, summed=False)


def modified_total_edf(alpha: float, m: int, count: int, points: int) -> float:
    """Equivalent degrees of freedom of the modified total variance (NIST SP 1065 table 10).

    They are at least 1, and at most those of a modified Allan variance of `points` − 2 differences. α is rounded to −2
    … 2.
    """
    b, c = MODIFIED_TOTAL[min(max(round(alpha), -2), 2)]
    return _published_edf(b, c, alpha, m, points, summed=True)


def _published_edf(b: float, c: float, alpha: float, m: int, points: int, *, summed: bool) -> float:
    """Equivalent degrees of freedom b T/τ − c of a total variance, with the published constants b and c.

    The result is at least 1, and at most that of an Allan variance (if `summed`, a modified Allan variance).
    """
    # The published line is for long τ; at short τ, reflection adds no terms.
    most = degrees_of_freedom(alpha, m, points - 2, summed=summed)
    return max(1.0, min(b * (points - 1) / m - c, most))


def hadamard_total_edf(alpha: float, m: int, count: int, points: int) -> float:
    """Equivalent degrees of freedom of the Hadamard total variance (NIST SP 1065 table 11), at least 1 for m > 1.

    At m = 1 they are those of a Hadamard variance of `count` differences. α is rounded to −2 … 0.
    """
    if m == 1:
        return hadamard_edf(alpha, m, count, points)
    b0, b1 = HADAMARD_TOTAL[min(max(round(alpha), -2), 0)]
    ratio = (points - 1) / m
    return max(1.0, ratio / (b0 + b1 / ratio))


def total_bias(alpha: int, m: int, points: int) -> float:
    """Published ratio of the mean total variance to the true variance: 1 − a τ/T for α = −1 and −2.

    It is 1 for all other α, and for τ above half of the record.
    """
    share = m / (points - 1)
    return 1.0 - TOTAL_BIAS.get(alpha, 0.0) * share if share <= 0.5 else 1.0


def modified_total_bias(alpha: int, m: int, points: int) -> float:
    """Published ratio of the mean modified total variance to the true variance."""
    return MODIFIED_TOTAL_BIAS[min(max(alpha, -2), 2)]


def hadamard_total_bias(alpha: int, m: int, points: int) -> float:
    """Published ratio of the mean Hadamard total variance to the true variance; 1 at m = 1."""
    return 1.0 if m == 1 else HADAMARD_TOTAL_BIAS[min(max(alpha, -2), 0)]


def theo1_edf(alpha: float, m: int, count: int, points: int) -> float:
    """Equivalent degrees of freedom of Theo1 (NIST SP 1065 table 12) at the effective averaging time 0.75 m, at least 1.

    α is rounded to −2 … 2.
    """
    law, n, tau = min(max(round(alpha), -2), 2), points, 0.75 * m
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
