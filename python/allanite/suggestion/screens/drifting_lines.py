"""Screen of drifting lines: lines whose frequency changes, searched in bands with excess power.

A line that drifts by many cycles over the record is a flat-topped band. The search for lines sees nothing that stands
out, and a resonance describes the band without its phase. Multiplied by a chirp of the right rate it is a line again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import CATALOG, Deterministic, Stochastic
from allanite.fit.engine import solve
from allanite.fit.likelihood.peaks import has_all_ordinates
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.fit.rivals.line_trials import line_trials
from allanite.fit.shapes.deterministic import design_of, regress
from allanite.fit.shapes.drifting import (
    MAX_BAND_FREQUENCIES,
    MAX_EXHAUSTIVE_FREQUENCIES,
    Band,
    band_about,
    ordinates_of_drift,
    polished_line,
)
from allanite.suggestion.constants import (
    MAIN_SHARE,
    MAX_ORDINATE_POWER,
    MIN_DELTA_LOGL_OVER_SIMPLER,
)
from allanite.suggestion.p_values import (
    Family,
    log_p_value,
    may_become_significant,
    min_significant_score,
)
from allanite.suggestion.screens._screen import Candidate, Context, Screen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: Widths of the bands whose mean power is compared with the model, in ordinates.
WIDTHS = (64, 256, 1024, 4096, 16384, 32768, 65536)


def bands_with_excess(context: Context) -> tuple[Band, ...]:
    """Tuple of `Band` (complex series of a frequency band), one for each band that may hold a drifting or switched line.

    Empty for a summary, which keeps only the lowest ordinates, or if more than 10 % of the samples are missing.
    """
    solution, data = context.solution, context.data
    if not has_all_ordinates(data):
        return ()
    noise = solution.noise(data)
    return tuple(
        band_about(low, high, solution.ordinates, noise, data)
        for low, high in _bands_to_search(context.found["spectral"], data, context.white)
    )


def look(context: Context) -> tuple[Candidate, ...]:
    """Tuple with the best drifting line of each kind, as a refitted `Candidate`, if it explains more than steady lines."""
    solution, data, lines = context.solution, context.data, context.found["lines"]
    bands = context.shared(bands_with_excess)
    blanks = blanks_of_screen("drifting line", solution, data)
    found = (_best_candidate(blank, bands, lines, solution, data) for blank in blanks if bands)
    return tuple(c for c in found if c is not None)


SCREEN = Screen(
    "drifting lines",
    "lines whose frequency changes: all rates of change in bands with excess power",
    "frequency",
    look,
    after=("spectral", "lines"),
    needs_samples=True,
    searches=lambda _: 0,
)


def blanks_of_screen(screened: str, solution: Solution, data: Data) -> list[Deterministic]:
    """List of functions of time without values whose `Effect.screened` is `screened` and that the model may get."""
    return [
        blank
        for cls in CATALOG
        if cls.screened == screened and issubclass(cls, Deterministic)
        for blank in cls.candidates(solution.model, data.covariates)
    ]


def solved_with(
    effect: Deterministic, solution: Solution, data: Data
) -> tuple[Solution, Deterministic, float]:
    """Tuple (solution, fitted effect, ΔlogL): the model refitted with the drifting line or tone burst `effect`.

    ΔlogL is that of the ordinates near the line, given the noise of the new model, but at most the rise of logL of the
    whole fit.
    """
    # With the noise of the old model the line would count as discrepancy.
    refitted = solve(data, solution.model + effect, like=solution, polish=False, rounds=3)
    last = refitted.model.deterministic[-1]
    j = ordinates_of_drift(last, data)
    matrix = design_of((last,), data, j).matrix
    gain = regress(matrix, solution.ordinates[j], refitted.noise(data).variance(j)).gain
    return refitted, last, min(gain, refitted.log_likelihood - solution.log_likelihood)


def _bands_to_search(
    spectral: tuple[Candidate, ...], data: Data, white: NDArray[np.float64]
) -> Iterator[tuple[float, float]]:
    """Iterator over (low, high), Hz: the frequency bands that are searched for drifting lines.

    * All frequencies, if the record has at most 131072 ordinates.
    * For each of several widths from 64 to 65536 ordinates, the band with the most power. Its excess over the model must
      be significant (1 %) and more than twice that of its neighbors.
    * The band of the resonance candidate with the largest ΔlogL, if this is above 3 and the band is narrower than
      65536/T. T is the length of the record.
    """
    whole = white.size <= 2 * MAX_BAND_FREQUENCIES
    if whole:
        yield 1.0 / data.duration, 0.5 * data.rate - 1.0 / data.duration
    total = np.square(white)
    total[0] = 0.0
    np.cumsum(np.minimum(total, MAX_ORDINATE_POWER, out=total), out=total)
    for width in WIDTHS:
        if whole and width > MAX_EXHAUSTIVE_FREQUENCIES:
            continue
        if width < MAIN_SHARE * total.size:
            mean = (total[width:] - total[:-width]) / width
            top = int(np.argmax(mean))
            above = float(mean[top]) - 1.0
            # If the neighbors are as high, the excess is wider and is searched at another width.
            neighbors = np.mean(mean[[max(0, top - width), min(mean.size - 1, top + width)]]) - 1.0
            if (
                above * np.sqrt(0.5 * width) > min_significant_score(total.size / width)
                and neighbors < MAIN_SHARE * above
            ):
                yield (top + 1) / (2.0 * data.duration), (top + width) / (2.0 * data.duration)
    resonances = [
        c
        for c in spectral
        if isinstance(c.effect, Stochastic)
        and c.effect.occupies is not None
        and c.gain > MAX_RIVAL_LOG_EVIDENCE
    ]
    for one in sorted(resonances, key=lambda c: -c.gain)[:1]:
        assert one.effect.occupies is not None
        low, high = one.effect.occupies
        # Lines that drift farther than this width are not searched.
        if (high - low) * data.duration < MAX_BAND_FREQUENCIES:
            yield low, high


def _best_candidate(
    blank: Deterministic,
    bands: tuple[Band, ...],
    lines: tuple[Candidate, ...],
    solution: Solution,
    data: Data,
) -> Candidate | None:
    """Refitted `Candidate` of the best drifting line of one kind over all `bands`; or None.

    None if its ΔlogL is less than 8 above that of the best steady line in `lines`, or if the line drifts by less than one
    cycle per record over the record.
    """
    noise, T = solution.noise(data), data.duration
    steady = max((c.gain for c in lines), default=0.0)
    tried = [(band, band.search()) for band in bands]
    band, (middle, drift, _) = max(tried, key=lambda one: one[1][2])
    middle, drift, search_gain = band.polished(middle, drift)
    # In a band that moves, chance lines are as strong as the band.
    loud = band.relative_noise(middle, drift)
    search_gain /= loud
    # A drift by less than one cycle over the record, its resolution, is a steady line.
    if search_gain < steady + MIN_DELTA_LOGL_OVER_SIMPLER or abs(drift) < 1.0:
        return None
    frequency = (middle - drift * (0.5 + data.start / T)) / T
    # Conservative: as if every frequency had been searched at every rate of drift.
    family = Family("line", width=line_trials(data.n) * band.trials)
    if frequency <= 0.0:
        return None
    effect = blank.with_values(frequency=frequency, drift=drift / T**2)
    effect, search_gain = polished_line(effect, solution.ordinates, noise, data)
    if not may_become_significant(family, search_gain / loud):
        return None
    refitted, last, gain = solved_with(effect, solution, data)
    gain /= loud
    if gain < steady + MIN_DELTA_LOGL_OVER_SIMPLER:
        return None
    return Candidate(last, gain, family, refitted, 4, log_p_value=log_p_value(family, gain))
