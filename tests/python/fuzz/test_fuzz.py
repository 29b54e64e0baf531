"""Half a minute of what `make fuzz` does for ten, and inputs that were once answered wrongly."""

import json
import re
import subprocess
import sys
import time
import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.cli.options import rate_varies
from allanite.readers import FORMATS
from fuzz.logs import SAMPLES_OF

HERE = Path(__file__).resolve().parent
NEEDS = {
    "mat73": "h5py",
    "hdf5": "h5py",
    "ulog": "pyulog",
    "page": "starlette",
    "page, a study": "starlette",
    "ardupilot": "pymavlink",
}
NEEDS |= dict.fromkeys(("parquet", "feather"), "pyarrow") | dict.fromkeys(
    ("bag", "db3", "mcap"), "rosbags"
)
# Read as text: what makes the seeds need not be installed.
TARGETS = [
    *re.findall(r'^        "(.+)": ', (HERE / "targets.py").read_text("utf-8"), re.MULTILINE),
    *SAMPLES_OF,
]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="memory is read the POSIX way")
@pytest.mark.parametrize("target", TARGETS)
def test_damaged_input_is_answered(target, tmp_path):
    if target in NEEDS:
        pytest.importorskip(NEEDS[target])
    words = ["--target", target, "--seconds", "1", "--calls", "200"]
    done = subprocess.run(
        [sys.executable, HERE / "run.py", *words],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="readers run in forks")
def test_logs_with_one_field_changed_are_answered(tmp_path):
    for library in ("h5py", "pyarrow", "rosbags", "pyulog", "pymavlink"):
        pytest.importorskip(library)
    done = subprocess.run(
        [sys.executable, HERE / "structured.py", "--mutants", "420"],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=900,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("target", [name for name in TARGETS if not name.startswith("page")])
def test_seeds_are_accepted(target, tmp_path, monkeypatch):
    """Damaged copies of a refused seed test nothing; the data sheets of both forms were once refused."""
    if target in NEEDS:
        pytest.importorskip(NEEDS[target])
    monkeypatch.syspath_prepend(HERE)
    from targets import targets

    seeds, call, _ = targets()[target]()
    for seed in seeds:
        with suppress(al.AllaniteError):
            call(seed, tmp_path)
            return
    pytest.fail("every seed is refused")


def test_every_reader_is_fuzzed():
    source = (HERE / "targets.py").read_text(encoding="utf-8")
    tried = {suffix for suffix, *_ in SAMPLES_OF.values()}
    tried |= set(re.findall(r'reader\("(\.\w+)"', source))
    missing = [one.title for one in FORMATS if one.suffixes and not tried & set(one.suffixes)]
    assert not missing, f"add a sample to SAMPLES_OF in logs.py: {missing}"


def test_numbers_near_the_edge_are_judged_without_warnings():
    for scale in (1e300, 1e39, 1e-300):
        recording = al.Recording(np.random.default_rng(1).standard_normal(500) * scale, rate=10)
        assert recording.describe()["n"] == 500


def test_whether_samples_near_the_ends_of_doubles_vary_is_told_without_a_warning():
    assert rate_varies(al.Recording([-1.7e308, 1.7e308] * 9, rate=1.0))
    assert not rate_varies(al.Recording([1.7e308] * 9, rate=1.0))


def test_a_message_of_no_length_is_read_once():
    """A damaged format stated the length 0, and the library never ended."""
    pytest.importorskip("pymavlink")
    start = time.process_time()
    refused(HERE / "found" / "no-length.bin", "length 0")
    assert time.process_time() - start < 5.0


def test_a_nan_that_signals_is_missing_like_others():
    bits = np.random.default_rng(1).standard_normal(500)
    bits *= 1e300
    bits[7] = np.array(0x7FF0000000000001, dtype="<u8").view("<f8")
    for kind in ("oadev", "mdev", "mtie"):
        assert np.isfinite(getattr(al, kind)(bits, rate=10.0).deviation[0])


def test_a_model_string_is_no_name_of_a_file():
    for text in ("N" * 3000, "N+\0", "\ud800"):
        with pytest.raises(al.AllaniteError):
            al.parse_model(text)


def refused(path, words):
    with pytest.raises(al.AllaniteError, match=words):
        al.read(path)


@pytest.mark.parametrize(
    "stamps", [[0.0, 1e305, 2.0, 3.0], [0.0, 1e-316, 1.0, 2.0], [1e-316 * k for k in range(9)]]
)
def test_stamps_that_no_clock_has(stamps):
    """An answer or one line, and no warning of NumPy."""
    try:
        assert np.isfinite(al.Recording(range(len(stamps)), time=stamps).rate)
    except al.AllaniteError as error:
        assert "time" in str(error) or "rate must be" in str(error)


@pytest.mark.slow
def test_text_of_an_arrow_file_with_offsets_that_go_back(tmp_path):
    """A damaged column that was not even requested took 23 s."""
    pa = pytest.importorskip("pyarrow")
    feather = pytest.importorskip("pyarrow.feather")
    offsets = np.array([0, 1, -(2**30), 3], dtype=np.int32)
    text = pa.StringArray.from_buffers(3, pa.py_buffer(offsets), pa.py_buffer(b"abc"))
    table = pa.table({"gx": [1.0, 2.0, 3.0], "note": text})
    feather.write_feather(table, tmp_path / "x.feather", compression="uncompressed")
    start = time.process_time()
    refused(tmp_path / "x.feather", r"x\.feather: ")
    assert time.process_time() - start < 5.0


def test_an_archive_with_a_damaged_directory(tmp_path):
    path = tmp_path / "x.zip"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("gyro.csv", "t,x\n0,1\n1,2\n")
    data = bytearray(path.read_bytes())
    end = data.index(b"PK\x05\x06")
    # The place of the directory, from which the beginning of the archive is reckoned.
    data[end + 16 : end + 20] = (10**6).to_bytes(4, "little")
    path.write_bytes(data)
    refused(path, r"x\.zip: ")
    # A name that is said to be UTF-8 and is not.
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("gÿro.csv", "t,x\n0,1\n1,2\n")
    path.write_bytes(path.read_bytes().replace("ÿ".encode(), b"\x82\x82"))
    refused(path, r"x\.zip: damaged")


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted((HERE / "found").iterdir()), ids=lambda path: path.name)
def test_found_inputs(path):
    """Each input once caused a traceback, a warning, a signal or half a minute; it must not end this process."""
    needs = {".h5": "h5py", ".feather": "pyarrow", ".ulg": "pyulog", ".bin": "pymavlink"}
    pytest.importorskip(needs.get(path.suffix, "scipy"))
    code = (
        "import sys, allanite as al\n"
        "try: al.read(sys.argv[1]).describe()\n"
        "except al.AllaniteError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code, str(path)],
        capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(done.stdout) <= 300


@pytest.mark.parametrize(
    "effects",
    [3, [3], ["N"], [{"kind": "N", "parameters": 3}], [{"kind": "N", "parameters": {"N": 3}}],
     [{"kind": "N", "held": 3}], [{"kind": "N", "parameters": {"N": {"value": {}}}}], {"N": 1}],
)  # fmt: skip
def test_a_model_file_with_another_shape_is_one_line(tmp_path, effects):
    path = tmp_path / "m.json"
    path.write_text(json.dumps({"schema": "allanite/model/1", "effects": effects}))
    with pytest.raises(al.AllaniteError, match=r"m\.json|is not a number"):
        al.parse_model(str(path))


@pytest.mark.parametrize("text", ["[" * 100_000, '{"schema": ' + "1" * 5000 + "}"])
def test_a_model_file_that_json_itself_gives_up_is_one_line(tmp_path, text):
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(al.AllaniteError, match="not a JSON file"):
        al.parse_model(str(tmp_path / "m.json"))


def test_single_precision_nan_that_signals_is_missing_like_others(tmp_path):
    samples = np.random.default_rng(1).standard_normal(500).astype(np.float32)
    samples[7] = np.array(0x7F800001, dtype="<u4").view("<f4")
    assert np.isnan(al.Recording(samples, rate=10).rate_samples()[7])


@pytest.mark.parametrize("name", ["prints-on-stdout.ulg", "prints-on-stderr.bin"])
def test_what_a_foreign_library_prints_is_not_said(name, capfd):
    """Warnings of pyulog were printed before a command's JSON, and those of pymavlink beside its one line."""
    pytest.importorskip({".ulg": "pyulog", ".bin": "pymavlink"}[name[-4:]])
    with suppress(al.AllaniteError):
        al.read(HERE / "found" / name)
    assert capfd.readouterr() == ("", "")
