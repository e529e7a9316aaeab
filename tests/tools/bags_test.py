#!/usr/bin/env python3
"""What flappy-fly --mcap wrote, in the Python packages mcap and rosbags; what rosbags wrote, in flappy-gap import; hashes of types and
bytes of messages, by both; a ULog, in pyulog and in flappy-gap import: bags_test.py BIN SOURCE WORK
"""
import filecmp
import json
import os
import random
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import numpy
import pyulog
from mcap.reader import NonSeekingReader, make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

BIN, SOURCE, WORK = (Path(argument).resolve() for argument in sys.argv[1:4])
MAPPING = SOURCE / "configs/mapping/ros2.toml"
# written down once more, so that a slip in the project's own is seen
OWN = {
    "WingInput": "std_msgs/Header header\nuint64 tick\nfloat64 amplitude_v\nfloat64 difference_v\nfloat64 bias_v\nfloat64 split_cycle\n"
                 "float64 left_voltage_v\nfloat64 right_voltage_v\nfloat64 phase_rad\n",
    "TrainingMetrics": "std_msgs/Header header\nstring run\nuint64 update\nuint64 updates\nuint64 episodes\nuint64 env_steps\n"
                       "float64 mean_return\nfloat64 success\nfloat64 updates_per_s\nfloat64 env_steps_per_s\n",
    "JobStatus": "std_msgs/Header header\nuint64 id\nstring<=64 kind\nstring<=256 config\nstring<=16 state\nuint32 attempts\nint32 exit_code\n"
                 "float64 progress\nstring<=1024 message\nstring<=256 folder\n",
    "Watch": "uint32 flapper\n",
    "Command": "builtin_interfaces/Time stamp\nstring<=64 id\nstring<=16 verb\nstring<=64 kind\nstring<=256 config\nuint64 job\n"
               "string<=256[<=32] overrides\n",
    "CommandResult": "string<=64 id\nbool accepted\nuint64 job\nstring<=1024 message\n",
}
STANDARD = """builtin_interfaces/Time builtin_interfaces/Duration std_msgs/Header std_msgs/Float64MultiArray std_msgs/MultiArrayLayout
    std_msgs/MultiArrayDimension geometry_msgs/Point geometry_msgs/Quaternion geometry_msgs/Vector3 geometry_msgs/Pose geometry_msgs/PoseStamped
    geometry_msgs/PoseWithCovariance geometry_msgs/Accel geometry_msgs/AccelStamped geometry_msgs/Twist geometry_msgs/TwistWithCovariance geometry_msgs/Transform geometry_msgs/TransformStamped
    nav_msgs/Odometry sensor_msgs/Imu sensor_msgs/JointState sensor_msgs/BatteryState tf2_msgs/TFMessage rosgraph_msgs/Clock
    diagnostic_msgs/KeyValue diagnostic_msgs/DiagnosticStatus diagnostic_msgs/DiagnosticArray""".split()


def store(release):
    types = get_typestore(release)
    for name, text in OWN.items():
        types.register(get_types_from_msg(text, f"flappy_msgs/msg/{name}"))
    return types


RELEASES = {"humble": store(Stores.ROS2_HUMBLE), "jazzy": store(Stores.ROS2_JAZZY)}


def run(*command, env=None):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, env={**os.environ, **(env or {})}, check=False)
    assert done.returncode == 0, f"{command}: {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def imported(name, file):
    """The folder of a flight log."""
    run(BIN / "flappy-gap", "import", file, "--mapping", MAPPING, "--out", WORK / name)
    return WORK / name


def same_logs(one, other):
    names = sorted(path.name for path in one.iterdir())
    match, mismatch, errors = filecmp.cmpfiles(one, other, names, shallow=False)
    assert match == names, f"{one} and {other} differ in {mismatch + errors}"


def read_by_mcap(file):
    """Every message, by the index and without it."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        indexed = [(c.topic, m.log_time, m.publish_time, m.data) for _, c, m in reader.iter_messages()]
    with file.open("rb") as stream:
        plain = [(c.topic, m.log_time, m.publish_time, m.data) for _, c, m in NonSeekingReader(stream, validate_crcs=True).iter_messages()]
    assert sorted(indexed) == sorted(plain) and len(plain) == summary.statistics.message_count > 1000
    assert all(c.metadata["offered_qos_profiles"] == "" for c in summary.channels.values())  # the profile requires it
    hashes = {c.topic: (summary.schemas[c.schema_id].name, c.metadata["topic_type_hash"]) for c in summary.channels.values()}
    for types in RELEASES.values():
        for topic, (name, given) in hashes.items():
            assert types.hash_rihs01(name) == given, f"{topic}: {given}"
    return plain


def read_by_rosbags(file):
    """(topic, type, received, bytes); both releases write each message as it was written."""
    messages = []
    with AnyReader([file]) as reader:  # by the definitions in the file
        for connection, received, data in reader.messages():
            reader.deserialize(data, connection.msgtype)
            for types in RELEASES.values():
                message = types.deserialize_cdr(data, connection.msgtype)
                assert bytes(types.serialize_cdr(message, connection.msgtype)) == bytes(data), connection.topic
            messages.append((connection.topic, connection.msgtype, received, bytes(data)))
    return messages


def write_bag(folder, types, version, plugin, messages, compressed=False):
    shutil.rmtree(folder, ignore_errors=True)
    writer = Writer(folder, version=version, storage_plugin=plugin)
    if compressed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, name, received, data in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=types)
            writer.write(connections[topic], received, data)
    return folder


def cut_short(file):
    """Half of the file, in the reader that needs no index and in ours."""
    half = WORK / "half.mcap"
    half.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    count = 0
    with half.open("rb") as stream:
        try:
            for _ in NonSeekingReader(stream).iter_messages(log_time_order=False):
                count += 1
        except Exception as error:  # its end is missing, and mcap says so
            assert "nd" in f"{type(error).__name__} {error}", error
    assert count > 100, count
    log = imported("half", half)
    rows = sum(len((log / name).read_text().splitlines()) - 1 for name in ("command.csv", "imu.csv", "mocap.csv"))
    assert rows > 100


def disturbed(types, messages):
    """A flight as a recorder gets it over a network, from a robot whose clock is off: what was done to it must be said of it."""
    offset_ns, drift, least_ns = 1_700_000_000_123_456_789, 12e-6, 300_000
    dice, held = random.Random(2), []
    poses = 0
    for topic, name, logged, data in messages:
        delay = least_ns + int(dice.expovariate(1 / 400e3))
        arrived = logged + offset_ns + int(drift * logged) + delay
        if topic == "/pose":
            poses += 1
            if poses in (500, 900, 901):
                continue  # never
            if poses % 600 == 0:
                arrived += 60_000_000  # late
            if poses == 700:
                held.append((topic, name, arrived + 1000, data))  # twice
        held.append((topic, name, arrived, data))
    held.sort(key=lambda message: message[2])
    bag = write_bag(WORK / "disturbed", types, 9, StoragePlugin.MCAP, held)
    report = WORK / "disturbed.json"
    said = run(BIN / "flappy-gap", "import", bag, "--mapping", MAPPING, "--out", WORK / "disturbed_log", "--json", report)
    found = json.loads(report.read_text())
    mocap, clock = found["streams"][1], found["clocks"][0]
    assert (mocap["never"], mocap["twice"], mocap["late"]) == (3, 1, poses // 600), mocap
    assert mocap["out_of_order"] >= poses // 600, mocap
    assert abs(clock["drift"] - drift) < 0.3e-6, clock
    assert abs(clock["offset_s"] - 1e-9 * (offset_ns + least_ns)) < 20e-6, clock
    return said


def ulog():
    """A flight as PX4 logs it, in the package pyulog and in ours."""
    formats = {
        "actuator_motors": "uint64_t timestamp;uint64_t timestamp_sample;float[12] control;uint16_t reversible_flags;uint8_t[6] _padding0;",
        "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;float[3] accelerometer_m_s2;",
        "vehicle_visual_odometry": "uint64_t timestamp;uint64_t timestamp_sample;float[3] position;float[4] q;uint8_t quality;uint8_t[3] _padding0;",
    }
    records = [(b"B", bytes(40))]
    records += [(b"F", f"{name}:{members}".encode()) for name, members in formats.items()]
    records += [(b"A", struct.pack("<BH", 0, i) + name.encode()) for i, name in enumerate(formats)]
    for k in range(200):
        t = 1_000_000 + 5000 * k
        records.append((b"D", struct.pack("<HQQ12fH", 0, t, t, 0.01 * k % 1, -0.5, *[0] * 10, 0)))
        records.append((b"D", struct.pack("<HQ3fI3f", 1, t, 0.1 * k, 2, 3, 5000, 4, 5, -9.8)))
        records.append((b"D", struct.pack("<HQQ3f4fB", 2, t, t - 2000, k, 20, -30, 1, 0, 0, 0, 100)))
    file = WORK / "px4.ulg"
    body = b"".join(struct.pack("<Hc", len(content), kind) + content for kind, content in records)
    file.write_bytes(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1) + body)
    theirs = {d.name: d.data for d in pyulog.ULog(str(file)).data_list}
    run(BIN / "flappy-gap", "import", file, "--mapping", SOURCE / "configs/mapping/px4.toml", "--out", WORK / "px4")
    ours = {name: numpy.genfromtxt(WORK / "px4" / f"{name}.csv", delimiter=",", names=True) for name in ("command", "mocap", "imu")}
    motors, imu, pose = (theirs[name] for name in formats)
    start = 1_000_000 - 2000
    for found, expected in (
        (ours["command"]["t_s"], 1e-6 * (motors["timestamp"] - start)), (ours["command"]["left_voltage_V"], 18 * motors["control[0]"]),
        (ours["imu"]["gyro_x_rad_s"], imu["gyro_rad[0]"]), (ours["imu"]["accel_z_m_s2"], -imu["accelerometer_m_s2[2]"]),
        (ours["mocap"]["t_s"], 1e-6 * (pose["timestamp_sample"] - start)), (ours["mocap"]["y_m"], pose["position[0]"]),
        (ours["mocap"]["z_m"], -pose["position[2]"]),
    ):
        assert len(found) == 200 and numpy.allclose(found, expected, rtol=1e-6, atol=1e-9), (found, expected)


def any_message(types, name, dice):
    """With numbers and lengths at random."""
    numbers = {"bool": lambda: dice.random() < 0.5, "byte": lambda: dice.randrange(128), "char": lambda: dice.randrange(256),
               "float32": lambda: float(numpy.float32(dice.gauss(0, 1))), "float64": lambda: dice.gauss(0, 1)}
    for bits in (8, 16, 32, 64):
        numbers[f"int{bits}"] = lambda b=bits: dice.randrange(-2 ** (b - 1), 2 ** (b - 1))
        numbers[f"uint{bits}"] = lambda b=bits: dice.randrange(2**b)

    def one(kind, rest):
        if kind.name == "NAME":
            return any_message(types, rest, dice)
        if rest[0] == "string":
            return "".join(dice.choice("abcxyz /") for _ in range(dice.randrange(min(rest[1] or 30, 30))))
        return numbers[rest[0]]()

    values = {}
    for field, (kind, rest) in types.fielddefs[name][1]:
        if kind.name in ("ARRAY", "SEQUENCE"):
            (inner, what), bound = rest
            count = bound if kind.name == "ARRAY" else dice.randrange(min(bound or 5, 5))
            value = [one(inner, what) for _ in range(count)]
            if inner.name == "BASE" and what[0] != "string":
                value = numpy.array(value, dtype={"byte": "uint8", "char": "uint8"}.get(what[0], what[0]))
        else:
            value = one(kind, rest)
        values[field] = value
    return types.types[name](**values)


def all_messages(types, folder):
    """A bag with messages of every type that the project knows, whose topics are their hashes, read and written again by ros_test."""
    names = [name.replace("/", "/msg/") for name in STANDARD] + [f"flappy_msgs/msg/{name}" for name in OWN]
    dice = random.Random(1)
    messages = []
    for time in range(20):
        for name in names:
            data = bytes(types.serialize_cdr(any_message(types, name, dice), name))
            messages.append((f"/{name}/{types.hash_rihs01(name)}", name, time, data))
    write_bag(folder, types, 9, StoragePlugin.MCAP, messages)
    said = run(BIN / "ros_test", "--gtest_filter=Cdr.GivesBackTheMessagesOfABagFromOutside", env={"FLAPPY_BAG": str(folder)})
    assert f"{len(messages)} messages of {len(names)} types" in said, said


def main():
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    flown = WORK / "flown.mcap"
    run(BIN / "flappy-fly", SOURCE / "configs/fly/open_loop.toml", "--set", "flight.duration_s=4", "--mcap", flown)
    by_mcap, by_rosbags = read_by_mcap(flown), read_by_rosbags(flown)
    assert sorted((m[0], m[1], m[3]) for m in by_mcap) == sorted((m[0], m[2], m[3]) for m in by_rosbags)
    log = imported("flown", flown)
    cut_short(flown)
    for release, types in RELEASES.items():
        for plugin in StoragePlugin:
            for compressed in (False, True) if plugin == StoragePlugin.MCAP else (False,):
                folder = WORK / f"{release}_{plugin.name.lower()}{'_zstd' if compressed else ''}"
                bag = write_bag(folder, types, 8 if release == "humble" else 9, plugin, by_rosbags, compressed)
                same_logs(log, imported(folder.name + "_log", bag))
                same_logs(log, imported(folder.name + "_log", next(p for p in bag.iterdir() if p.suffix in (".db3", ".mcap"))))
        all_messages(types, WORK / f"{release}_all")
    ulog()
    long = WORK / "long.mcap"
    run(BIN / "flappy-fly", SOURCE / "configs/fly/open_loop.toml", "--set", "flight.duration_s=30", "--mcap", long)
    print(disturbed(RELEASES["jazzy"], read_by_rosbags(long)))
    print(f"{len(by_mcap)} messages there and back")


if __name__ == "__main__":
    main()
