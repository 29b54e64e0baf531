"""Pipes, logs larger than memory, and files that are whole or absent."""

import os
from pathlib import Path

import numpy as np
import pytest

from command_line import needs, piped, refused, strict

RNG = np.random.default_rng(7)


@pytest.mark.slow
def test_a_log_from_a_pipe(run, log, tmp_path):
    needs("deviation")
    code, out, err = piped(log.read_bytes(), "fit", "-", "--model", "N", "--json")
    assert (code, err) == (0, "")
    document = strict(out)
    assert document["recording"]["path"] == "standard input"
    direct = strict(run("fit", log, "--model", "N", "--json")[1])
    assert document["effects"] == direct["effects"]
    np.save(tmp_path / "x.npy", RNG.standard_normal(300))
    code, out, _ = piped((tmp_path / "x.npy").read_bytes(), "fit", "-", "--model", "N", "--rate", 5)
    assert code == 0
    assert "300 samples at 5 Hz" in out


def test_a_log_larger_than_memory_is_read_in_chunks(run, log, tmp_path, monkeypatch):
    from allanite.readers import long_log

    def adev(*arguments):
        code, out, err = run("adev", *arguments, "--json")
        assert code == 0, err
        return strict(out)

    x = np.cumsum(RNG.standard_normal((3000, 2)), axis=0)
    np.save(tmp_path / "x.npy", x)
    for file, options in ((log, ()), (tmp_path / "x.npy", ("--rate", 10, "--column", "x1"))):
        whole = adev(file, *options)
        with monkeypatch.context() as patch:
            patch.setattr(long_log, "budget", lambda: 500.0)
            assert long_log.is_too_large(Path(file))
            chunked = adev(file, *options)
        assert "chunks" in chunked["diagnostics"][0]
        assert chunked["recording"]["n"] == whole["recording"]["n"]
        assert chunked["recording"]["column"] == whole["recording"]["column"]
        same = {p["m"]: p["deviation"] for p in whole["points"]}
        near = [p for p in chunked["points"] if p["m"] < 32]
        assert len(near) == 5
        for point in near:
            assert point["deviation"] == pytest.approx(same[point["m"]], rel=1e-9)
    assert not long_log.is_too_large(Path(log))
    assert not long_log.is_too_large(Path("no such file"))


@pytest.mark.long
def test_adev_of_a_pipe_needs_no_memory_of_it(run, log, monkeypatch):
    needs("deviation.accumulator")
    direct = strict(run("adev", log, "--json")[1])
    monkeypatch.setenv("ALLANITE_MEMORY", "1000")
    code, out, err = piped(log.read_bytes(), "adev", "-", "--json")
    assert (code, err) == (0, "")
    streamed = strict(out)
    assert "chunks" in streamed["diagnostics"][0]
    assert streamed["recording"]["path"] == "standard input"
    assert streamed["recording"]["n"] == direct["recording"]["n"] == 4000
    assert streamed["recording"]["column"] == "gyro_x"
    assert streamed["recording"]["rate_hz"] == pytest.approx(100)
    whole = {p["m"]: p["deviation"] for p in direct["points"]}
    for point in streamed["points"]:
        # Below m = 32 the stream has every term; above, its terms are a subset.
        if point["m"] < 32 and point["m"] in whole:
            assert point["deviation"] == pytest.approx(whole[point["m"]], rel=1e-9)
    rad = strict(piped(log.read_bytes(), "adev", "-", "--json", "--output-unit", "rad/s")[1])
    ratio = rad["points"][0]["deviation"] / streamed["points"][0]["deviation"]
    assert ratio == pytest.approx(np.pi / 180)
    two = "gx [rad/s],ax [m/s^2]\n" + "1,2\n2,3\n1,1\n" * 100
    asked = ["--rate", 1, "--json", "--output-unit"]
    columns = strict(piped(two.encode(), "adev", "-", *asked, "ug,deg/√h")[1])["columns"]
    assert [c["recording"]["unit"] for c in columns] == ["deg/h", "ug"]
    refused(piped(two.encode(), "adev", "-", *asked, "ppb"), 2, "cannot express rad/s, m/s^2")
    phase = np.cumsum(RNG.standard_normal(1000))
    text = "\n".join(map(repr, phase.tolist())).encode()
    options = ["--rate", 1, "--quantity", "angle", "--json"]
    piped_phase = strict(piped(text, "adev", "-", *options)[1])
    expected = np.sqrt(np.mean(np.diff(phase, n=2) ** 2) / 2)
    assert piped_phase["points"][0]["deviation"] == pytest.approx(expected)
    refused(piped(b"x\n1\n2\n3\n4\n", "adev", "-"), 2, "standard input", "--rate")
    refused(piped(b"x\n1\n2\nthree\n", "adev", "-", "--rate", 1), 2, "three")
    refused(piped(b"", "adev", "-", "--rate", 1), 2, "standard input")


def stamped(tmp_path, name, time, header=""):
    path = tmp_path / name
    x = np.random.default_rng(3).standard_normal(time.size)
    rows = np.column_stack((time, x))
    np.savetxt(path, rows, "%.9g", ",", header=header, comments="")
    return path


@pytest.mark.long
def test_a_stream_sees_the_gaps_of_its_time_column(run, tmp_path, monkeypatch):
    n = 150_000
    keep = np.ones(n, bool)
    # Within a chunk, at the border of two (65 536 rows), a single row, and close to the end.
    for gap in (slice(30_000, 35_000), slice(70_534, 70_540), 131_000, slice(n - 3, n - 1)):
        keep[gap] = False
    time = np.arange(n) * 0.01
    for name, stamps, header in (
        ("gaps.csv", time[keep], "time [s],gy [deg/s]"),
        ("nameless.csv", time[keep], ""),
        ("late.csv", time + 3600.0 * (time > 700.0), "time [s],gy [deg/s]"),
        ("jitter.csv", time + 0.003 * np.sin(np.arange(n) ** 2), "time [s],gy [deg/s]"),
    ):
        path = stamped(tmp_path, name, stamps, header)
        # The rate of 50 Hz contradicts stamps of 100 Hz: the user insists.
        for options in ((), ("--rate", "50!")):
            whole = strict(run("adev", path, "--json", *options)[1])
            with monkeypatch.context() as patch:
                patch.setenv("ALLANITE_MEMORY", "1M")
                code, out, _ = piped(path.read_bytes(), "adev", "-", "--json", *options)
            assert code == 0
            stream = strict(out)
            for key in ("column", "n", "gaps", "duration_s"):
                assert stream["recording"][key] == whole["recording"][key], (name, key)
            assert stream["recording"]["rate_hz"] == pytest.approx(
                whole["recording"]["rate_hz"], rel=1e-12
            )
            said = [f["message"] for f in whole["recording"]["audit"] if f["column"] is None]
            assert [f["message"] for f in stream["recording"]["audit"]] == said, name
            pairs = zip(stream["points"][:5], whole["points"][:5], strict=True)
            for ours, theirs in pairs:
                assert ours["deviation"] == pytest.approx(theirs["deviation"], rel=1e-9)
    monkeypatch.setenv("ALLANITE_MEMORY", "500")
    text = b"time,x\n" + b"".join(b"%d,%d\n" % (k, k % 7) for k in range(100)) + b"nan,1\n"
    refused(piped(text, "adev", "-"), 2, "time column", "row 100")


@pytest.mark.slow
def test_a_stream_reads_the_unit_in_a_name(run, tmp_path, monkeypatch):
    monkeypatch.setenv("ALLANITE_MEMORY", "100")
    path = tmp_path / "dps.csv"
    x = np.random.default_rng(3).standard_normal(60)
    path.write_text("GyrX_dps\n" + "".join(f"{v}\n" for v in x))
    stream = strict(piped(path.read_bytes(), "adev", "-", "--rate", 10, "--json")[1])
    assert stream["recording"]["unit"] == "deg/s"
    assert not stream["recording"]["audit"]


@pytest.mark.slow
def test_what_a_stream_does_not_need_may_be_text(run, tmp_path, monkeypatch):
    path = tmp_path / "notes.csv"
    x = np.random.default_rng(3).standard_normal(60)
    path.write_text("gx,label\n" + "".join(f"{v},foo\n" for v in x))
    options = ("--rate", 1, "--column", "gx", "--json")
    whole = strict(run("adev", path, *options)[1])
    monkeypatch.setenv("ALLANITE_MEMORY", "100")
    stream = strict(piped(path.read_bytes(), "adev", "-", *options)[1])
    assert stream["points"][0]["deviation"] == pytest.approx(whole["points"][0]["deviation"])


def test_large_integers_in_chunks(run, tmp_path, monkeypatch):
    from allanite.readers import long_log

    x = 2**60 + np.random.default_rng(3).integers(0, 100, 5_000)
    np.save(tmp_path / "counts.npy", x)
    whole = strict(run("adev", tmp_path / "counts.npy", "--rate", 1, "--json")[1])
    monkeypatch.setattr(long_log, "budget", lambda: 500.0)
    chunked = strict(run("adev", tmp_path / "counts.npy", "--rate", 1, "--json")[1])
    assert chunked["points"][0]["deviation"] == whole["points"][0]["deviation"] > 20
    # Angles that fall: differences of unsigned and of narrow integers must not wrap.
    for dtype in (np.uint16, np.int8):
        angle = np.random.default_rng(4).integers(0, 100, 5_000).astype(dtype)
        angle[::2] += 27
        np.save(tmp_path / "angle.npy", angle)
        options = ("--rate", 1, "--quantity", "angle", "--json")
        chunked = strict(run("adev", tmp_path / "angle.npy", *options)[1])
        expected = np.sqrt(np.mean(np.diff(angle.astype(float), n=2) ** 2) / 2)
        assert chunked["points"][0]["deviation"] == pytest.approx(expected)


@pytest.mark.slow
def test_averaging_times_that_a_stream_does_not_have(monkeypatch):
    monkeypatch.setenv("ALLANITE_MEMORY", "100")
    text = b"x\n" + b"1\n2\n" * 50
    for taus in ("0", "1000"):
        refused(piped(text, "adev", "-", "--rate", 1, "--taus", taus), 2, f"--taus {taus}")


@pytest.mark.slow
def test_bad_pipes():
    refused(piped(b"x\n1\n2\nthree\n", "fit", "-", "--rate", 1), 2, "standard input", "three")
    refused(piped(b"", "fit", "-", "--rate", 1), 2, "standard input", "empty")


def test_whole_file_or_nothing(tmp_path):
    from allanite.common.errors import InputError
    from allanite.common.files import whole_file

    target = tmp_path / "x.txt"

    def interrupted():
        with whole_file(target) as draft:
            draft.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []
    with whole_file(target) as draft:
        draft.write_text("whole")
    assert target.read_text() == "whole"
    assert [p.name for p in tmp_path.iterdir()] == ["x.txt"]
    for bad in (tmp_path, tmp_path / "absent" / "x.txt"):
        with pytest.raises(InputError), whole_file(bad):
            pass


def test_an_interrupt_as_soon_as_the_draft_is_there_leaves_none(tmp_path, monkeypatch):
    """In one of thousands of runs, it came after the creation of the file and before its name was known."""
    from allanite.common.files import whole_file

    close = os.close

    def interrupted(descriptor):
        close(descriptor)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):  # noqa: PT012
        patch.setattr(os, "close", interrupted)
        with whole_file(tmp_path / "x.csv"):
            pytest.fail("no interrupt came")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="links and pipes as POSIX has them")
def test_a_link_stays_a_link_and_a_pipe_a_pipe(tmp_path):
    from allanite.common.files import whole_file

    link, pipe = tmp_path / "link.txt", tmp_path / "pipe"
    link.symlink_to(tmp_path / "x.txt")
    with whole_file(link) as draft:
        draft.write_text("whole")
    assert link.is_symlink()
    assert (tmp_path / "x.txt").read_text() == "whole"
    os.mkfifo(pipe)
    with whole_file(pipe) as draft:
        assert draft == pipe
    assert pipe.is_fifo()


@pytest.mark.slow
def test_an_infinite_sample_is_named_by_line_and_column(tmp_path, run, monkeypatch):
    rows = [f"{k},{k % 7}" for k in range(60)]
    rows[7] = "7,inf"
    text = "a,b\n" + "\n".join(rows) + "\n"
    words = 'standard input: row 9, column 2 (b): "inf" is infinite: write nan for a missing sample'
    for command in (("adev", "-"), ("fit", "-", "--model", "N")):
        code, out, err = piped(text.encode(), *command, "--rate", 1)
        assert (code, out) == (2, "")
        assert words in err
    # A column that nobody asked for may hold infinities, and text.
    text = text.replace("9,2", "9,bump")
    code, _, err = piped(text.encode(), "adev", "-", "--rate", 1, "--column", "a")
    assert (code, err) == (0, "")

    from allanite.readers import long_log

    x = RNG.standard_normal((100, 2))
    x[41, 1] = -np.inf
    path = tmp_path / "x.npy"
    np.save(path, x)
    words = "column x1: sample 42, counted from 1, is -inf"
    refused(run("adev", path, "--rate", 1), 2, "x.npy", words)
    monkeypatch.setattr(long_log, "budget", lambda: 50.0)
    refused(run("adev", path, "--rate", 1), 2, "x.npy", words)


@pytest.mark.slow
def test_no_row_of_a_pipe_is_lost_to_a_comment():
    rows = [f"{0.1257 + k % 7:.4f}" for k in range(40)]
    rows[0] += " # note"
    rows[20] += " # bump"
    code, out, _ = piped("\n".join(rows).encode(), "adev", "-", "--rate", 1, "--json")
    assert code == 0
    assert strict(out)["recording"]["n"] == 40
