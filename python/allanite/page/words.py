"""Names of the fields of the page for remedies in error messages."""

from __future__ import annotations

WORDS = {
    "rate": "the rate",
    "this_rate": "the rate {} Hz and no time column",
    "unit": "the unit",
    "model": "the model",
    "this_unit": "the unit {}",
    "quantity": "the quantity {}",
    "column": "the list of columns",
    "covariate": "the column of temperature",
    "logged": "the list of logged columns",
    "piece": "another segment",
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
