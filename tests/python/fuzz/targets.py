"""What is fuzzed: a format, its seeds, and what is done with a damaged one of them."""

import io
import json
import struct
import warnings
import zipfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import logs
import numpy as np

import allanite as al
from allanite.readers.plausibility import checked

RNG = np.random.default_rng(1)
SAMPLES = RNG.standard_normal((300, 3))


def _bytes(write):
    stream = io.BytesIO()
    write(stream)
    return stream.getvalue()


def _npy():
    arrays = [SAMPLES, SAMPLES[:, 0], SAMPLES.astype(np.float32), np.arange(200, dtype=np.int16)]
    return [_bytes(lambda s, a=a: np.save(s, a)) for a in arrays]


def _npz():
    full = {"data": SAMPLES, "rate_hz": 100.0, "channels": np.array(["gx", "gy", "gz"])}
    full |= {"unit": np.array("deg/s"), "t": np.arange(300) / 100}
    return [
        _bytes(lambda s: np.savez(s, **full)),
        _bytes(lambda s: np.savez_compressed(s, **full)),
        _bytes(lambda s: np.savez(s, data=SAMPLES[:, 0])),
    ]


def _mat():
    from scipy.io import savemat

    content = {"gyro": SAMPLES, "Fs": 100.0, "imu": {"acc": SAMPLES, "note": "at rest"}}
    content |= {"k": np.arange(9, dtype=np.int16), "c": np.array([["a", 1]], dtype=object)}
    return [
        _bytes(lambda s: savemat(s, content)),
        _bytes(lambda s: savemat(s, content, do_compression=True)),
        _bytes(lambda s: savemat(s, {"gyro": SAMPLES, "Fs": 100.0}, format="4")),
    ]


def _hdf5():
    import h5py

    def write(stream):
        with h5py.File(stream, "w", userblock_size=512) as file:
            file["gyro"] = SAMPLES.T
            file["log/fs"] = np.array([[100.0]])

    content = bytearray(_bytes(write))
    content[:38] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64"
    return [bytes(content)]


def _ulog():
    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    form = b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;"
    rows = b"".join(
        message("D", struct.pack("<HQ6f", 0, 5000 * i, *SAMPLES[i], *SAMPLES[i])) for i in range(60)
    )
    return [
        head + message("B", bytes(40)) + message("F", form)
        + message("A", struct.pack("<BH", 0, 0) + b"sensor_combined") + rows
    ]  # fmt: skip


def _text():
    head = "time [s],gyro_x [deg/s],temperature\n"
    rows = [f"{k / 100:.2f},{v:.5f},{20 + k}" for k, v in enumerate(SAMPLES[:60, 0])]
    plain = "\n".join(rows)
    return [
        (head + plain).encode(),
        (
            "# made by hand\n" + head.replace(",", ";") + plain.replace(",", ";").replace(".", ",")
        ).encode(),
        plain.replace(",", " ").encode(),
        (
            "\ufeff" + head.replace(",", "\t") + plain.replace(",", "\t").replace("\n", "\r\n")
        ).encode(),
        b'"a","b"\n' + b"1,2\n3,\n" * 20,
    ]


MODELS = [
    "N+B+K", "Q+N+B+K+R", "N+GM(T=30)+SIN(f=7.3)", "angle_random_walk+gauss_markov(correlation_time=30!)",
    "N(N=1.5e-3)+RES(f=3,damping=0.1)+PL(exponent=-0.5)",
    "N+COV(column=temp,lag=0.1)+STEP(time=3)+WARM", "N+RTS+LEVEL+OUT+BW(cutoff=3)",
]  # fmt: skip


def _models():
    from allanite.effects.files import model_to_dict

    texts = ["N(N=1)+K(K=0.1)", "N(N=1)+GM(q_c=0.1,T=30)", "N(N=1)+SIN(f=3,A=1)"]
    return [json.dumps(model_to_dict(al.parse_model(t))).encode() for t in texts]


UNITS = ["deg/s", "m/s/sqrt(h)", "µg/√Hz one-sided", "(rad/s)/Hz^(1/2)", "deg/h^1.5", "m s-2"]
SHEETS = [
    """name = "gyro"\nbandwidth = "40 Hz"\n[figures]\nangle_random_walk = "0.3 deg/√h"
noise_density = "0.03 deg/s/√Hz two-sided"\nbias_instability = "5 deg/h"\n""".encode(),
    json.dumps(
        {"name": "acc", "figures": {"vrw": "0.03 m/s/√h", "noise_density": "150 µg/√Hz"}}
    ).encode(),
]
ACTIONS = [
    {"do": "read", "rate": 100, "unit": "deg/s", "columns": "gx,gy"}, {"do": "add", "kind": "gauss_markov"},
    {"do": "hold", "place": 0, "name": "N", "value": 1.0}, {"do": "remove", "place": 1}, {"do": "model", "model": "N+B"},
    {"do": "column", "place": 0}, {"do": "source", "place": 0}, {"do": "cancel"}, {"do": "improve"}, {"do": "undo"},
]  # fmt: skip


def reader(suffix, seeds, text=False, **options):
    """Read a format from a file and compute deviations; the command must answer as the library does."""
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]

    def call(data, folder):
        path = Path(folder) / f"x{suffix}"
        path.write_bytes(data)
        error, codes = None, {0}
        try:
            recording = al.read(path, **options)
            repr(recording)
            json.dumps(recording.describe(), allow_nan=False).encode()
            recording.deviations()
            codes = codes_for(recording)
        except al.AllaniteError as caught:
            error = caught
            codes = {3 if isinstance(error, al.TooShortError) else 2}
        commanded(["adev", str(path), *words, "--json"], codes)
        if error is not None:
            raise error

    return seeds, call, text


def codes_for(recording):
    """Exit codes that a command may have for a log that the library reads.

    The command needs 16 samples, no stuck sensor, and accelerometers whose mean can be gravity in their unit.
    """
    with np.errstate(invalid="ignore"):  # a NaN that signals
        columns = np.atleast_2d(recording.samples.T).astype(float)
    stuck = any(np.unique(x[~np.isnan(x)]).size < 2 for x in columns)
    try:
        checked(recording, for_fit=False)
    except al.InputError:
        stuck = True
    return {0, *[3] * (recording.n < 16), *[2] * stuck}


def commanded(words, codes):
    """Check that a command ends with one of these exit codes, and with one short line if the code is not 0."""
    from allanite.cli import main

    out, err = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(out), redirect_stderr(err):
            main(words)
    except SystemExit as ended:
        code = ended.code
    said = err.getvalue()
    assert code in codes, f"exit code {code}, not of {codes}: {said}"
    if code:
        assert said.startswith("allanite: "), said
        assert said.count("\n") == 1, said
        assert out.getvalue() == ""
    else:
        json.loads(out.getvalue(), parse_constant=float)
    for line in said.splitlines():
        assert line.isprintable(), repr(line)
        assert len(line) <= 310, line


def model_string(data, _folder):
    model = al.parse_model(data.decode("utf-8", "replace").replace("/", "").replace("\0", ""))
    al.parse_model(model.name)


def unit(data, _folder):
    from allanite.common.units import conversion, parse_unit

    text = data.decode("utf-8", "replace")
    conversion(text, text)
    parse_unit(text)


def parsed(suffix, parse):
    def call(data, folder):
        path = Path(folder) / f"x{suffix}"
        path.write_bytes(data)
        parse(str(path))

    return call


def sheet(path):
    from allanite.sources.datasheet import read_datasheet

    read_datasheet(path)


def page():
    """Requests of a page on a short log."""
    from allanite.page.sessions import Sessions
    from allanite.page.source import Source
    from page_sessions import client_of, opened, send

    recording = al.Recording(SAMPLES[:, :1], rate=100, unit="deg/s", columns=["gx"], path="x.npz")
    client = client_of(Sessions([Source("x.npz", recording=recording)], most_bytes=1_000_000))
    tab, _ = opened(client, checked=False)
    paths = [
        b"tabs",
        b"tabs/TAB",
        b"tabs/TAB/view/deviation?theme=dark",
        b"tabs/TAB/file/report.html",
    ]
    bodies = [json.dumps(order).encode() for order in ACTIONS]

    def call(data, _folder):
        if data[:1] == b"{":
            answer = client.post(f"tabs/{tab}/act", content=data)
        elif data[:4] == b"tabs":
            path = data.decode("latin-1").replace("TAB", tab).replace("\0", "")
            answer = client.get(
                "".join(c for c in path if " " < c < "\x7f" and c not in "\\#[]:@")[:500]
            )
        else:
            answer = send(client, tab, "x.csv", data)
        assert answer.status_code < 500, answer.text
        if answer.status_code >= 400 and answer.headers.get("content-type") == "application/json":
            said = answer.json()["error"]
            assert said.isprintable(), said
            assert len(said) <= 300, said

    return [*paths, *bodies, _text()[0]], call, True


def study():
    """A running page and random actions in its tabs; an input is the seed of one request."""
    from page_actions import Hand

    hand = Hand()
    # A value of 1e100 that is tried overflows somewhere: what counts here is what the page makes of it.
    warnings.simplefilter("default", RuntimeWarning)

    def call(data, _folder):
        hand.one(np.random.default_rng(list(data[:400])))

    return [bytes([k]) * 8 for k in range(64)], call, False


def member():
    """An array inside an archive whose checksum is correct, because a damaged archive is refused before its content."""
    _, call, _ = reader(".npz", [])

    def inside(data, folder):
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as archive:
            archive.writestr("data.npy", data)
            archive.writestr("rate_hz.npy", _bytes(lambda s: np.save(s, 10.0)))
        call(stream.getvalue(), folder)

    return _npy(), inside, False


def targets():
    """Name → maker of (seeds, call(data, folder), whether it is text)."""
    return {
        "text": lambda: reader(".csv", _text(), True),
        "text with a rate": lambda: reader(".csv", _text(), True, rate=100),
        "npy": lambda: reader(".npy", _npy(), rate=10),
        "npz": lambda: reader(".npz", _npz()),
        "npz, an array": member,
        "mat": lambda: reader(".mat", _mat()),
        "mat73": lambda: reader(".mat", _hdf5()),
        "ulog": lambda: reader(".ulg", _ulog()),
        **{
            name: lambda suffix=suffix, seeds=seeds, text=text, options=options: reader(
                suffix, seeds(), text, **options
            )
            for name, (suffix, seeds, text, options) in logs.SAMPLES_OF.items()
        },
        "formats of text": lambda: reader(".txt", logs.texts(), True, rate=40),
        "sentences": lambda: reader(".txt", logs.sentences(), True, rate=40),
        "gzip": lambda: reader(".csv.gz", logs.packed()),
        "archive": lambda: reader(".zip", logs.archive()),
        "unit": lambda: ([one.encode() for one in UNITS], unit, True),
        "model string": lambda: ([m.encode() for m in MODELS], model_string, True),
        "model file": lambda: (_models(), parsed(".json", al.parse_model), True),
        "data sheet": lambda: (SHEETS[:1], parsed(".toml", sheet), True),
        "data sheet, JSON": lambda: (SHEETS[1:], parsed(".json", sheet), True),
        "page": page,
        "page, a study": study,
    }
