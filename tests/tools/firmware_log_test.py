"""The log that the exported app of the Crazyflie's firmware leaves on its card: read by the mapping beside the app, and checked.

python3 firmware_log_test.py BIN ROOT WORK: folders of the programs, the project, and one to use.
"""

import ctypes
import math
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import zlib

BIN, ROOT, WORK = (pathlib.Path(a) for a in sys.argv[1:4])
WITHIN = ["task.action.amplitude_V=[0.3,0.75]", "task.action.bias_V=[-0.19,0.19]"]  # what the firmware can set
SHORT = ["learn.updates=60", "evaluate.every=60", "checkpoint.every=60", "evaluate.vehicles=8", "collect.flappers=64", "learn.replay=2000"]
WRAPPER = '#include "flappy_policy.h"\nvoid step(const float *o, float *a) { flappy_policy_step(o, a); }\n'
FULL = 65535


def run(*command, code=0):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    assert done.returncode == code, (command, done.returncode, done.stderr, done.stdout)
    return done.stdout + done.stderr


def events():
    """What the card logs: {event: its variables}."""
    found = {}
    for line in (WORK / "exported/crazyflie/config.txt").read_text().split("\n")[4:]:
        if line.startswith("on:"):
            found[line[3:]] = []
        elif "." in line:
            found[list(found)[-1]].append(line)
    assert all(len(variables) <= 20 for variables in found.values()), found  # more are lost in the firmware
    return found


def rows(policy, observations):
    """A robot that sways: what its firmware logs at 100 Hz, from before its policy begins."""
    random.seed(1)
    phase = [random.uniform(0, 6) for _ in range(observations)]
    for tick in range(300):
        t_s, begun = tick / 100, tick > 50
        seen = (ctypes.c_float * observations)(*(math.sin(3 * t_s + p) if begun else 0 for p in phase))
        action = (ctypes.c_float * 4)()
        if begun:
            policy.step(seen, action)
        a = list(action) if begun else [0.6, 0, 0, 0]
        motor = {"m2": a[0] + a[1], "m4": a[0] - a[1], "m1": 0.5 - a[2], "m3": 0.5 + a[3]}
        row = {f"motor.{name}": round(FULL * min(max(x, 0), 1)) for name, x in motor.items()}
        row |= {f"flappy.o{k}": x for k, x in enumerate(seen)} | {f"flappy.a{k}": x for k, x in enumerate(action)}
        row |= {"stateEstimate.qw": 1.0, "stateEstimate.z": 1 + 0.1 * math.sin(t_s), "acc.z": 1.0, "pm.vbat": 7.6, "flappy.state": 3 if begun else 1}
        yield tick, row


def write_log(policy, observations, name, swap=()):
    def kind(v):
        return "I" if v.startswith("motor.") or v == "flappy.flags" else "B" if v == "flappy.state" else "f"

    head = b"\xbc" + struct.pack("<HH", 2, len(events()))
    for number, (event, variables) in enumerate(events().items()):
        head += struct.pack("<H", number) + event.encode() + b"\0" + struct.pack("<H", len(variables))
        head += b"".join(f"{v}({kind(v)})\0".encode() for v in variables)
    body = b""
    for tick, row in rows(policy, observations):
        for one, other in swap:
            row[one], row[other] = row[other], row[one]
        for late, (number, variables) in enumerate(reversed(list(enumerate(events().values())))):  # the first event is triggered last
            if number and tick <= 50:
                continue  # before the first inference
            body += struct.pack("<HQ", number, 10_000 * tick + late) + b"".join(struct.pack("<" + kind(v), row.get(v, 0)) for v in variables)
    (WORK / name).write_bytes(head + body + struct.pack("<I", zlib.crc32(head + body)))


shutil.rmtree(WORK, ignore_errors=True)
WORK.mkdir(parents=True)
run(BIN / "flappy-train", ROOT / "configs/train/flapper_dash.toml", "--out", WORK / "run", *(w for s in WITHIN + SHORT for w in ("--set", s)))
run(BIN / "flappy-export", WORK / "run", "--out", WORK / "exported", "--for", "crazyflie")
subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-I", WORK / "exported", "-x", "c", "-", "-o", WORK / "policy.so", "-lm"], input=WRAPPER, text=True, check=True)
policy = ctypes.CDLL(str(WORK / "policy.so"))
observations = int(re.search(r"FLAPPY_POLICY_OBS (\d+)", (WORK / "exported/flappy_policy.h").read_text())[1])

write_log(policy, observations, "log00")
run(BIN / "flappy-gap", "import", WORK / "log00", "--mapping", WORK / "exported/crazyflie/mapping.toml", "--out", WORK / "flight")
said = run(BIN / "flappy-gap", "check", "--flown", WORK / "exported", WORK / "flight")
assert "the robot flew what was exported: 249 of 249 inferences are the exported policy's" in said, said
write_log(policy, observations, "log01", swap=[("motor.m1", "motor.m2")])  # an older board of the Flapper
run(BIN / "flappy-gap", "import", WORK / "log01", "--mapping", WORK / "exported/crazyflie/mapping.toml", "--out", WORK / "swapped")
said = run(BIN / "flappy-gap", "check", "--flown", WORK / "exported", WORK / "swapped", code=1)
assert "the robot did not fly what was exported: 249 of 249" in said and re.search(r"left_flap follows it in \d\.", said), said
