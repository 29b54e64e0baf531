"""Names of options in error messages: the library's name of a remedy → the option of the command line."""

from __future__ import annotations

#: Name of a remedy → option; ``{}`` stands for the suggested value.
WORDS = {
    "rate": "--rate HZ",
    "this_rate": "--rate {}!",
    "model": "--model",
    "unit": "--unit UNIT",
    "this_unit": "--unit {}",
    "quantity": "--quantity {}",
    "column": "--column",
    "covariate": "--covariate NAME",
    "logged": "--covariate",
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
    "find": "--find EFFECT",
    "know": "--know NAME",
    "tell": "--tell A,B",
}


def words_of(trim: str | None) -> dict[str, str]:
    """Dict that translates placeholders of error messages to command-line options, such as ``rate`` to ``--rate HZ``.

    After --trim (`trim`), ``this_span`` (a proposed part of the log) becomes --trim without times: times found in the
    trimmed record are not those of the log.
    """
    return WORDS if trim is None else {**WORDS, "this_span": WORDS["trim"]}
