#!/usr/bin/env python3
"""Damages of a ULog, in flappy-gap import and in pyulog: ulog_damage.py BIN WORK [--cases N] [--seed S]

Of a log with three topics, a byte is lost or changed, a sector is zeroed, or the end is cut off, each at a random place. In 95 % of the cases import has to read at least 95 % of the
samples that pyulog reads of the same file; where it reads fewer than were written, it has to warn or to refuse.
"""
import argparse
import json
import math
import random
import struct
import subprocess
import sys
from pathlib import Path

import pyulog

MAPPING = """schema = 1
vehicle = "hummingbird_nominal.toml"
gravity_m_s2 = 9.81
ambient = { air_density_kg_m3 = 1.2, ground_z_m = -1000.0, ceiling_z_m = 1000.0, walls = [] }
[command]
channel = "actuator_outputs"
inputs = ["u"]
columns = { u = "output[3]" }
[mocap]
channel = "vehicle_visual_odometry"
latency_s = 0.0
position_noise_m = 1e-3
attitude_noise_rad = 5e-3
columns = { x_m = "position[0]", y_m = "position[1]", z_m = "position[2]", qw = "q[0]", qx = "q[1]", qy = "q[2]", qz = "q[3]" }
[imu]
channel = "sensor_combined"
latency_s = 0.0
bandwidth_hz = 100.0
position_m = [0.0, 0.0, 0.0]
gyro_noise_rad_s = 0.01
gyro_bias_sd_rad_s = [0.01, 0.01, 0.01]
accel_noise_m_s2 = 0.1
gyro = true
[imu.columns]
gyro_x_rad_s = "gyro_rad[0]"
gyro_y_rad_s = "gyro_rad[1]"
gyro_z_rad_s = "gyro_rad[2]"
accel_x_m_s2 = "accelerometer_m_s2[0]"
accel_y_m_s2 = "accelerometer_m_s2[1]"
accel_z_m_s2 = "accelerometer_m_s2[2]"
"""
SECTOR = 512


def message(kind, content):
    return struct.pack("<HB", len(content), ord(kind)) + content


def whole_log(seconds=10):
    """The bytes, how many samples they hold, and where messages begin."""
    sync = bytes([0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12])
    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0), message("B", bytes(40))]
    for text in (
        "sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
        "vehicle_visual_odometry:uint64_t timestamp;float[3] position;float[4] q;",
        "actuator_outputs:uint64_t timestamp;float[4] output;",
    ):
        parts.append(message("F", text.encode()))
    for number, name in enumerate(("sensor_combined", "vehicle_visual_odometry", "actuator_outputs")):
        parts.append(message("A", struct.pack("<BH", 0, number) + name.encode()))
    samples = 0
    for i in range(250 * seconds):
        t_us, s = 1_000_000 + 4000 * i, i / 250
        parts.append(message("D", struct.pack("<HQ6f", 0, t_us, 0.1 * math.sin(s), 0, 0, 0, 0, -9.81)))
        samples += 1
        if i % 5 == 0:
            parts.append(message("D", struct.pack("<HQ7f", 1, t_us, s / 10, 0, 1, 1, 0, 0, 0)))
            parts.append(message("D", struct.pack("<HQ4f", 2, t_us, 1500, 1500, 1500, 1500 + i % 7)))
            samples += 2
        if i % 125 == 0:
            parts.append(message("S", sync))
    begins = set()
    at = 0
    for part in parts:
        begins.add(at)
        at += len(part)
    return b"".join(parts), samples, begins


def damaged(log, random_):
    kind, at = random_.choice(("lost", "changed", "zeroed", "cut")), random_.randrange(16, len(log) - SECTOR)
    if kind == "lost":
        return kind, at, log[:at] + log[at + 1 :]
    if kind == "changed":
        return kind, at, log[:at] + bytes([(log[at] + random_.randrange(1, 256)) % 256]) + log[at + 1 :]
    if kind == "zeroed":
        return kind, at, log[:at] + bytes(SECTOR) + log[at + SECTOR :]
    return kind, at, log[:at]


def read_by_pyulog(file):
    try:
        return sum(len(topic.data["timestamp"]) for topic in pyulog.ULog(str(file)).data_list)
    except Exception:  # whatever a damage makes of it
        return 0


def read_by_import(gap, file, mapping, work):
    """Samples that were read, usable or not, and what was said."""
    report = work / "import.json"
    report.unlink(missing_ok=True)
    done = subprocess.run([gap, "import", file, "--mapping", mapping, "--out", work / "flight", "--json", report], capture_output=True, text=True, check=False)
    if done.returncode == 2:
        return 0, done.stderr
    assert done.returncode == 0, f"{file}: {done.returncode}: {done.stderr}"
    return sum(s["samples"] + s["unusable"] + s["twice"] for s in json.loads(report.read_text())["streams"]), done.stderr


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bin", type=Path)
    parser.add_argument("work", type=Path)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    asked.work.mkdir(parents=True, exist_ok=True)
    mapping, file = asked.work / "mapping.toml", asked.work / "damaged.ulg"
    mapping.write_text(MAPPING)
    log, written, begins = whole_log()
    random_ = random.Random(asked.seed)
    good = silent = 0
    shares = {}
    for _ in range(asked.cases):
        kind, at, text = damaged(log, random_)
        file.write_bytes(text)
        theirs = read_by_pyulog(file)
        ours, said = read_by_import(asked.bin / "flappy-gap", file, mapping, asked.work)
        good += ours >= 0.95 * theirs
        if ours < 0.95 * theirs:
            print(f"fewer: {kind} at byte {at}: {ours} of {written} samples, pyulog {theirs}: {said.strip()}")
        if ours < written and not said and not (kind == "cut" and at in begins):  # which is a shorter log
            silent += 1
            print(f"silent: {kind} at byte {at}: {ours} of {written} samples")
        shares.setdefault(kind, []).append((ours / written, theirs / written))
    print(f"{asked.cases} damages of a ULog of {len(log)} bytes and {written} samples, seed {asked.seed}: in {good} import reads at least 95 % of what pyulog {pyulog.__version__ if hasattr(pyulog, '__version__') else ''} reads; {silent} silent losses")
    for kind, pairs in sorted(shares.items()):
        ours, theirs = (sum(p[k] for p in pairs) / len(pairs) for k in (0, 1))
        print(f"  {kind:8} {len(pairs):4} cases: import reads {100 * ours:.1f} % of the samples, pyulog {100 * theirs:.1f} %")
    sys.exit(0 if good >= 0.95 * asked.cases and silent == 0 else 1)


if __name__ == "__main__":
    main()
