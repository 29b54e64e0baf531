"""What the options of the command line are called in a remedy."""

from __future__ import annotations

__all__ = ["WORDS"]

WORDS = {
    "rate": "--rate HZ",
    "model": "--model",
    "unit": "--unit UNIT",
    "this_unit": "--unit {}",
    "quantity": "--quantity {}",
    "column": "--column",
    "piece": "--piece",
    "topic": "--topic NAME",
    "time_column": "--time-column",
    "to": "--output-unit UNIT",
    "decimate": "--decimate {}",
    "trim": "--trim START:END",
    "this_span": "--trim {}",
    "quiet": "--trim quiet",
}
