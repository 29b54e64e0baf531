"""Table of estimators: each row defines an estimator and makes the public function with its name."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from allanite import _kernels
from allanite.deviation import bias
from allanite.deviation.averaging import Taus, samples_of
from allanite.deviation.estimation import estimate
from allanite.deviation.table import ESTIMATORS, Entry, Estimator
from allanite.recording import Recording

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from allanite.deviation.result import Deviation

#: When to use an estimator, of several estimators that share a line of the help.
OTHER_TOTALS = Entry(80, "the same for mdev, tdev and hdev")
NO_OVERLAP = Entry(100, "without overlap; to compare with results of this kind")
INTERVAL_ERROR = "maximum and rms time interval error; no intervals"
#: Docstring of the functions.
TEXT = """{title}: {source}.

    {more}

    Parameters
    ----------
    x : array_like of shape (n,) or Recording
        Samples; a recording has its own rate, unit and quantity. NaN samples cost only the terms that touch
        them; integers are used exactly. For several columns use `deviations`.
    rate : float
        Sampling rate, Hz.
    taus : {{"octave", "decade", "all"}} or int or sequence of float
        Averaging times in sampling intervals: 1, 2, 4, 8, … (octave); 1, 2, 4, 10, 20, 40, … (decade); all; a number
        per decade; or times in seconds, which are rounded to multiples of the sampling interval.
    factors : array_like of int, optional
        Averaging factors instead of `taus`.
    quantity : {{"rate", "increment", "angle"}}
        Quantity of the samples: the rate, its integral over one sample, or its integral from the start
        (the phase of a clock).{unbiased}

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate{unit};
        {interval}.

    Raises
    ------
    InputError
        Samples, rate, taus or quantity that cannot be used.
    TooShortError
        Fewer than 3 samples, or no averaging time fits.

    Examples
    --------
    The nine frequencies of NIST SP 1065, page 107, at τ of one and two intervals:

    >>> nbs14 = [892, 809, 823, 798, 671, 644, 883, 903, 677]
    >>> print(al.{name}(nbs14, factors=[1, 2]).deviation.round(3))
    [{nbs14}]
    """
#: Part of the docstring of functions with a published bias.
UNBIASED = """
    unbiased : bool
        If true, the published bias is divided out."""


class Deviate(Protocol):
    """Signature of the functions without a published bias."""

    __name__: str

    def __call__(
        self,
        x: ArrayLike | Recording,
        rate: float = 1.0,
        taus: Taus = "octave",
        factors: ArrayLike | None = None,
        quantity: str = "rate",
    ) -> Deviation:
        """Deviation of a record over averaging times."""


class Correctable(Protocol):
    """Signature of the functions with a published bias."""

    __name__: str

    def __call__(
        self,
        x: ArrayLike | Recording,
        rate: float = 1.0,
        taus: Taus = "octave",
        factors: ArrayLike | None = None,
        quantity: str = "rate",
        unbiased: bool = ...,
    ) -> Deviation:
        """Deviation of a record over averaging times; if `unbiased`, the published bias is divided out."""


def _register_estimator(**what: Any) -> Estimator:
    """New `Estimator` with these attributes, added to `ESTIMATORS`; its default kernel is the one with its name."""
    row = Estimator(**{"kernel": _family_kernel(what["name"]), **what})
    ESTIMATORS[row.name] = row
    return row


def _with_docstring(function: Any, row: Estimator, more: str, nbs14: str) -> Any:
    """`function` itself, after it got the name and the description of the estimator `row`.

    `more` is a sentence of the docstring, and `nbs14` the output of the docstring's example.
    """
    function.__name__ = function.__qualname__ = row.name
    function.__module__ = "allanite.deviation"
    function.__doc__ = TEXT.format(
        title=row.title[:1].upper() + row.title[1:],
        source=row.source,
        more=more,
        name=row.name,
        nbs14=nbs14,
        unbiased=UNBIASED if row.bias else "",
        unit=" times s (deg of deg/s, s of a frequency)" if row.gain else "",
        interval="95 % intervals from the noise identified at each τ"
        if row.edf
        else "no interval is known",
    )
    return function


def _uncorrected_estimator(more: str, nbs14: str, **what: Any) -> Deviate:
    """Public function, such as `oadev`, of a new estimator without a published bias, which is added to `ESTIMATORS`.

    For `more` and `nbs14` see `_with_docstring`; `what` are attributes of `Estimator`.
    """
    row = _register_estimator(**what)

    def deviation(
        x: ArrayLike | Recording,
        rate: float = 1.0,
        taus: Taus = "octave",
        factors: ArrayLike | None = None,
        quantity: str = "rate",
    ) -> Deviation:
        """`Deviation` of the record `x`."""
        return estimate(row, samples_of(x, rate, quantity), taus, factors)

    function: Deviate = _with_docstring(deviation, row, more, nbs14)
    return function


def _corrected_estimator(more: str, nbs14: str, **what: Any) -> Correctable:
    """Public function, such as `totdev`, of a new estimator with a known, removable bias; as `_uncorrected_estimator`."""
    row = _register_estimator(**what)

    def deviation(
        x: ArrayLike | Recording,
        rate: float = 1.0,
        taus: Taus = "octave",
        factors: ArrayLike | None = None,
        quantity: str = "rate",
        unbiased: bool = row.unbiased,
    ) -> Deviation:
        """`Deviation` of the record `x`."""
        return estimate(row, samples_of(x, rate, quantity), taus, factors, unbiased)

    function: Correctable = _with_docstring(deviation, row, more, nbs14)
    return function


def _allan_of_samples(
    kernel: Any, samples: NDArray[Any], m: NDArray[np.int64], angle: bool
) -> tuple[Any, Any, Any, int]:
    """Result of an Allan `kernel`; for samples of phase (`angle`), variances over m², which are those of mean rates."""
    variance, *rest = kernel(samples, m, angle)
    return (variance / m**2 if angle else variance, *rest)


def _family_kernel(name: str) -> Any:
    """Compiled kernel with this name: a function of samples, averaging factors and a flag for phase samples."""
    return partial(_kernels.family_variance, name)


def _time_factor(scale: float, tau: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
    """Factor from a modified deviation of the samples to a time deviation, shape (k,): `scale`·τ/√3."""
    return scale * tau / np.sqrt(3.0)


oadev = _uncorrected_estimator(
    "σ²(m τ0) = 1/(2 τ² M) Σ_k (θ[k+2m] − 2 θ[k+m] + θ[k])², all M = L − 2m of them.",
    "91.229 85.953",
    name="oadev",
    title="overlapping Allan deviation",
    source="NIST SP 1065 eq. 11",
    use=Entry(10, "overlapping Allan deviation; for sensors and clocks"),
    choice=Entry(10, "Overlapping Allan"),
    symbol="σ_y(τ)",
    allan=True,
    kernel=partial(_allan_of_samples, _kernels.overlapping_allan),
    most=lambda points: (points - 1) // 2,
    terms=lambda m, points: points - 2 * m,
    edf=bias.allan_edf,
)
adev = _uncorrected_estimator(
    "Uses adjacent averages, not overlapping ones.",
    " 91.229 115.808",
    name="adev",
    title="Allan deviation",
    source="NIST SP 1065 eq. 9",
    use=NO_OVERLAP,
    choice=Entry(20, "Allan (non-overlapping)"),
    symbol="σ_y(τ)",
    allan=True,
    kernel=partial(_allan_of_samples, _kernels.adjacent_allan),
    most=lambda points: (points - 1) // 2,
    terms=lambda m, points: -((2 * m - points) // m),
    edf=lambda alpha, m, count, points: bias.allan_edf(alpha, m, count, points, stride=m),
)
mdev = _uncorrected_estimator(
    "Distinguishes white from flicker phase noise.",
    "91.229 74.788",
    name="mdev",
    title="modified Allan deviation",
    source="NIST SP 1065 eq. 14",
    use=Entry(20, "modified Allan deviation; separates white PM from flicker PM"),
    choice=Entry(30, "Modified Allan"),
    symbol="Mod σ_y(τ)",
    most=lambda points: points // 3,
    terms=lambda m, points: points - 3 * m + 1,
    edf=bias.modified_edf,
)
hdev = _uncorrected_estimator(
    "Uses adjacent averages, not overlapping ones. Not sensitive to a drift of the rate.",
    " 70.806 116.798",
    name="hdev",
    title="Hadamard deviation",
    source="NIST SP 1065 eq. 18",
    use=NO_OVERLAP,
    choice=Entry(60, "Hadamard"),
    symbol="Hadamard σ_y(τ)",
    most=lambda points: (points - 1) // 3,
    terms=lambda m, points: -((3 * m - points) // m),
    edf=lambda alpha, m, count, points: bias.hadamard_edf(alpha, m, count, points, stride=m),
)
ohdev = _uncorrected_estimator(
    "Not sensitive to a drift of the rate.",
    "70.806 85.615",
    name="ohdev",
    title="overlapping Hadamard deviation",
    source="NIST SP 1065 eq. 20",
    use=Entry(50, "overlapping Hadamard deviation; ignores a linear drift"),
    choice=Entry(50, "Overlapping Hadamard"),
    symbol="Hadamard σ_y(τ)",
    most=lambda points: (points - 1) // 3,
    terms=lambda m, points: points - 3 * m,
    edf=bias.hadamard_edf,
)
tdev = _uncorrected_estimator(
    "τ/√3 times the modified Allan deviation.",
    "52.671 86.358",
    name="tdev",
    title="time deviation",
    source="NIST SP 1065 eq. 16",
    use=Entry(30, "time deviation, for the time error of clocks and masks"),
    choice=Entry(40, "Time (TDEV)"),
    symbol="σ_x(τ)",
    kernel=_family_kernel("mdev"),
    most=lambda points: points // 3,
    terms=lambda m, points: points - 3 * m + 1,
    edf=bias.modified_edf,
    gain=_time_factor,
)
totdev = _corrected_estimator(
    "Of the record reflected at its ends. The published bias of flicker and random-walk FM is 1 − a τ/T in\n"
    "    variance, up to half of the record.",
    "91.229 93.904",
    name="totdev",
    title="total deviation",
    source="NIST SP 1065 eq. 25",
    use=Entry(70, "total deviation; long τ of a short log"),
    choice=Entry(70, "Total"),
    symbol="σ_y(τ), total",
    most=lambda points: points - 1,
    terms=lambda m, points: np.full_like(m, points - 2),
    edf=bias.total_edf,
    bias=bias.total_bias,
)
pdev = _uncorrected_estimator(
    "Uses slopes fitted to the phase. The interval uses the degrees of freedom of `mdev`, which are fewer.",
    "91.229 87.605",
    name="pdev",
    title="parabolic deviation",
    source="Vernotte et al. 2016 eq. 9",
    use=Entry(60, "parabolic deviation; for counters that fit lines to the phase"),
    choice=Entry(80, "Parabolic"),
    most=lambda points: (points - 1) // 2,
    terms=lambda m, points: points - 2 * m,
    edf=bias.modified_edf,
)
mtotdev = _corrected_estimator(
    "The published bias is 0.73 of white FM in variance; Stable32 1.60 keeps it, which is the default here. O(n).",
    "64.509 64.794",
    name="mtotdev",
    title="modified total deviation",
    source="NIST SP 1065 eq. 27",
    use=OTHER_TOTALS,
    most=lambda points: points // 3,
    terms=lambda m, points: points - 3 * m + 1,
    edf=bias.modified_total_edf,
    bias=bias.modified_total_bias,
    unbiased=False,
)
ttotdev = _corrected_estimator(
    "τ/√3 times the modified total deviation; its bias is kept by default, too.",
    "37.244 74.818",
    name="ttotdev",
    title="time total deviation",
    source="NIST SP 1065 eq. 28",
    use=OTHER_TOTALS,
    kernel=_family_kernel("mtotdev"),
    most=lambda points: points // 3,
    terms=lambda m, points: points - 3 * m + 1,
    edf=bias.modified_total_edf,
    bias=bias.modified_total_bias,
    unbiased=False,
    gain=_time_factor,
)
htotdev = _corrected_estimator(
    "At m = 1 the overlapping Hadamard deviation. The published bias at m > 1 is 0.995 of white FM in variance. O(n).",
    "70.806 91.164",
    name="htotdev",
    title="Hadamard total deviation",
    source="NIST SP 1065 eq. 29",
    use=OTHER_TOTALS,
    most=lambda points: (points - 1) // 3,
    terms=lambda m, points: points - 3 * m,
    edf=bias.hadamard_total_edf,
    bias=bias.hadamard_total_bias,
)
# The functions of these two estimators choose their own averaging times, see `theo.py`.
THEO1 = _register_estimator(
    name="theo1",
    title="Theo1 deviation",
    source="NIST SP 1065 eq. 30",
    use=Entry(90, "τ up to three quarters of the log"),
    kernel=_family_kernel("theo1"),
    most=lambda points: points - 1,
    terms=lambda m, points: points - m,
    edf=bias.theo1_edf,
)
THEOH = replace(THEO1, name="theoh", title="TheoH deviation", source="NIST SP 1065 eq. 33")
ESTIMATORS[THEOH.name] = THEOH
tierms = _uncorrected_estimator(
    "Root mean square change of the phase in τ beyond the mean rate.",
    " 95.202 135.47 ",
    name="tierms",
    title="root mean square time interval error",
    source="ITU-T G.810",
    use=Entry(41, INTERVAL_ERROR),
    most=lambda points: points - 1,
    terms=lambda m, points: points - m,
    gain=lambda scale, tau, rate: scale / rate,
)
mtie = _uncorrected_estimator(
    "Largest range of the phase within τ.",
    "144.889 262.778",
    name="mtie",
    title="maximum time interval error",
    source="ITU-T G.810",
    use=Entry(40, INTERVAL_ERROR),
    most=lambda points: points - 1,
    terms=lambda m, points: points - m,
    gain=lambda scale, tau, rate: scale / rate,
)

#: Estimator that other modules use.
OADEV = ESTIMATORS["oadev"]
