"""A word of 70 000 characters in a text log takes no time that grows with its square."""

import sys
from pathlib import Path
from time import process_time

import pytest

import allanite as al

FUZZ = str(Path(__file__).parents[2] / "fuzz")
sys.path.insert(0, FUZZ)
import logs  # noqa: E402
import targets  # noqa: E402

sys.path.remove(FUZZ)

WORDS = {
    "letters": "a" * 70_000,
    "digits": "9" * 70_000,
    "blanks": "a" + " " * 70_000 + "b",
    "brackets": "(" * 70_000,
    "label": "gx:" + "1" * 70_000 + "a",
    "pairs": "a:1 " * 17_000 + "b",
    "axes": "Rotation " + "X " * 35_000,
}
LOGS = [seed.decode() for seed in (*logs.texts(), *targets._text()[:3], *logs.sentences())]


@pytest.mark.long
@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize("number", range(len(LOGS)))
def test_a_long_word(tmp_path, word, number):
    lines = LOGS[number].splitlines()
    first = [lines[0][:5] + WORDS[word] + lines[0][5:], *lines[1:]]
    middle = len(lines) // 2
    for text in (first, [WORDS[word], *lines], [*lines[:middle], WORDS[word], *lines[middle:]]):
        path = tmp_path / "log.txt"
        path.write_text("\n".join(text) + "\n", "utf-8")
        begun = process_time()
        try:
            al.read(path, rate=10)
        except al.AllaniteError as error:
            assert len(str(error)) <= 300  # noqa: PT017 - most are refused
        assert process_time() - begun < 2.0
