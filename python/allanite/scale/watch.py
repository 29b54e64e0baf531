"""Watch: sequential test whether a model still holds, valid at any time.

`Bets` test the model on segments: short segments for every change, long segments for weak lines, whose power they
concentrate in few ordinates. While the model holds, the capital of each length is a supermartingale of its own segments.
The probability that a capital ever reaches c is at most 1/c (Ville 1939; Shafer & Vovk 2019; Ramdas et al. 2023), for any
duration and any stopping time. The mean of both capitals is no martingale, because a long segment overlaps several short
ones. Each capital therefore has its own limit, and the probabilities add.
"""

from __future__ import annotations

import json
import math
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import fields_dict, invalid_as_input_error, json_of
from allanite.common.errors import InputError, about
from allanite.common.files import whole_file
from allanite.common.validation import positive_rate, require_quantity
from allanite.effects import as_model
from allanite.scale.bets import Bets
from allanite.summary import Summary
from allanite.summary.stream_segment import StreamSegment

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from allanite.effects import Effect, Model

#: Number of samples of a short segment, and number of short segments in a long one.
SEGMENT, SEGMENTS_IN_LONG = 1024, 8
#: Shares of the initial capital on short and on long segments.
CAPITAL_SHARES = (0.75, 0.25)
#: Maximum probability of a false alarm in a run of any length.
FALSE_ALARM_PROBABILITY = 0.01
#: Default relative deviation of the noise within which the model holds: fits are not more accurate.
DEFAULT_TOLERANCE = 0.01
#: Samples are clipped at this value in the summary, so that sums of fourth powers do not overflow.
MAX_SUMMARY_SAMPLE = 1e60
#: Schema of a state file.
SCHEMA = "allanite/watch-state/3"


@dataclass(frozen=True, slots=True)
class Alarm:
    """Alarm of a watch: when and at which frequencies the samples contradict the model.

    `time_s` counts from the first sample; `since_s` is the most likely time of the change. The power differs most from
    `low_hz` to `high_hz`, where it is `ratio` times the model's since the change. While the model holds, the probability
    that the `e_value` ever reaches c is at most 1/c.
    """

    time_s: float
    since_s: float
    low_hz: float
    high_hz: float
    ratio: float
    e_value: float

    def to_dict(self) -> dict[str, float]:
        """Dict for JSON: all attributes by name."""
        return fields_dict(self)

    def __str__(self) -> str:
        return (
            f"the model does not hold since {self.since_s:.5g} s: at {self.low_hz:.3g}–{self.high_hz:.3g} Hz the power is"
            f" {self.ratio:.3g} × the model's (clear at {self.time_s:.5g} s, e = {self.e_value:.2g})"
        )


class Watch:
    """Sequential test of a sensor's model in constant memory: `update` adds samples and returns an alarm, if any.

    Parameters
    ----------
    model : Model, Effect or str
        Model with values.
    rate : float
        Hz.
    unit : str
        Unit of the samples.
    tolerance : float
        Relative deviation of the noise within which the model holds.
    quantity : {"rate", "increment", "angle"}
        Quantity of the samples: the rate, its integral over one sample, or its integral from the start (the phase of a
        clock).

    Attributes
    ----------
    alarm : Alarm or None
    position : dict or None
        Position in the source, saved with the state; `Watch` does not use it.

    Raises
    ------
    InputError
        A model without values.

    Notes
    -----
    The samples need not be normal. The bets are valid for independent whitened samples of any distribution with a
    variance, such as heavy-tailed, rounded or contaminated ones.

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
    >>> watch.interrupt()  # the samples in between are not known
    >>> alarm = watch.update(2 * model.simulate(duration=100, rate=100, seed=2).samples)
    >>> 80 < alarm.since_s < 120, watch.to_dict()["alarm"] is not None
    (True, True)
    >>> print(watch.prometheus().splitlines()[0])
    # HELP allanite_samples_total Samples taken
    """

    def __init__(
        self,
        model: Model | Effect | str,
        rate: float,
        unit: str = "1",
        tolerance: float = DEFAULT_TOLERANCE,
        quantity: str = "rate",
    ) -> None:
        model = as_model(model)
        require_quantity(quantity)
        self.quantity = quantity
        #: Last angle; the next angle minus this one, times the rate, is the next sample.
        self._angle: float | None = None
        self.model, self.rate, self.unit = model, positive_rate(rate), unit
        self.tolerance = tolerance
        self._bets = tuple(
            Bets(model, self.rate, SEGMENT * many, tolerance, lines=many > 1)
            for many in (1, SEGMENTS_IN_LONG)
        )
        self.taken = 0
        self.alarm: Alarm | None = None
        self.position: dict[str, Any] | None = None
        self._segment = StreamSegment.empty(0, 1, 0, self.rate, (unit,))
        #: Samples of the long segment that is not yet complete.
        self._pending = np.zeros(0)

    @property
    def segments(self) -> int:
        """Number of complete segments of 1024 samples so far, including those with missing samples."""
        return self._bets[0].segments

    @property
    def summary(self) -> Summary | None:
        """`Summary` of all samples so far, which can be fitted; None before the first sample."""
        if self._segment.stop == self._segment.start:
            return None
        return Summary(self.rate, (self.unit,), ("x",), (), {}, None, (deepcopy(self._segment),))

    @property
    def e_value(self) -> float:
        """Evidence against the model: the larger of two capitals, of the bets on short and of those on long segments.

        The capitals are 0.75 and 0.25 at the start. If the model holds, the probability that the evidence ever reaches 100
        is at most 1 %.
        """
        return max(self._capitals())

    def _capitals(self) -> list[float]:
        """List of two floats: capital of the bets on short and on long segments, 0.75 and 0.25 at the start."""
        return [part * bets.capital for part, bets in zip(CAPITAL_SHARES, self._bets, strict=True)]

    def update(self, chunk: ArrayLike) -> Alarm | None:
        """Add the next samples; returns the alarm if these samples raise it, else None (also after an earlier alarm).

        The alarm is raised once, when the evidence reaches 100. Only complete segments of 1024 samples are tested.

        Parameters
        ----------
        chunk : array_like, shape (n,)
            Samples; missing ones are NaN.

        Raises
        ------
        InputError
            Infinite samples; nothing of the chunk is added.
        """
        x = np.asarray(chunk, dtype=np.float64).ravel()
        if x.size == 0:
            return None
        infinite = np.isinf(x)
        if infinite.any():
            place = self.taken + int(np.argmax(infinite)) + 1
            raise InputError(f"sample {place} is infinite: mark missing samples with NaN")
        angle = float(x[-1])
        if self.quantity == "increment":
            x = x * self.rate
        elif self.quantity == "angle":
            angles = x if self._angle is None else np.concatenate([[self._angle], x])
            x = np.diff(angles) * self.rate
        # The summary may already have some of these samples, if a watch was killed between writing its two files.
        fresh = x[max(0, self._segment.stop - self.taken) :]
        if fresh.size:
            self._segment.update([np.clip(fresh, -MAX_SUMMARY_SAMPLE, MAX_SUMMARY_SAMPLE)])
        self.taken += x.size
        if self.quantity == "angle":
            self._angle = angle
        before = self.alarm
        joined = np.concatenate([self._pending, x])
        tested = self._pending.size // SEGMENT * SEGMENT
        for end in range(tested + SEGMENT, joined.size + 1, SEGMENT):
            for bets in self._bets:
                if end % bets.segment == 0:
                    bets.bet_on(joined[end - bets.segment : end])
            if self.alarm is None and self.e_value >= 1.0 / FALSE_ALARM_PROBABILITY:
                self.alarm = self._alarm_of_best_bet()
        whole = SEGMENT * SEGMENTS_IN_LONG
        self._pending = joined[joined.size // whole * whole :].copy()
        return self.alarm if before is None else None

    def interrupt(self) -> None:
        """Mark a break before the next sample: the short segment that is not yet complete counts as missing samples."""
        self._pending[self._pending.size // SEGMENT * SEGMENT :] = np.nan
        if self._angle is not None:
            self._angle = np.nan

    def _alarm_of_best_bet(self) -> Alarm:
        """`Alarm` at the end of the last tested segment, from the best bet of the larger capital."""
        bets = self._bets[int(np.argmax(self._capitals()))]
        low, high, ratio, since = bets.best_bet()
        hz, seconds = self.rate / (2.0 * bets.segment), bets.segment / self.rate
        end = self.segments * SEGMENT / self.rate
        return Alarm(end, since * seconds, low * hz, high * hz, ratio, self.e_value)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/watch/1``: samples, time_s, segments, e_value, holds and alarm."""
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
        """Text for Prometheus: counters and gauges of samples, segments, evidence and alarm."""
        numbers = {
            "samples_total": ("counter", "Samples taken", self.taken),
            "segments_total": ("counter", "Segments judged", self.segments),
            "e_value": ("gauge", "Evidence against the model", self.e_value),
            "model_holds": ("gauge", "1 while the model holds", int(self.alarm is None)),
        }
        return "".join(
            f"# HELP allanite_{name} {text}\n# TYPE allanite_{name} {kind}\nallanite_{name} {value!r}\n"
            for name, (kind, text, value) in numbers.items()
        )

    # -- restarts --------------------------------------------------------------------------------

    def save(self, path: str | Path) -> None:
        """Write the state to `path`, and the summary of the samples (if any) to a file next to it (``.summary``).

        Both replace existing files.
        """
        state = {
            "schema": SCHEMA,
            "model": str(self.model),
            "rate": self.rate,
            "taken": self.taken,
            "alarm": None if self.alarm is None else self.alarm.to_dict(),
            "position": self.position,
            "angle": None if self._angle is None or math.isnan(self._angle) else self._angle,
            # JSON has no NaN.
            "rest": [None if math.isnan(x) else x for x in self._pending.tolist()],
            "bets": [bets.state() for bets in self._bets],
        }
        summary = self.summary
        with whole_file(path) as draft:
            draft.write_text(json.dumps(state, allow_nan=False), encoding="utf-8")
            if summary is not None:
                summary.save(_summary_path(Path(path)))

    def restore(self, path: str | Path) -> None:
        """Set the watch to the state that `save` has written to `path`.

        Raises
        ------
        InputError
            No such file, not a saved watch, or one of another model or rate.
        """
        source = Path(path)
        with about(source):
            state = json_of(source)
            with invalid_as_input_error("damaged, or no state of a watch"):
                self._restore_state(state)
            if _summary_path(source).is_file():
                self._segment = Summary.load(_summary_path(source)).stretches[0]
            else:
                self._segment = StreamSegment.empty(self.taken, 1, 0, self.rate, (self.unit,))

    def _restore_state(self, state: dict[str, Any]) -> None:
        """Set the watch to the parsed state of a file; `InputError` for one of another model or rate.

        For a damaged state, `InputError` or an exception such as `KeyError`.
        """
        if state["schema"] != SCHEMA:
            raise InputError(f"{state['schema']}, and this is {SCHEMA}: use another state file")
        if (state["model"], state["rate"]) != (str(self.model), self.rate):
            raise InputError(
                f"saved for model {state['model']} at {state['rate']:g} Hz: use another state file"
            )
        for bets, saved in zip(self._bets, state["bets"], strict=True):
            bets.restore(saved)
        taken, rest = int(state["taken"]), np.array(state["rest"], dtype=np.float64)
        position = state["position"]
        unknown = position is not None and not isinstance(position, dict)
        # None becomes NaN in `rest`.
        if unknown or not 0 <= taken < 2**63 or rest.ndim != 1 or np.isinf(rest).any():
            raise InputError("damaged, or no state of a watch")
        self.taken, self._pending = taken, rest
        self.position = position
        if self.quantity == "angle":
            last = state.get("angle")
            self._angle = math.nan if last is None else float(last)
        self.alarm = None if state["alarm"] is None else Alarm(**state["alarm"])


def _summary_path(path: Path) -> Path:
    """Path of the summary of a state file, in the same folder: ``watch.json.summary``."""
    return path.with_name(path.name + ".summary")
