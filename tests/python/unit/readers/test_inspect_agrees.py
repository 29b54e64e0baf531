"""`inspect` and `characterize` read the same columns, roles, units and rate of every log, or refuse it alike.

The logs are the seeds of every format, the field logs and the real recordings. Headers of loggers are in `test_corpus.py`.
"""

import sys
from pathlib import Path

import pytest

import allanite as al
from allanite.common.units import parse_unit, rate_unit
from allanite.readers import read_sensors

HERE = Path(__file__).parents[2]
sys.path.insert(0, str(HERE / "fuzz"))
import logs  # noqa: E402
import targets  # noqa: E402

sys.path.remove(str(HERE / "fuzz"))

#: Format → suffix, its seeds, and the rate where the files hold none.
FORMATS = {
    "text": (".csv", targets._text, None),
    "npy": (".npy", targets._npy, 10),
    "npz": (".npz", targets._npz, None),
    "mat": (".mat", targets._mat, 10),
    "ulog": (".ulg", targets._ulog, None),
    **{
        n: (suffix, seeds, how.get("rate"))
        for n, (suffix, seeds, _, how) in logs.SAMPLES_OF.items()
    },
    "formats of text": (".txt", logs.texts, None),
    "sentences": (".txt", logs.sentences, 40),
    "gzip": (".csv.gz", logs.packed, None),
    "archive": (".zip", logs.archive, None),
}
FIELD = (
    "bracket.csv", "kalibr.csv", "mjd.csv", "station_tenv.txt", "phase_ns.csv", "andro_nodate.csv", "phyphox_rest.csv",
    "sensorconnect.csv", "serial_monitor.txt", "serial_plotter.txt", "lines.jsonl", "ptp4l.txt", "chrony_tracking.log",
    "allan_table.csv", "adis16448.toml", "imu_utils.yaml", "kalibr_d455.yaml",
)  # fmt: skip


def agree(path, **options):
    """What `inspect` shows is what `characterize` reads; both refuse for the same reason."""
    seen, problem = None, None
    try:
        seen = al.inspect(path, **options)
        problem = seen.problem
    except al.AllaniteError as error:
        problem = str(error)
    if problem is not None:
        with pytest.raises(al.AllaniteError) as raised:
            read_sensors(path, **options)
        assert str(raised.value) == problem
        return None
    first, *beside = read_sensors(path, **options)
    shown = {
        c.name: (c.role, c.used, c.unit, c.scale)
        for c in seen.columns
        if c.name not in ("(time)", "(topic)")
    }
    read = {c.name: (c.role, c.used, c.unit, c.scale) for c in first.log_columns}
    assert shown == read
    used = [name for name, (role, use, *_) in shown.items() if use and role == "sensor"]
    assert list(first.columns) == used
    # The samples of a phase or an angle are rates; those of a phase in ns are converted.
    kinds = [rate_unit(shown[name][2] or "1", first.quantity).kind for name in used]
    assert [parse_unit(unit).kind for unit in first.units] == kinds
    assert seen.rate == first.rate
    return [first, *beside]


@pytest.mark.usefixtures("forked")
@pytest.mark.parametrize("name", FORMATS)
def test_of_every_format(tmp_path, name):
    suffix, seeds, rate = FORMATS[name]
    read = 0
    for k, data in enumerate(seeds()):
        path = tmp_path / f"log{k}{suffix}"
        path.write_bytes(data)
        bare = agree(path)
        read += bare is not None or agree(path, rate=rate or 10) is not None
    assert read


@pytest.mark.data
@pytest.mark.parametrize("name", FIELD)
def test_of_field_logs(data, name):
    path = data(f"field/{name}")
    if agree(path) is None:
        agree(path, rate=50)


@pytest.mark.data
@pytest.mark.long
def test_of_real_recordings(data):
    folder = data("README.md").parent
    for path in sorted([*folder.glob("*.npz"), *folder.glob("logs/*.*")]):
        agree(path)
