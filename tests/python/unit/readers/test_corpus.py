"""Headers of more than fifty loggers with simulated rows: roles, units and rate are those that a person would read.

Each case states the sensor columns with the unit that the file gives (None: the program asks), the temperatures, the
sampling rate in the file (None: not there), and what the caller has to add.
"""

from __future__ import annotations

import datetime as dt
import json
from dataclasses import dataclass, field

import numpy as np
import pytest

import allanite as al
from allanite.readers import read_sensors

N = 240
RNG = np.random.default_rng(50)
K = np.arange(N)
#: Samples at rest: gyroscope in rad/s, accelerometer in m/s², magnetometer in µT.
GYRO = RNG.standard_normal((N, 3)) * 0.002 + [0.001, -0.002, 0.0015]
ACC = RNG.standard_normal((N, 3)) * 0.02 + [0.1, -0.2, 9.80]
MAG = RNG.standard_normal((N, 3)) * 0.3 + [20.0, -3.0, 41.0]
TEMP = 25.0 + 0.01 * np.cumsum(RNG.standard_normal(N))
DEG, G = np.degrees(1.0), 9.80665
UNIX = 1_700_000_000


@dataclass(frozen=True)
class Case:
    """One log, and how a person reads it."""

    text: str
    sensors: dict
    rate: float | None
    temperature: tuple = ()
    give: dict = field(default_factory=dict)
    suffix: str = ".csv"
    quantity: str = "rate"


CASES: dict[str, Case] = {}


def cells(columns, form="{:.9g}"):
    """Rows of cells; text, whole numbers and numbers as loggers print them."""
    return [
        [
            v
            if isinstance(v, str)
            else str(v)
            if float(v).is_integer() and abs(v) > 1e6
            else form.format(v)
            for v in row
        ]
        for row in zip(*columns, strict=True)
    ]


def log(header, *columns, sep=",", end="\n", before=(), **more):
    """Text of a log with a header; matrices stand for their columns."""
    flat = []
    for column in columns:
        flat += list(column.T) if isinstance(column, np.ndarray) and column.ndim == 2 else [column]
    lines = [
        *before,
        *([header] if header else []),
        *(sep.join(row) for row in cells(flat, **more)),
    ]
    return end.join(lines) + end


def dates(rate, form="%Y-%m-%d %H:%M:%S.%f", digits=3):
    """Date-times of the rows."""

    start = dt.datetime(2024, 5, 3, 14, 0, 0, tzinfo=dt.UTC)
    moments = (start + dt.timedelta(microseconds=round(k / rate * 1e6)) for k in range(N))
    cut = 6 - digits if form.endswith("%f") and digits < 6 else 0
    return [m.strftime(form)[: -cut or None] for m in moments]


def whole(column, scale):
    return np.rint(column * scale).astype(np.int64)


def named(stem, axes="xyz"):
    return [f"{stem}{axis}" for axis in axes]


def of(names, unit):
    return dict.fromkeys(names, unit)


BOTH = {"unit": "deg/s,m/s^2"}
ZERO, ONE = np.zeros(N, int), np.ones(N, int)

# fmt: off
# ruff: noqa: E501 - headers are as the loggers write them
# -- telephones ------------------------------------------------------------------------------------------------------------

# Sensor Logger (Tszheichoi): a file a sensor, time in ns since 1970.
CASES["Sensor Logger, gyroscope"] = Case(
    log("time,seconds_elapsed,z,y,x", UNIX * 10**9 + K * 10_000_000, K / 100, GYRO),
    of("zyx", None), 100.0, give={"unit": "rad/s"},
)
CASES["Sensor Logger, accelerometer"] = Case(
    log("time,seconds_elapsed,z,y,x", UNIX * 10**9 + K * 10_000_000, K / 100, ACC),
    of("zyx", None), 100.0, give={"unit": "m/s^2"},
)
# phyphox, "Gyroscope" and "Acceleration with g".
CASES["phyphox, gyroscope"] = Case(
    log(
        '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)","Absolute (rad/s)"',
        K / 200, GYRO, np.linalg.norm(GYRO, axis=1),
    ),
    of(named("Gyroscope "), "rad/s"), 200.0,
)
CASES["phyphox, acceleration, semicolons and decimal commas"] = Case(
    log(
        '"Time (s)";"Acceleration x (m/s^2)";"Acceleration y (m/s^2)";"Acceleration z (m/s^2)";"Absolute acceleration (m/s^2)"',
        K / 200, ACC, np.linalg.norm(ACC, axis=1), sep=";",
    ).replace(".", ","),
    of(named("Acceleration "), "m/s^2"), 200.0,
)
CASES["AndroSensor"] = Case(
    log(
        "ACCELEROMETER X (m/s²);ACCELEROMETER Y (m/s²);ACCELEROMETER Z (m/s²);GYROSCOPE X (rad/s);GYROSCOPE Y (rad/s);"
        "GYROSCOPE Z (rad/s);MAGNETIC FIELD X (μT);MAGNETIC FIELD Y (μT);MAGNETIC FIELD Z (μT);ORIENTATION Z (azimuth °);"
        "ATMOSPHERIC PRESSURE (hPa);Time since start in ms ;YYYY-MO-DD HH-MI-SS_SSS",
        ACC, GYRO, MAG, 100 + GYRO[:, 0], 1013 + TEMP / 100, K * 20, dates(50, "%Y-%m-%d %H:%M:%S:%f"), sep=";",
    ),
    of(named("ACCELEROMETER ", "XYZ"), "m/s²") | of(named("GYROSCOPE ", "XYZ"), "rad/s"), 50.0,
)
CASES["HyperIMU"] = Case(
    log(
        "Timestamp [ms],bmi160_accelerometer.x,bmi160_accelerometer.y,bmi160_accelerometer.z,"
        "bmi160_gyroscope.x,bmi160_gyroscope.y,bmi160_gyroscope.z",
        UNIX * 1000 + K * 20, ACC, GYRO,
    ),
    of(named("bmi160_accelerometer."), None) | of(named("bmi160_gyroscope."), None), 50.0,
    give={"unit": "rad/s,m/s^2"},
)
CASES["MATLAB Mobile, timetable as CSV"] = Case(
    log("Timestamp,X,Y,Z", dates(100, "%d-%b-%Y %H:%M:%S.%f"), GYRO),
    of("XYZ", None), 100.0, give={"unit": "rad/s"},
)
CASES["SensorLog (iOS)"] = Case(
    log(
        "loggingTime(txt),loggingSample(N),accelerometerTimestamp_sinceReboot(s),accelerometerAccelerationX(G),"
        "accelerometerAccelerationY(G),accelerometerAccelerationZ(G),gyroRotationX(rad/s),gyroRotationY(rad/s),"
        "gyroRotationZ(rad/s),motionYaw(rad),motionRoll(rad)",
        [f"2024-05-03T14:00:{k / 50:06.3f}+0200" for k in K], K, 62608 + K / 50, ACC / G, GYRO, GYRO[:, 0], GYRO[:, 1],
    ),
    of(named("accelerometerAcceleration", "XYZ"), "G") | of(named("gyroRotation", "XYZ"), "rad/s"), 50.0,
)
CASES["Physics Toolbox, g-force"] = Case(
    log("time,gFx,gFy,gFz,TgF", K / 100, ACC / G, np.linalg.norm(ACC, axis=1) / G),
    of(named("gF"), None), 100.0, give={"unit": "g"},
)

# -- autopilots ------------------------------------------------------------------------------------------------------------

CASES["PX4, ulog2csv of sensor_combined"] = Case(
    log(
        "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,"
        "accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_integral_dt,"
        "accelerometer_clipping,gyro_clipping,accel_calibration_count,gyro_calibration_count",
        5_000_000 + K * 5000, GYRO, 5000 * ONE, ZERO, ACC, 5000 * ONE, ZERO, ZERO, ONE, ONE,
    ),
    of((f"gyro_rad[{i}]" for i in range(3)), None) | of((f"accelerometer_m_s2[{i}]" for i in range(3)), "m/s^2"), 200.0,
    give={"unit": "rad/s,m/s^2"},
)
CASES["PX4, ulog2csv of sensor_gyro"] = Case(
    log(
        "timestamp,timestamp_sample,device_id,x,y,z,temperature,error_count,clip_counter[0],clip_counter[1],clip_counter[2],samples",
        5_000_000 + K * 2500, 4_999_700 + K * 2500, 3932170 * ONE, GYRO, TEMP, ZERO, ZERO, ZERO, ZERO, 8 * ONE,
    ),
    of("xyz", None), 400.0, ("temperature",), {"unit": "rad/s"},
)
CASES["betaflight, blackbox_decode"] = Case(
    log(
        "loopIteration, time (us), axisP[0], axisP[1], axisP[2], motor[0], motor[1], gyroADC[0], gyroADC[1], gyroADC[2],"
        " accSmooth[0], accSmooth[1], accSmooth[2]",
        8 * K, 1_000_000 + K * 1000, whole(MAG, 1), 1000 + whole(GYRO[:, :2], 1e4), whole(GYRO, 1e5), whole(ACC, 2048 / G),
        sep=", ",
    ),
    of((f"gyroADC[{i}]" for i in range(3)), None) | of((f"accSmooth[{i}]" for i in range(3)), None), 1000.0,
    give={"unit": "deg/s,g"},
)
CASES["ArduPilot, mavlogdump CSV"] = Case(
    log(
        "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
        UNIX + K / 50, 60_000_000 + K * 20_000, ZERO, GYRO, ACC, ZERO, ZERO, TEMP, ONE, ONE, 1000 * ONE, 1000 * ONE,
        form="{:.16g}",
    ),
    of(named("Gyr", "XYZ"), None) | of(named("Acc", "XYZ"), None), 50.0, give={"unit": "rad/s,m/s^2"},
)
# -- robots ----------------------------------------------------------------------------------------------------------------

CASES["Kalibr"] = Case(
    log("timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z", UNIX * 10**9 + K * 5_000_000, GYRO, ACC),
    of(named("omega_"), "rad/s") | of(named("alpha_"), "m/s^2"), 200.0,
)
EUROC = [*(f"w_RS_S_{a}" for a in "xyz"), *(f"a_RS_S_{a}" for a in "xyz")]
CASES["EuRoC"] = Case(
    log(
        "#timestamp [ns]," + ",".join(f"{n} [{'rad s^-1' if n[0] == 'w' else 'm s^-2'}]" for n in EUROC),
        1_403_636_579_758_555_392 + K * 5_000_000, GYRO, ACC, end="\r\n",
    ),
    of(EUROC[:3], "rad s^-1") | of(EUROC[3:], "m s^-2"), 200.0,
)
ROS = (
    *("header.seq", "header.stamp", "header.frame_id"),
    *(f"orientation.{a}" for a in "xyzw"),
    *(f"orientation_covariance{i}" for i in range(9)),
    *(f"angular_velocity.{a}" for a in "xyz"),
    *(f"angular_velocity_covariance{i}" for i in range(9)),
    *(f"linear_acceleration.{a}" for a in "xyz"),
    *(f"linear_acceleration_covariance{i}" for i in range(9)),
)
STAMP = UNIX * 10**9 + K * 10_000_000
QUATERNION, COVARIANCE = (
    np.tile([0.0, 0.0, 0.0, 1.0], (N, 1)),
    np.tile([1e-4, 0, 0, 0] * 2 + [1e-4], (N, 1)),
)
CASES["rostopic echo -p"] = Case(
    log(
        "%time," + ",".join(f"field.{name}" for name in ROS),
        STAMP + RNG.integers(0, 3_000_000, N), K, STAMP, ["imu_link"] * N, QUATERNION, COVARIANCE, GYRO, COVARIANCE, ACC,
        COVARIANCE,
    ),
    of(named("gyro_"), "rad/s") | of(named("acc_"), "m/s^2"), 100.0,
)
CASES["bagpy"] = Case(
    log(
        "Time,header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id,orientation.x,orientation.y,orientation.z,"
        "orientation.w," + ",".join(f"orientation_covariance_{i}" for i in range(9)) + ","
        "angular_velocity.x,angular_velocity.y,angular_velocity.z," + ",".join(f"angular_velocity_covariance_{i}" for i in range(9))
        + ",linear_acceleration.x,linear_acceleration.y,linear_acceleration.z",
        UNIX + K / 100, K, UNIX + K // 100, K % 100 * 10_000_000, ["imu"] * N, QUATERNION, COVARIANCE, GYRO, COVARIANCE, ACC,
        form="{:.16g}",
    ),
    of(named("angular_velocity."), None) | of(named("linear_acceleration."), None), 100.0,
    give={"unit": "rad/s,m/s^2"},
)
CASES["PlotJuggler"] = Case(
    log(
        "__time,/imu/angular_velocity/x,/imu/angular_velocity/y,/imu/angular_velocity/z,/imu/header/stamp,"
        "/imu/linear_acceleration/x,/imu/linear_acceleration/y,/imu/linear_acceleration/z",
        UNIX + K / 100, GYRO, UNIX + K / 100, ACC, form="{:.16g}",
    ),
    of(named("/imu/angular_velocity/"), None) | of(named("/imu/linear_acceleration/"), None), 100.0,
    give={"unit": "rad/s,m/s^2"},
)
CASES["RealSense, one stream as CSV"] = Case(
    log(
        "Stream Type,Index,F#,HW Timestamp (ms),Host Timestamp(ms), 3DOF_x,3DOF_y,3DOF_z",
        ["Gyro"] * N, ZERO, K + 7, 1000.25 + K * 5.0, 1003.5 + K * 5.0, GYRO,
    ),
    of(named("3DOF_"), None), 200.0, give={"unit": "rad/s"},
)
CASES["JSON lines of a bridge"] = Case(
    "".join(
        json.dumps({"ts": UNIX + k / 50, "imu": {"gyro": GYRO[k].tolist(), "accel": ACC[k].tolist(), "temp": TEMP[k]}}) + "\n"
        for k in K
    ),
    of(named("imu_gyro_"), None) | of(named("imu_accel_"), None), 50.0, ("imu_temp",), {"unit": "rad/s,m/s^2"}, ".jsonl",
)

# -- makers of sensors -----------------------------------------------------------------------------------------------------

CHANNELS = [*named("scaledAccel", "XYZ"), *named("scaledGyro", "XYZ")]
CASES["MicroStrain, SensorConnect"] = Case(
    log(
        "Time," + ",".join(f"6284.12345:{c}" for c in CHANNELS),
        dates(100, "%m/%d/%Y %H:%M:%S.%f000", 9), ACC / G, GYRO,
        before=["Session Info,", "Name,6284.12345", "Timezone,UTC", "", "DATA_START"],
    ),
    of(CHANNELS[:3], "g") | of(CHANNELS[3:], "rad/s"), 100.0,
)
CASES["MicroStrain, MIP Monitor"] = Case(
    log(
        "GPS TFlags,GPS Week,GPS TOW,X Accel [x8004],Y Accel [x8004],Z Accel [x8004],X Gyro [x8005],Y Gyro [x8005],Z Gyro [x8005]",
        7 * ONE, 2260 * ONE, 345600 + K / 100, ACC / G, GYRO,
    ),
    of([f"{a} Accel [x8004]" for a in "XYZ"], None) | of([f"{a} Gyro [x8005]" for a in "XYZ"], None), 100.0,
    give={"unit": "rad/s,g"},
)
CASES["Xsens, MT Manager"] = Case(
    log(
        "PacketCounter,SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z,Mag_X,Mag_Y,Mag_Z,Roll,Pitch,Yaw",
        (65500 + K) % 65536, 123456 + K * 100, ACC, GYRO, MAG, GYRO * DEG,
        before=["// General information:", "//  MT Manager version: 2022.0", "// Update Rate: 100.0Hz", "// Filter Profile: general"],
    ),
    of(named("Acc_", "XYZ"), None) | of(named("Gyr_", "XYZ"), None), 100.0, give={"unit": "rad/s,m/s^2"},
)
CASES["Movella DOT"] = Case(
    log(
        "PacketCounter,SampleTimeFine,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z",
        1 + K, 1_234_567_000 + K * 16_667 - (K % 3 == 2), ACC, GYRO * DEG,
        before=["sep=,", "DeviceTag:,Xsens DOT 1", "FirmwareVersion:,2.0.0", "OutputRate:,60Hz"],
    ),
    of(named("Acc_", "XYZ"), None) | of(named("Gyr_", "XYZ"), None), 60.0, give=BOTH,
)
CASES["VectorNav, Control Center"] = Case(
    log(
        "TimeStartup,Accel X [m/s^2],Accel Y [m/s^2],Accel Z [m/s^2],Gyro X [rad/s],Gyro Y [rad/s],Gyro Z [rad/s],Temp [C],Pressure [kPa]",
        1_000_000_000 + K * 5_000_000, ACC, GYRO, TEMP, 99.7 + TEMP / 1000,
    ),
    of(named("Accel ", "XYZ"), "m/s^2") | of(named("Gyro ", "XYZ"), "rad/s"), 200.0, ("Temp",),
)
CASES["SBG, sbgECom log"] = Case(
    log(
        "timestamp\tstatus\taccelerometers_x\taccelerometers_y\taccelerometers_z\tgyroscopes_x\tgyroscopes_y\tgyroscopes_z\ttemperature\n"
        "(us)\t(na)\t(m/s^2)\t(m/s^2)\t(m/s^2)\t(rad/s)\t(rad/s)\t(rad/s)\t(°C)",
        2_000_000 + K * 5000, 255 * ONE, ACC, GYRO, TEMP, sep="\t",
    ),
    of(named("accelerometers_"), "m/s^2") | of(named("gyroscopes_"), "rad/s"), 200.0, ("temperature",), suffix=".txt",
)
CASES["Inertial Sense"] = Case(
    log(
        "time,pqr[0],pqr[1],pqr[2],acc[0],acc[1],acc[2],status", 345600 + K / 250, GYRO, ACC, 0x1A0 * ONE, form="{:.10g}",
    ),
    of((f"pqr[{i}]" for i in range(3)), None) | of((f"acc[{i}]" for i in range(3)), None), 250.0,
    give={"unit": "rad/s,m/s^2"},
)
CASES["x-io, x-IMU3"] = Case(
    log(
        "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
        "Accelerometer Z (g)", 7_000_000 + K * 2500, GYRO * DEG, ACC / G,
    ),
    of(named("Gyroscope ", "XYZ"), "deg/s") | of(named("Accelerometer ", "XYZ"), "g"), 400.0,
)
CASES["x-io, NGIMU"] = Case(
    log(
        "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
        "Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT),Barometer (hPa)",
        K / 50, GYRO * DEG, ACC / G, MAG, 1013 + TEMP / 100,
    ),
    of(named("Gyroscope ", "XYZ"), "deg/s") | of(named("Accelerometer ", "XYZ"), "g"), 50.0,
)
CASES["OpenIMU"] = Case(
    log(
        "time,xAccel (m/s/s),yAccel (m/s/s),zAccel (m/s/s),xRate (deg/s),yRate (deg/s),zRate (deg/s),xMag (G),yMag (G),zMag (G)",
        K / 100, ACC, GYRO * DEG, MAG / 100,
    ),
    of([f"{a}Accel" for a in "xyz"], "m/s/s") | of([f"{a}Rate" for a in "xyz"], "deg/s"), 100.0,
)
SHIMMER = [
    *(f"Shimmer_8665_Accel_LN_{a}_CAL" for a in "XYZ"),
    *(f"Shimmer_8665_Gyro_{a}_CAL" for a in "XYZ"),
]
CASES["Shimmer, Consensys"] = Case(
    log(
        "\t".join(["Shimmer_8665_Timestamp_Unix_CAL", *SHIMMER]) + "\n" + "\t".join(["ms", *["m/(s^2)"] * 3, *["deg/s"] * 3]),
        UNIX * 1000 + K * 10, ACC, GYRO * DEG, sep="\t", before=["sep=\t"],
    ),
    of(SHIMMER[:3], "m/(s^2)") | of(SHIMMER[3:], "deg/s"), 100.0,
)
CASES["STMicroelectronics, MEMS Studio"] = Case(
    log(
        "Timestamp [us]\tA_X [mg]\tA_Y [mg]\tA_Z [mg]\tG_X [dps]\tG_Y [dps]\tG_Z [dps]\tT [degC]",
        K * 2500, ACC / G * 1000, GYRO * DEG, TEMP, sep="\t", before=["STEVAL-MKI197V1 (LSM6DSOX)", ""],
    ),
    of(named("A_", "XYZ"), "mg") | of(named("G_", "XYZ"), "dps"), 400.0, ("T",), suffix=".txt",
)
CASES["Bosch, Development Desktop"] = Case(
    log(
        "SampleNr;Timestamp[us];AccX[g];AccY[g];AccZ[g];GyrX[dps];GyrY[dps];GyrZ[dps];Temp[degC]",
        K, 40_000 + K * 10_000, ACC / G, GYRO * DEG, TEMP, sep=";",
    ),
    of(named("Acc", "XYZ"), "g") | of(named("Gyr", "XYZ"), "dps"), 100.0, ("Temp",),
)
CASES["InvenSense, eMD"] = Case(
    log(
        "Timestamp (us),Accel X (g),Accel Y (g),Accel Z (g),Gyro X (dps),Gyro Y (dps),Gyro Z (dps),Temperature (C)",
        K * 1000, ACC / G, GYRO * DEG, TEMP,
    ),
    of(named("Accel ", "XYZ"), "g") | of(named("Gyro ", "XYZ"), "dps"), 1000.0, ("Temperature",),
)
ADIS = [f"{a}GYRO_OUT" for a in "XYZ"] + [f"{a}ACCL_OUT" for a in "XYZ"]
CASES["Analog Devices, IMU Evaluation"] = Case(
    log(
        "Timestamp," + ",".join(ADIS) + ",TEMP_OUT,DATA_CNTR",
        K / 2000, whole(GYRO, 1e5), whole(ACC, 800 / G), whole(TEMP, 10), (65400 + K) % 65536,
    ),
    of(ADIS[:3], None) | of(ADIS[3:], None), 2000.0, ("TEMP_OUT",), {"unit": "deg/s,m/s^2"},
)
CASES["Analog Devices, channels of IIO"] = Case(
    log("anglvel_x,anglvel_y,anglvel_z,accel_x,accel_y,accel_z,temp0", GYRO, ACC, TEMP),
    of(named("anglvel_"), None) | of(named("accel_"), None), None, ("temp0",), {"rate": 2460.0, "unit": "rad/s,m/s^2"},
)
CASES["WitMotion"] = Case(
    log(
        "time\tDeviceName\tAccX(g)\tAccY(g)\tAccZ(g)\tAsX(°/s)\tAsY(°/s)\tAsZ(°/s)\tAngleX(°)\tAngleY(°)\tAngleZ(°)\tT(°)",
        dates(20), ["WT901(c4)"] * N, ACC / G, GYRO * DEG, GYRO * DEG, TEMP, sep="\t",
    ),
    of(named("Acc", "XYZ"), "g") | of(named("As", "XYZ"), "°/s"), 20.0, suffix=".txt",
)
CASES["PicoQuake"] = Case(
    log(
        "count,a_x,a_y,a_z,g_x,g_y,g_z", K + 1, ACC / G, GYRO * DEG,
        before=["# PLab PicoQuake Data", "# Num. samples: 240", "# data_rate = 2000.0 Hz", "# Integrity: True"],
    ),
    of(named("a_"), None) | of(named("g_"), None), 2000.0, give={"unit": "deg/s,g"},
)
CASES["Axivity"] = Case(
    log("", dates(100), ACC / G), of(("x1", "x2", "x3"), None), 100.0, give={"unit": "g"},
)
CASES["ActiGraph"] = Case(
    log(
        "Accelerometer X,Accelerometer Y,Accelerometer Z", ACC / G,
        before=["------------ Data File Created By ActiGraph GT3X+ ActiLife v6.13 Date Format M/d/yyyy at 100 Hz -----------",
                "Serial Number: CLE2B21130054", "Start Time 14:00:00", "--------------------------------------------------"],
    ),
    of([f"Accelerometer {a}" for a in "XYZ"], None), None, give={"rate": 100.0, "unit": "g"},
)

# -- boards ----------------------------------------------------------------------------------------------------------------

CASES["MPU-6050, prints of a sketch with labels"] = Case(
    "".join(
        "AccX: {:.3f} AccY: {:.3f} AccZ: {:.3f} GyroX: {:.4f} GyroY: {:.4f} GyroZ: {:.4f}\n".format(*ACC[k], *GYRO[k]) for k in K
    ),
    of(named("Acc", "XYZ"), None) | of(named("Gyro", "XYZ"), None), None, give={"rate": 50.0, "unit": "rad/s,m/s^2"}, suffix=".txt",
)
CASES["STM32, raw counts over a serial line"] = Case(
    log("ax,ay,az,gx,gy,gz", whole(ACC, 16384 / G), whole(GYRO * DEG, 131)),
    of(named("a"), None) | of(named("g"), None), None, give={"rate": 100.0, "unit": "deg/s,m/s^2"},
)
CASES["Arduino, millis and a temperature"] = Case(
    log("millis\tgx\tgy\tgz\ttemp", 1200 + K * 10, GYRO * DEG, TEMP, sep="\t"),
    of(named("g"), None), 100.0, ("temp",), {"unit": "deg/s"}, ".txt",
)
CASES["Arduino, serial monitor"] = Case(
    "".join(f"12:00:{k / 50:06.3f} -> {ACC[k, 0]:.4f},{ACC[k, 1]:.4f},{ACC[k, 2]:.4f}\n" for k in K),
    of(("x0", "x1", "x2"), None), 50.0, give={"unit": "m/s^2"}, suffix=".txt",
)
CASES["Arduino, serial plotter"] = Case(
    "".join("gx:{:.5f}\tgy:{:.5f}\tgz:{:.5f}\n".format(*GYRO[k]) for k in K),
    of(named("g"), None), None, give={"rate": 50.0, "unit": "rad/s"}, suffix=".txt",
)
CASES["Fortran, doubles with D"] = Case(
    log("", K / 10, GYRO, sep="  ", form="{:.12E}").replace("E", "D"),
    of(("x1", "x2", "x3"), None), 10.0, give={"unit": "rad/s"}, suffix=".dat",
)

# -- clocks, time servers, stations ----------------------------------------------------------------------------------------

PHASE = np.cumsum(RNG.standard_normal(N)) * 1e-9
CASES["Stable32, header"] = Case(
    log(
        "", PHASE, form="{:.12e}",
        before=["# File: ocxo.dat", "# Type: Phase", "# Tau: 1.000000e+01", "# Header End"],
    ),
    {"phase": "s"}, 0.1, suffix=".dat", quantity="angle",
)
CASES["TimeLab"] = Case(
    f'TIM 1\n"Input Freq" 1.0000000E+07\nTIC {N} 1\n' + "".join(f"{v:.15e}\n" for v in PHASE) + "END\n",
    {"phase": "s"}, None, give={"rate": 1.0}, suffix=".tim", quantity="angle",
)
CASES["time-interval counter, phase in ns"] = Case(
    log("time [s],offset [ns]", K, PHASE * 1e9), {"offset": "ns"}, 1.0, quantity="angle",
)
CASES["counter, MJD and frequency"] = Case(
    log("MJD,fractional_frequency", 60000 + K / 1440, PHASE * 1e-3, form="{:.12g}"),
    {"fractional_frequency": None}, 1 / 60, give={"unit": "1"},
)
CASES["ptp4l"] = Case(
    "".join(
        f"ptp4l[{1000 + k}.125]: master offset {round(v * 1e9):10d} s2 freq {k:+7d} path delay      900\n"
        for k, v in enumerate(PHASE * 100)
    ),
    {"offset": "s"}, 1.0, suffix=".log", quantity="angle",
)
CASES["chrony, tracking"] = Case(
    "=" * 100 + "\n   Date (UTC) Time     IP Address   St   Freq ppm   Skew ppm     Offset L Co  Offset sd Rem. corr.\n" + "=" * 100 + "\n"
    + "".join(
        f"{d} PPS              1     -3.541      0.075 {v: .3e} N  1  2.940e-06 -2.084e-07\n"
        for d, v in zip(dates(1 / 16, "%Y-%m-%d %H:%M:%S"), PHASE, strict=True)
    ),
    {"offset": "s"}, 1 / 16, suffix=".log", quantity="angle",
)
CASES["ntpd, loopstats"] = Case(
    "".join(f"60433 {100 + 64 * k}.031 {v:.9f} 13.778190 0.000351733 0.013380 6\n" for k, v in enumerate(PHASE * 1000)),
    {"offset": "s"}, 1 / 64, suffix="", quantity="angle",
)
CASES["pulse per second, ppstest"] = Case(
    "".join(
        f"source 0 - assert {UNIX + k}.{500_000_000 + round(v * 1e9):09d}, sequence: {k} - clear  0.000000000, sequence: 0\n"
        for k, v in enumerate(PHASE)
    ),
    {"phase": "s"}, 1.0, suffix=".txt", quantity="angle",
)
CASES["UNR, tenv"] = Case(
    "".join(
        f"MPRA 02AUG09 {2002.6037 + k / 365.25:.4f} {52495 + k} {1178 + (k + 5) // 7} {(k + 5) % 7} {v * 1e6: .6f}  0.001000 -0.0020"
        f"{k % 10}0  0.0083 0.000573 0.000705 0.002338 -0.113796  0.146139 -0.157282\n"
        for k, v in enumerate(PHASE)
    ),
    of(("east", "north", "up"), None), 1 / 86400, suffix=".tenv",
)
CASES["Hector, mom"] = Case(
    "# sampling period 1.0\n" + "".join(f"{51544 + k}.5 {v * 1e9:.4f}\n" for k, v in enumerate(PHASE)),
    {"observation": None}, 1 / 86400, suffix=".mom",
)

# -- headers as public programs write them ---------------------------------------------------------------------------------

NAMES = [*named("gyro_"), *named("accel_")]
MS = 1200 + K * 20
CASES["Unity, battery in the last column"] = Case(
    log("Timestamp,accX,accY,accZ,gyroX,gyroY,gyroZ,Battery", MS, ACC, GYRO, 3.7 - K * 1e-4),
    of(named("acc", "XYZ"), None) | of(named("gyro", "XYZ"), None), 50.0, give={"unit": "rad/s,m/s^2"},
)
CASES["telephone, orientation behind the magnetometer"] = Case(
    log("timestamp,accX,accY,accZ,gyroX,gyroY,gyroZ,magX,magY,magZ,roll,pitch,yaw", UNIX * 1000 + K * 20, ACC, GYRO, MAG, GYRO),
    of(named("acc", "XYZ"), None) | of(named("gyro", "XYZ"), None), 50.0, give={"unit": "rad/s,m/s^2"},
)
CASES["ESP32, magnitudes and jerk"] = Case(
    log("timestamp,accX,accY,accZ,gyroX,gyroY,gyroZ,accel_mag,gyro_mag,jerkX,jerkY,jerkZ", MS, ACC, GYRO * DEG,
        np.linalg.norm(ACC, axis=1), np.linalg.norm(GYRO * DEG, axis=1), np.gradient(ACC, axis=0)),
    of(named("acc", "XYZ"), None) | of(named("gyro", "XYZ"), None), 50.0, give=BOTH,
)
CASES["session server, sequence numbers and positions"] = Case(
    log("sequence_num,timestamp_ms,lat,lng,gps_accuracy_meters,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z",
        K, UNIX * 1000 + K * 20, 48.1 + K * 1e-7, 11.5 + K * 1e-7, 5 + 0 * K, ACC, GYRO),
    of(NAMES, None), 50.0, give={"unit": "rad/s,m/s^2"},
)
CASES["serial bridge, time_milliseconds"] = Case(
    log("time_milliseconds,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z", MS, ACC / G, GYRO * DEG),
    of(NAMES, None), 50.0, give={"unit": "deg/s,g"},
)
CASES["gesture logger, a label in the last column"] = Case(
    log("accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,label", whole(ACC, 1670), whole(GYRO * DEG, 131), ["i"] * N),
    of(NAMES, None), None, give={"rate": 100.0, "unit": "deg/s,m/s^2"},
)
CASES["rocket, two accelerometers and quaternions"] = Case(
    log("Temp,Press,Alt,Accel_x2,Accel_y2,Accel_z2,Accel_x,Accel_y,Accel_z,Gyro_x,Gyro_y,Gyro_z,Mag_x,Mag_y,Mag_z,"
        "Quaternion_1,Quaternion_2,Quaternion_3,Quaternion_4,Stage",
        TEMP, 1013 + TEMP / 50, 300 + TEMP, ACC, ACC + 0.01 * RNG.standard_normal((N, 3)), GYRO, MAG, QUATERNION, ONE),
    of(["Accel_x2", "Accel_y2", "Accel_z2", *named("Accel_"), *named("Gyro_")], None), None, ("Temp",),
    {"rate": 20.0, "unit": "rad/s,m/s^2"},
)
CASES["ship model, setpoints with units beside the IMU"] = Case(
    log("timestamp,speedMps (m/s),yaw (°),heading_setpoint (°),heading_error (°),rudder_cmd (°),track_wp_index,distance_to_wp (m),"
        "accel_x (g),accel_y (g),accel_z (g),gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s),rpm_prop_1 (rpm),battery_1 (V),mode_auto",
        UNIX + K / 20, 0 * K, 90 + GYRO[:, 0], 90 + ZERO, GYRO[:, 0], ZERO, ZERO, 5 + GYRO[:, 1], ACC / G, GYRO * DEG, ZERO,
        12 + GYRO[:, 2], ZERO, form="{:.16g}"),
    of(named("accel_"), "g") | of(named("gyro_"), "deg/s"), 20.0,
)
CASES["underwater logger, magnitude with a unit"] = Case(
    log("Time (s),Accel_X (g),Accel_Y (g),Accel_Z (g),Accel_Mag (g),Gyro_X (deg/s),Gyro_Y (deg/s),Gyro_Z (deg/s),Mag_X (mT),"
        "Mag_Y (mT),Mag_Z (mT),Pressure (mbar),P_Temp (C),Battery (V)",
        K / 250, ACC / G, np.linalg.norm(ACC / G, axis=1), GYRO * DEG, MAG / 1000, 1013 + TEMP / 30, TEMP, 3.9 - K * 1e-5),
    of(named("Accel_", "XYZ"), "g") | of(named("Gyro_", "XYZ"), "deg/s"), 250.0, ("P_Temp",),
)
CASES["weather rocket, everything with units"] = Case(
    log("Cycle/Iter,Time (s),Temperature (C),Pressure (hPa),Altitude_Baro (m),Humidity (%),Gyro_X (deg/s),Gyro_Y (deg/s),Gyro_Z (deg/s),"
        "RawAccel_X (m/s^2),RawAccel_Y (m/s^2),RawAccel_Z (m/s^2),Euler_X (deg),Euler_Y (deg),Euler_Z (deg)",
        K, K / 10, TEMP, 1013 + TEMP / 30, 100 + TEMP, 40 + TEMP / 9, GYRO * DEG, ACC, GYRO),
    of(named("Gyro_", "XYZ"), "deg/s") | of(named("RawAccel_", "XYZ"), "m/s^2"), 10.0, ("Temperature",),
)
CASES["gnss-ins-sim, gyro-0.csv"] = Case(
    log("gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s)", GYRO * DEG), of(named("gyro_"), "deg/s"), None, give={"rate": 100.0},
)
CASES["data manager, m/s2"] = Case(
    log("timestamp,accel_x (m/s2),accel_y (m/s2),accel_z (m/s2),gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s),mag_x (uT),mag_y (uT),mag_z (uT)",
        UNIX + K / 100, ACC, GYRO * DEG, MAG, form="{:.16g}"),
    of(named("accel_"), "m/s2") | of(named("gyro_"), "deg/s"), 100.0,
)
CASES["SD card, date and seconds"] = Case(
    log("date,seconds,accel_x (g),accel_y (g),accel_z (g),gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s),mag_x (uT),mag_y (uT),mag_z (uT)",
        ["2024-05-03"] * N, K / 100, ACC / G, GYRO * DEG, MAG),
    of(named("accel_"), "g") | of(named("gyro_"), "deg/s"), 100.0,
)
CASES["packet number, field in gauss"] = Case(
    log("Packet number,Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
        "Accelerometer Z (g),Magnetometer X (G),Magnetometer Y (G),Magnetometer Z (G)", K, GYRO * DEG, ACC / G, MAG / 100),
    of(named("Gyroscope ", "XYZ"), "deg/s") | of(named("Accelerometer ", "XYZ"), "g"), None, give={"rate": 50.0},
)
CASES["stage with a motor, position in mm"] = Case(
    log("Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g),"
        "ground truth pos (mm)", GYRO * DEG, ACC / G, GYRO[:, 0]),
    of(named("Gyroscope ", "XYZ"), "deg/s") | of(named("Accelerometer ", "XYZ"), "g"), None, give={"rate": 50.0},
)
AXES = [f"{a}-axis" for a in "xyz"]
CASES["MetaWear, gyroscope"] = Case(
    log("epoch (ms),time (01:00),elapsed (s),x-axis (deg/s),y-axis (deg/s),z-axis (deg/s)",
        UNIX * 1000 + K * 20, dates(50, "%Y-%m-%dT%H:%M:%S.%f"), K / 50, GYRO * DEG),
    of(AXES, "deg/s"), 50.0,
)
CASES["MetaWear, accelerometer"] = Case(
    log("epoc (ms),timestamp (-0700),elapsed (s),x-axis (g),y-axis (g),z-axis (g)",
        UNIX * 1000 + K * 20, dates(50, "%Y-%m-%dT%H.%M.%S.%f"), K / 50, ACC / G),
    of(AXES, "g"), 50.0,
)
CASES["TUM-VI, a header behind a hash"] = Case(
    log("#timestamp,wx,wy,wz,ax,ay,az", UNIX * 10**9 + K * 5_000_000, GYRO, ACC),
    of([*named("w"), *named("a")], None), 200.0, give={"unit": "rad/s,m/s^2"},
)
CASES["bag to CSV, seconds"] = Case(
    log("timestamp,wx,wy,wz,ax,ay,az", [f"{UNIX + k / 200:.9f}" for k in K], GYRO, ACC),
    of([*named("w"), *named("a")], None), 200.0, give={"unit": "rad/s,m/s^2"},
)
CASES["Adafruit MPU6050, time_ms and temp_c"] = Case(
    log("time_ms,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,temp_c", MS, ACC, GYRO, TEMP),
    of(NAMES, None), 50.0, ("temp_c",), {"unit": "rad/s,m/s^2"},
)
CASES["smart ring, three photodiodes and three temperatures"] = Case(
    log("wall_ms,green,red,ir,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,temp0,temp1,temp2", UNIX * 1000 + K * 40,
        50_000 + whole(GYRO, 1e5), ACC, GYRO, TEMP, TEMP + 1 + 0.01 * RNG.standard_normal(N), TEMP + 2 + 0.01 * RNG.standard_normal(N)),
    of(NAMES, None), 25.0, ("temp0", "temp1", "temp2"), {"unit": "rad/s,m/s^2"},
)
CASES["Nano 33, a button in the last column"] = Case(
    log("timestamp_ms,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z,temp,button", K * 10, ACC / G, GYRO * DEG, TEMP, ZERO),
    of([*named("acc_"), *named("gyro_")], None), 100.0, ("temp",), {"unit": "deg/s,g"},
)
CASES["registers of a board, temperature_raw"] = Case(
    log("timestamp_ms,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,temperature_raw", K * 10, whole(ACC, 1670), whole(GYRO * DEG, 131),
        whole(TEMP, 340)),
    of(NAMES, None), 100.0, ("temperature_raw",), {"unit": "deg/s,m/s^2"},
)
CASES["units in the names: g and dps"] = Case(
    log("time_ms,accel_x_g,accel_y_g,accel_z_g,gyro_x_dps,gyro_y_dps,gyro_z_dps", MS, ACC / G, GYRO * DEG),
    of([f"accel_{a}_g" for a in "xyz"], "g") | of([f"gyro_{a}_dps" for a in "xyz"], "deg/s"), 50.0,
)
CASES["two sensors on a board, units in the names"] = Case(
    log("timestamp_us," + ",".join(f"imu{i}_{s}" for i in (1, 2) for s in [*(f"gyro_{a}_dps" for a in "xyz"), *(f"accel_{a}_g" for a in "xyz")]),
        K * 1000, GYRO * DEG, ACC / G, GYRO * DEG + 0.01 * RNG.standard_normal((N, 3)), ACC / G + 0.001 * RNG.standard_normal((N, 3))),
    of([f"imu{i}_gyro_{a}_dps" for i in (1, 2) for a in "xyz"], "deg/s") | of([f"imu{i}_accel_{a}_g" for i in (1, 2) for a in "xyz"], "g"), 1000.0,
)
CASES["SensorLog, device motion"] = Case(
    log("loggingTime(txt),motionTimestamp_sinceReboot(s),motionYaw(rad),motionPitch(rad),motionRoll(rad),motionRotationRateX(rad/s),"
        "motionRotationRateY(rad/s),motionRotationRateZ(rad/s)",
        dates(50), 62608 + K / 50, GYRO, GYRO),
    of(named("motionRotationRate", "XYZ"), "rad/s"), 50.0,
)
CASES["BNO085, magnitudes and gravity"] = Case(
    log("time_ms,acceleration_x,acceleration_y,acceleration_z,acceleration_t,angular_velocity_x,angular_velocity_y,angular_velocity_z,"
        "angular_velocity_t", MS, ACC, MS - 3, GYRO, MS - 2),
    of([*named("acceleration_"), *named("angular_velocity_")], None), 50.0, give={"unit": "rad/s,m/s^2"},
)
CASES["ROS 2 node, stamp in two columns"] = Case(
    log("receive_time_ns,ros_stamp_sec,ros_stamp_nanosec,quaternion_w,quaternion_x,quaternion_y,quaternion_z,quaternion_norm,"
        "angular_velocity_x,angular_velocity_y,angular_velocity_z,linear_acceleration_x,linear_acceleration_y,linear_acceleration_z,arrival_gap_ms",
        UNIX * 10**9 + K * 5_000_000 + RNG.integers(0, 300_000, N), UNIX + K // 200, K % 200 * 5_000_000, QUATERNION, 1.0 + 0 * K,
        GYRO, ACC, 5 + 0.1 * RNG.standard_normal(N), before=["# frequency_hz=200"]),
    of([*named("angular_velocity_"), *named("linear_acceleration_")], None), 200.0, give={"unit": "rad/s,m/s^2"},
)
CASES["ROS 2 logger, receive and message time"] = Case(
    log("recv_time,msg_time,orientation_x,orientation_y,orientation_z,orientation_w,angular_velocity_x,angular_velocity_y,angular_velocity_z,"
        "linear_acceleration_x,linear_acceleration_y,linear_acceleration_z",
        UNIX + K / 100, UNIX + K / 100, QUATERNION, GYRO, ACC, form="{:.16g}"),
    of([*named("angular_velocity_"), *named("linear_acceleration_")], None), 100.0, give={"unit": "rad/s,m/s^2"},
)
CASES["floor data set, row, series and measurement numbers"] = Case(
    log("row_id,series_id,measurement_number,angular_velocity_X,angular_velocity_Y,angular_velocity_Z,linear_acceleration_X,"
        "linear_acceleration_Y,linear_acceleration_Z", [f"0_{k}" for k in K], ZERO, K, GYRO, ACC),
    of([*named("angular_velocity_", "XYZ"), *named("linear_acceleration_", "XYZ")], None), None,
    give={"rate": 100.0, "unit": "rad/s,m/s^2"},
)

# fmt: on


def test_there_are_fifty():
    assert len(CASES) >= 50


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_what_a_person_would_read(name, tmp_path):
    case = CASES[name]
    path = tmp_path / f"log{case.suffix}"
    path.write_text(case.text, encoding="utf-8", newline="")
    seen = al.inspect(path, **case.give)
    used = {c.name: c for c in seen.columns if c.used}
    assert seen.problem is None, seen.problem
    assert {n for n, c in used.items() if c.role == "sensor"} == set(case.sensors)
    assert {n for n, c in used.items() if c.role == "temperature"} == set(case.temperature)
    bare = al.inspect(path, **{k: v for k, v in case.give.items() if k == "rate"})
    assert {c.name for c in bare.columns if c.used and c.role == "sensor"} == set(case.sensors)
    stated = {c.name: c.unit for c in bare.columns}
    assert {n: stated[n] for n in case.sensors} == case.sensors
    rate = case.give.get("rate", case.rate)
    assert seen.rate == pytest.approx(rate, rel=1e-4)
    # What a command reads is what `inspect` shows.
    r = al.read(path, **case.give)
    assert set(r.columns) == set(case.sensors)
    assert set(r.covariates) == set(case.temperature)
    assert (r.rate, r.n, r.quantity) == (seen.rate, N, case.quantity)
    assert {c.name: (c.role, c.unit, c.scale) for c in r.log_columns} == {
        c.name: (c.role, c.unit, c.scale) for c in seen.columns if c.name != "(time)"
    }
    # `characterize` reads every sensor of the device.
    first, *_ = read_sensors(path, **case.give)
    assert (first.columns, first.units, first.rate) == (r.columns, r.units, r.rate)


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.rate is None])
def test_a_rate_that_no_log_holds_is_asked_for(name, tmp_path):
    case = CASES[name]
    path = tmp_path / f"log{case.suffix}"
    path.write_text(case.text, encoding="utf-8", newline="")
    rest = {k: v for k, v in case.give.items() if k != "rate"}
    with pytest.raises(al.InputError, match="rate"):
        al.read(path, **rest)
    assert "rate" in al.inspect(path, **rest).problem
