"""Logs that read other files, promise more than they hold, or never end: one line each, within the memory budget."""

import os
import resource
import time
import zipfile

import numpy as np
import pytest

import allanite as al
from allanite.common.memory import VARIABLE

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pipes and devices are POSIX")
X = np.random.default_rng(1).standard_normal(1000)


def refused(path, match):
    """Read a log that must be refused in one short line, with little processor time and memory."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started = time.process_time()
    with pytest.raises(al.AllaniteError, match=match) as caught:
        al.read(path, rate=100)
    message = str(caught.value)
    assert message.isprintable()
    assert len(message) <= 300
    assert time.process_time() - started < 2.0
    if os.uname().sysname == "Linux":  # macOS counts in bytes
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000
    return message


# -- HDF5 -------------------------------------------------------------------------------------------


def virtual(source, name):
    def add(h5py, file):
        layout = h5py.VirtualLayout(shape=(1000,), dtype="f8")
        layout[:] = h5py.VirtualSource(source, name, shape=(1000,))
        file.create_virtual_dataset("v", layout)

    return add


def external_storage(source):
    return lambda _, file: file.create_dataset(
        "e", shape=(1000,), dtype="f8", external=[(source, 0, 8000)]
    )


def external_link(source):
    def add(h5py, file):
        file.create_group("g")["l"] = h5py.ExternalLink(source, "/x")

    return add


#: What reads another file → what adds it to an open file, and words of the refusal.
FEATURES = {
    "virtual, of itself": (virtual(".", "v"), "dataset v is virtual"),
    "virtual, of another file": (virtual("other.h5", "x"), "dataset v is virtual"),
    "virtual, of a pipe": (virtual("pipe", "x"), "dataset v is virtual"),
    "external storage": (external_storage("raw.bin"), "dataset e has external storage"),
    "external storage in a pipe": (external_storage("pipe"), "dataset e has external storage"),
    "external link": (external_link("other.h5"), "link g/l is external"),
    "external link to a pipe": (external_link("pipe"), "link g/l is external"),
}


def hdf5_log(path, add=None):
    h5py = pytest.importorskip("h5py")
    matlab = path.suffix == ".mat"
    with h5py.File(path, "w", userblock_size=512 if matlab else 0) as file:
        file["x"] = X
        if add is not None:
            add(h5py, file)
    if matlab:
        with path.open("r+b") as stream:
            stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    return path


@pytest.mark.parametrize("suffix", [".h5", ".nc", ".mat"])
@pytest.mark.parametrize("feature", FEATURES)
def test_what_reads_another_file_is_refused(tmp_path, forked, monkeypatch, feature, suffix):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    hdf5_log(tmp_path / "other.h5")
    (tmp_path / "raw.bin").write_bytes(X.tobytes())
    add, words = FEATURES[feature]
    refused(hdf5_log(tmp_path / f"log{suffix}", add), f"{words} and would read another file")


def test_links_inside_the_file_are_no_reason_to_refuse_it(tmp_path, forked):
    def add(h5py, file):
        file["soft"], file["nowhere"] = h5py.SoftLink("/x"), h5py.SoftLink("/gone")
        file.create_group("g")["again"] = file["/"]

    recording = al.read(hdf5_log(tmp_path / "log.h5", add), rate=100)
    np.testing.assert_array_equal(recording.samples, X)


# -- files that are none ------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".csv", ".npy", ".npz", ".mat", ".h5", ".bin", ".tim", ".clk", ".phd"])  # fmt: skip
def test_pipes_and_devices_are_no_logs(tmp_path, suffix):
    os.mkfifo(tmp_path / f"pipe{suffix}")
    (tmp_path / f"zeros{suffix}").symlink_to("/dev/zero")
    for name in ("pipe", "zeros"):
        refused(
            tmp_path / f"{name}{suffix}", "a pipe or a device, but a log is read more than once"
        )


def test_a_pipe_in_the_folder_of_a_bag(tmp_path, forked):
    pytest.importorskip("rosbags")
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    os.mkfifo(tmp_path / "bag.db3")
    refused(tmp_path, "the folder of the bag contains a pipe or a device")


# -- promises of headers ------------------------------------------------------------------------------


def npy(path, shape, content=b"", hole=0):
    with path.open("wb") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, header)
        file.write(content)
        file.truncate(file.tell() + hole)
    return path


def test_arrays_without_samples_and_with_more_columns_than_samples(tmp_path):
    empty = npy(tmp_path / "empty.npy", (0, 10**12))
    refused(empty, "no samples")
    with zipfile.ZipFile(tmp_path / "empty.npz", "w") as archive:
        archive.write(empty, "data.npy")
    refused(tmp_path / "empty.npz", "no samples")
    refused(npy(tmp_path / "wide.npy", (3, 10**8), hole=24 * 10**8), "transpose")
    refused(npy(tmp_path / "cut.npy", (10**10,), bytes(80)), "needs 80000000000 bytes")


def sparse(path, begin, size=3 * 10**9):
    with path.open("wb") as file:
        file.write(begin)
        file.truncate(size)
    return path


#: Name of a log → how it begins, its size, and words of the refusal.
LARGE = {
    "count.tim": (b"TIC 1000000000000000000 1\n1 2 3\n", 32, "ends after 3 of"),
    "count-of-columns.tim": (b"TIC 1 1000000000000000000\n1 2 3\n", 32, "ends after 3 of"),
    "hole.tim": (b"TIC 100000000 1\n1 2 3\n", 3 * 10**9, "holds text"),
    "nothing.tim": (b"", 3 * 10**9, "no block of time errors"),
    "hole.clk": (b"   END OF HEADER\n", 3 * 10**9, "line 2 is longer than 64 kB"),
    "hole.txt": (b"$VNGYR,1,2,3*XX\n" * 400, 3 * 10**9, "binary data"),
    "hole.mcap": (b"\x89MCAP0\r\n", 3 * 10**9, "damaged or not a ROS bag"),
}


@pytest.mark.parametrize("name", LARGE)
def test_holes_and_counts(tmp_path, forked, monkeypatch, name):
    if name.endswith(".mcap"):
        pytest.importorskip("rosbags")
    monkeypatch.setenv(VARIABLE, "500M")
    begin, size, words = LARGE[name]
    refused(sparse(tmp_path / name, begin, size), words)


def test_a_compressed_file_within_another_is_refused(tmp_path):
    """A chain of them was decompressed to its end, and each of a thousand files may be as large as the budget."""
    import gzip

    text = "gx\n" + "\n".join(map(str, X))
    (tmp_path / "x.csv.gz").write_bytes(gzip.compress(text.encode()))
    assert al.read(tmp_path / "x.csv.gz", rate=1).n == 1000
    (tmp_path / "x.csv.gz").write_bytes(gzip.compress(gzip.compress(text.encode())))
    refused(tmp_path / "x.csv.gz", "a gzip file within a gzip file")


def test_an_archive_of_archives_holds_no_text_log(tmp_path):
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        archive.writestr("y.zip", b"PK")
    refused(tmp_path / "x.zip", "no text log in the archive")


def test_clocks_that_share_no_epoch(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, "100M")
    rows = [
        f"AS G{k:05d} 2026 01 01 {k // 3600:02d} {k // 60 % 60:02d} {k % 60:9.6f}  1   1.0e-9\n"
        for k in range(4000)
    ]
    (tmp_path / "x.clk").write_text("   END OF HEADER\n" + "".join(rows))
    refused(tmp_path / "x.clk", "4000 clocks at 4000 epochs needs 0.128 GB")


def test_text_that_needs_more_than_the_budget(tmp_path, monkeypatch):
    (tmp_path / "x.csv").write_text("a,b\n" + "1,2\n" * 200_000)
    assert al.read(tmp_path / "x.csv", rate=1).n == 200_000
    monkeypatch.setenv(VARIABLE, "2M")
    refused(tmp_path / "x.csv", r"2 columns needs 3\.84 MB of memory, more than 2 MB")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["parquet", "feather"])
def test_columns_of_text_and_lists_are_not_read(tmp_path, forked, monkeypatch, kind):
    """750 bytes once grew beyond 3 GB, for a column that was not requested."""
    pa = pytest.importorskip("pyarrow")
    from pyarrow import feather, parquet

    columns = {"gx": X, "note": ["x" * 200_000] * 1000, "rows": [[0.0] * 20_000] * 1000}
    write = {"parquet": parquet.write_table, "feather": feather.write_feather}[kind]
    path = tmp_path / f"x.{kind}"
    write(pa.table(columns), str(path), compression="zstd")
    del columns
    monkeypatch.setenv(VARIABLE, "50M")
    recording = al.read(path, rate=100)
    assert recording.columns == ("gx",)
    np.testing.assert_array_equal(recording.samples, X)
    write(pa.table({"gx": np.zeros(10_000_000)}), str(path), compression="zstd")
    refused(path, "unpacked file needs")


def test_arrays_of_matlab_that_are_too_large_together(tmp_path, monkeypatch):
    savemat = pytest.importorskip("scipy.io").savemat
    savemat(tmp_path / "x.mat", {f"a{k}": np.zeros(10**6) for k in range(9)}, do_compression=True)
    monkeypatch.setenv(VARIABLE, "40M")
    refused(tmp_path / "x.mat", "unpacked file needs")


def test_the_names_of_many_arrays_take_little_time():
    """The time once grew with the square of their number: a file of 8 MB took 16 s."""
    from allanite.readers.arrays.matlab import assemble

    found = {f"g{k}.gyro" if k < 2 else f"g.x{k}": X[:3] for k in range(40_000)}
    started = time.process_time()
    table = assemble(found)
    assert time.process_time() - started < 10.0  # by the square, minutes
    assert table.names[:3] == ("g0.gyro", "g1.gyro", "x2")


# -- readers that never end ---------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".ulg", ".bin", ".h5"])
def test_every_reader_of_a_foreign_library_has_a_deadline(tmp_path, forked, monkeypatch, suffix):
    from allanite.readers import FORMATS, _isolated

    def endless(*_):
        while True:
            pass

    monkeypatch.setattr(_isolated, "CPU_SECONDS", 1.0)
    monkeypatch.setattr(FORMATS.of_suffix(suffix).read, "__wrapped__", endless)
    (tmp_path / f"x{suffix}").write_bytes(b"something")
    try:
        refused(tmp_path / f"x{suffix}", "does not finish reading this file")
    except ModuleNotFoundError:
        pytest.skip("its library is not installed")


def test_every_reader_of_a_foreign_library_is_isolated():
    """A reader either reads bytes itself, or runs in a child process."""
    from allanite.readers import FORMATS

    own = {f"allanite.readers.arrays.{name}" for name in ("npy", "npz", "matlab")}
    own |= {f"allanite.readers.clocks.{name}" for name in ("rinex", "stable32", "timelab")}
    readers = [one.read for one in FORMATS if one.suffixes]
    others = {read for read in readers if read.__module__ not in own}
    assert others
    assert all(hasattr(read, "__wrapped__") for read in others)


def test_a_lack_of_memory_of_arrow_is_no_damage(tmp_path, monkeypatch):
    """The error of Arrow for a lack of memory is also one of its errors for damaged files."""
    pa = pytest.importorskip("pyarrow")
    from allanite.readers.arrays import parquet

    def greedy(_):
        raise pa.lib.ArrowMemoryError("malloc of size 240000000 failed")

    monkeypatch.setattr(parquet, "_parquet_table", greedy)
    (tmp_path / "x.parquet").write_bytes(b"PAR1 something")
    with pytest.raises(MemoryError):
        parquet.read.__wrapped__(tmp_path / "x.parquet", None)


@pytest.mark.slow
def test_a_lack_of_memory_is_no_damage(tmp_path, forked, monkeypatch):
    from allanite.readers import FORMATS

    def greedy(*_):
        from allanite.readers import refused_as

        with refused_as("a log"):
            return [bytearray(10**8) for _ in range(100)]

    monkeypatch.setattr(FORMATS.of_suffix(".h5").read, "__wrapped__", greedy)
    monkeypatch.setenv(VARIABLE, "300M")
    pytest.importorskip("h5py")
    (tmp_path / "x.h5").write_bytes(b"something")
    if os.uname().sysname == "Linux":
        with pytest.raises(
            al.InputError, match=r"more memory than 0\.3 GB \(ALLANITE_MEMORY=300M\)"
        ):
            al.read(tmp_path / "x.h5", rate=1)
