"""Ablation of the search: what each move, veto and constant changes on the small set of records.

    python benches/decisions/ablation.py RESULT.json [--part cases|sets|effects|nulls] [--records FOLDER] [--only NAME ...]
    python benches/decisions/ablation.py RESULT.json --table docs/ablation.md

A first search of each record notes which moves and vetoes acted, and which comparisons with a constant would differ if the
constant were half or twice as large. Only on these records can a search with the move switched off, or the constant
changed, end otherwise; only these are searched again. The result file is written after each search, and a repeated run
continues.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import small_set

from allanite.suggestion import constants

STEPS = "allanite.study.steps"
RANKING = "allanite.suggestion.ranking"
SCORE = "allanite.fit.rivals.score"
ADD = "allanite.study.moves.add"


def _none(*_: Any) -> None:
    """Return nothing."""


def _nothing(*_: Any) -> tuple[()]:
    return ()


def _no(*_: Any) -> bool:
    return False


def _yes(*_: Any) -> bool:
    return True


def _zero(*_: Any) -> float:
    return 0.0


def _second(*given: Any) -> Any:
    return given[1]


def _some(_: Any, found: Any) -> bool:
    return found is not None


def _true(_: Any, found: Any) -> bool:
    return bool(found)


def _false(_: Any, found: Any) -> bool:
    return not found


def _other(given: Any, found: Any) -> bool:
    return found is not given[1]


def _promising(_: Any, found: Any) -> bool:
    return any(promised > 0.0 for promised, *_ in found)


#: Name of a move, veto or rule → (module, function, what replaces it, whether a call acted).
SWITCHES: dict[str, tuple[str, str, Callable[..., Any], Callable[[Any, Any], bool]]] = {
    "add: a second effect, if the first alone raises an error": (
        STEPS,
        "with_second_effect",
        _none,
        _some,
    ),
    "add: of a line and a band at one frequency only one stays": (
        ADD,
        "is_same_feature",
        _no,
        _true,
    ),
    "add: effects inside an excluded segment leave": (ADD, "lies_mostly_within", _no, _true),
    "drop": (STEPS, "without_needless", _none, _some),
    "replace": (STEPS, "models_with_replacement", _nothing, _promising),
    "split": ("allanite.fit.rivals.pairs", "alternative_pairs", _nothing, _true),
    "merge: a stack becomes a nameless shape": (STEPS, "with_nameless_shape", _none, _some),
    "merge: lines become a wandering line": (STEPS, "with_wandering_line", _none, _some),
    "merge: excursions": (STEPS, "with_merged_excursions", _none, _some),
    "merge: levels": (STEPS, "must_merge_levels", _no, _true),
    "merge: harmonics and side bands": (STEPS, "with_harmonics_or_side_bands", _second, _other),
    "veto: an error rises": (STEPS, "no_error_rises", _yes, _false),
    "veto: unseen data are predicted worse": (STEPS, "predicts_as_well", _yes, _false),
    "veto: a doubtful event": (STEPS, "is_doubtful_event", _no, _true),
    "veto: a step whose time is unknown": (STEPS, "has_known_time", _yes, _false),
    "further steps from one check": ("allanite.study.search", "further_steps", _nothing, _true),
    "rank: segments that nothing else explains go first": (
        RANKING,
        "disturbance_goes_first",
        _no,
        _true,
    ),
    "rank: outliers that nothing else explains go first": (
        RANKING,
        "outliers_go_first",
        _no,
        _true,
    ),
    "rank: a level change far ahead goes first": (RANKING, "is_far_ahead", _no, _true),
    "score: priors": (SCORE, "prior", _zero, _true),
    "score: priors of replacements": (SCORE, "replacing_prior", _zero, _true),
}
CONSTANTS = {
    name: value
    for name, value in vars(constants).items()
    if name.isupper() and isinstance(value, int | float)
}
#: Limits of time and steps, whose change only ends a search earlier or later.
LIMITS = {"DEFAULT_SECONDS", "DEFAULT_SECONDS_PER_SAMPLE", "MAX_ADDED_EFFECTS"}


class Traced(float):
    """A constant that notes when half or twice its value would change the result of a comparison."""

    name: str
    low: float
    high: float
    noted: set[str]

    @classmethod
    def of(cls, name: str, values: tuple[float, float, float], noted: set[str]) -> Traced:
        """Return a number with its value at half and at twice the constant."""
        new = cls(values[0])
        new.name, new.low, new.high, new.noted = name, values[1], values[2], noted
        return new

    def _compared(self, other: Any, how: Callable[[Any, Any], Any]) -> Any:
        one = float(other) if isinstance(other, float | int) else other
        found = how(float(self), one)
        if any(np.any(how(value, one) != found) for value in (self.low, self.high)):
            self.noted.add(self.name)
        return found

    def _combined(self, other: Any, how: Callable[[Any, Any], Any]) -> Any:
        if not isinstance(other, float | int | np.number):
            self.noted.add(self.name)
            return how(float(self), other)
        three = [how(value, float(other)) for value in (float(self), self.low, self.high)]
        return Traced.of(self.name, (three[0], three[1], three[2]), self.noted)

    def __lt__(self, other: Any) -> Any:
        return self._compared(other, lambda a, b: a < b)

    def __le__(self, other: Any) -> Any:
        return self._compared(other, lambda a, b: a <= b)

    def __gt__(self, other: Any) -> Any:
        return self._compared(other, lambda a, b: a > b)

    def __ge__(self, other: Any) -> Any:
        return self._compared(other, lambda a, b: a >= b)

    def __neg__(self) -> Traced:
        return Traced.of(self.name, (-float(self), -self.low, -self.high), self.noted)

    def __add__(self, other: Any) -> Any:
        return self._combined(other, lambda a, b: a + b)

    def __sub__(self, other: Any) -> Any:
        return self._combined(other, lambda a, b: a - b)

    def __rsub__(self, other: Any) -> Any:
        return self._combined(other, lambda a, b: b - a)

    def __mul__(self, other: Any) -> Any:
        return self._combined(other, lambda a, b: a * b)

    def __truediv__(self, other: Any) -> Any:
        return self._combined(other, lambda a, b: a / b)

    def __rtruediv__(self, other: Any) -> Any:
        return self._combined(other, lambda a, b: b / a)

    def __pow__(self, other: Any, _: None = None) -> Any:
        return self._combined(other, lambda a, b: a**b)

    __radd__, __rmul__ = __add__, __mul__
    __hash__ = float.__hash__

    def __eq__(self, other: object) -> bool:
        return float(self) == other

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Compare with arrays as with numbers; any other use of a constant in an array is noted."""
        plain = [float(x) if isinstance(x, Traced) else x for x in inputs]
        found = getattr(ufunc, method)(*plain, **options)
        for value in (self.low, self.high):
            tried = [value if x is self else p for x, p in zip(inputs, plain, strict=True)]
            if not np.array_equal(getattr(ufunc, method)(*tried, **options), found):
                self.noted.add(self.name)
        return found


@contextmanager
def replaced(name: str, old: Any, new: Any) -> Iterator[None]:
    """Replace a function or a constant for a while in all modules that imported it."""
    modules = [module for key, module in list(sys.modules.items()) if key.startswith("allanite")]
    places = [module for module in modules if vars(module).get(name) is old]
    for module in places:
        setattr(module, name, new)
    try:
        yield
    finally:
        for module in places:
            setattr(module, name, old)


def _switched(name: str, new: Callable[..., Any] | None = None) -> Any:
    """Return a context in which a switch is off, or its function is another one."""
    module, attribute, neutral, _ = SWITCHES[name]
    old = getattr(importlib.import_module(module), attribute)
    return replaced(attribute, old, neutral if new is None else new)


@contextmanager
def traced(noted: set[str]) -> Iterator[None]:
    """Note which switches act, and which constants decide, in `noted`."""
    from contextlib import ExitStack

    def watched(name: str, function: Callable[..., Any], acted: Any) -> Callable[..., Any]:
        def call(*given: Any) -> Any:
            found = function(*given)
            if isinstance(found, Iterator):
                found = list(found)
            if acted(given, found):
                noted.add(name)
            return found

        return call

    with ExitStack() as stack:
        for name, (module, attribute, _, acted) in SWITCHES.items():
            function = getattr(importlib.import_module(module), attribute)
            stack.enter_context(_switched(name, watched(name, function, acted)))
        for name, value in CONSTANTS.items():
            if isinstance(value, float):
                new = Traced.of(name, (value, *_half_and_twice(name)), noted)
                stack.enter_context(replaced(name, value, new))
        yield


def _changed(name: str) -> list[tuple[str, Any]]:
    """Return the changes of a switch or a constant: label and context manager."""
    if name in SWITCHES:
        return [("off", _switched(name))]
    value = CONSTANTS[name]
    kind = type(value)
    return [
        (label, replaced(name, value, kind(new)))
        for label, new in zip(("half", "twice"), _half_and_twice(name), strict=True)
    ]


def _half_and_twice(name: str) -> tuple[float, float]:
    """Return half and twice the value of a constant; a fraction is at most 1."""
    value = CONSTANTS[name]
    twice = 2.0 * value
    return 0.5 * value, min(twice, 1.0) if name.endswith("_FRACTION") else twice


def measure(result: Path, parts: list[str], folder: Path | None, only: list[str] | None) -> None:
    """Search all records, then again with each change on the records on which it can matter."""
    found: dict[str, Any] = json.loads(result.read_text("utf-8")) if result.exists() else {}
    records = [case for part in parts for case in small_set.cases(part, folder)]
    for case in records:
        if case.name not in found:
            noted: set[str] = set()
            with traced(noted):
                base = small_set.search(case)
            found[case.name] = {"base": base, "noted": sorted(noted), "changed": {}}
            _write(result, found)
    for name in only or [*SWITCHES, *(c for c in CONSTANTS if c not in LIMITS)]:
        for case in records:
            own = found[case.name]
            whole = only is not None and isinstance(CONSTANTS.get(name), int)
            if name not in own["noted"] and not whole:
                continue
            for label, change in _changed(name):
                key = f"{name}: {label}"
                if key not in own["changed"]:
                    with change:
                        own["changed"][key] = small_set.search(case)
                    print(case.name, key, own["base"]["model"], "→", own["changed"][key]["model"])
                    _write(result, found)


def _write(path: Path, found: dict[str, Any]) -> None:
    """Write the result file."""
    path.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", "utf-8")


def table(result: Path) -> str:
    """Return the page of the table: for each change, the records on which the search ends otherwise."""
    found = json.loads(result.read_text("utf-8"))
    exact = sum(one["base"]["exact"] for one in found.values())
    lines = [
        "# Ablation of the search",
        "",
        "`python benches/decisions/ablation.py RESULT.json` searches the records of `benches/decisions/small_set.py` and",
        "writes RESULT.json. The same command with `--table docs/ablation.md` writes this page.",
        "",
        f"In {exact} of {len(found)} records the search finds exactly the hidden effects.",
        "An ablation removes one part of the search and repeats it. A move changes the model (add, drop, replace, split,",
        "merge); a veto refuses a change; the constants are those of `allanite/suggestion/constants.py`.",
        "In each row one move or veto is off, or one constant is half or twice as large. *Acts on* counts the records",
        "whose search uses the move or the constant; all others end the same without it. *Searched again* counts those",
        "that were searched with the change. Most of them end with the same model; the last columns count the others.",
        "*Better*: only the search with the change ends with exactly the hidden effects. *Worse*: only the search without",
        "the change does. *Other*: both are right or both are wrong, with different models.",
        "",
        "| changed | acts on | searched again | better | worse | other |",
        "|---|---|---|---|---|---|",
    ]
    idle, waiting = [], []
    for name in (*SWITCHES, *(c for c in CONSTANTS if c not in LIMITS)):
        changed = [
            one for one in found.values() if any(k.startswith(f"{name}: ") for k in one["changed"])
        ]
        acts = [one for one in found.values() if name in one["noted"] or one in changed]
        if not acts:
            traceable = name in SWITCHES or isinstance(CONSTANTS[name], float)
            idle += [name] if traceable else []
            continue
        if not changed:
            waiting.append(name)
        for label, _ in _changed(name):
            key = f"{name}: {label}"
            again = [(one["base"], one["changed"][key]) for one in acts if key in one["changed"]]
            if not again:
                continue
            gains = [
                now["exact"] - base["exact"] for base, now in again if now["model"] != base["model"]
            ]
            counts = (gains.count(1), gains.count(-1), gains.count(0))
            shown = name if name in SWITCHES else f"`{name}` {label}"
            cells = (shown, len(acts), len(again), *counts)
            lines.append(f"| {' | '.join(map(str, cells))} |")
    lines += [
        "",
        "The following moves, vetoes and constants never acted on these records. Their effect is therefore unknown:",
        "",
        *(f"* {_shown(name)}" for name in idle),
        "",
        "The following act on some of these records. A search without them, or with another value, was not run:",
        "",
        *(f"* {_shown(name)}" for name in waiting),
    ]
    return "\n".join(lines) + "\n"


def _shown(name: str) -> str:
    """Return a switch or a constant as text."""
    return name if name in SWITCHES else f"`{name}`"


def main() -> None:
    """Measure, or write the page of a result file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("result", type=Path, help="JSON file that is written or continued")
    parts = ("cases", "sets", "effects", "nulls")
    parser.add_argument("--part", action="append", choices=parts, help="search this part only")
    parser.add_argument("--records", type=Path, help="folder that keeps the sets of three")
    parser.add_argument("--only", nargs="+", help="change only these switches and constants")
    parser.add_argument("--table", type=Path, help="write this page from the result file and end")
    asked = parser.parse_args()
    if asked.table is None:
        measure(asked.result, asked.part or list(parts), asked.records, asked.only)
    else:
        asked.table.write_text(table(asked.result), "utf-8")


if __name__ == "__main__":
    main()
