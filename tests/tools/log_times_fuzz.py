#!/usr/bin/env python3
"""Logs whose times are wrong, in import, check, report and diagnose: log_times_fuzz.py BIN SOURCE WORK [--seconds S] [--seed N]

Times of a short flight are made zero, negative, rolled over, repeated, reversed, huge or none, or lie years apart: in a table that is imported, and in a flight log itself. Every program has to end
within 60 s or show how far it is, by itself or with one line of a mistake, and never with "internal fault"; after an interrupt it has to end within 1 s.
"""
import argparse
import csv
import math
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

MAPPING = """schema = 1
vehicle = "{vehicle}"
gravity_m_s2 = 9.81
ambient = {{ air_density_kg_m3 = 1.2, ground_z_m = -1000.0, ceiling_z_m = 1000.0, walls = [] }}
[command]
channel = "*"
time = "field"
time_field = "t"
inputs = ["motor_1", "motor_2", "motor_3", "motor_4"]
columns = {{ motor_1 = "m1", motor_2 = "m2", motor_3 = "m3", motor_4 = "m4" }}
[mocap]
channel = "*"
time = "field"
time_field = "t"
latency_s = 0.0
position_noise_m = 1e-4
attitude_noise_rad = 5e-3
columns = {{ x_m = "x", y_m = "y", z_m = "z", qw = "qw", qx = "qx", qy = "qy", qz = "qz" }}
"""
NAMES = ["t", "m1", "m2", "m3", "m4", "x", "y", "z", "qw", "qx", "qy", "qz"]
YEAR = 3.15e7


def flight(seconds=8, rate=100):
    rows = []
    for i in range(seconds * rate):
        s = i / rate
        roll = 0.2 * math.sin(4 * s)
        motors = [0.5 + 0.02 * math.sin(3 * s + k) for k in range(4)]
        rows.append([s, *motors, 0.3 * math.sin(s), 0.1 * s, 1 + 0.1 * math.cos(2 * s), math.cos(roll / 2), math.sin(roll / 2), 0, 0])
    return rows


def spoilt(times, random_):
    """Times, and what was done to them: one thing or several."""
    times, done = list(times), []
    for _ in range(random_.choice((1, 1, 2, 4))):
        n = len(times)
        i = random_.choice((0, n - 1, random_.randrange(n)))
        j = min(n, i + random_.choice((1, 1, 3, n // 4, n)))
        kind = random_.choice(("zero", "negative", "rolled", "repeated", "reversed", "gap", "huge", "none", "epoch", "scaled", "shuffled", "many gaps"))
        done.append(kind)
        number = lambda k: times[k] if isinstance(times[k], float) else 0.0
        if kind == "zero":
            times[i:j] = [0.0] * (j - i)
        elif kind == "negative":
            times[i:j] = [-abs(number(k)) - 1 for k in range(i, j)]
        elif kind == "rolled":
            times[i:j] = [number(k) + random_.choice((4294.967296, 2**64 * 1e-9, -(2**63) * 1e-9)) for k in range(i, j)]
        elif kind == "repeated":
            times[i:j] = [times[i]] * (j - i)
        elif kind == "reversed":
            times[i:j] = times[i:j][::-1]
        elif kind == "gap":
            gap = random_.choice((1.0, 100.0, 500.0, 3600.0, 86400.0, YEAR, 50 * YEAR))
            times[i:] = [number(k) + gap for k in range(i, n)]
        elif kind == "huge":
            times[i:j] = [random_.choice((1e30, -1e30, 1e308, 1e10))] * (j - i)
        elif kind == "none":
            times[i:j] = [random_.choice(("", "nan", "inf", "-inf", "later"))] * (j - i)
        elif kind == "epoch":
            times = [number(k) + 1.7e9 for k in range(n)]
        elif kind == "scaled":
            factor = random_.choice((1e3, 1e6, 1e9, 1e-3, 1e-6, 40.0))
            times = [factor * number(k) for k in range(n)]
        elif kind == "shuffled":
            part = times[i:j]
            random_.shuffle(part)
            times[i:j] = part
        elif kind == "many gaps":
            gap, at = random_.choice((0.5, 9.0, 300.0, 599.0, 4000.0)), 0.0
            for k in range(n):
                at += gap if k % random_.choice((2, 10)) == 0 else 0.01
                times[k] = at
    return times, done


class Watcher:
    def __init__(self, random_):
        self.random, self.runs, self.interrupts, self.longest = random_, 0, 0, 0.0
        self.codes = {}

    def run(self, command, case):
        """The exit code; None where it was interrupted."""
        self.runs += 1
        began = time.monotonic()
        process = subprocess.Popen([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        interrupts = self.random.random() < 0.1
        try:
            text, _ = process.communicate(timeout=self.random.uniform(0.05, 2) if interrupts else 60)
        except subprocess.TimeoutExpired:
            asked = time.monotonic()
            process.send_signal(signal.SIGINT)
            try:
                text, _ = process.communicate(timeout=1)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                sys.exit(f"{case}: {command}: does not heed an interrupt after {asked - began:.1f} s")
            if not interrupts and "%" not in text:
                sys.exit(f"{case}: {command}: lasts more than 60 s and shows no progress:\n{text}")
            self.interrupts += 1
            return None
        self.longest = max(self.longest, time.monotonic() - began)
        program = command[1] if "gap" in str(command[0]) else "report"
        self.codes[(program, process.returncode)] = self.codes.get((program, process.returncode), 0) + 1
        if process.returncode not in (0, 2) and not (process.returncode == 1 and program == "check") or "internal fault" in text:
            sys.exit(f"{case}: {command}: ends with {process.returncode}:\n{text}")
        return process.returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bin", type=Path)
    parser.add_argument("source", type=Path)
    parser.add_argument("work", type=Path)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    shutil.rmtree(asked.work, ignore_errors=True)
    asked.work.mkdir(parents=True)
    gap, report, vehicle = asked.bin / "flappy-gap", asked.bin / "flappy-report", asked.source / "configs/vehicles/crazyflie.toml"
    mapping = asked.work / "mapping.toml"
    mapping.write_text(MAPPING.format(vehicle=vehicle.name))
    rows, random_ = flight(), random.Random(asked.seed)
    table, log = asked.work / "log.csv", asked.work / "flight"
    watcher = Watcher(random_)

    def write(times):
        with table.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(NAMES)
            writer.writerows([t, *row[1:]] for t, row in zip(times, rows))

    def use(case):
        for command in ([gap, "check", log], [report, log, "--out", asked.work / "page.html"], [gap, "diagnose", "--vehicle", vehicle, "--flights", log, "--out", asked.work / "diagnosis"]):
            shutil.rmtree(asked.work / "diagnosis", ignore_errors=True)
            watcher.run(command, case)

    began, cases = time.monotonic(), 0
    while time.monotonic() - began < asked.seconds:
        cases += 1
        times, done = spoilt([row[0] for row in rows], random_)
        shutil.rmtree(log, ignore_errors=True)
        if random_.random() < 0.6:
            write(times)
            if watcher.run([gap, "import", table, "--mapping", mapping, "--out", log], f"case {cases}, table: {done}") == 0:
                use(f"case {cases}, table: {done}")
            continue
        write([row[0] for row in rows])
        subprocess.run([gap, "import", table, "--mapping", mapping, "--out", log], check=True, capture_output=True)
        for name in random_.choice((["command.csv"], ["mocap.csv"], ["command.csv", "mocap.csv"])):
            lines = (log / name).read_text().splitlines()
            kept = [line.split(",", 1)[1] for line in lines[1:]]
            (log / name).write_text("\n".join([lines[0], *(f"{t},{rest}" for t, rest in zip(times, kept))]) + "\n")
        use(f"case {cases}, log: {done}")
    codes = ", ".join(f"{program} {code}: {count}" for (program, code), count in sorted(watcher.codes.items()))
    print(f"{cases} logs, seed {asked.seed}, {asked.seconds:.0f} s: {watcher.runs} runs, {watcher.interrupts} of them interrupted; the longest that ended by itself took {watcher.longest:.1f} s; exit codes: {codes}")


if __name__ == "__main__":
    main()
