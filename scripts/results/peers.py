#!/usr/bin/env python3
"""Peers at their newest, beside us on one core: steps, flights at equal error, environment steps. Run by scripts/bench peers.

    scripts/results/peers.py BUILD OUT [--flights 16] [--part bench|dart|warp|environments]

BUILD: made by scripts/bench peers with MuJoCo's newest library, its venv in BUILD/venv. Prints tables, and writes OUT/peers.json.
An engine that no C++ of ours reaches flies our vehicle in Python; of its time only the call of its own step counts, so that Python
costs it little. Loads on it are those of tests/reference/peer.hpp, as in C++.
"""
import argparse
import ctypes
import importlib.metadata
import json
import os
import statistics
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path

ROUNDS, SECONDS = 5, 2.0
HOLD_S = 1e-3  # each voltage is held so long
VECTOR = ctypes.c_double * 21, ctypes.c_double * 12


class Loads:
    """What acts on a vehicle of a file beyond gravity, inertia and stops (tests/reference/peer_library.cpp)."""

    def __init__(self, library, file, step_s):
        self.library = ctypes.CDLL(str(library))
        for name, result, arguments in (
            ("peer_open", ctypes.c_void_p, [ctypes.c_char_p, ctypes.c_double]),
            ("peer_mjcf", ctypes.c_char_p, [ctypes.c_void_p]),
            ("peer_loads", None, [ctypes.c_void_p, VECTOR[0], ctypes.c_double, ctypes.c_double, VECTOR[1]]),
        ):
            function = getattr(self.library, name)
            function.restype, function.argtypes = result, arguments
        self.opened = self.library.peer_open(str(file).encode(), step_s)
        self.mjcf = self.library.peer_mjcf(self.opened).decode()
        self.found = VECTOR[1]()

    def at(self, state, left_V, right_V):
        self.library.peer_loads(self.opened, VECTOR[0](*state), left_V, right_V, self.found)
        return self.found


def numbers(text):
    return [float(word) for word in text.split()]


class DartFlight:
    """The vehicle in DART as tests/reference/dart_peer.cpp has it, with an explicit spring and damping as a load."""

    def __init__(self, loads, step_s, stroke_rad, rotation_rad):
        import dartpy
        import numpy as np

        self.np, self.loads, self.dynamics, self.math = np, loads, dartpy.dynamics, dartpy.math
        root = ET.fromstring(loads.mjcf)
        torso = root.find("worldbody/body")
        self.skeleton = self.dynamics.Skeleton("vehicle")
        self.free, self.torso = self.skeleton.createFreeJointAndBodyNodePair(None, self.dynamics.FreeJointProperties(), self.body(torso, "torso"))
        self.stroke, self.rotation, self.wing, self.rotor = [], [], [], []
        for name, edge in zip(("left", "right"), torso.findall("body"), strict=True):
            inner, link = edge.find("joint"), edge.find("body")
            self.rotor.append(float(inner.get("armature")))
            stroke, node = self.skeleton.createRevoluteJointAndBodyNodePair(
                self.torso, self.hinge(inner, name + " stroke", numbers(edge.get("pos"))), self.body(edge, name + " edge", self.rotor[-1]))
            rotation, wing = self.skeleton.createRevoluteJointAndBodyNodePair(
                node, self.hinge(link.find("joint"), name + " rotation", [0, 0, 0]), self.body(link, name + " wing"))
            self.stroke.append(stroke)
            self.rotation.append(rotation)
            self.wing.append(wing)
        for i in (0, 1):
            self.stroke[i].setPosition(0, stroke_rad[i])
            self.rotation[i].setPosition(0, rotation_rad[i])
        self.skeleton.resetAccelerations()
        self.world = dartpy.simulation.World()
        self.world.setTimeStep(step_s)
        self.world.setGravity([0, 0, -9.81])
        self.world.addSkeleton(self.skeleton)
        self.frame = self.dynamics.Frame.World()

    def body(self, element, name, rotor=0.0):
        np, inertial = self.np, element.find("inertial")
        w, x, y, z = numbers(inertial.get("quat"))
        turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
        moments = turn @ np.diag(numbers(inertial.get("diaginertia"))) @ turn.T
        moments[2, 2] += rotor
        aspect = self.dynamics.BodyNodeAspectProperties(name)
        aspect.mInertia = self.dynamics.Inertia(float(inertial.get("mass")), numbers(inertial.get("pos")), moments)
        return self.dynamics.BodyNodeProperties(aspect)

    def hinge(self, element, name, origin_m):
        p = self.dynamics.RevoluteJointProperties()
        p.mName, p.mAxis = name, numbers(element.get("axis"))
        low, high = numbers(element.get("range"))
        p.mPositionLowerLimits, p.mPositionUpperLimits, p.mIsPositionLimitEnforced = [low], [high], True
        at = self.np.eye(4)
        at[:3, 3] = origin_m
        p.mT_ParentBodyToJoint = self.math.Isometry3(at)
        return p

    def step(self, left_V, right_V):
        """Returns the seconds of the engine's own step."""
        np = self.np
        at = self.torso.getTransform()
        q = at.quaternion()
        twist = self.torso.getSpatialVelocity()
        turn = at.rotation()
        rates = [[j.getVelocity(0) for j in joints] for joints in (self.stroke, self.rotation)]
        state = [*at.translation(), q.w(), q.x(), q.y(), q.z(), *(turn @ twist[3:]), *twist[:3],
                 *(j.getPosition(0) for j in self.stroke), *(j.getPosition(0) for j in self.rotation), *rates[0], *rates[1]]
        found = self.loads.at(state, left_V, right_V)
        # the leading edge carries the rotor; what the torso feels of it besides is taken back (dart_peer.cpp)
        turning = self.torso.getAngularAcceleration(self.frame, self.torso)[2]
        for i, sign in ((0, 1), (1, -1)):
            force, span, depth, damping, stroke_Nm, rotation_Nm = found[6 * i:6 * i + 6]
            rotor, stroke = self.rotor[i], self.stroke[i]
            stroke.setForce(0, stroke_Nm + sign * rotor * turning)
            self.rotation[i].setForce(0, rotation_Nm)
            self.wing[i].addExtForce([force, 0, 0], [0, sign * span, -depth], True, True)
            self.wing[i].addExtTorque([0, damping, 0], True)
            spin = np.array([0, 0, rotor * (twist[2] + sign * rates[0][i])])
            back = np.cross(twist[:3], spin)
            back[2] += rotor * (turning + sign * stroke.getAcceleration(0))
            self.torso.addExtTorque(back, True)
        begin = time.thread_time()
        self.world.step()
        return time.thread_time() - begin

    def position_m(self):
        return self.torso.getTransform().translation()


def dart_rows(library, folder, count):
    """Errors and flight per second of DART at several steps, as flappy-bench work-precision has them of Debian's."""
    rows = []
    flights = json.loads((folder / "flights.json").read_text())[:count]
    for step_us in (250, 200, 125, 100):
        squares = spent = steps = 0.0
        for f in flights:
            flight = DartFlight(Loads(library, folder / f["vehicle"], step_us * 1e-6), step_us * 1e-6, f["stroke_rad"], f["rotation_rad"])
            each = round(HOLD_S / (step_us * 1e-6))
            for left_V, right_V in f["voltages_V"]:
                for _ in range(each):
                    spent += flight.step(left_V, right_V)
                    steps += 1
            squares += sum((a - b) ** 2 for a, b in zip(flight.position_m(), f["end_m"], strict=True))
        seconds = len(flights[0]["voltages_V"]) * HOLD_S * len(flights)
        rows.append({"step_us": step_us, "error_mm": 1e3 * (squares / len(flights)) ** 0.5, "flight_s_per_s": seconds / spent, "us_a_step": 1e6 * spent / steps})
    return rows


def rates(step, count):
    """[round] Steps per second of `count` copies."""
    for _ in range(3):
        step()
    found = []
    for _ in range(ROUNDS):
        begin, done = time.perf_counter(), 0
        while time.perf_counter() - begin < SECONDS:
            step()
            done += 1
        found.append(count * done / (time.perf_counter() - begin))
    return found


def warp_rates(mjcf, count):
    """MuJoCo Warp without loads, on the processor."""
    import mujoco
    import mujoco_warp
    import warp

    warp.config.quiet = True
    with warp.ScopedDevice("cpu"):
        model = mujoco.MjModel.from_xml_string(mjcf)
        there = mujoco_warp.put_model(model)
        data = mujoco_warp.put_data(model, mujoco.MjData(model), nworld=count)
        return rates(lambda: mujoco_warp.step(there, data), count)


def own_rates(environment, count, **options):
    import gymnasium
    import numpy as np
    import flappy  # noqa: F401  registers the environments

    envs = gymnasium.make_vec(environment, num_envs=count, copy=False, **options)
    envs.reset(seed=1)
    action = np.zeros(envs.action_space.shape, np.float32)
    return rates(lambda: envs.step(action), count)


def envpool_rates(environment, count):
    import envpool
    import numpy as np

    envs = envpool.make(environment, env_type="gymnasium", num_envs=count, num_threads=1)
    envs.reset()
    action = np.stack([envs.action_space.sample() for _ in range(count)])
    return rates(lambda: envs.step(action), count)


def crazyflow_rates(count):
    import jax
    import numpy as np
    from crazyflow.sim import Sim

    sim = Sim(n_worlds=count, n_drones=1, device="cpu")
    sim.reset()
    command = np.zeros((count, 1, 4))
    command[..., 3] = 0.4  # N of thrust: about hover

    def step():
        sim.attitude_control(command)
        sim.step(5)  # five steps of 2 ms are the 10 ms of our environments
        jax.block_until_ready(sim.data)

    return rates(step, count)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--flights", type=int, default=16, help="of DART at each step (16; at most 64)")
    parser.add_argument("--part", choices=["bench", "dart", "warp", "environments"], help="only this part")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    o = parser.parse_args()
    if not 1 <= o.flights <= 64:
        sys.exit(f"--flights {o.flights}: is not from 1 to 64; accepted: so many")
    o.build, o.out = o.build.resolve(), o.out.resolve()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    bench, library, folder = o.build / "bin" / "flappy-bench", o.build / "tools" / "libflappy_peer_library.so", o.out / "flights"
    o.out.mkdir(parents=True, exist_ok=True)

    # each in a process of its own, for each brings threads and libraries along
    each = {
        "flappy/Hover-v0": lambda: own_rates("flappy/Hover-v0", 4096),
        "flappy/Fly-v0 of a Crazyflie": lambda: own_rates("flappy/Fly-v0", 4096, config="fly/quadrotor.toml"),
        "crazyflow": lambda: crazyflow_rates(4096),
        "envpool Ant-v5": lambda: envpool_rates("Ant-v5", 256),
        "envpool Pendulum-v1": lambda: envpool_rates("Pendulum-v1", 4096),
        "warp": lambda: warp_rates(Loads(library, folder / "vehicle_0.toml", 250e-6).mjcf.replace("solver='PGS'", "solver='Newton'"), 4096),
    }
    if o.one:
        print("\n" + json.dumps(each[o.one]()))
        return

    def rate_of(name):
        done = subprocess.run([sys.executable, Path(__file__).resolve(), o.build, o.out, "--one", name], capture_output=True, text=True, cwd=o.out)
        if done.returncode != 0:
            sys.exit(f"{name}: {(done.stderr.strip().splitlines() or [f'exit code {done.returncode}'])[-1]}")
        return json.loads(done.stdout.strip().splitlines()[-1])

    file = o.out / "peers.json"
    found = json.loads(file.read_text()) if file.exists() else {}
    found["versions"] = {p: importlib.metadata.version(p) for p in ("mujoco", "mujoco-warp", "dartpy", "envpool", "crazyflow", "jax")}
    print(found["versions"])
    if o.part in (None, "dart", "warp"):
        subprocess.run([bench, "work-precision", "--flights", folder], check=True)
    if o.part in (None, "bench"):
        for name, command in (("speed", []), ("work-precision", ["work-precision"])):
            subprocess.run([bench, "--json", o.out / f"{name}.json", *command], check=True, cwd=o.out)
            found[name] = json.loads((o.out / f"{name}.json").read_text())
    if o.part in (None, "dart"):
        found["dart"] = dart_rows(library, folder, o.flights)
        for row in found["dart"]:
            print("DART, explicit spring, at {step_us} us: {error_mm:.3f} mm, {flight_s_per_s:.4g} flapper-seconds per second of its own "
                  "steps, {us_a_step:.2f} us a step".format(**row))
    for part, names in (("warp", ["warp"]), ("environments", [n for n in each if n != "warp"])):
        for name in names if o.part in (None, part) else []:
            found[name] = rate_of(name)
            print(f"{name}: {statistics.median(found[name]):,.0f} steps/s ({min(found[name]):,.0f} to {max(found[name]):,.0f})")
    file.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
