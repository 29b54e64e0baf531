"""MATLAB, ROS and ULog logs, written here by the libraries that the readers use."""

import struct

import numpy as np
import pytest

import allanite as al
from allanite.cli import main
from allanite.readers import read_sensors

RNG = np.random.default_rng(11)
N, RATE = 400, 200.0
GYRO = RNG.standard_normal((N, 3)) * 0.01
ACC = RNG.standard_normal((N, 3)) * 0.1 + [0, 0, 9.81]


# -- MATLAB --------------------------------------------------------------------------------------


def mat5(path, **variables):
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(path, variables)
    return path


def test_mat5_vector_and_rate(tmp_path):
    r = al.read(mat5(tmp_path / "x.mat", omega=GYRO[:, 0], Fs=RATE), unit="rad/s")
    assert (r.columns, r.rate, r.unit) == (("omega",), RATE, "rad/s")
    np.testing.assert_array_equal(r.samples, GYRO[:, 0])


def test_mat5_matrix_lying_down_and_time(tmp_path):
    path = mat5(tmp_path / "x.mat", time=np.arange(N) / RATE, gyro=GYRO.T, acc=ACC)
    r = al.read(path)
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
    assert r.rate == pytest.approx(RATE)
    np.testing.assert_array_equal(r.samples, np.hstack([GYRO, ACC]))
    assert al.read(path, unit="rad/s").columns == ("gyro_x", "gyro_y", "gyro_z")


def test_mat5_structure(tmp_path):
    r = al.read(mat5(tmp_path / "x.mat", imu={"gyro": GYRO, "fs": RATE, "note": "static"}))
    assert (r.columns, r.rate) == (("gyro_x", "gyro_y", "gyro_z"), RATE)


@pytest.mark.slow
def test_mat73(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "x.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["gyro"] = GYRO.T  # as MATLAB writes an (n, 3) matrix
        file["log/fs"] = np.array([[RATE]])
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    r = al.read(path)
    assert (r.columns, r.rate) == (("gyro_x", "gyro_y", "gyro_z"), RATE)
    np.testing.assert_array_equal(r.samples, GYRO)


@pytest.mark.slow
def test_mat_refusals(tmp_path):
    path = mat5(tmp_path / "x.mat", name="only text")
    with pytest.raises(al.InputError, match=r"x\.mat: no numeric array"):
        al.read(path, rate=1)
    path.write_bytes(b"no MATLAB file at all")
    with pytest.raises(al.InputError, match=r"x\.mat: damaged"):
        al.read(path, rate=1)
    path.write_bytes(b"\x89HDF\r\n\x1a\n" + b"\0" * 30)
    pytest.importorskip("h5py")
    with pytest.raises(al.InputError, match=r"x\.mat: damaged"):
        al.read(path, rate=1)


# -- ROS -----------------------------------------------------------------------------------------


def imu_messages(store, stamped=True):
    """(nanoseconds, sensor_msgs/Imu) of the test signal."""
    types = store.types
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    header, stamp = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    extra = {"seq": 0} if "seq" in header.__dataclass_fields__ else {}
    zeros = np.zeros(9)
    start = 1_700_000_000_000_000_000
    for k in range(N):
        at = start + round(k * 1e9 / RATE)
        when = stamp(*divmod(at if stamped else 0, 10**9))
        yield (
            at,
            types["sensor_msgs/msg/Imu"](
                header=header(stamp=when, frame_id="imu", **extra),
                orientation=quaternion(0.0, 0.0, 0.0, 1.0),
                orientation_covariance=zeros,
                angular_velocity=vector(*GYRO[k]),
                angular_velocity_covariance=zeros,
                linear_acceleration=vector(*ACC[k]),
                linear_acceleration_covariance=zeros,
            ),
        )


def check_imu(r):
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
    assert r.units == ("rad/s",) * 3 + ("m/s^2",) * 3
    assert r.rate == pytest.approx(RATE)
    assert r.gaps == 0
    np.testing.assert_array_equal(r.samples, np.hstack([GYRO, ACC]))


@pytest.mark.slow
@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
@pytest.mark.parametrize("by", ["folder", "file"])
def test_ros2(tmp_path, storage, by):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    path = tmp_path / "bag"
    with rosbag2.Writer(path, version=9, storage_plugin=rosbag2.StoragePlugin[storage]) as bag:
        topic = bag.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
        for at, message in imu_messages(store):
            bag.write(topic, at, store.serialize_cdr(message, "sensor_msgs/msg/Imu"))
    if by == "file":
        (path,) = [p for p in path.iterdir() if p.suffix in (".db3", ".mcap")]
    check_imu(al.read(path))


@pytest.mark.slow
@pytest.mark.parametrize("stamped", [True, False])
def test_ros1(tmp_path, stamped):
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    path = tmp_path / "log.bag"
    with rosbag1.Writer(path) as bag:
        topic = bag.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
        for at, message in imu_messages(store, stamped):
            bag.write(topic, at, store.serialize_ros1(message, "sensor_msgs/msg/Imu"))
    check_imu(al.read(path))


@pytest.mark.slow
def test_ros_without_imu_lists_the_topics(tmp_path):
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    path = tmp_path / "log.bag"
    with rosbag1.Writer(path) as bag:
        topic = bag.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        text = store.types["std_msgs/msg/String"]("hello")
        bag.write(topic, 1, store.serialize_ros1(text, "std_msgs/msg/String"))
    with pytest.raises(al.InputError, match="/chatter"):
        al.read(path)
    path.write_bytes(b"#ROSBAG V2.0\n broken")
    with pytest.raises(al.InputError, match="damaged"):
        al.read(path)


# -- ULog ----------------------------------------------------------------------------------------


def ulog(path, topic, fields, rows):
    """A minimal ULog file after the format's specification: header, one topic, its rows."""

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    out = b"\x55\x4c\x6f\x67\x01\x12\x35" + b"\x01" + struct.pack("<Q", 0)
    out += message("F", f"{topic}:{fields}".encode())
    out += message("A", struct.pack("<BH", 0, 0) + topic.encode())
    for row in rows:
        out += message("D", struct.pack("<H", 0) + row)
    path.write_bytes(out)
    return path


@pytest.mark.slow
def test_ulog_sensor_combined(tmp_path):
    pytest.importorskip("pyulog")
    fields = "uint64_t timestamp;float[3] gyro_rad;uint32_t dt;float[3] accelerometer_m_s2;"
    rows = [struct.pack("<Q3fI3f", 10**6 + 5000 * k, *GYRO[k], 5000, *ACC[k]) for k in range(N)]
    r = al.read(ulog(tmp_path / "log.ulg", "sensor_combined", fields, rows))
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
    assert r.rate == pytest.approx(RATE)
    np.testing.assert_allclose(r.samples, np.hstack([GYRO, ACC]), rtol=1e-6)
    assert al.read(tmp_path / "log.ulg", unit="rad/s", column="gyro_z").unit == "rad/s"


@pytest.mark.slow
def test_ulog_sensor_gyro_with_temperature(tmp_path):
    pytest.importorskip("pyulog")
    fields = (
        "uint64_t timestamp;uint64_t timestamp_sample;float x;float y;float z;float temperature;"
    )
    rows = [
        struct.pack("<QQ4f", 10**6 + 5000 * k + k % 7 * 100, 10**6 + 5000 * k, *GYRO[k], 30 + k)
        for k in range(N)
    ]
    r = al.read(ulog(tmp_path / "log.ulg", "sensor_gyro", fields, rows))
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z")
    assert r.covariates["temperature"][2] == 32
    assert r.covariate_units["temperature"] == "degC"
    assert r.rate == pytest.approx(RATE)
    assert r.stamps.jitter == 0


@pytest.mark.slow
def test_ulog_refusals(tmp_path):
    pytest.importorskip("pyulog")
    path = ulog(
        tmp_path / "log.ulg",
        "battery_status",
        "uint64_t timestamp;float v;",
        [struct.pack("<Qf", 1, 2.0)],
    )
    with pytest.raises(al.InputError, match="no inertial topic among battery_status"):
        al.read(path)
    path.write_bytes(b"not a ULog at all")
    with pytest.raises(al.InputError, match=r"log\.ulg: damaged"):
        al.read(path)


# -- topics --------------------------------------------------------------------------------------


def separate_topics(path, rates=(1, 1)):
    """A bag with a gyroscope and an accelerometer on topics of their own, and a slow temperature."""
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    vector = store.types["geometry_msgs/msg/Vector3"]
    thermal = store.types["sensor_msgs/msg/Temperature"]
    zero = vector(0.0, 0.0, 0.0)
    with rosbag1.Writer(path) as bag:
        kinds = {
            "/gyro": "sensor_msgs/msg/Imu",
            "/accel": "sensor_msgs/msg/Imu",
            "/temp": "sensor_msgs/msg/Temperature",
        }
        topics = {
            name: bag.add_connection(name, kind, typestore=store) for name, kind in kinds.items()
        }
        for k, (at, message) in enumerate(imu_messages(store)):
            rate, force = message.angular_velocity, message.linear_acceleration
            object.__setattr__(message, "linear_acceleration", zero)
            bag.write(topics["/gyro"], at, store.serialize_ros1(message, kinds["/gyro"]))
            object.__setattr__(message, "angular_velocity", zero)
            object.__setattr__(message, "linear_acceleration", force)
            if k % rates[1] == 0:
                bag.write(topics["/accel"], at, store.serialize_ros1(message, kinds["/accel"]))
            if k % 50 == 0:
                warm = thermal(header=message.header, temperature=20.0 + k / 50, variance=0.0)
                bag.write(topics["/temp"], at, store.serialize_ros1(warm, kinds["/temp"]))
            del rate
    return path


@pytest.mark.long
def test_ros_topics(tmp_path):
    path = separate_topics(tmp_path / "log.bag")
    # Two sensors with one rate are one recording.
    check_imu(al.read(path))
    r = al.read(path, topic="/gyro")
    assert r.columns == ("gyro_x", "gyro_y", "gyro_z")
    np.testing.assert_array_equal(r.samples, GYRO)
    r = al.read(path)
    assert r.covariates["temperature"][25] == pytest.approx(20.5)
    assert r.covariate_units["temperature"] == "degC"
    r = al.read(path, topic="/accel")
    assert r.columns == ("acc_x", "acc_y", "acc_z")
    both = al.read(path, topic=["/gyro", "/accel"])
    assert both.columns[3] == "accel.acc_x"
    np.testing.assert_array_equal(both.samples, np.hstack([GYRO, ACC]))
    slow = al.read(path, topic="/temp", column="temperature")
    assert (slow.n, slow.rate) == (N // 50, pytest.approx(RATE / 50))
    with pytest.raises(al.InputError, match="no topic /imu in the bag; its topics: /accel"):
        al.read(path, topic="/imu")
    slow = separate_topics(tmp_path / "slow.bag", (1, 3))
    with pytest.raises(al.InputError, match="different rates"):
        al.read(slow, topic=["/gyro", "/accel"])
    assert al.read(slow, topic="/accel").rate == pytest.approx(RATE / 3)
    np.save(tmp_path / "x.npy", GYRO)
    with pytest.raises(al.InputError, match="no topics"):
        al.read(tmp_path / "x.npy", rate=1, topic="/imu")


@pytest.mark.long
def test_ros_sensors_with_two_rates(tmp_path, capsys):
    path = separate_topics(tmp_path / "log.bag", (1, 2))
    gyro, acc = read_sensors(path)
    assert (gyro.columns, gyro.rate) == (("gyro_x", "gyro_y", "gyro_z"), pytest.approx(RATE))
    assert (acc.columns, acc.rate) == (("acc_x", "acc_y", "acc_z"), pytest.approx(RATE / 2))
    (told,) = [f for f in al.read(path).added_findings if f.kind == "other_rate"]
    assert not [f for f in gyro.added_findings if f.kind == "other_rate"]
    assert "topic /accel holds another sensor of this device" in told.message
    assert len(read_sensors(path, topic="/accel")) == 1
    # One command, one output file.
    target = tmp_path / "imu.yaml"
    words = ["characterize", str(path), "--model", "N", "--quiet", "--export", "kalibr"]
    with pytest.raises(SystemExit) as ended:
        main([*words, "--output", str(target)])
    assert ended.value.code == 0
    table = capsys.readouterr().out
    head = " ".join(table.split("gyroscope")[0].split())
    assert "3 columns of 400 samples at 200 Hz" in head
    assert "3 columns of 200 samples at 100 Hz" in head
    text = target.read_text(encoding="utf-8")
    assert "gyroscope_noise_density" in text
    assert "accelerometer_noise_density" in text
    assert "update_rate: 200" in text


def test_characterize_refuses_a_column_twice():
    one = al.Recording(GYRO, rate=RATE, unit="rad/s", columns=["x", "y", "z"])
    with pytest.raises(al.InputError, match="the column x is in two of the recordings"):
        al.characterize([one, one])


@pytest.mark.slow
def test_ros_messages_of_another_type(tmp_path):
    rosbag1 = pytest.importorskip("rosbags.rosbag1")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    path = tmp_path / "log.bag"
    vector = store.types["geometry_msgs/msg/Vector3"]
    with rosbag1.Writer(path) as bag:
        topic = bag.add_connection("/w", "geometry_msgs/msg/Vector3", typestore=store)
        for k in range(N):
            raw = store.serialize_ros1(vector(*GYRO[k]), "geometry_msgs/msg/Vector3")
            bag.write(topic, round(k * 1e9 / RATE), raw)
    r = al.read(path, topic="/w")
    assert (r.columns, r.rate) == (("x", "y", "z"), pytest.approx(RATE))


@pytest.mark.slow
@pytest.mark.data
def test_a_real_ulog(data):
    pytest.importorskip("pyulog")
    r = al.read(data("logs/sample_log_small.ulg"))
    assert r.columns[0] == "gyro_x"
    assert r.rate > 50
