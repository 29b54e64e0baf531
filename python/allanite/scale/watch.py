"""Does the model still hold? A test that may be looked at at any time.

Samples come in segments; the squared cosine ordinates of each, over what the model expects, are independent χ²₁ while it
holds. For each of some hundred alternatives (more or less power in a band, from some segment on) the likelihood ratio is a
bet against the model; the capital, shared among alternatives and starts, is a martingale. Under the model it ever reaches
1/α with a chance of at most α (Ville 1939; Shafer & Vovk 2019; Ramdas et al. 2023), however long the run is and whenever
one looks.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.errors import InputError, about
from allanite.common.files import whole_file
from allanite.common.validation import positive_rate
from allanite.effects import Model, Periodic
from allanite.fit.likelihood.data import density
from allanite.summary import Summary
from allanite.summary.stretch import Stretch

if TYPE_CHECKING:
    from allanite.effects import Effect

__all__ = ["Alarm", "Watch"]

Array = NDArray[np.float64]
#: Samples of a segment.
SEGMENT = 1024
#: Chance of a false alarm in the whole run.
FALSE = 0.01
#: Deviation within which the model is taken to hold, relative: fitted numbers are not known better.
TOLERANCE = 0.01
#: Power over the model's that is bet on: in octaves and at all frequencies, and in narrow bands.
RATIOS = (0.25, 0.5, 0.7, 0.85, 0.95, 1.05, 1.2, 1.5, 2.0, 4.0)
NARROW = (1.5, 3.0, 10.0)
#: Ordinates of a narrow band.
WIDTH = 8


@dataclass(frozen=True, slots=True)
class Alarm:
    """The model does not hold any more.

    Attributes
    ----------
    time_s : float
        When that was clear, from the first sample.
    since_s : float
        When it began, most likely.
    low_hz, high_hz : float
        Where the power differs most.
    ratio : float
        Power over the model's there, since then.
    e_value : float
        By how much the capital has grown; without a change it ever reaches that with a chance of at most its reciprocal.
    """

    time_s: float
    since_s: float
    low_hz: float
    high_hz: float
    ratio: float
    e_value: float

    def to_dict(self) -> dict[str, float]:
        """JSON form."""
        return asdict(self)

    def __str__(self) -> str:
        return (
            f"the model does not hold since {self.since_s:.5g} s: at {self.low_hz:.3g}–{self.high_hz:.3g} Hz the power is"
            f" {self.ratio:.3g} × the model's (clear at {self.time_s:.5g} s, e = {self.e_value:.2g})"
        )


class Watch:
    """A sensor under watch: samples in, an alarm where the model does not hold any more, constant memory.

    Parameters
    ----------
    model : Model or Effect
        With values.
    rate : float
        Hz.
    unit : str
        Of the samples.
    tolerance : float
        Relative deviation of the noise within which the model is taken to hold.

    Attributes
    ----------
    alarm : Alarm or None

    Raises
    ------
    InputError
        A model without values.

    References
    ----------
    Ville, J. (1939). Étude critique de la notion de collectif. Paris: a test that may be looked at all the time.
    Ramdas, A. et al. (2023). Game-theoretic statistics and safe anytime-valid inference. Statistical Science 38, 576.

    Examples
    --------
    >>> model = al.AngleRandomWalk(N=0.1)
    >>> watch = al.Watch(model, rate=100.0)
    >>> watch.update(model.simulate(duration=100, rate=100, seed=1).samples)
    >>> watch.alarm is None
    True
    >>> watch.save("watch.json")

    Later, in another process, the noise has doubled:

    >>> watch = al.Watch(model, rate=100.0)
    >>> watch.restore("watch.json")
    >>> alarm = watch.update(2 * model.simulate(duration=100, rate=100, seed=2).samples)
    >>> 80 < alarm.since_s < 120, watch.to_dict()["alarm"] is not None
    (True, True)
    >>> print(watch.prometheus().splitlines()[0])
    # HELP allanite_samples_total Samples taken
    """

    def __init__(
        self, model: Model | Effect, rate: float, unit: str = "1", tolerance: float = TOLERANCE
    ) -> None:
        if not isinstance(model, Model):
            model = Model((model,))
        self.model, self.rate, self.unit = model, positive_rate(rate), unit
        self.tolerance = tolerance
        for effect in model.stochastic:
            if getattr(effect, effect.coefficient) is None:
                raise InputError(
                    f"{effect.kind}.{effect.coefficient} has no value: give a fitted model"
                )
        terms = model.terms(self.rate, (0.0, SEGMENT / self.rate))
        j = np.arange(1, SEGMENT, dtype=np.int64)
        self._expected = density(terms, j, SEGMENT)
        self._used = np.ones(j.size, dtype=bool)
        for line in (e for e in model if isinstance(e, Periodic)):
            for multiple, _, _ in line.lines:
                at = 2.0 * SEGMENT * multiple * (line.frequency or 0.0) / self.rate
                self._used &= np.abs(j - at) > 6.0
        self._bands, self._ratios = _alternatives()
        self._freedom = np.array(
            [np.count_nonzero(self._used[a - 1 : b - 1]) for a, b in self._bands]
        )
        self.segments = 0
        self.taken = 0
        self.alarm: Alarm | None = None
        self._stretch = Stretch.begun(0, 1, 0, self.rate, (unit,))
        count = self._ratios.size
        #: Capital of each alternative that is at stake, in logarithms, and what was never bet.
        self._stake = np.full(count, -np.inf)
        self._kept = 1.0
        #: Of the best start of each alternative: its logarithm, segment, and power since.
        self._best = np.full(count, -np.inf)
        self._since = np.zeros(count)
        self._power = np.zeros(count)
        self._rest = np.zeros(0)

    @property
    def summary(self) -> Summary | None:
        """Of all samples so far: what a new fit needs."""
        if self.taken == 0:
            return None
        return Summary(self.rate, (self.unit,), ("x",), (), {}, None, (self._stretch.copy(),))

    @property
    def e_value(self) -> float:
        """The capital: 1 at the start, rarely much more while the model holds."""
        return float(self._kept + np.exp(np.minimum(self._stake, 700.0)).mean())

    def update(self, chunk: Any) -> Alarm | None:
        """Take the next samples, a `chunk` of shape (n,); returns the alarm if it is raised by them."""
        x = np.asarray(chunk, dtype=np.float64).ravel()
        if x.size == 0:
            return None
        self._stretch.update([x])
        self.taken += x.size
        before = self.alarm
        joined = np.concatenate([self._rest, x])
        count = joined.size // SEGMENT
        for segment in joined[: count * SEGMENT].reshape(count, SEGMENT):
            self._bet(np.ascontiguousarray(segment))
        self._rest = joined[count * SEGMENT :].copy()
        return self.alarm if before is None else None

    def _bet(self, segment: Array) -> None:
        self.segments += 1
        if np.isnan(segment).any():
            return
        z = _kernels.cosine_transform(segment)[1:] ** 2 / self._expected
        total = np.concatenate([[0.0], np.cumsum(np.where(self._used, z, 0.0))])
        power = total[self._bands[:, 1] - 1] - total[self._bands[:, 0] - 1]
        # Against the nearest power that still counts as the model's.
        null = np.where(
            self._ratios > 1.0, (1.0 + self.tolerance) ** 2, (1.0 - self.tolerance) ** 2
        )
        gain = 0.5 * self._freedom * np.log(null / self._ratios)
        gain += 0.5 * power * (1.0 / null - 1.0 / self._ratios)
        # A share of the capital is bet at each start; all shares together are 1.
        share = _share(self.segments)
        self._kept -= share
        self._stake = np.logaddexp(self._stake, np.log(share)) + gain
        fresh = self._best < np.log(share)
        self._since[fresh], self._power[fresh] = self.segments - 1, 0.0
        self._best = np.maximum(self._best, np.log(share)) + gain
        self._power += power
        if self.alarm is None and self.e_value >= 1.0 / FALSE:
            self._raise()

    def _raise(self) -> None:
        top = int(np.argmax(self._best))
        low, high = self._bands[top]
        hz = self.rate / (2.0 * SEGMENT)
        freedom = self._freedom[top] * (self.segments - self._since[top])
        seconds = SEGMENT / self.rate
        self.alarm = Alarm(
            self.segments * seconds,
            float(self._since[top]) * seconds,
            float(low * hz),
            float(high * hz),
            float(self._power[top] / max(freedom, 1.0)),
            self.e_value,
        )

    def to_dict(self) -> dict[str, Any]:
        """One line of the log: samples, time, e-value and the alarm."""
        return {
            "schema": "allanite/watch/1",
            "samples": self.taken,
            "time_s": self.taken / self.rate,
            "segments": self.segments,
            "e_value": self.e_value,
            "holds": self.alarm is None,
            "alarm": None if self.alarm is None else self.alarm.to_dict(),
        }

    def prometheus(self) -> str:
        """The same in the text format of Prometheus."""
        numbers = {
            "samples_total": ("counter", "Samples taken", self.taken),
            "segments_total": ("counter", "Segments judged", self.segments),
            "e_value": ("gauge", "Evidence against the model", self.e_value),
            "model_holds": ("gauge", "1 while the model holds", int(self.alarm is None)),
        }
        return "".join(
            f"# HELP allanite_{name} {text}\n# TYPE allanite_{name} {kind}\nallanite_{name} {value:g}\n"
            for name, (kind, text, value) in numbers.items()
        )

    # -- restarts --------------------------------------------------------------------------------

    def save(self, path: str | Path) -> None:
        """Write the state to `path`, and the summary of the samples beside it (``.summary``)."""
        state = {
            "schema": "allanite/watch-state/1",
            "model": str(self.model),
            "rate": self.rate,
            "segments": self.segments,
            "taken": self.taken,
            "kept": self._kept,
            "alarm": None if self.alarm is None else self.alarm.to_dict(),
            **{name: getattr(self, f"_{name}").tolist() for name in _ARRAYS},
        }
        summary = self.summary
        with whole_file(path) as draft:
            draft.write_text(json.dumps(state), encoding="utf-8")
            if summary is not None:
                summary.save(_beside(Path(path)))

    def restore(self, path: str | Path) -> None:
        """Go on from a state that `save` has written to `path`.

        Raises
        ------
        InputError
            No such file, not a saved watch, or one of another model or rate.
        """
        source = Path(path)
        with about(source):
            try:
                state = json.loads(source.read_text(encoding="utf-8"))
                if state["schema"] != "allanite/watch-state/1":
                    raise InputError(f"{state['schema']} is no state of a watch")
            except FileNotFoundError:
                raise InputError("no such file") from None
            except OSError as error:
                raise InputError(f"cannot be read ({error.strerror or error})") from None
            except (ValueError, KeyError, TypeError):
                raise InputError("damaged, or no state of a watch") from None
            if (state["model"], state["rate"]) != (str(self.model), self.rate):
                raise InputError(
                    f"saved for model {state['model']} at {state['rate']:g} Hz: use another state file"
                )
            self.segments, self.taken, self._kept = state["segments"], state["taken"], state["kept"]
            self.alarm = None if state["alarm"] is None else Alarm(**state["alarm"])
            for name in _ARRAYS:
                setattr(self, f"_{name}", np.array(state[name], dtype=np.float64))
            if _beside(source).is_file():
                self._stretch = Summary.load(_beside(source)).stretches[0]


_ARRAYS = ("stake", "best", "since", "power", "rest")


def _beside(path: Path) -> Path:
    return path.with_name(path.name + ".summary")


def _share(segment: int) -> float:
    """Part of the capital that is bet on a change at a segment, from 1; the sum over all is 1."""
    # Telescoping: of 1/ln(e + k − 1) what is lost at each step.
    return float(1.0 / np.log(math.e + segment - 1.0) - 1.0 / np.log(math.e + segment))


def _alternatives() -> tuple[NDArray[np.int64], Array]:
    """First and last ordinate of each band that is bet on, shape (bets, 2), and the power ratio of each."""
    octaves = [(1 << k, min(2 << k, SEGMENT)) for k in range(SEGMENT.bit_length() - 1)]
    wide = [(1, SEGMENT), (SEGMENT // 8, SEGMENT), (1, 4), *octaves]
    narrow = [(j, min(j + WIDTH, SEGMENT)) for j in range(8, SEGMENT - 1, WIDTH)]
    bets = [(band, ratio) for band in wide for ratio in RATIOS]
    bets += [(band, ratio) for band in narrow for ratio in NARROW]
    return (
        np.array([band for band, _ in bets], dtype=np.int64),
        np.array([ratio for _, ratio in bets]),
    )
