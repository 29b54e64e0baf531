"""Hooks of effects that only fits and searches use; each has a default that suits most effects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from allanite.common.former import Former
from allanite.effects._declared import Array, Columns, names_of

if TYPE_CHECKING:
    from allanite.effects._base import Effect
    from allanite.effects.model import Model


class SearchHooks:
    """Optional declarations and methods of an effect, by which fits and searches choose what to try; a base of `Effect`.

    Examples
    --------
    The results of most effects:

    >>> lag = al.GaussMarkov(q_c=0.01, correlation_time=30.0)
    >>> len(lag.candidates(al.parse_model("N"), {})), len(lag.variants()), lag.extended(), lag.equal_forms()
    (1, 1, (), ())
    >>> lag.seen_in(np.ones(100), 10.0), lag.shape_error("q_c", 1e-4, 1000.0)
    ((), None)
    >>> al.effects.HighPass(cutoff=1.0).shows(al.parse_model("N(N=1)+HP(f=1,order=1)"), 100.0, 600.0)
    True
    """

    if TYPE_CHECKING:
        # Declared by `Effect`.
        kind: ClassVar[str]
        single: ClassVar[bool]

        def with_values(self, **values: Any) -> Self:
            """See `Effect.with_values`."""

    #: Kinds that exclude this effect: if the model has one of them, a check does not suggest this effect. An effect that
    #: follows a column is excluded only by effects of the same column.
    one_of: ClassVar[tuple[str, ...]] = ()
    #: Kind whose search also finds this effect; empty if a check tries the effect itself.
    found_with: ClassVar[str] = ""
    #: Label used when an effect of several items (levels, excursions) is extended by more; empty for other effects.
    further: ClassVar[str] = ""
    #: True if the bias leaves its level and returns at a second edge, once or several times (`Deterministic.singly`).
    returns: ClassVar[bool] = False
    #: True if the effect only describes a spectrum; two standard effects that explain as much are preferred.
    last_resort: ClassVar[bool] = False
    #: True if the effect has no physical name; it is used only if no other effect explains the record.
    nameless: ClassVar[bool] = False

    @classmethod
    def candidates(cls, model: Model, columns: Columns) -> tuple[Self, ...]:
        """Tuple of effects of this kind that a check tries to add to a fitted `model`; empty if the model must not get one.

        By default it contains one effect without values, or, if the kind has a ``column``, one for each logged column that
        is not constant. With `single`, the model must not contain the kind already; otherwise it must not contain a kind of
        `one_of`. For kinds with a ``column``, this concerns effects of the same column only. Empty if `found_with` is set.
        `columns` are the logged columns by name.
        """
        if cls.found_with:
            return ()
        kinds = (cls.kind,) if cls.single else cls.one_of
        used = {e.follows for e in model if e.kind in kinds}
        if "column" not in names_of(cls):
            return () if used else (cls(),)
        varying = (name for name, values in columns.items() if float(np.ptp(values)) > 0.0)
        return tuple(cls().with_values(column=name) for name in varying if name not in used)

    def variants(self) -> tuple[Self, ...]:
        """Forms of this effect to try, e.g. filter designs, with the values that are set; by default only the effect."""
        return (self,)

    def extended(self) -> tuple[Effect, ...]:
        """Tuple of effects with more parameters that a search tries instead of this one; by default empty.

        A search tries them if a misfit remains, and starts from the fitted values.
        """
        return ()

    otherwise = Former("equal_forms")

    def equal_forms(self) -> tuple[Effect, ...]:
        """Tuple of other forms of the effect with the same number of parameters; by default empty.

        A search tries each form, starting from the fitted values.
        """
        return ()

    @classmethod
    def seen_in(cls, power: Array, rate: float) -> tuple[Self, ...]:
        """Tuple of effects of this kind with values read from a spectrum, which a fit tries in addition to the grid.

        By default empty. `power` are the squared coefficients of the cosine transform of n samples at `rate` Hz, raw or
        relative to the model, shape (n,).
        """
        return ()

    def shape_error(self, name: str, variance: float, duration: float) -> float | None:
        """Standard error of the shape parameter `name`, in its unit, if its likelihood is not smooth; otherwise None.

        By default None: Fisher information is used. `variance` is the variance of the first amplitude, `duration` the
        duration of the record, s.
        """
        return None

    def shows(self, model: Model, rate: float, duration: float) -> bool:
        """True if the fitted effect, the last of `model`, differs visibly from a simpler effect; by default always True.

        A notch, for example, must show the rise of the density above its center. The record has a `duration` in s and a
        sampling `rate` in Hz.
        """
        return True


class ProcessSearchHooks:
    """Optional methods of a random process, by which fits and searches make further effects; a base of `Stochastic`.

    Examples
    --------
    >>> print(al.effects.BurstNoise.like(al.GaussMarkov(q_c=1.0, correlation_time=2.0)))
    RTS(amplitude=1, dwell_time=4)
    >>> pieces = al.effects.Unexplained.pieces(10_000, 100.0)  # of which a fit puts this effect together
    >>> len(pieces), al.effects.Unexplained.joined(pieces[:2], [1.0, 3.0]).rms
    (24, 2.0)
    >>> print(al.effects.Resonance(rms=0.1).banded(9.9, 10.1), al.Quantization().banded(9.9, 10.1))
    RES(frequency=10, damping=0.01, rms=0.1) None
    >>> band = al.effects.Resonance(frequency=10.0, damping=0.01, rms=0.1)
    >>> print(al.effects.ModulatedVibration.like(band, modulation=2.0, depth=0.5), al.Quantization.like(band))
    MOD(frequency=10, damping=0.01, rms=0.106066, modulation=2, depth=0.5) None
    """

    modulating = Former(
        "like", lambda cls, band, rate, depth: cls.like(band, modulation=rate, depth=depth)
    )

    @classmethod
    def like(cls, other: Effect, **values: Any) -> Self | None:
        """Effect of this kind with the shape parameters of the effect `other` and further `values` by JSON name.

        None if this kind cannot take over the shape of `other`, or if the names in `values` are not exactly the further
        parameters of this kind. The base class returns None.
        """
        return None

    @classmethod
    def pieces(cls, n: int, rate: float) -> tuple[Self, ...]:
        """Tuple of narrow-band effects of this kind whose sum can describe any spectrum; by default empty.

        A fit of n samples at `rate` Hz chooses some of them, and `joined` builds one effect from these.
        """
        return ()

    @classmethod
    def joined(cls, pieces: Sequence[Self], variances: Sequence[float]) -> Self:
        """One effect whose spectrum is the sum of `pieces`, each with its squared coefficient in `variances`.

        Only kinds that define `Stochastic.pieces` (narrow-band effects) define it.
        """
        raise NotImplementedError

    @property
    def unsteady(self) -> tuple[float, float] | None:
        """Pair (low, high) of the frequencies, Hz, at which the power changes over time because the process wanders there.

        None (default) for processes that are equally loud at all times.
        """
        return None

    def banded(self, low: float, high: float) -> Self | None:
        """Copy with its band moved to `low` … `high` Hz; by default None: the effect has no movable band."""
        return None
