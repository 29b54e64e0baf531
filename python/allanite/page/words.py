"""What the fields of the page are called in a remedy."""

from __future__ import annotations

__all__ = ["WORDS"]

WORDS = {
    "rate": "the rate",
    "this_rate": "the rate {} Hz and no time column",
    "unit": "the unit",
    "model": "the model",
    "this_unit": "the unit {}",
    "quantity": "the quantity {}",
    "column": "the column",
    "covariate": "the column of temperature",
    "piece": "another piece",
    "topic": "the topic",
    "time_column": "the time column",
    "to": "another unit",
    "decimate": "averaging {} samples",
    "trim": "trimming",
    "this_span": "trimming to {} s",
    "quiet": "trimming to it",
    "scale": "the scale of the data sheet",
    "anyway": "the log as it is",
    "record_length": "the length of the record",
}
