"""Constants that decide which effects are suggested and which the search adds, drops or replaces.

Each comment gives the unit, what is compared with the constant, and the basis of its value. "Judgment" means chosen by
judgment; not measured. "Ablation: no change" means that 21 searches end with equal models with half and with twice the
value (docs/ablation.md). Grids of shapes and sizes of arrays are defined where they are used. Three limits are defined in
`allanite.fit`: `MAX_RIVAL_LOG_EVIDENCE`, the score within which two models cannot be distinguished (screens ignore a
smaller ΔlogL), `MAX_POLISH_DELTA_LOGL`, the most that the optimization of shapes adds to logL, and `MAINS_TOLERANCE`, the
largest relative error of a mains frequency.
"""

from __future__ import annotations

import numpy as np

# Errors of a whole check.

#: Unit: probability. False-alarm probability of all suggestions of one check together.
#: Basis: definition; 0.75–1 % of the null records of the statistical tests raise an alarm.
FALSE_ALARM_PROBABILITY = 0.01

# Order of the suggestions.

#: Unit: 1. Overdispersion of the spectrum above which a change of the noise level goes before all other suggestions.
#: Basis: judgment; a tenth of the record seven times as loud otherwise raised two to four false suggestions.
MIN_OVERDISPERSION_LEVEL_FIRST = 1.1
#: Unit: fraction. A candidate is explained by another effect if less of its power or evidence remains with that effect.
#: Outliers or a change of level go first if the other scores are below this part of theirs. A function of time leaves with
#: an excluded segment if less of its energy lies elsewhere. A disturbance in a band that has a narrow peak at other
#: times counts with this part of its power ratio.
#: Basis: judgment; the order is needed for a phase that wraps at the range of its counter.
MAX_EXPLAINED_REMAINDER = 0.1
#: Unit: samples. Minimum mean number of outliers per cluster with which outliers count as clustered and may go first.
#: Basis: judgment.
MIN_OUTLIERS_PER_CLUSTER = 4
#: Unit: nats. Minimum ΔlogL of separate octave levels in the segment of a disturbance that must remain under every other
#: event in time, for the disturbance to go first.
#: Basis: derivation; a dozen octaves, ½χ²₁ each, together exceed it once in 200 records.
MIN_DISTURBANCE_DELTA_LOGL = 14.0

# Used by several screens and moves.

#: Unit: fraction. A cause accounts for a change if at least this part of the change or of the evidence is due to it.
#: Two suggestions explain the same misfit if this part of the gains of one is also gained by the other.
#: Basis: definition; the larger part. Ablation: no change.
MAIN_SHARE = 0.5
#: Unit: periods. Fewest periods of a line in the record, of a tone burst, and of a level that changes periodically.
#: Basis: judgment; with fewer periods it is a drift, or a few waves of a slow process. Ablation: no change.
MIN_PERIODS = 4
#: Unit: samples. Shortest segment that is described as an event, a stuck value or a spectrum; shorter ones are outliers.
#: Basis: judgment. Ablation: no change.
MIN_SEGMENT_SAMPLES = 16
#: Unit: ordinates. Fewest ordinates whose mean power is compared with a level, and fewest spectra that are averaged.
#: Basis: derivation; the standard error of the mean power of 8 ordinates is half of the mean. Ablation: no change.
MIN_ORDINATES = 8
#: Unit: values. Fewest values of the power over time from which its usual level is estimated.
#: Basis: derivation; the standard error of the mean power of 64 values is 18 % of the mean. Ablation: no change.
MIN_POWER_VALUES = 64
#: Unit: events. Most events that one effect describes, and most lines among which an evenly spaced comb is searched.
#: Basis: judgment. Ablation: no change.
MAX_EVENTS = 32

# Random processes and filters.

#: Unit: nats. ΔlogL by which a richer form must beat the simpler one: a drifting line or a tone burst a steady line, a
#: wandering line a pure one, a filter with a noise floor a filter without, two lines that beat once a narrow band. It is
#: also the height of a harmonic above ln of the number of frequencies searched for it, and the ΔlogL of a Gauss-Markov
#: process from which two levels are searched.
#: Basis: derivation; e⁻⁸, a false-alarm probability of 3 in 10 000 for each line. Judgment for the other forms.
#: Ablation: no change.
MIN_DELTA_LOGL_OVER_SIMPLER = 8.0
#: Unit: effects. Number of best plain forms of an effect from which a richer form is made. Also the number of second
#: effects that are tried if the first one alone raises an error.
#: Basis: judgment. Ablation: with half, one of 21 searches ends otherwise.
MAX_FORMS_TRIED = 8
#: Unit: designs. Best designs of a filter whose shapes are optimized.
#: Basis: judgment.
MAX_DESIGNS_POLISHED = 3
#: Unit: points. Grid points of a resonance or a notch from which the likelihood is maximized.
#: Basis: judgment.
MAX_NARROW_POINTS_CLIMBED = 60
#: Unit: 1. Other designs of a filter are tried with shapes up to this factor above and below those of the present design.
#: Basis: judgment.
MAX_SHAPE_RATIO = 2.0

# Lines and narrow bands.

#: Unit: lines. Most lines that are refitted in one check.
#: Basis: judgment.
MAX_LINES_REFITTED = 12
#: Unit: nats. Peaks of the periodogram below this height are not refitted.
#: Basis: derivation; the search of 100 samples reaches this height by chance.
MIN_LINE_PEAK = 6.0
#: Unit: 1. Highest harmonic of a line or of a narrow band that is searched.
#: Basis: judgment.
MAX_LINE_HARMONIC = 12
#: Unit: 1. Highest harmonic that the strongest line of a short comb may be.
#: Basis: judgment.
MAX_FUNDAMENTAL_DIVISOR = 3
#: Unit: 1. Highest harmonic of a train of pulses that is searched.
#: Basis: judgment.
MAX_PULSE_HARMONIC = 64
#: Unit: fraction. Part of the places of a comb at which a line must stand out.
#: Basis: judgment; none of 50 sets of 20 random places is a comb.
MIN_COMB_FRACTION = 0.6
#: Unit: lines. Fewest lines of an evenly spaced comb.
#: Basis: judgment; none of 50 sets of 20 random places is a comb.
MIN_SPACED_LINES = 5
#: Unit: expected power. A single ordinate counts at most this much in the mean power of a band.
#: Basis: judgment; with 12, strong lines that drift by 2.5 or 4 cycles are not found
#: (tests/python/unit/effects/test_drifting_line.py).
MAX_ORDINATE_POWER = 20.0

# Bands that move.

#: Unit: sections. Most sections of the record in which a band is located.
#: Basis: judgment.
MAX_BAND_SECTIONS = 64
#: Unit: sections. Fewest sections of the record in which a band is located.
#: Basis: judgment.
MIN_BAND_SECTIONS = 8

# Burst noise.

#: Unit: ordinates. Fewest ordinates in which the Gauss-Markov process exceeds the other noise.
#: Basis: judgment.
MIN_BURST_NOISE_ORDINATES = 32
#: Unit: nats. Cost of the two levels in ΔlogL; with lower log odds, a Gauss-Markov process explains the record better.
#: Basis: simulation; 157 Gauss-Markov records of ΔlogL 12 to 70 stay below −2.6, median −50. Markov's inequality does
#: not give the error rate: four parameters of the chain are optimized first, which adds about 2.
MIN_BURST_NOISE_LOG_ODDS = float(np.log(1000.0))

# Slow functions and events.

#: Unit: fraction. Part of its gain that a richer slow function may add when the noise is refitted.
#: Basis: simulation of 400 weak events (benches/decisions/chosen_values.py forms): it leaves out 538 of 863 forms, and 2
#: of the 138 that are significant.
MAX_NOISE_REFIT_FRACTION = 0.05
#: Unit: samples. In longer events a few samples cannot make up the change, so their tails are not examined.
#: Basis: judgment; 4 of 60 records of t(5) noise had a false short event.
MAX_SHORT_EVENT_SAMPLES = 4096
#: Unit: fraction of the record. Largest standard error of the time of a step; a step known less well is not suggested.
#: Basis: judgment.
MAX_STEP_TIME_ERROR = 0.02

# Changes of the noise level.

#: Unit: cells. Cells of the record between which a level may change before its times are refined; an interval has at
#: least the length of one cell, and outliers closer than one cell form one cluster.
#: Basis: judgment; the clusters are needed for a tap that had been called a resonance.
LEVEL_CELLS = 256
#: Unit: fraction of the record. Minimum length of the interval of a change of a band's level, and of the time outside it.
#: Basis: judgment; a shorter ringing is a disturbance. Without this limit, one of three taps is named a louder band.
MIN_BAND_LEVEL_FRACTION = 1.0 / 64.0

# Outliers and disturbances.

#: Unit: probability. False-alarm probability, per record, of outliers among the first and last samples.
#: Basis: judgment.
END_OUTLIER_PROBABILITY = 0.001
#: Unit: samples. Inner neighbors with which a sample near an end of the record is compared.
#: Basis: judgment.
END_NEIGHBORS = 9
#: Unit: fraction of the record. Most samples that outliers or one disturbance exclude.
#: Basis: judgment.
MAX_EXCLUDED_FRACTION = 0.2
#: Unit: probability. Largest false-alarm probability at which a segment is excluded.
#: Basis: judgment.
MAX_EXCLUSION_PROBABILITY = 1e-6
#: Unit: 1. Minimum power of a disturbance in some band, relative to the power of the band at other times.
#: Basis: judgment; 116 of 120 disturbances of twice the noise are found, none in 600 records without one.
MIN_DISTURBANCE_POWER_RATIO = 2.0
#: Unit: 1/√ordinates. Excess of a band over both neighbors, relative to them, from which the band has a narrow peak.
#: Basis: judgment.
MIN_NARROW_PEAK = 8.0
#: Unit: fraction. Maximum part of equal neighboring samples elsewhere in the record with which a stuck value is searched.
#: Basis: judgment.
MAX_EQUAL_NEIGHBOR_FRACTION = 0.1
#: Unit: periods. Periods of the middle of a band in the window that finds the ends of a disturbance.
#: Basis: judgment.
WINDOW_PERIODS = 8
#: Unit: 1. Maximum power of a window, relative to the usual power, with which it does not belong to the disturbance.
#: Basis: with 2, a strong shaking of one minute seems longer than it is (`test_disturbances.py`).
MAX_QUIET_POWER_RATIO = 4.0
#: Unit: 1. Minimum power of a disturbance, relative to the usual power, with which its octave rings beyond its ends.
#: Basis: judgment.
MIN_RINGING_POWER_RATIO = 100.0

# Limits of the search.

#: Unit: s. Default processor time of a search, independent of the record.
#: Basis: judgment.
DEFAULT_SECONDS = 60.0
#: Unit: s per sample. Default processor time of a search for each sample.
#: Basis: judgment.
DEFAULT_SECONDS_PER_SAMPLE = 1e-5
#: Unit: steps. Default maximum number of effects that a search adds. The score ends a search, not this limit.
#: Basis: judgment.
MAX_ADDED_EFFECTS = 32

# Acceptance of a step.

#: Unit: nats. Smallest score of a significant suggestion, and smallest rise of the score for which effects are dropped or
#: replaced. A process whose best grid point gains less is not refitted, and an effect of the initial model that explains
#: less is dropped.
#: Basis: derivation; the mean ΔlogL of one parameter of an effect that is absent, ½χ²₁. With 0.05, searches replace an
#: effect of a complete model in 15 instead of 8 of 96 records (benches/decisions/benchmark.py, nulls).
MIN_SCORE_GAIN = 0.5
#: Unit: expected scatter. Allan errors, and their rises on a step, beyond this multiple are a fault of the model.
#: Basis: simulation; of 200 true models each, 3 (white noise), 2 (with a random walk) and 0 (with flicker) exceed it.
MAX_ALLAN_ERROR_SCATTERS = 2.0
#: Unit: log10 of the p-value. An event with a larger p-value is refused if it raises an Allan error beyond its scatter, and
#: is not added from a check of another spectrum.
#: Basis: judgment.
MAX_EVENT_LOG10_P = -4.0

# Dropping and replacing effects.

#: Unit: cycles in the record. A line closer to a band may be part of the band.
#: Basis: judgment.
MAX_LINE_BAND_DISTANCE = 10.0
#: Unit: 1. Two overlapping bands whose widths have a smaller ratio are one band.
#: Basis: judgment.
MAX_BAND_WIDTH_RATIO = 3.0
#: Unit: cycles in the record. Closer lines may be one line that wanders.
#: Basis: judgment.
MAX_WANDERING_LINE_DISTANCE = 3.0
#: Unit: half-widths of the band. Smallest distance of a side band.
#: Basis: judgment.
MIN_SIDE_BAND_HALF_WIDTHS = 6.0
#: Unit: fraction of the frequency of the band. Largest distance of a side band.
#: Basis: judgment.
MAX_SIDE_BAND_FRACTION = 0.5
#: Unit: intervals. Maximum number of louder intervals that stay separate effects; more are merged into one effect.
#: Basis: judgment.
MAX_SEPARATE_LEVEL_INTERVALS = 2
