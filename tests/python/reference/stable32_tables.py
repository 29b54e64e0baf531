"""Stable32's tables as the tests of allantoolkit hold them: what a table says, and which of its rows are ours."""

from __future__ import annotations

import gzip
import inspect
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

import allanite as al
from allanite.deviation import bias

#: What Stable32 calls a deviation → ours, and the column of its tables that holds it, from the end.
KINDS = {
    "Allan": [("adev", -2)],
    "Overlapping Allan": [("oadev", -2)],
    "Modified Allan": [("mdev", -2)],
    "Overlapping and Modified Allan": [("oadev", -2), ("mdev", -1)],
    "Time": [("tdev", -2)],
    "Hadamard": [("hdev", -2)],
    "Overlapping Hadamard": [("ohdev", -2)],
    "Total": [("totdev", -2)],
    "Modified Total": [("mtotdev", -2)],
    "Time Total": [("ttotdev", -2)],
    "Hadamard Total": [("htotdev", -2)],
    "Thêo1": [("theo1", -2)],
    "ThêoH": [("oadev", 4), ("theo1", 5)],
    "TIE rms": [("tierms", -1)],
    "MTIE": [("mtie", -1)],
}
#: Samples of a table, where its own first lines name a file of another name.
SAMPLES = {
    "5071A_phase": "Cs5071A/5071A_phase.txt.gz",
    "tic_ch1_ch2_2015-03-23": "Keysight53230A_ti_noise_floor/tic_phase.txt",
    "freq_data": "Sr87/freq/freq_data.txt",
    "phase_data": "Sr87/phase/phase_data.txt",
    "phase0_data": "Sr87/phase0/phase0_data.txt",
    "gps_1pps_phase_data": "gps/gps_1pps_phase_data.txt.gz",
    "ocxo_frequency": "ocxo/ocxo_frequency.txt",
    "ocxo_frequency0": "ocxo/ocxo_frequency0.txt",
    "PHASE": "phasedat/PHASE.DAT",
    "pink_frequency": "pink_frequency/pink_frequency.txt",
    "pinknoise_frequency": "pink_frequency/pink_frequency.txt",
}


class Table(NamedTuple):
    """A table of one file of Stable32."""

    kind: str
    samples: str
    quantity: str
    rows: np.ndarray


def table_of(path):
    """Table of a file; None without a row."""
    lines = [
        line.lstrip("# ").rstrip()
        for line in path.read_text(encoding="utf-8", errors="replace").splitlines()
    ]
    head = "\n".join(lines)
    kind = re.search(r"Sigma Type: (.+)", head)
    numbers = [line.split() for line in lines if re.match(r"\d+ +\d\.\d+e", line)]
    if kind is None or not numbers:
        return None
    samples = Path(re.search(r"STATISTICS FOR FILE: (\S+)", head)[1]).stem
    quantity = {"Phase": "angle", "Frequency": "rate"}[re.search(r"(\w+) Data Points", head)[1]]
    return Table(kind[1].strip(), samples, quantity, np.array(numbers, dtype=float))


def samples_of(path):
    """The last column of numbers; comments begin with #."""
    with (gzip.open if path.suffix == ".gz" else open)(path, "rt", encoding="latin-1") as file:
        lines = [line.split() for line in file if re.match(r"\s*[-+\d.]", line)]
    x = np.array([line[-1] for line in lines], dtype=float)
    # A frequency of some 10 MHz: what deviates is its share.
    return x / 1e7 - 1 if x.mean() > 1e6 else x


def ours(name, samples, table, factors):
    """Our deviation without correction of bias (NaN where we have none), and its number of differences."""
    # The averaging time that is printed of Theo1 is the effective one.
    share = 0.75 if table.kind == "Thêo1" else 1.0
    options = {"rate": share * table.rows[0, 0] / table.rows[0, 1], "quantity": table.quantity}
    if "unbiased" in inspect.signature(getattr(al, name)).parameters:
        options["unbiased"] = False
    found = getattr(al, name)(samples, factors=factors, **options)
    values = zip(found.deviation, found.n, strict=True)
    known = dict(zip(found.factors.tolist(), values, strict=True))
    return np.array([known.get(k, (np.nan, np.nan)) for k in factors.tolist()], dtype=float).T


def close(deviation, printed, digits=0.5):
    """True if a number rounds to the five printed digits, or is at most so many of the last digit away."""
    digit = 10.0 ** (np.floor(np.log10(printed)) - 4)
    return np.abs(deviation - printed) <= digits * digit * (1 + 1e-6)


def _theo1_ratio(samples, table):
    """Allan variance over Theo1, averaged over all pairs of NIST SP 1065's TheoBR; `allanite.theoh` uses 30 of them."""
    pairs = np.arange(samples.size // 6 - 3 + 1)
    allan = al.oadev(samples, quantity=table.quantity, factors=9 + 3 * pairs).deviation
    theo1 = al.theo1(samples, quantity=table.quantity, factors=12 + 4 * pairs).deviation
    return np.mean((allan / theo1) ** 2)


def unbiased(name, deviation, samples, table, factors):
    """A deviation corrected for the bias that Stable32 corrects: that of the power law that the row prints."""
    if name == "theo1":
        return deviation * np.sqrt(_theo1_ratio(samples, table))
    points = samples.size
    published = {"totdev": _total, "htotdev": bias.hadamard_total_bias}
    of = published.get(name, bias.modified_total_bias)
    rows = zip(table.rows[:, 3].astype(int), factors.tolist(), strict=True)
    return deviation / np.sqrt([of(alpha, m, points) for alpha, m in rows])


def _total(alpha, m, points):
    # Stable32 takes the number of phases for the record's length, allanite the intervals between them.
    return bias.total_bias(alpha, m, points + 1)


def classes(name, column, samples, table):
    """Class of every row: as printed, within one of the last digit, after correction of Stable32's bias, or other."""
    factors = table.rows[:, 0].astype(int)
    printed = table.rows[:, column]
    if table.kind == "ThêoH":
        # Short averaging times of ThêoH are those of another deviation, in another column.
        there = printed > 0
        table = table._replace(rows=table.rows[there])
        factors, printed = factors[there], printed[there]
    deviation, n = ours(name, samples, table, factors)
    found = np.full(printed.size, "other", dtype=object)
    if name in {"totdev", "mtotdev", "ttotdev", "htotdev", "theo1"}:
        again = unbiased(name, deviation, samples, table, factors)
        found[close(again, printed, 1.0)] = "bias"
    found[close(deviation, printed, 1.0)] = "digit"
    found[close(deviation, printed)] = "printed"
    # Many terms are printed to five digits too.
    return found, np.abs(n - table.rows[:, 2]) <= 5e-5 * table.rows[:, 2]
