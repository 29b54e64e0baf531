"""Files that are damaged, or meant to do harm: one short line each, never a traceback, a signal or a full memory."""

import gzip
import io
import os
import zipfile
from contextlib import suppress

import numpy as np
import pytest

import allanite as al
from allanite.common.memory import VARIABLE

X = np.random.default_rng(5).standard_normal(200)


def refused(path, *words, **options):
    with pytest.raises(al.AllaniteError) as caught:
        al.read(path, **{"rate": 1, **options})
    message = str(caught.value)
    assert message.isprintable()
    assert len(message) <= 300
    for word in words:
        assert word in message
    return message


def npz(path, **members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            if isinstance(content, np.ndarray):
                buffer = io.BytesIO()
                np.save(buffer, content)
                content = buffer.getvalue()
            archive.writestr(f"{name}.npy", content)
    return path


HEADERS = {
    "an open bracket": b"{'descr': '<f8', 'fortran_order': False, 'shape': (3,",
    "no literal": b"{'descr': '<f8', 'fortran_order': False, 'shape': f()}",
    "too many": b"{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999999999999999,)}",
    "many": b"{'descr': '<f8', 'fortran_order': False, 'shape': (999999999999,)}",
    "negative": b"{'descr': '<f8', 'fortran_order': False, 'shape': (-3,)}",
    "no type": b"{'descr': '<q99', 'fortran_order': False, 'shape': (3,)}",
    "an open string": b"{'descr': '<f8",
    "a line end": b"{'descr': '<f8',\n 'shape'\n: L)}",
}


@pytest.mark.parametrize("name", HEADERS)
def test_headers_of_npy(tmp_path, name):
    header = HEADERS[name].ljust(117) + b"\n"
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(24)
    (tmp_path / "x.npy").write_bytes(content)
    if name == "negative":
        with suppress(al.AllaniteError):  # older NumPy reads what is there
            assert al.read(tmp_path / "x.npy", rate=1).n == 3
        return
    refused(tmp_path / "x.npy", "x.npy")
    refused(npz(tmp_path / "x.npz", data=content), "x.npz")


def test_archives_that_are_no_archives(tmp_path):
    good = npz(tmp_path / "x.npz", data=X).read_bytes()
    at = good.index(b"PK\x01\x02")
    good = bytes(good)
    for change in (
        lambda b: b.__setitem__(slice(at + 10, at + 12), b"\x63\x00"),
        lambda b: b.__setitem__(slice(at + 8, at + 10), b"\x01\x00"),
        lambda b: b.__setitem__(slice(at + 42, at + 46), b"\xff\xff\xff\x7f"),
        lambda b: b.__setitem__(slice(40, 60), bytes(20)),
    ):
        bad = bytearray(good)
        change(bad)
        assert bad != good
        (tmp_path / "bad.npz").write_bytes(bad)
        refused(tmp_path / "bad.npz", "bad.npz")


def test_arrays_of_the_wrong_kind(tmp_path):
    path = tmp_path / "x.npz"
    refused(npz(path, data=np.empty((0, 3))), "no samples")
    np.save(tmp_path / "x.npy", np.empty((0, 3)))
    refused(tmp_path / "x.npy", "no samples")
    refused(npz(path, data=X, t=np.array(["a"] * 200)), "'t'", rate=None)
    refused(npz(path, data=X, t=np.arange(200).astype("m8[s]")), "'t'", rate=None)
    refused(npz(path, data=X, t=np.arange(200) + 1j), "'t'", rate=None)
    refused(npz(path, data=X, unit=np.array(5)), "'unit'")
    refused(npz(path, data=X, channels=np.array(5)), "'channels'")
    refused(npz(path, data=X, rate_hz=np.array("a")), "'rate_hz'", rate=None)


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
    path = npz(tmp_path / "x.npz", data=np.zeros(2_000_000))
    assert path.stat().st_size < 50_000
    monkeypatch.setenv(VARIABLE, "8M")
    refused(path, "16 MB", "ALLANITE_MEMORY=8M", "to allow it")
    monkeypatch.setenv(VARIABLE, "40 MB")
    assert al.read(path, rate=1).n == 2_000_000
    monkeypatch.setenv(VARIABLE, "much")
    refused(path, "ALLANITE_MEMORY=much")


def _hdf5(path, x):
    with pytest.importorskip("h5py").File(path, "w") as file:
        file.create_dataset("gyro", data=x, compression="gzip")


def _matlab(path, x):
    pytest.importorskip("scipy.io").savemat(path, {"gyro": x}, do_compression=True)


def _parquet(path, x):
    pa, files = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    files.write_table(pa.table({"gyro": x}), path, compression="zstd")


def _feather(path, x):
    pa, files = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.feather")
    files.write_feather(pa.table({"gyro": x}), path, compression="zstd")


def _gzip(path, x):
    with gzip.open(path, "wb") as stream:
        np.save(stream, x)


PACKED = {"h5": _hdf5, "mat": _matlab, "parquet": _parquet, "feather": _feather, "npy.gz": _gzip}


@pytest.mark.parametrize("form", PACKED)
def test_a_bomb_of_any_format_is_refused(tmp_path, monkeypatch, form):
    path = tmp_path / f"x.{form}"
    PACKED[form](path, np.zeros(2_000_000))
    assert path.stat().st_size < 100_000
    monkeypatch.setenv(VARIABLE, "8M")
    said = refused(path, "of memory, more than", "ALLANITE_MEMORY=8M", "to allow it")
    assert "damaged" not in said
    monkeypatch.setenv(VARIABLE, "80 MB")
    assert al.read(path, rate=1).n == 2_000_000


def test_a_row_of_two_million_columns(tmp_path):
    (tmp_path / "x.csv").write_text(",".join(["1.5"] * 2_000_000) + "\n")
    refused(tmp_path / "x.csv", "row 1", "transposed")


def test_names_are_data(tmp_path):
    hostile = "gx\nsystem('rm -rf /'); % \x1b[2J\x00\u202e"
    path = npz(tmp_path / "x.npz", data=X, channels=np.array(hostile), rate_hz=np.array(1.0))
    recording = al.read(path, column=hostile)
    assert recording.columns[0].isprintable()
    assert r"\n" in recording.columns[0]
    assert al.Recording(X, rate=1, columns=[hostile]).columns == recording.columns
    assert al.read(path, column=recording.columns[0]).n == 200
    refused(path, "unknown column", column="\x1b]0;gone\x07")
    refused(path, column="x" * 100_000)


@pytest.mark.skipif(os.name != "posix", reason="names of files are bytes on POSIX only")
@pytest.mark.parametrize("form", ["csv", "npy", "npz"])
def test_names_of_files_that_are_not_text(tmp_path, form):
    path = tmp_path / os.fsdecode(b"gyro\xff\n\x1b[31m." + form.encode())
    try:
        path.touch()
    except OSError:
        pytest.skip("this system wants names in UTF-8")
    refused(path, "empty")
    if form == "csv":
        path.write_text("gx\n" + "\n".join(map(repr, X.tolist())))
    elif form == "npy":
        with path.open("wb") as stream:
            np.save(stream, X)
    else:
        npz(path, data=X)
    recording = al.read(path, rate=1)
    assert recording.n == 200
    assert recording.path is not None
    assert r"\udcff\n\x1b" in recording.describe()["path"]


def test_two_points_of_an_angle_describe_themselves():
    recording = al.Recording([1.0, 2.0], rate=1, quantity="angle", unit="rad")
    assert recording.describe()["n"] == 2
