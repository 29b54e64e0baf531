"""What the options of the command line are called in a remedy."""

from __future__ import annotations

__all__ = ["WORDS", "words_of"]

WORDS = {
    "rate": "--rate HZ",
    "this_rate": "--rate {}!",
    "model": "--model",
    "unit": "--unit UNIT",
    "this_unit": "--unit {}",
    "quantity": "--quantity {}",
    "column": "--column",
    "covariate": "--covariate NAME",
    "piece": "--piece",
    "topic": "--topic NAME",
    "time_column": "--time-column",
    "to": "--output-unit UNIT",
    "decimate": "--decimate {}",
    "trim": "--trim START:END",
    "this_span": "--trim {}",
    "quiet": "--trim quiet",
    "scale": "--scale NAME=FACTOR",
    "anyway": "--anyway",
    "record_length": "--record-length SECONDS",
}


def words_of(trim: str | None) -> dict[str, str]:
    """The same for a log of which a part is used: its seconds are not those that --trim takes."""
    return WORDS if trim is None else {**WORDS, "this_span": WORDS["trim"]}
