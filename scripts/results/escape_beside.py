#!/usr/bin/env python3
"""The trained escape of the bird beside the robot's: prints the trained columns of docs/results/animals.md.

    scripts/results/escape_beside.py BIN ROOT BIRD_RUN ROBOT_RUN OUT

BIN holds the programs, ROOT is the project, the runs are folders of flappy-train configs/train/escape_hummingbird.toml and escape.toml, OUT takes the logs.
Each figure is the median of 50 flights of randomised vehicles, from the start to the hand-back at 0.35 s: angles are Euler's of z, y, x from the
start's heading, rates are means over a beat, so that a body's shaking by its own wings counts for nothing.
"""

import csv
import math
import pathlib
import statistics
import subprocess
import sys

BIN, ROOT, BIRD, ROBOT, OUT = (pathlib.Path(a) for a in sys.argv[1:6])
MANOEUVRE_S = 0.35
FLIGHTS = 50


def fly(name, run, manoeuvre, *more):
    config = ROOT / "configs/fly" / manoeuvre
    log = OUT / name
    actor = f"actor={(run / 'best.json').resolve()}"
    subprocess.run([BIN / "flappy-fly", config, "--count", str(FLIGHTS), "--set", actor, *more, "--log", log], check=True, stdout=subprocess.DEVNULL)
    return sorted(log.glob("*/")) if not (log / "truth.csv").exists() else [log]


def rows_of(file):
    with open(file, newline="") as f:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(f)]


def angles(row):
    w, x, y, z = (row["q" + k] for k in "wxyz")
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return [math.degrees(a) for a in (roll, pitch, heading)]


def averaged(values, width):
    half = width // 2
    return [sum(values[max(0, i - half) : i + half + 1]) / len(values[max(0, i - half) : i + half + 1]) for i in range(len(values))]


def figures(folder, beats_Hz):
    rows = [r for r in rows_of(folder / "truth.csv") if r["t_s"] <= MANOEUVRE_S]
    dt = rows[1]["t_s"] - rows[0]["t_s"]
    beat = max(1, round(1 / beats_Hz / dt))
    first = angles(rows[0])
    roll, pitch, heading = (averaged(a, beat) for a in zip(*(angles(r) for r in rows)))
    turned, total = [0.0], 0.0
    for a, b in zip(heading, heading[1:]):
        total += (b - a + 180) % 360 - 180
        turned.append(total)
    result = {"largest pitch, nose down, deg": max(pitch), "largest pitch, nose up, deg": -min(pitch), "largest roll, deg": max(abs(a) for a in roll)}
    result["heading turned, deg"] = abs(turned[-1])
    for name, key in (("roll", "x"), ("pitch", "y"), ("yaw", "z")):
        result[f"largest {name} rate, deg/s"] = math.degrees(max(abs(a) for a in averaged([r[f"rate_{key}_rad_s"] for r in rows], beat)))
    ahead = (math.cos(math.radians(first[2])), math.sin(math.radians(first[2])))
    moved = (rows[-1]["x_m"] - rows[0]["x_m"], rows[-1]["y_m"] - rows[0]["y_m"])
    result["path backward, mm"] = -1e3 * (ahead[0] * moved[0] + ahead[1] * moved[1])
    result["path sideways, mm"] = 1e3 * abs(ahead[0] * moved[1] - ahead[1] * moved[0])
    result["path upward, mm"] = 1e3 * (rows[-1]["z_m"] - rows[0]["z_m"])
    speeds = [averaged([r[f"velocity_{k}_m_s"] for r in rows], beat) for k in "xyz"]
    result["largest speed, m/s"] = max(math.dist(v, (0, 0, 0)) for v in zip(*speeds))
    result["largest acceleration, m/s^2"] = max(math.dist(a, b) for a, b in zip(list(zip(*speeds))[beat:], list(zip(*speeds)))) / (beat * dt)
    if (folder / "joints.csv").exists():
        work = [r for r in rows_of(folder / "joints.csv") if r["t_s"] <= MANOEUVRE_S]
        later = [r for r in rows_of(folder / "joints.csv") if 2.0 <= r["t_s"]]
        power = [(a["positive_work_J"], a["t_s"]) for a in (work[0], work[-1], later[0], later[-1])]
        result["muscle power beside that of hover"] = (power[1][0] - power[0][0]) / (power[1][1] - power[0][1]) / ((power[3][0] - power[2][0]) / (power[3][1] - power[2][1]))
    return result


def frequency(folder):
    for line in (folder / "flight.toml").read_text().splitlines():
        if line.startswith("flapping_Hz"):
            return float(line.split("=")[1])
    raise SystemExit(f"{folder}/flight.toml: no flapping_Hz")


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    columns = []
    for name, run, manoeuvre in (("bird", BIRD, "escape_hummingbird.toml"), ("robot", ROBOT, "escape.toml")):
        all_of = [figures(folder, frequency(folder)) for folder in fly(name, run, manoeuvre)]
        columns.append({key: statistics.median(f[key] for f in all_of) for key in all_of[0]})
    print(f"| median of {FLIGHTS} flights, {MANOEUVRE_S} s | hummingbird_magnificent | robot |\n|---|---|---|")
    for key in columns[0]:
        print(f"| {key} |" + "|".join(f" {c[key]:.3g} " if key in c else " - " for c in columns) + "|")


main()
