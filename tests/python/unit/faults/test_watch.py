"""A watch beside logs that rotate, signals, and odd samples."""

from __future__ import annotations

import json
import os
import signal
import socket

import numpy as np
import pytest

import allanite as al
from allanite.cli.first_rows import WatchedColumn
from allanite.cli.live_source import MAX_LINE, Stop, samples_of_source
from command_line import piped, refused, started, strict, until
from moving_records import MOVING

MODEL = ("--model", "N(N=0.1)", "--rate", "100")
posix = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


def noise(n, seed=1):
    return np.random.default_rng(seed).standard_normal(n)


def text(samples):
    return "".join(f"{x:.6f}\n" for x in samples)


def last(out):
    return strict(out.splitlines()[-1])


# -- odd samples -----------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e20, 1e155, 1e308, -1e308])
def test_a_huge_sample_leaves_numbers_and_later_changes_are_found(tmp_path, size):
    watch, x = al.Watch(al.parse_model("N(N=0.1)"), 100.0), noise(20_000)
    x[5000] = size
    watch.update(x)
    assert np.isfinite(watch.e_value)
    strict(json.dumps(watch.to_dict()))
    watch.save(tmp_path / "state")
    strict((tmp_path / "state").read_text())
    again = al.Watch(al.parse_model("N(N=0.1)"), 100.0)
    again.restore(tmp_path / "state")
    assert again.e_value == watch.e_value
    again.update(2.0 * noise(20_000, 2))
    assert again.alarm is not None
    assert again.e_value > 1e6


def test_a_single_outlier_is_no_alarm():
    watch, x = al.Watch(al.parse_model("N(N=0.1)"), 100.0), noise(100_000)
    x[50_000] = 1e4
    watch.update(x)
    assert watch.alarm is None


def test_an_infinite_sample_is_refused_and_nothing_is_lost(run, tmp_path):
    with pytest.raises(al.InputError, match="sample 3 is infinite"):
        al.Watch(al.parse_model("N(N=0.1)"), 100.0).update([0.0, 1.0, np.inf])
    log = tmp_path / "log.csv"
    log.write_text(text(noise(200)) + "inf\n0.1\n")
    code, out, err = run("watch", log, *MODEL, "--state", tmp_path / "state")
    assert (code, last(out)["samples"], len(err.splitlines())) == (2, 200, 1)
    assert "log.csv" in err
    assert "infinite" in err


@pytest.mark.parametrize("rows", [50, 200, 5000])
def test_rows_before_a_bad_row_are_counted_once(run, tmp_path, rows):
    """The state ends before the bad row, so a second run reads no row again; 50 rows are within the first lines."""
    log, state = tmp_path / "log.csv", tmp_path / "state"
    log.write_text("gx\n" + text(noise(rows)) + "inf\n0.1\n")
    for _ in range(2):
        assert run("watch", log, *MODEL, "--state", state)[0] == 2
        assert al.Summary.load(f"{state}.summary").n == rows
    log.write_text(log.read_text().replace("inf", "nan"))
    code, out, _ = run("watch", log, *MODEL, "--state", state)
    assert (code, last(out)["samples"]) == (0, rows + 2)


def test_counters_for_prometheus_are_whole_numbers():
    watch = al.Watch(al.parse_model("N(N=0.1)"), 100.0)
    watch.taken = 123_456_789
    assert "allanite_samples_total 123456789\n" in watch.prometheus()


def test_a_segment_across_an_interruption_decides_nothing():
    watch = al.Watch(al.parse_model("N(N=0.1)"), 100.0)
    watch.update(noise(1500))
    watch.interrupt()
    assert np.isnan(watch._pending).sum() == 1500 - 1024
    watch.update(1e3 + noise(1000, 2))
    assert watch.segments == 2
    assert watch.e_value < 1.0


# -- input that does not end, addresses ------------------------------------------------------------


def test_a_line_without_end_is_refused_in_little_memory(monkeypatch, tmp_path):
    # The file is larger than any line may be; it is never read to its end.
    with (tmp_path / "log").open("wb") as file:
        file.write(b"7" * (2 * MAX_LINE))
        file.truncate(1 << 40)
    with pytest.raises(al.InputError, match="a line is longer than") as raised:
        list(samples_of_source(str(tmp_path / "log"), lambda _: WatchedColumn(0), Stop()))
    assert "\n" not in str(raised.value)


@pytest.mark.slow
def test_a_long_line_on_a_pipe_is_one_line_of_complaint():
    refused(piped(b"1" * (3 * MAX_LINE), "watch", "-", *MODEL), 2, "standard input", "longer than")


@pytest.mark.parametrize("port", ["0", "65536", "99999999999999999999", "-1", "x", ""])
def test_a_port_that_is_none_is_refused(run, port):
    refused(run("watch", f"udp://127.0.0.1:{port}", *MODEL), 2, "port", "1 to 65535")


def test_an_address_in_use_is_said(run):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        address = f"udp://127.0.0.1:{other.getsockname()[1]}"
        refused(run("watch", address, *MODEL), 2, address, "in use", "another port")


@posix
def test_files_that_cannot_be_written_are_refused_before_the_first_row(run, tmp_path):
    """A missing state file was once noticed after a minute of samples, and a pipe was waited for."""
    os.mkfifo(tmp_path / "pipe")
    for option in ("--state", "--prometheus"):
        path = tmp_path / "nowhere" / "file"
        refused(run("watch", "-", *MODEL, option, path), 2, "does not exist")
        refused(run("watch", "-", *MODEL, option, tmp_path), 2, "is a folder")
    refused(run("watch", "-", *MODEL, "--state", tmp_path / "pipe"), 2, "not a file")


@pytest.mark.parametrize("every", ["0", "-1", "nan", "inf"])
def test_the_time_between_lines_is_a_positive_number(run, every):
    refused(run("watch", "-", *MODEL, "--every", every), 2, "--every", "positive number of seconds")


# -- signals ---------------------------------------------------------------------------------------

ENDS = {signal.SIGTERM: 143, signal.SIGINT: 130}


@pytest.mark.slow
@posix
@pytest.mark.parametrize("number", ENDS)
def test_a_signal_loses_no_row_of_a_pipe(tmp_path, number):
    state = tmp_path / "state"
    with started("watch", "-", *MODEL, "--every", 1, "--state", state, stdin=-1) as process:
        process.stdin.write(text(noise(150)).encode())
        process.stdin.flush()
        until(state.is_file)  # a second of samples was reported
        process.stdin.write((text(noise(77)) + "0.12").encode())
        process.stdin.flush()
        process.send_signal(number)
        code = process.wait(30)
        out = process.stdout.read().decode()
    assert (code, last(out)["samples"]) == (ENDS[number], 227)
    assert json.loads(state.read_text())["taken"] == 227


@pytest.mark.slow
@posix
def test_a_signal_loses_no_datagram(tmp_path):
    state = tmp_path / "state"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = (*MODEL, "--every", 1, "--state", state)
    with started("watch", f"udp://127.0.0.1:{port}", *options) as process:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:

            def reported():
                sender.sendto(text(noise(10)).encode(), ("127.0.0.1", port))
                return state.is_file()

            until(reported)
            before = json.loads(state.read_text())["taken"]
            for _ in range(5):
                sender.sendto(text(noise(3)).encode(), ("127.0.0.1", port))
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 143
        samples = last(process.stdout.read().decode())["samples"]
    assert samples >= before + 15
    assert samples % 10 == 5


# -- files that change -----------------------------------------------------------------------------


class Following:
    """Rows of a file that is followed, read on demand."""

    def __init__(self, path, position=None, monkeypatch=None):
        self.stop = Stop()
        self.rows = samples_of_source(
            str(path), lambda _: WatchedColumn(0), self.stop, position=position, follow=True
        )

    def until_samples(self, n):
        out, found = [], []
        while len(out) < n:
            some = next(self.rows)
            out += some.samples.tolist()
            found.append(some)
        return out, found


@pytest.fixture(autouse=True)
def _few_rows_tell_the_column(monkeypatch):
    monkeypatch.setattr("allanite.cli.live_source.FIRST_ROWS", 2)
    monkeypatch.setattr("allanite.cli.live_source.POLL_S", 0.01)


@pytest.mark.parametrize("longer", [False, True])
def test_a_file_truncated_in_place_is_read_again(tmp_path, capsys, longer):
    log = tmp_path / "log.csv"
    log.write_text("gx\n" + text(range(50)))
    follower = Following(log)
    assert follower.until_samples(50)[0] == list(range(50))
    # Shorter than before, or as the writer has already filled it again.
    fresh = list(range(100, 200 if longer else 110))
    with log.open("r+") as file:
        file.truncate(0)
        file.write("gx\n" + text(fresh))
    samples, rows = follower.until_samples(len(fresh))
    assert samples == fresh
    assert not rows[0].follows
    assert "truncated" in capsys.readouterr().err


def test_a_rotated_file_loses_no_row(tmp_path, capsys):
    log = tmp_path / "log.csv"
    log.write_text("gx\n" + text(range(50)))
    follower = Following(log)
    follower.until_samples(50)
    old = log.open("a")
    log.rename(tmp_path / "log.csv.1")
    old.write(text(range(50, 60)))
    old.flush()
    log.write_text("gx\n" + text(range(60, 70)))
    samples, rows = follower.until_samples(20)
    old.close()
    assert samples == list(range(50, 70))
    assert all(some.follows for some in rows)
    assert "replaced" in capsys.readouterr().err


@posix
@pytest.mark.parametrize("kind", ["pipe", "folder", "device"])
def test_a_log_replaced_by_something_that_never_ends_is_refused(tmp_path, kind):
    """The opening of a pipe once waited for a writer, and no signal ended the watch."""
    log = tmp_path / "log.csv"
    log.write_text("gx\n" + text(range(50)))
    follower = Following(log)
    follower.until_samples(50)
    with log.open("a") as old:
        old.write(text(range(50, 60)))
    log.rename(tmp_path / "log.csv.1")
    {"pipe": os.mkfifo, "folder": os.mkdir, "device": lambda p: p.symlink_to("/dev/zero")}[kind](
        log
    )
    assert follower.until_samples(10)[0] == list(range(50, 60))
    with pytest.raises(al.InputError, match=r"log.csv: (not a regular|a folder, not a) file"):
        next(follower.rows)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize("change", ["none", "rotated", "truncated"])
def test_a_state_knows_the_file_that_it_ended_in(run, tmp_path, change, newline):
    log, state = tmp_path / "log.csv", tmp_path / "state"
    options = (*MODEL, "--state", state)
    log.write_text("gx\n" + text(noise(3000)), newline=newline)
    assert run("watch", log, *options)[0] == 0
    more = text(noise(2000, 2))
    if change == "none":
        with log.open("a", newline=newline) as file:
            file.write(more)
    elif change == "rotated":
        log.rename(tmp_path / "log.csv.1")
        log.write_text("gx\n" + more, newline=newline)
    else:
        with log.open("r+", newline=newline) as file:
            file.truncate(0)
            file.write("gx\n" + more)
    code, out, err = run("watch", log, *options)
    assert (code, last(out)["samples"]) == (0, 5000)
    assert ("first row" in err) == (change != "none")


# -- motion ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("moves", [True, False])
def test_motion_at_the_start_is_said_once(run, tmp_path, moves):
    log = tmp_path / "log.csv"
    x = MOVING["hand"](1, only=("gyro_z",)).samples if moves else 0.1 * noise(24_000)
    log.write_text("gyro_z\n" + text(x))
    code, out, err = run("watch", log, "--model", "N(N=0.01)", "--rate", "100", "--unit", "deg/s")
    assert code == 0
    assert last(out)["holds"] is not moves
    assert err.count("not at rest") == err.count("\n") == int(moves)
