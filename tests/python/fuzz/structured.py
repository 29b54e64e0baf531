"""Valid logs with one field changed: `structured.py --mutants 100000 [--seed 0] [--format NAME]`.

A mutant is written by the format's own library, or is such a file with another value of one count, size, offset, type
or name. Each format has its own process, in which readers of foreign libraries run in forks. One log of a hundred is
read in a new process. Every mutant must give a recording and its deviations, or one of allanite's errors in one line of
at most 300 characters, within 10 s and 1 GB.
"""

import argparse
import faulthandler
import gzip
import io
import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import traceback
import warnings
import zipfile
from collections import Counter
from functools import partial
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import logs  # noqa: E402
import numpy as np  # noqa: E402
import run  # noqa: E402
import targets  # noqa: E402
from mutate import EDGES  # noqa: E402

#: s and KiB that one call may take.
SLOW, LARGE = 10.0, 1_000_000
#: Budget of memory in the run: bombs must be refused far below a gigabyte.
BUDGET = "400M"
X = np.random.default_rng(3).standard_normal(200)


# -- fields of binary files: (offset, width, order) -----------------------------------------------


def words(data):
    """Places of whole numbers that may be counts, sizes or offsets: not 0, and not beyond the file."""
    found = []
    for width in (2, 4, 8):
        values = np.frombuffer(data[: len(data) // width * width], f"<u{width}")
        places = np.flatnonzero((values > 0) & (values <= 2 * len(data)))[:400]
        found += [(int(at) * width, width, "little") for at in places]
    return found


def ulog_fields(data):
    """Length and type of every message, and the first bytes of its body."""
    found, at = [(8, 8, "little")], 16
    while at + 3 <= len(data):
        (size,) = struct.unpack_from("<H", data, at)
        found += [(at, 2, "little"), (at + 2, 1, "little"), (at + 3, 2, "little")]
        found += [(at + 3 + k, 8, "little") for k in range(0, min(size, 48) - 7, 8)]
        at += 3 + size
    return found


def ardupilot_fields(data):
    """Type and length of formats, and the codes and names of their fields."""
    found = []
    for at in range(0, min(len(data), 178), 89):
        found += [(at + k, 1, "little") for k in range(89)] * (1 + (at == 89))
    return [*found, *((at, 1, "little") for at in range(178, min(len(data), 400)))]


def mcap_fields(data):
    """Opcode, length and body of every record, also inside chunks that are not compressed."""
    found, at = [], 8
    while at + 9 <= len(data) - 8:
        (size,) = struct.unpack_from("<Q", data, at + 1)
        found += [(at, 1, "little"), (at + 1, 8, "little")]
        found += [
            (at + 9 + k, w, "little") for w in (2, 4, 8) for k in range(0, min(size, 80) - 7, w)
        ]
        at += 9 + size
    return found


def bag_fields(data):
    """Lengths of the records and of the fields in their heads."""
    found, at = [], 13
    while at + 8 <= len(data):
        (head,) = struct.unpack_from("<I", data, at)
        found.append((at, 4, "little"))
        inner = at + 4
        while inner < at + 4 + head and inner + 4 <= len(data):
            (size,) = struct.unpack_from("<I", data, inner)
            found += [(inner, 4, "little"), (inner + 4, 1, "little")]
            found += [(max(inner + size, 0), 4, "little"), (max(inner + size - 4, 0), 8, "little")]
            inner += 4 + size
        at += 4 + head
        if at + 4 > len(data):
            break
        (size,) = struct.unpack_from("<I", data, at)
        found.append((at, 4, "little"))
        at += 4 + size
    return [field for field in found if field[0] + field[1] <= len(data)]


def archive_fields(data):
    """Every field of the heads of members, of the directory and of its end."""
    found = []
    for mark, length in ((b"PK\3\4", 30), (b"PK\1\2", 46), (b"PK\5\6", 22)):
        at = data.find(mark)
        while at >= 0:
            found += [(at + k, 2, "little") for k in range(4, length, 2)]
            found += [(at + k, 4, "little") for k in range(4, length - 3, 2)]
            at = data.find(mark, at + 1)
    return found


def all_bytes(data):
    """Every place but the last ones, as numbers of 1, 2 and 4 bytes."""
    return [(k, width, "little") for width in (1, 2, 4) for k in range(len(data) - 4)]


def archives():
    """A log in an archive, packed by each method of the library."""
    (stored,) = logs.archive()
    with zipfile.ZipFile(io.BytesIO(stored)) as archive:
        rows = archive.read("Gyroscope.csv")
    found = [stored]
    for method in (zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", method) as archive:
            archive.writestr("Gyroscope.csv", rows)
        found.append(stream.getvalue())
    return found


def repacked(make):
    """The mutants of `make`, packed by gzip."""

    def packed(rng):
        suffix, data, options = make(rng)
        return f"{suffix}.gz", gzip.compress(data, 1, mtime=0), options

    return packed


def changed(rng, data, fields):
    """The file with another value in one of its fields."""
    data = bytearray(data)
    at, width, order = fields[rng.integers(len(fields))]
    old = int.from_bytes(data[at : at + width], order)
    other = fields[rng.integers(len(fields))]
    new = (
        EDGES[rng.integers(len(EDGES))],
        old + 1,
        old - 1,
        2 * old,
        old // 2,
        old ^ (1 << int(rng.integers(8 * width))),
        int.from_bytes(data[other[0] : other[0] + other[1]], order),
        256**width - old,
        int(rng.integers(256)),
        len(data) - at,
    )[rng.integers(10)]
    data[at : at + width] = (new % 256**width).to_bytes(width, order)
    return bytes(data)


def patched(suffix, seeds, fields, **options):
    """Mutants of seeds, with another value in one of the fields that `fields` finds."""
    seeds = seeds()
    places = [fields(seed) for seed in seeds]

    def make(rng):
        k = int(rng.integers(len(seeds)))
        return suffix, changed(rng, seeds[k], places[k]), options

    return make


# -- text: one cell changed -------------------------------------------------------------------------

CELLS = [
    "",
    "nan",
    "-inf",
    "1e999",
    "1e308",
    "-1e-320",
    "0",
    "-1",
    "1,5",
    "99999999999999999999",
    "2026-13-45",
    "\0",
    "a" * 70_000,
    "9" * 70_000,
    "a" + " " * 70_000 + "b",
    "1e-320",
    "0x10",
    "１",
    "TIC",
    "\r",
    "\u202e",
    "9" * 5000,
    "-0",
    "+",
    "1;2",
    '"',
    "END OF HEADER",
    "AS",
    "1_000",
]

#: What stands between the words of a line.
PARTS = r"([\s,;=:*\[\]]+)"


def cells(suffix, seeds, **options):
    """Mutants of text: one cell, word or line has another value, is missing or is repeated."""
    seeds = [seed.decode() for seed in seeds()]

    def make(rng):
        lines = seeds[rng.integers(len(seeds))].splitlines(keepends=True)
        # Heads decide how the rest is read: half of the changes are there.
        row = int(rng.integers(min(len(lines), 6) if rng.random() < 0.5 else len(lines)))
        kind = int(rng.integers(6))
        if kind == 0:
            lines[row] = "" if rng.random() < 0.5 else lines[row] * int(rng.integers(2, 40))
        else:
            parts = re.split(PARTS, lines[row])
            at = int(rng.integers(len(parts)))
            parts[at] = CELLS[rng.integers(len(CELLS))]
            lines[row] = "".join(parts)
        return suffix, "".join(lines).encode("utf-8", "surrogatepass"), options

    return make


# -- what libraries write -----------------------------------------------------------------------------

DTYPES = [
    "<f8",
    "<f4",
    ">f8",
    "<i2",
    "|u1",
    "<u8",
    "|b1",
    "<f2",
    "<c16",
    "<M8[us]",
    "|S3",
    "<U2",
    "|V8",
    "<f16",
]
SHAPES = [
    (0,),
    (1,),
    (200,),
    (0, 3),
    (200, 1),
    (3, 66),
    (66, 3),
    (2, 10, 10),
    (),
    (0, 10**12),
    (10**12,),
    (10**6, 0),
    (-1,),
    (1, 200),
    (2**62, 4),
    (200, 0, 3),
    (1,) * 30,
    (10**30,),
]


def npy(rng):
    """An array whose header states another type, order or shape."""
    head = {
        "descr": DTYPES[rng.integers(len(DTYPES))],
        "fortran_order": bool(rng.integers(2)),
        "shape": SHAPES[rng.integers(len(SHAPES))],
    }
    if rng.random() < 0.2:
        head[["descr", "shape", "more"][rng.integers(3)]] = [
            None,
            "|O",
            (1.5,),
            [("x", "<f8")],
            ("a",),
        ][rng.integers(5)]
    # Written here: the library would refuse most of these heads.
    width = int(rng.choice([2, 4]))
    text = repr(head).encode()
    if rng.random() < 0.2:
        # Brackets and quotes that are not closed.
        at, more = int(rng.integers(len(text))), b"([{'\",:\n\\#-"
        text = (
            text[:at] + bytes([more[rng.integers(len(more))]]) + text[at + int(rng.integers(3)) :]
        )
    text = text.ljust(117) + b"\n"
    begin = b"\x93NUMPY" + bytes([width // 2, 0]) + len(text).to_bytes(width, "little")
    data = bytearray(begin + text + X.tobytes())
    if rng.random() < 0.3:
        data = bytearray(
            changed(
                rng,
                bytes(data),
                [(6, 1, "little"), (7, 1, "little"), (8, 2, "little"), (8, 4, "little")],
            )
        )
    return ".npy", bytes(data), {"rate": 10}


def npz(rng):
    stream = io.BytesIO()
    with zipfile.ZipFile(
        stream, "w", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED][rng.integers(2)]
    ) as archive:
        for key in ("data", "rate_hz", "channels", "unit", "t"):
            value = {
                "data": X.reshape(-1, 2),
                "rate_hz": np.array(9.0),
                "channels": np.array(["a", "b"]),
                "unit": np.array("deg/s"),
                "t": np.arange(100.0),
            }[key]
            if rng.random() < 0.25:
                archive.writestr(f"{key}.npy", npy(rng)[1])
            elif rng.random() < 0.95:
                inner = io.BytesIO()
                np.save(inner, value)
                archive.writestr(f"{key}.npy", inner.getvalue())
    data = stream.getvalue()
    return ".npz", changed(rng, data, archive_fields(data)) if rng.random() < 0.4 else data, {}


def hdf5(suffix):
    """HDF5 with virtual datasets, links, external storage, filters, chunks, types and attributes."""
    import h5py

    def make(rng):
        stream = io.BytesIO()
        block = 512 if suffix == ".mat" else 0
        version = [None, "latest", ("v108", "v110")][rng.integers(3)]
        with h5py.File(stream, "w", userblock_size=block, libver=version) as file:
            file["gyro"] = X
            for feature in rng.choice(len(FEATURES), int(rng.integers(1, 3)), replace=False):
                FEATURES[feature](h5py, file, rng)
        data = stream.getvalue()
        if suffix == ".mat":
            data = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512, b"\0") + data[512:]
        return suffix, changed(rng, data, words(data)) if rng.random() < 0.6 else data, {"rate": 10}

    return make


def _virtual(h5py, file, rng):
    n = [200, h5py.h5s.UNLIMITED][rng.integers(2)]
    name = ["v", "gyro", "gone"][rng.integers(3)]
    layout = h5py.VirtualLayout(shape=(200,), dtype="f8", maxshape=(None,))
    source = h5py.VirtualSource(
        [".", "other.h5", "/dev/zero"][rng.integers(3)], name, shape=(200,), maxshape=(None,)
    )
    layout[:n] = source[:n]
    file.create_virtual_dataset("v", layout)


def _external(h5py, file, rng):
    name = ["/dev/zero", "/etc/passwd", "gone"][rng.integers(3)]
    file.create_dataset(
        "e", shape=(200,), dtype="f8", external=[(name, int(rng.integers(3)), 1600)]
    )


def _link(h5py, file, rng):
    file.create_group("g")["l"] = [
        h5py.ExternalLink("other.h5", "/x"),
        h5py.SoftLink("/g/l"),
        h5py.SoftLink("/gyro"),
        h5py.SoftLink("../.."),
        file["/"],
        file["gyro"],
    ][rng.integers(6)]


def _chunked(h5py, file, rng):
    filters = {
        "compression": [None, "gzip", "lzf", "szip"][rng.integers(3)],
        "shuffle": bool(rng.integers(2)),
        "fletcher32": bool(rng.integers(2)),
    }
    file.create_dataset(
        "c", data=X, chunks=(int(rng.choice([1, 7, 200])),), maxshape=(None,), **filters
    )


def _large(h5py, file, rng):
    shape = [(10**9,), (10**15,), (10**6, 10**6), (0, 10**12), (2**40,), (0,), ()][rng.integers(7)]
    chunks = None if 0 in shape or not shape else tuple(min(k, 1000) for k in shape)
    file.create_dataset(
        "big", shape=shape, dtype="f8", chunks=chunks, compression=chunks and "gzip"
    )


def _typed(h5py, file, rng):
    kind = [
        h5py.string_dtype(),
        h5py.vlen_dtype("f8"),
        h5py.ref_dtype,
        np.dtype([("t", "f8"), ("s", h5py.string_dtype()), ("x", "f4")]),
        np.dtype("f2"),
        np.dtype(">i8"),
        h5py.enum_dtype({"A": 1}, "i1"),
        np.dtype(("f8", (3,))),
        np.dtype("c16"),
        np.dtype("V8"),
        h5py.opaque_dtype("M8[us]"),
        np.dtype("f8,(2,)f4"),
    ][rng.integers(12)]
    file.create_dataset("typed", shape=(200,), dtype=kind)


def _attributes(h5py, file, rng):
    value = [
        "deg/s",
        b"ms since 2026",
        7,
        np.zeros(5),
        ["a", "b"],
        h5py.Empty("f8"),
        np.nan,
        "x" * 60_000,
        "\u202e",
        "",
        np.zeros((2, 0)),
        -1.5,
    ][rng.integers(12)]
    name = ["units", "unit", "rate", "fs", "NAME", "scale_factor", "add_offset", "_FillValue"][
        rng.integers(8)
    ]
    file["gyro"].attrs[name] = value


def _deep(h5py, file, rng):
    group = file
    # The library needs seconds for 900 groups in each other.
    for _ in range(int(rng.choice([2, 50, 900], p=[0.49, 0.49, 0.02]))):
        group = group.create_group("g")
    group["x"] = X


def _empty(h5py, file, rng):
    file["empty"] = h5py.Empty("f8")
    file["zero"] = np.zeros((0, 3))


FEATURES = (_virtual, _external, _link, _chunked, _large, _typed, _attributes, _deep, _empty)


def columnar(kind):
    """Parquet and Arrow of every type, including decompression bombs; half of them with one changed field."""
    import pyarrow as pa
    from pyarrow import feather, parquet

    long = pa.array(["x" * 300_000])
    columns = [
        lambda: pa.array(X),
        lambda: pa.array(X, pa.float32()),
        lambda: pa.array(np.arange(200), pa.timestamp("us", tz="UTC")),
        lambda: pa.array([None, 1.5] * 100),
        lambda: pa.array([[0.0] * 500] * 200),
        lambda: pa.array(["a"] * 200),
        lambda: pa.DictionaryArray.from_arrays(pa.array(np.zeros(200, np.int32)), long),
        lambda: pa.array([b"\0"] * 200),
        lambda: pa.array([{"a": 1}] * 200),
        lambda: pa.nulls(200),
        lambda: pa.array(np.zeros(200), pa.float16()),
        lambda: pa.array([1] * 200, pa.decimal128(5)),
        lambda: pa.array([True] * 200),
        lambda: pa.array(range(200), pa.date32()),
        lambda: pa.array(range(200), pa.time64("ns")),
        lambda: pa.array(range(200), pa.duration("ms")),
        lambda: pa.array(range(200), pa.uint64()),
        lambda: pa.array(np.zeros(200)).dictionary_encode(),
        lambda: pa.array([[1.0, 2.0]] * 200, pa.list_(pa.float64(), 2)),
        lambda: pa.chunked_array([[float("nan")] * 100, [1e308] * 100]),
    ]
    names = ["gx", "time", "t [s]", "note", "a.b", "", "gx [deg/s]", "temp", "\u202e", "x" * 3000]
    write = {"parquet": parquet.write_table, "feather": feather.write_feather}[kind]

    def make(rng):
        count = int(rng.integers(1, 5))
        chosen = [columns[rng.integers(len(columns))]() for _ in range(count)]
        table = pa.table(chosen, names=[names[rng.integers(len(names))] for _ in range(count)])
        stream = io.BytesIO()
        pack = [None, "zstd", "lz4", "uncompressed"][rng.integers(4)]
        try:
            write(table, stream, compression=pack or ("snappy" if kind == "parquet" else "lz4"))
        except (pa.ArrowException, ValueError):
            return make(rng)
        data = stream.getvalue()
        return (
            f".{kind}",
            changed(rng, data, words(data)) if rng.random() < 0.6 else data,
            {"rate": 10},
        )

    return make


def bags():
    """Bags of ROS 1 with plain and with packed chunks."""
    return [bag for packed in (None, "BZ2", "LZ4") for bag in logs.rosbag("bag", packed)]


def mcaps():
    """MCAP with plain and with packed chunks."""
    return [bag for packed in (None, "ZSTD") for bag in logs.rosbag("mcap", packed)]


def mat5():
    seeds = targets._mat()
    return patched(".mat", lambda: [seeds[0], seeds[2]], words)


FORMATS = {
    "npy": lambda: npy,
    "npz": lambda: npz,
    "mat": mat5,
    "mat 7.3": lambda: hdf5(".mat"),
    "hdf5": lambda: hdf5(".h5"),
    "netcdf 4": lambda: hdf5(".nc"),
    "netcdf 3": lambda: patched(
        ".nc", logs.netcdf, lambda d: [(k, w, "big") for w in (1, 4, 8) for k in range(0, 500, w)]
    ),
    "parquet": lambda: columnar("parquet"),
    "feather": lambda: columnar("feather"),
    "bag": lambda: patched(".bag", bags, bag_fields),
    "db3": lambda: patched(
        ".db3",
        lambda: logs.rosbag("db3"),
        lambda d: [(k, w, "big") for w in (1, 2, 4) for k in range(0, 4096, w)],
    ),
    "mcap": lambda: patched(".mcap", mcaps, mcap_fields),
    "ulog": lambda: patched(".ulg", targets._ulog, ulog_fields),
    "ardupilot": lambda: patched(".bin", logs.ardupilot, ardupilot_fields),
    "text": lambda: cells(".csv", targets._text),
    "sentences": lambda: cells(".txt", logs.sentences, rate=40),
    "formats of text": lambda: cells(".txt", logs.texts),
    "archive": lambda: patched(".zip", archives, archive_fields),
    "packed member": lambda: patched(".zip", archives, all_bytes),
    "gzip": lambda: patched(".csv.gz", logs.packed, all_bytes),
    "array in gzip": lambda: patched(
        ".npy.gz",
        lambda: [gzip.compress(seed, mtime=0) for seed in targets._npy()],
        all_bytes,
        rate=10,
    ),
    "cell in gzip": lambda: repacked(cells(".csv", targets._text)),
}
for _name, (_suffix, _seeds, _text, _options) in logs.SAMPLES_OF.items():
    _whole = (
        partial(cells, _suffix, _seeds, **_options)
        if _text
        else partial(patched, _suffix, _seeds, all_bytes, **_options)
    )
    FORMATS.setdefault(_name, _whole)


def attack(name, count, seed, folder):
    """Read mutants of one format and return what happened; failures are kept in the working folder."""
    import allanite as al
    from allanite.readers.texts.hector import offsets_of

    os.environ["ALLANITE_MEMORY"] = BUDGET
    run.fork_children()
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", ResourceWarning)
    warnings.simplefilter("ignore", DeprecationWarning)
    make = FORMATS[name]()
    rng = np.random.default_rng([seed, *name.encode()])
    found = Counter(
        dict.fromkeys(("mutants", "read", "refused", "contained", "children", "failures"), 0)
    )
    slowest, longest = 0.0, 0
    before = run.largest()
    faults = []
    number = -1
    while found["mutants"] < count:
        number += 1
        try:
            suffix, data, options = make(rng)
        except Exception:  # the library refuses to write it
            found["unwritable"] += 1
            continue
        path = folder / f"x{suffix}"
        path.write_bytes(data)
        begun, wrong = run.spent(), None
        faulthandler.dump_traceback_later(300, exit=True)
        try:
            recording = al.read(path, **options)
            json.dumps(recording.describe(), allow_nan=False).encode()
            recording.deviations()
            if suffix == ".mom":
                offsets_of(path)
            found["read"] += 1
        except al.AllaniteError as error:
            said = str(error)
            found["refused"] += 1
            # What a child process died of, or what stopped it.
            found["contained"] += "crashes on this file" in said or "does not finish" in said
            longest = max(longest, len(said))
            if not said.isprintable() or len(said) > 300:
                wrong = f"message: {said!r}"
        except Exception:
            wrong = traceback.format_exc()
        finally:
            faulthandler.cancel_dump_traceback_later()
        took, grown = run.spent() - begun, run.largest() - before
        slowest = max(slowest, took)
        if took > SLOW:
            wrong = f"{took:.1f} s"
        if grown > LARGE:
            wrong = f"{grown / 1e6:.2f} GB"
            before = run.largest()
        if wrong:
            keep = Path(f"mutant-{name.replace(' ', '-')}-{seed}-{number}{suffix}")
            keep.write_bytes(data)
            faults.append(f"{keep}: {wrong[-1500:]}")
        found["mutants"] += 1
    found["failures"], found["children"] = len(faults), run.forks.children
    return {
        **found,
        "slowest": round(slowest, 2),
        "longest": longest,
        "grown": round((run.largest() - before) / 1e3),
        "faults": faults[:5],
    }


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--mutants", type=int, default=2000, help="of all formats together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--format", choices=FORMATS)
    parser.add_argument("--folder")
    options = parser.parse_args()
    if options.folder:
        faulthandler.enable()
        count = options.mutants
        print("\n" + json.dumps(attack(options.format, count, options.seed, Path(options.folder))))
        return
    names = [options.format] if options.format else list(FORMATS)
    total: Counter = Counter()
    for name in names:
        share = -(-options.mutants // len(names))
        with tempfile.TemporaryDirectory(prefix="allanite-fuzz-") as folder:
            command = [
                sys.executable,
                __file__,
                "--format",
                name,
                "--mutants",
                str(share),
                "--seed",
                str(options.seed),
            ]
            done = subprocess.run(
                [*command, "--folder", folder], capture_output=True, text=True, check=False
            )
            if done.returncode:
                total += Counter(signals=1)
                for path in Path(folder).glob("x*"):
                    Path(
                        f"mutant-{name.replace(' ', '-')}-{options.seed}-signal{path.suffix}"
                    ).write_bytes(path.read_bytes())
                print(
                    f"{name:10} ended with code {done.returncode}\n{done.stderr[-2000:]}",
                    flush=True,
                )
                continue
        found = json.loads(done.stdout.splitlines()[-1])
        print(
            "{name:15} {mutants:6} mutants, {read:6} read, {refused:6} refused, {contained:4} stopped in a child,"
            " {children:3} in a process of their own, slowest {slowest:5.2f} s,"
            " {grown:4} MB grown, longest line {longest}, failures {failures}".format_map(
                {"name": name, **found}
            ),
            *found["faults"],
            sep="\n  ",
            flush=True,
        )
        total += Counter(
            {
                key: found[key]
                for key in ("mutants", "read", "refused", "contained", "children", "failures")
            }
        )
    print(f"all: {dict(total)}")
    sys.exit(bool(total["failures"] or total["signals"]))


if __name__ == "__main__":
    main()
