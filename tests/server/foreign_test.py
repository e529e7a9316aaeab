#!/usr/bin/env python3
"""Reads what we put on the wire with what others have: foreign_test.py BUILD SOURCE WORK [FASTDDS_READER]

Python's cyclonedds and, where its reader is given, Fast DDS read every topic; the bytes are those that rosbags writes for Humble
and Jazzy, and the hashes of types that we announce are those that it works out.
"""
import os
import subprocess
import sys
import time
from pathlib import Path

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, bounded_str, float32, float64, int32, sequence, uint8, uint32, uint64
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from dataclasses import dataclass
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

DOMAIN = 98
# as rmw_cyclonedds_cpp of Jazzy has it
JAZZY = ("<CycloneDDS><Domain><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
         "</Discovery></Domain></CycloneDDS>")
build, source, work = (Path(name).resolve() for name in sys.argv[1:4])
fastdds = sys.argv[4] if len(sys.argv) > 4 else None


# Dataclasses with the names that ROS 2 has on the wire.
@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Vector3
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseStamped_"):
    header: Header
    pose: Pose


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class Imu(IdlStruct, typename="sensor_msgs::msg::dds_::Imu_"):
    header: Header
    orientation: Quaternion
    orientation_covariance: array[float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: array[float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: array[float64, 9]


@dataclass
class JointState(IdlStruct, typename="sensor_msgs::msg::dds_::JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class BatteryState(IdlStruct, typename="sensor_msgs::msg::dds_::BatteryState_"):
    header: Header
    voltage: float32
    temperature: float32
    current: float32
    charge: float32
    capacity: float32
    design_capacity: float32
    percentage: float32
    power_supply_status: uint8
    power_supply_health: uint8
    power_supply_technology: uint8
    present: bool
    cell_voltage: sequence[float32]
    cell_temperature: sequence[float32]
    location: str
    serial_number: str


@dataclass
class Clock(IdlStruct, typename="rosgraph_msgs::msg::dds_::Clock_"):
    clock: Time


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class WingInput(IdlStruct, typename="flappy_msgs::msg::dds_::WingInput_"):
    header: Header
    tick: uint64
    amplitude_v: float64
    difference_v: float64
    bias_v: float64
    split_cycle: float64
    left_voltage_v: float64
    right_voltage_v: float64
    phase_rad: float64


@dataclass
class Tick(IdlStruct, typename="flappy_msgs::msg::dds_::Tick_"):
    stamp: Time
    until: Time
    tick: uint64
    imu: uint32
    poses: uint32
    wish: uint8


@dataclass
class TrainingMetrics(IdlStruct, typename="flappy_msgs::msg::dds_::TrainingMetrics_"):
    header: Header
    run: str
    update: uint64
    updates: uint64
    episodes: uint64
    env_steps: uint64
    mean_return: float64
    success: float64
    updates_per_s: float64
    env_steps_per_s: float64


@dataclass
class JobStatus(IdlStruct, typename="flappy_msgs::msg::dds_::JobStatus_"):
    header: Header
    id: uint64
    kind: bounded_str[64]
    config: bounded_str[256]
    state: bounded_str[16]
    attempts: uint32
    exit_code: int32
    progress: float64
    message: bounded_str[1024]
    folder: bounded_str[256]


FLIGHT = {"/flappy/pose": PoseStamped, "/flappy/imu": Imu, "/flappy/joint_states": JointState, "/tf": TFMessage, "/clock": Clock}
TOPICS = {
    "flappy-train": {**FLIGHT, "/flappy/wing_input": WingInput, "/flappy/training": TrainingMetrics, "/diagnostics": DiagnosticArray},
    "flappy-sitl": {"/flappy/pose": PoseStamped, "/flappy/imu": Imu, "/flappy/joint_states": JointState, "/flappy/battery": BatteryState,
                    "/flappy/motors": JointState, "/flappy/driver": WingInput, "/flappy/tick": Tick, "/clock": Clock},
    "flappy-server": {"/flappy/jobs": JobStatus},
}
DDS = ["--set", "dds.enabled=true", "--set", f"dds.domain={DOMAIN}", "--set", "dds.reach=host"]
LOG = ["log.power.battery_nominal_V=18", "log.power.rate_hz=500", "log.power.latency_s=0.0", "log.power.voltage_noise_V=0.01",
       "log.power.current_noise_A=0.02"]


def start(program, *arguments):
    return subprocess.Popen([build / "bin" / program, *map(str, arguments)], cwd=source, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def main():
    work.mkdir(parents=True, exist_ok=True)
    stores = {}
    for store in (Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY):
        stores[store] = get_typestore(store)
        for file in sorted((source / "examples/ros2/flappy_msgs/msg").glob("*.msg")):
            stores[store].register(get_types_from_msg(file.read_text(), f"flappy_msgs/msg/{file.stem}"))
    domain = Domain(DOMAIN, JAZZY)  # noqa: F841  which lives as long as its participants
    participant = DomainParticipant(DOMAIN)
    best_effort = Qos(Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(100))
    publications = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)

    def train():
        return start("flappy-train", "configs/train/escape.toml", "--out", work / "train", "--set", "learn.updates=4000",
                     "--set", "evaluate.every=500", "--set", "evaluate.vehicles=50", "--threads", "1", *DDS)

    def sitl():
        return start("flappy-sitl", "configs/fly/escape.toml", "--real-time", "--timeout", "1000", "--set", "flight.duration_s=20",
                     *sum((["--set", each] for each in LOG), []), *DDS)

    def server():
        return start("flappy-server", "configs/server/local.toml", "--set", f"jobs.output={work / 'jobs'}", *DDS)

    read = []
    for program, starts in (("flappy-train", train), ("flappy-sitl", sitl), ("flappy-server", server)):
        readers = {name: DataReader(participant, Topic(participant, "rt" + name, kind), best_effort) for name, kind in TOPICS[program].items()}
        fast = {}
        if fastdds:
            environment = {**os.environ, "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
            for name, kind in TOPICS[program].items():
                type_name = kind.__idl__.idl_transformed_typename
                fast[name] = subprocess.Popen([fastdds, str(DOMAIN), "rt" + name, type_name, "25"], stdout=subprocess.PIPE, text=True, env=environment)
            time.sleep(1)
        # of ticks and jobs others than our own ask for, so that there is something to see
        process = starts()
        ask = None
        if program == "flappy-sitl":
            ask = start("flappy-record", "configs/mapping/sitl.toml", "--out", work / "recorded", "--duration", "8", *DDS[2:])
            from cyclonedds.pub import DataWriter
            pilot = DataReader(participant, Topic(participant, "rt/flappy/tick", Tick), best_effort)
            inputs = DataWriter(participant, Topic(participant, "rt/flappy/wing_input", WingInput),
                                qos=Qos(Policy.Reliability.Reliable(1_000_000_000), Policy.Durability.TransientLocal, Policy.History.KeepLast(64)))
        seen = {}
        hashes = {}
        until = time.time() + 15
        submitted = 0.0
        while time.time() < until and (len(seen) < len(readers) or len(hashes) < len(readers)):
            if program == "flappy-sitl":
                for tick in pilot.take(100):
                    inputs.write(WingInput(Header(tick.stamp, ""), tick.tick, 10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
            if program == "flappy-server" and time.time() - submitted > 2:
                submitted = time.time()
                subprocess.run([build / "bin/flappy-job", "--dds", f"domain={DOMAIN}", "--dds", "reach=host", "submit", "train", "train/escape.toml", "--set", "learn.updates=1000000"],
                               capture_output=True)
            for name, reader in readers.items():
                for sample in reader.take(100):
                    seen[name] = sample
            for publication in publications.take(200):
                if publication.topic_name is None or publication.qos is None:  # of one that is gone
                    continue
                name = publication.topic_name.removeprefix("rt")
                data = publication.qos[Policy.Userdata].data.decode() if Policy.Userdata in publication.qos else ""
                if name in readers and data.startswith("typehash="):
                    hashes[name] = (publication.type_name, data.removeprefix("typehash=").rstrip(";"))
            time.sleep(0.001)
        if ask:
            ask.wait(timeout=30)
        missing = [name for name in readers if name not in seen]
        assert not missing, f"{program}: never read {missing}"
        for name, (type_name, announced) in hashes.items():
            ros = type_name.replace("::dds_", "").replace("::", "/").rstrip("_")
            for store in stores.values():
                assert store.hash_rihs01(ros) == announced, f"{name}: {announced} is not the hash of {ros}"
        assert set(hashes) == set(readers), f"no hash of {set(readers) - set(hashes)}"
        for name, reader in fast.items():
            out, _ = reader.communicate(timeout=40)
            lines = out.split()
            assert len(lines) == 3, f"Fast DDS read {len(lines)} of {name}"
            ros = TOPICS[program][name].__idl__.idl_transformed_typename.replace("::dds_", "").replace("::", "/").rstrip("_")
            for line in lines:
                for store in stores.values():
                    raw = bytes.fromhex(line)
                    # senders fill the last four bytes and say in the header by how much
                    message = store.deserialize_cdr(raw, ros)
                    again = bytes(store.serialize_cdr(message, ros, little_endian=True))
                    assert raw[4:len(again)] == again[4:] and len(raw) - len(again) < 4, f"{name}: bytes of rosbags differ"
        process.terminate()
        process.wait(timeout=60)
        read += [f"{program} {name}" for name in readers]
    # what was recorded off the wire, byte by byte
    count = 0
    for store in stores.values():
        with AnyReader([work / "recorded.mcap"], default_typestore=store) as bag:
            for connection, _, raw in bag.messages():
                again = bytes(store.serialize_cdr(bag.deserialize(raw, connection.msgtype), connection.msgtype, little_endian=True))
                assert raw[4:len(again)] == again[4:] and len(raw) - len(again) < 4, f"{connection.topic}: bytes of rosbags differ"
                count += 1
    assert count > 1000, count
    print(f"{len(read)} topics read by cyclonedds of Python{' and Fast DDS' if fastdds else ''}; {count} recorded messages as rosbags writes them")


if __name__ == "__main__":
    main()
