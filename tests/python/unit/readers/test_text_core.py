"""Text logs: what is found by itself, what is refused and in which words, chunks and pipes."""

from __future__ import annotations

import os
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
from allanite import _core

nan = float("nan")


@pytest.fixture
def log(tmp_path):
    def write(content, name="log.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    return write


FOUND = {
    "comma": ("a,b\n1,2\n3,4\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "comma, blanks": ("a, b\n1, 2\n3, 4\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "blank before comma": ("1 ,2\n3 ,4\n", ",", False, None, [[1, 2], [3, 4]]),
    "semicolon": ("a;b\n1.5;2\n3;4\n", ";", False, ["a", "b"], [[1.5, 2], [3, 4]]),
    "tab": ("a x\tb\n1\t2\n3\t4\n", "\t", False, ["a x", "b"], [[1, 2], [3, 4]]),
    "bar": ("1|2\n3|4\n", "|", False, None, [[1, 2], [3, 4]]),
    "white space": ("  a   b\n 1  2 \n\t3 \t 4\n", " ", False, ["a", "b"], [[1, 2], [3, 4]]),
    "one column": ("gyro x\n1\n2\n3\n", " ", False, ["gyro x"], [[1], [2], [3]]),
    "no header": ("1,2\n3,4", ",", False, None, [[1, 2], [3, 4]]),
    "one number": ("5", " ", False, None, [[5]]),
    "decimal comma": ("a;b\n1,5;2\n-3,25;4e-1\n", ";", True, ["a", "b"], [[1.5, 2], [-3.25, 0.4]]),
    "decimal comma, blanks": ("1,5 2,5\n3 4\n", " ", True, None, [[1.5, 2.5], [3, 4]]),
    "decimal comma, quotes": ('"1,5","2,5"\n"3","4,5"\n', ",", True, None, [[1.5, 2.5], [3, 4.5]]),
    "quotes": ('"a","b, c"\n"1","2"\n3,4\n', ",", False, ["a", "b, c"], [[1, 2], [3, 4]]),
    "mark of UTF-8": ("\ufeffa,b\n1,2\n3,4\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "CRLF": ("a,b\r\n1,2\r\n3,4\r\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "CR": ("a,b\r1,2\r3,4\r", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "trailing": ("a,b,\n1,2,\n3,4,\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "trailing, rows only": ("a,b\n1,2,\n3,4,\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "trailing, bare": ("1;2;\n3;4;\n", ";", False, None, [[1, 2], [3, 4]]),
    "comments": ("# x\n% y\n// z\na,b\n1,2\n! w\n3,4\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "names in a comment": ("# a b\n1 2\n3 4\n", " ", False, ["a", "b"], [[1, 2], [3, 4]]),
    "empty lines": ("\na,b\n\n1,2\n\n\n3,4\n\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "preamble": ("Logger 7\nSerial: 5\na,b\n1,2\n3,4\n", ",", False, ["a", "b"], [[1, 2], [3, 4]]),
    "units": ("t;x\ns;deg/s\n1;2\n3;4\n", ";", False, ["t", "x"], [[1, 2], [3, 4]]),
    "units apart": (
        "t [s] x [deg / s]\n1 2\n3 4\n",
        " ",
        False,
        ["t [s]", "x [deg / s]"],
        [[1, 2], [3, 4]],
    ),
    "missing": (
        "a,b,c\n1,,3\n,nan,NaN\n4,N/A,\n",
        ",",
        False,
        ["a", "b", "c"],
        [[1, nan, 3], [nan, nan, nan], [4, nan, nan]],
    ),
    "infinite": (
        "1,inf\n-inf,2\n+3,Infinity\n",
        ",",
        False,
        None,
        [[1, np.inf], [-np.inf, 2], [3, np.inf]],
    ),
    "exponents": ("1e3,-2.5E-3\n.5,5.\n", ",", False, None, [[1000, -0.0025], [0.5, 5]]),
    "Fortran exponents": (
        "1D3,-2.5d-3\n.5D+00,5.D0\n",
        ",",
        False,
        None,
        [[1000, -0.0025], [0.5, 5]],
    ),
    "degree sign": ("t,x [°/s]\n1,2\n", ",", False, ["t", "x [°/s]"], [[1, 2]]),
}


@pytest.mark.slow
@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from("Dd"), st.integers(0, 17))
def test_exponents_of_fortran_are_those_of_c(tmp_path_factory, value, mark, digits):
    cell = f"{value:.{digits}e}"
    path = tmp_path_factory.mktemp("core") / "log.csv"
    path.write_text(f"{cell.replace('e', mark)},0\n{cell},1\n", encoding="utf-8")
    _, (found, _), _ = _core.read_text(str(path))
    assert found.tolist() == [float(cell)] * 2


def test_words_with_a_d_are_no_numbers(log):
    for word in ("3D", "D3", "1D", "day5", "1D2D3"):
        with pytest.raises(al.InputError):
            _core.read_text(log(f"1,2\n3,4\n5,{word}\n"))


@pytest.mark.parametrize("name", FOUND)
def test_found_by_itself(log, name):
    content, delimiter, comma, header, rows = FOUND[name]
    path = log(content)
    names, columns, meta = _core.read_text(path)
    assert names == header
    np.testing.assert_array_equal(np.column_stack(columns), np.array(rows, float))
    assert (meta["delimiter"], meta["decimal_comma"]) == (delimiter, comma)
    assert meta["missing"] == np.isnan(rows).sum()
    reader = _core.TextReader(path)
    assert reader.header == header
    np.testing.assert_array_equal(reader.next(100), np.array(rows, float))
    assert reader.next(100) is None
    assert reader.meta == meta


def test_meta_counts(log):
    path = log("Logger\n# c\na,b\n\n1,2\n// d\n3,\n")
    _, _, meta = _core.read_text(path)
    assert meta == {
        "delimiter": ",",
        "decimal_comma": False,
        "comments": 2,
        "blank": 1,
        "header_line": 3,
        "skipped": 1,
        "missing": 1,
        "rows": 2,
    }


def test_latin_1_header(log):
    names, _, _ = _core.read_text(log("t,x [°/s]\n1,2\n".encode("latin-1")))
    assert names == ["t", "x [°/s]"]


def test_what_the_caller_knows(log):
    path = log("1,5\n2,5\n")
    assert [c.tolist() for c in _core.read_text(path)[1]] == [[1, 2], [5, 5]]
    assert [c.tolist() for c in _core.read_text(path, decimal_comma=True)[1]] == [[1.5, 2.5]]
    path = log("1:2\n3:4\n")
    assert [c.tolist() for c in _core.read_text(path, ":")[1]] == [[1, 3], [2, 4]]
    path = log("when,x,note,y\n2024-01-01 10:00,1,ok,2\n2024-01-01 10:01,3,,4\n")
    names, columns, _ = _core.read_text(path, columns=[3, 1])
    assert names == ["y", "x"]
    assert [c.tolist() for c in columns] == [[2, 4], [1, 3]]


ERRORS = {
    "bad cell": ("t,gx\n1,2\n3,oops\n5,6\n", r"row 3, column 2 \(gx\): \"oops\" is not a number"),
    "bad cell, no header": ("1,2\n\n# c\n3,1.2.3\n", r"row 4, column 2: \"1.2.3\" is not a number"),
    "long text": ("1,2\n3," + "x" * 99 + "\n", r"column 2: \"x{24}…\" is not"),
    "glued": ("1,2\n3,4 5\n", r"\"4 5\" is not a number"),
    "short row": ("a,b,c\n1,2,3\n1,2\n", "row 3 has 2 columns, the others 3"),
    "long row": ("1 2\n1 2 3\n", "row 2 has 3 columns, the others 2"),
    "header": ("a,b\n1,2,3\n1,2,3\n", "row 2 has 3 columns, the header 2"),
    "only header": ("a,b\n", "no rows of numbers"),
    "only comments": ("# a\n\n", "no rows of numbers"),
    "hexadecimal": ("0x1.8p+0\n" * 100 + "1.5\n2.5\n", r"row 1 has 0x1\.8p\+0: hexadecimal"),
    "nothing": ("", "is empty"),
    "UTF-16": ("1,2\n".encode("utf-16"), "UTF-16"),
    "binary": (b"\x93NUMPY\x01\x00v\x00", "binary"),
    "gzip": (b"\x1f\x8b\x08\x00", "gzip"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_errors_say_where(log, name):
    content, message = ERRORS[name]
    path = log(content)
    with pytest.raises(al.InputError, match=message) as caught:
        _core.read_text(path)
    assert str(caught.value).startswith(path)
    assert "\n" not in str(caught.value)


def test_no_file_a_directory_no_column(tmp_path, log):
    with pytest.raises(al.InputError, match=r"nowhere\.csv: no such file"):
        _core.read_text(str(tmp_path / "nowhere.csv"))
    with pytest.raises(al.InputError, match="is a directory"):
        _core.read_text(str(tmp_path))
    with pytest.raises(al.InputError, match="no column 3; it has 2"):
        _core.read_text(log("1,2\n"), columns=[2])
    with pytest.raises(al.InputError, match="one character"):
        _core.read_text(log("1,2\n"), "ab")


@pytest.mark.slow
def test_large_file_in_pieces(log):
    # Several chunks, each in several pieces; the bad cell is named by its line of the whole file.
    x = np.random.default_rng(0).normal(size=(200_000, 4))
    lines = ["a,b,c,d", *(",".join(map(repr, row)) for row in x.tolist())]
    path = log("\n".join(lines) + "\n")
    _, columns, meta = _core.read_text(path)
    np.testing.assert_array_equal(np.column_stack(columns), x)
    assert meta["rows"] == len(x)
    reader = _core.TextReader(path)
    chunks = [reader.next(70_001) for _ in range(3)]
    assert reader.next(1) is None
    assert [len(chunk) for chunk in chunks] == [70_001, 70_001, 59_998]
    np.testing.assert_array_equal(np.concatenate(chunks), x)
    lines[171_001] += "?"
    with pytest.raises(al.InputError, match=r"row 171002, column 4 \(d\)"):
        _core.read_text(log("\n".join(lines)))


def test_pipe_gives_rows_as_they_come(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    first, second = threading.Event(), threading.Event()

    def write():
        with path.open("w") as pipe:
            pipe.write("a b\n" + "".join(f"{i} {-i}\n" for i in range(100)))
            pipe.flush()
            first.wait(10)
            pipe.write("100 -100\n")
        second.set()

    writer = threading.Thread(target=write)
    writer.start()
    reader = _core.TextReader(str(path))
    assert reader.header == ["a", "b"]
    # Rows that have been written are handed out while the writer still holds the pipe.
    np.testing.assert_array_equal(reader.next(100)[:, 0], np.arange(100))
    first.set()
    assert reader.next(100).tolist() == [[100, -100]]
    assert reader.next(100) is None
    writer.join()


cell = st.one_of(
    st.floats(allow_nan=False).map(lambda x: (repr(x), x)),
    st.integers(-(10**18), 10**18).map(lambda i: (str(i), float(i))),
    st.sampled_from([("", nan), ("nan", nan), ("NA", nan), ("+1.5", 1.5), ("1E5", 1e5)]),
)


@pytest.mark.slow
@settings(max_examples=150)
@given(
    data=st.data(),
    width=st.integers(2, 6),
    delimiter=st.sampled_from([",", ";", "\t", "|"]),
    end=st.sampled_from(["\n", "\r\n"]),
    blank=st.sampled_from(["", " "]),
    header=st.booleans(),
)
def test_what_is_written_is_read(tmp_path_factory, data, width, delimiter, end, blank, header):
    row = st.lists(cell, min_size=width, max_size=width)
    rows = data.draw(st.lists(row, min_size=1, max_size=12))
    # A first and a last cell in every row keep it from looking empty or trailing.
    rows = [[("7", 7.0), *row, ("8", 8.0)] for row in rows]
    text = [(delimiter + blank).join(cell for cell, _ in row) for row in rows]
    if header:
        text.insert(0, delimiter.join(f"c{i}" for i in range(width + 2)))
    path = tmp_path_factory.getbasetemp() / "property.csv"
    path.write_text(end.join(text) + end, newline="")
    names, columns, meta = _core.read_text(str(path), delimiter)
    assert (names is not None) == header
    expected = np.array([[value for _, value in row] for row in rows])
    np.testing.assert_array_equal(np.column_stack(columns), expected)
    assert meta["missing"] == np.isnan(expected).sum()


def test_a_short_row_does_not_make_commas_decimal(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text("1,2\n3,4\n5,6\n7\n")
    with pytest.raises(al.InputError, match="row 4"):
        _core.read_text(str(log))
