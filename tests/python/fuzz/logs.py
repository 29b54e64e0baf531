"""Seeds of the formats that other libraries write: small logs of each, made by those libraries."""

import gzip
import io
import struct
import tempfile
import zipfile
from pathlib import Path

import numpy as np

SAMPLES = np.random.default_rng(2).standard_normal((60, 3))


def _written(write, name):
    """The bytes of a file that `write(path)` makes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        if path.is_dir():
            (path,) = [p for p in path.iterdir() if p.suffix in (".db3", ".mcap")]
        return path.read_bytes()


def hdf5():
    import h5py

    def write(path):
        with h5py.File(path, "w") as file:
            file["imu/gyro"] = SAMPLES
            file["imu/gyro"].attrs["units"] = "deg/s"
            file["imu/temperature"] = 20 + SAMPLES[:, 0]
            file["imu/time"] = np.arange(60) / 50
            file.create_dataset("packed", data=SAMPLES[:, 0], chunks=(20,), compression="gzip")

    def table(path):
        with h5py.File(path, "w") as file:
            rows = np.zeros(60, dtype=[("t", "f8"), ("gx", "f4")])
            rows["t"], rows["gx"] = np.arange(60) / 50, SAMPLES[:, 0]
            file["log"] = rows

    return [_written(write, "x.h5"), _written(table, "x.h5")]


def netcdf():
    from scipy.io import netcdf_file

    def write(path):
        with netcdf_file(path, "w") as file:
            file.createDimension("time", 60)
            time = file.createVariable("time", "f8", ("time",))
            time.units = "milliseconds since 2026-01-31 00:00:00"
            time[:] = 20.0 * np.arange(60)
            gyro = file.createVariable("gyro_x", "f4", ("time",))
            gyro.units = "deg/s"
            gyro[:] = SAMPLES[:, 0]

    return [_written(write, "x.nc")]


def columnar(kind):
    import pyarrow as pa
    from pyarrow import feather, parquet

    when = np.datetime64("2026-01-31", "ns") + np.arange(60) * np.timedelta64(20, "ms")
    table = pa.table({"when": when, "gx [deg/s]": SAMPLES[:, 0], "note": ["a"] * 60})
    write = {"parquet": parquet.write_table, "feather": feather.write_feather}[kind]
    return [_written(lambda path: write(table, str(path)), f"x.{kind}")]


def rosbag(kind, packed=None):
    """A bag with one topic; its chunks are packed by a method of the library."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
    types, imu = store.types, "sensor_msgs/msg/Imu"
    vector, turn = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    header, stamp = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    extra = {"seq": 0} if kind == "bag" else {}
    raw = store.serialize_ros1 if kind == "bag" else store.serialize_cdr
    zeros, still = np.zeros(9), turn(0.0, 0.0, 0.0, 1.0)

    def write(path):
        if kind == "bag":
            bag = rosbag1.Writer(path)
            if packed:
                bag.set_compression(rosbag1.Writer.CompressionFormat[packed])
        else:
            storage = {"db3": "SQLITE3", "mcap": "MCAP"}[kind]
            bag = rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[storage])
            if packed:
                bag.set_compression(
                    rosbag2.CompressionMode.STORAGE, rosbag2.CompressionFormat[packed]
                )
        with bag:
            topic = bag.add_connection("/imu", imu, typestore=store)
            for k, x in enumerate(SAMPLES):
                at = 1_700_000_000_000_000_000 + 5_000_000 * k
                head = header(stamp=stamp(*divmod(at, 10**9)), frame_id="imu", **extra)
                message = types[imu](head, still, zeros, vector(*x), zeros, vector(*x), zeros)
                bag.write(topic, at, raw(message, imu))

    return [_written(write, "x.bag" if kind == "bag" else "x")]


def ardupilot():
    def described(kind, size, name, codes, fields):
        return b"\xa3\x95\x80" + struct.pack(
            "<BB4s16s64s", kind, size, name.encode(), codes.encode(), fields.encode()
        )

    out = described(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
    row = struct.Struct("<QB6f")
    names = "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"
    out += described(129, 3 + row.size, "IMU", "QBffffff", names)
    for k, x in enumerate(SAMPLES):
        out += b"\xa3\x95\x81" + row.pack(10**6 + 20_000 * k, 0, *x, *x)
    return [out]


def rinex():
    head = "     3.00           C                                       RINEX VERSION / TYPE\n"
    rows = "".join(
        f"AS G01  2026 01 01 00 {k // 2:02} {30 * (k % 2):9.6f}  1   {x * 1e-9:19.12E}\n"
        for k, x in enumerate(SAMPLES[:, 0])
    )
    return [(head + " " * 60 + "END OF HEADER\n" + rows).encode()]


def stable32():
    phase = np.cumsum(SAMPLES[:, 0]) * 1e-12
    plain = "# Phase data\n# Tau: 1.000e+01\n" + "".join(f"{v:.9e}\n" for v in phase)
    tagged = "".join(f"{60000 + k / 86400:.9f} {v:.9e}\n" for k, v in enumerate(phase))
    return [plain.encode(), tagged.encode()]


def timelab():
    phase = np.cumsum(SAMPLES[:, :2], axis=0) * 1e-9
    rows = "".join(f"{a:.15e} {b:.15e}\n" for a, b in phase)
    return [f'TIM 1\n"Input Freq" 1.0000000E+07\nTIC 60 2\n{rows}END\n'.encode()]


def sentences():
    """Lines of a VN-100, with their checksums."""
    out = []
    for x, y, z in SAMPLES:
        body = f"VNIMU,-02.0841,+00.6045,+02.8911,{x:+.3f},{y:+.3f},{z:+.3f},{x:+.6f},{y:+.6f},{z:+.6f},+21.6,+00099.761"
        check = 0
        for byte in body.encode():
            check ^= byte
        out.append(f"${body}*{check:02X}\r\n")
    return ["".join(out).encode()]


def packed():
    rows = (
        "time,gx\n" + "".join(f"{k / 50},{x:.5f}\n" for k, x in enumerate(SAMPLES[:, 0]))
    ).encode()
    return [gzip.compress(rows, mtime=0)]


def archive():
    rows = "time,x,y,z\n" + "".join(
        f"{k / 50},{a},{b},{c}\n" for k, (a, b, c) in enumerate(SAMPLES)
    )
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        file.writestr("Gyroscope.csv", rows)
        file.writestr("Accelerometer.csv", rows)
    return [stream.getvalue()]


def series():
    """A series of Hector with a step."""
    head = "# sampling period 1.0\n# offset 55020.0\n"
    return [
        (head + "".join(f"{55000 + k} {v:.4f}\n" for k, v in enumerate(SAMPLES[:, 0]))).encode()
    ]


def texts():
    """A seed of each text format that is more than a table."""
    x = SAMPLES[:, 0]
    ptp = "".join(
        f"ptp4l[{100 + k}.125]: master offset {v * 1e4:8.0f} s2 freq {k:+6d} path delay 900\n"
        for k, v in enumerate(x)
    )
    chrony = (
        "   Date (UTC) Time     IP Address   St   Freq ppm   Skew ppm     Offset L Co\n"
        + "".join(
            f"2021-11-20 09:{k:02d}:00 PPS 1 -764.399 0.056 {v * 1e-6:.3e} N 1\n"
            for k, v in enumerate(x)
        )
    )
    loop = "".join(
        f"50935 {64 * k}.031 {v * 1e-6:.9f} 13.7 0.0003 0.01 6\n" for k, v in enumerate(x)
    )
    peer = "".join(
        f"50935 {64 * k}.031 127.127.4.1 9714 {v * 1e-6:.9f} 0.0 0.001 0.001\n"
        for k, v in enumerate(x)
    )
    station = "".join(
        f"MPRA 02AUG09 2002.6037 {52495 + k} 1178 5 {v:.6f} 0.1 0.2 0.0083 1 1 1 0 0 0\n"
        for k, v in enumerate(x)
    )
    edges = "".join(f"{1516102326 + k}.{500000 + int(1000 * v):06d}#{k}\n" for k, v in enumerate(x))
    message = "%time,field.header.stamp,field.angular_velocity.x\n" + "".join(
        f"{(1600000000 + k) * 10**9},{(1600000000 + k) * 10**9},{v:.6f}\n" for k, v in enumerate(x)
    )
    monitor = "".join(f"12:00:{k:02d}.000 -> {v:.5f},{v:.4f}\n" for k, v in enumerate(x))
    plotter = "".join(f"gx:{v:.5f}\tgy:{v:.4f}\n" for v in x)
    lines = "".join(f'{{"t": {k / 50}, "gyro": [{v:.5f}, 1, 2]}}\n' for k, v in enumerate(x))
    head = "# Type: Phase\n# Tau: 1.0\n# Header End\n"
    stable = head + "".join(f"{v * 1e-9:.6e}\n" for v in x)
    channel = "DATA_START\nTime,6284.1:scaledGyroX\n" + "".join(
        f"{k / 100},{v:.6f}\n" for k, v in enumerate(x)
    )
    sketch = "".join(
        f"Acceleration X: {v:.2f}, Y: {0.1 + 0.3 * v:.2f}, Z: {9.8 - 0.2 * v:.2f} m/s^2\n"
        f"Rotation X: {v:.4f}, Y: {1 + 0.5 * v:.4f}, Z: {2 - 0.4 * v:.4f} rad/s\nTemperature: 25.1 degC\n\n"
        for v in x
    )
    turns = "".join(
        f"ACCE;{k / 100};{v:.4f};1\nGYRO;{k / 100};{v:.5f};2\n" for k, v in enumerate(x)
    )
    lvm = (
        "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tOne\n***End_of_Header***\t\nChannels\t1\nY_Unit_Label\tdeg/s\n"
        "X_Dimension\tTime\nDelta_X\t0.01\n***End_of_Header***\t\nX_Value\tGyro\tComment\n"
    ) + "".join(f"{k / 100}\t{v:.6f}\n" for k, v in enumerate(x))
    echo = "header: \n  seq: 1\n  stamp: \n    secs: 5\n---\n" * 9
    found = (
        series()[0].decode(),
        echo,
        sketch,
        turns,
        lvm,
        ptp,
        chrony,
        loop,
        peer,
        station,
        edges,
        message,
        monitor,
        plotter,
        lines,
        stable,
        channel,
    )
    return [text.encode() for text in found]


#: Samples of the formats with a suffix of their own: name → (suffix, seeds, whether they are text, options of the reader).
#: All tests of formats use these samples.
SAMPLES_OF = {
    "hdf5": (".h5", hdf5, False, {}),
    "netcdf": (".nc", netcdf, False, {}),
    "parquet": (".parquet", lambda: columnar("parquet"), False, {}),
    "feather": (".feather", lambda: columnar("feather"), False, {}),
    "bag": (".bag", lambda: rosbag("bag"), False, {}),
    "db3": (".db3", lambda: rosbag("db3"), False, {}),
    "mcap": (".mcap", lambda: rosbag("mcap"), False, {}),
    "ardupilot": (".bin", ardupilot, False, {}),
    "rinex": (".clk", rinex, True, {}),
    "stable32": (".phd", stable32, True, {}),
    "timelab": (".tim", timelab, True, {"rate": 1}),
    "hector": (".mom", series, True, {}),
}
