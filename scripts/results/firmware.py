#!/usr/bin/env python3
"""Whether flappy-gap check --flown finds the mistakes of firmwares: robots of the blind families fly an exported policy with one mistake each.
Prints the tables of docs/results/firmware.md; every flight and answer is kept in OUT, so it goes on where it was stopped.

    scripts/results/firmware.py BIN PROJECT RUN OTHER_RUN OUT [--robots N] [--first-seed N] [--families a b c] [--only MISTAKE...] [--effects N]
"""

import argparse
import csv
import json
import pathlib
import re
import shutil
import subprocess
import time

# Right answer of the check, by mistake of the firmware: its kind, a pattern of its words, and the number in them, which may be off by NEAR.
ANSWERS = {
    "gyro_degrees": ("sensor", "gyro's rates are in degrees"),
    "accel_g": ("sensor", "accelerometer's values are in g"),
    "accel_sign": ("sensor", "accelerometer has the other sign"),
    "accel_z_sign": ("sensor", "accelerometer's z has the other sign"),
    "gyro_x_sign": ("sensor", "gyro's x has the other sign"),
    "gyro_y_sign": ("sensor", "gyro's y has the other sign"),
    "gyro_z_sign": ("sensor", "gyro's z has the other sign"),
    "gyro_xy_swapped": ("sensor", "gyro's x and y are swapped"),
    "gyro_yz_swapped": ("sensor", "gyro's y and z are swapped"),
    "accel_xy_swapped": ("sensor", "accelerometer's x and y are swapped"),
    "imu_quarter_turn": ("sensor", "IMU is turned by 90 degrees about z"),
    "imu_upside_down": ("sensor", "IMU is turned by 180 degrees about x"),
    "quaternion_xyzw": ("sensor", "order x, y, z, w"),
    "quaternion_to_body": ("sensor", "quaternion turns W into B"),
    "yaw_quarter_turn": ("sensor", "world is turned by (\\S+) degrees about z", 90),
    "yaw_third_turn": ("sensor", "world is turned by (\\S+) degrees about z", 30),
    "heading_half_turn": ("sensor", "heading of motion capture is -?(\\S+) degrees off", 180),
    "mocap_z_down": ("sensor", "motion capture has z down"),
    "mocap_y_up": ("sensor", "motion capture's world has y up"),
    "position_mm": ("sensor", "position is in mm"),
    "position_and_velocity_swapped": ("observation", "position error and velocity are swapped"),
    "velocity_and_rate_swapped": ("observation", "velocity and body rate are swapped"),
    "rate_and_phase_swapped": ("observation", "body rate and beat phase are swapped"),
    "no_mean": ("observation", "normalisation's mean is left out"),
    "no_scale": ("observation", "normalisation's scale is left out"),
    "no_normalisation": ("observation", "normalisation is left out"),
    "rate_zero": ("observation", "body rate stays 0"),
    "velocity_zero": ("observation", "velocity stays 0"),
    "previous_zero": ("observation", "previous action stays 0"),
    "trim_zero": ("observation", "trim stays 0"),
    "rotation_transposed": ("observation", "goal rotation is transposed"),
    "goal_elsewhere": ("observation", "relative to a goal"),
    "every_second": ("time", "acts every 2 of"),
    "every_third": ("time", "acts every 3 of"),
    "one_period_late": ("time", "act \\d+ control periods late"),
    "two_periods_late": ("time", "act \\d+ control periods late"),
    "imu_held": ("time", "one of 2 samples of the IMU"),
    "pose_held": ("time", "one of 3 poses"),
    "clock_1024": ("time", "clock takes (\\S+)", 1.024),
    "never_back": ("time", "never hands back"),
    "back_early": ("time", "hands back after"),
    "difference_and_bias_swapped": ("output", "inputs difference and bias are swapped"),
    "bias_sign": ("output", "input bias has the other sign"),
    "split_mirrored": ("output", "input split cycle has the other sign"),
    "policy_difference_sign": ("output", "policy's difference has the other sign"),
    "not_clipped": ("output", "not clipped"),
    "clipped_low": ("output", "clipped at (\\S+)", 9),
    "shares": ("output", "voltages are (\\S+)", 0.45),
    "wings_swapped": ("output", "other wing's voltage"),
    "int8": ("software", "policy in 8 bits"),
    "contracted": ("software", "contracted"),
    "another_policy": ("software", "another policy flies"),
    "another_gain": ("software", "controller's .* is (\\S+) of", 0.7),
}
NEAR = 0.02
EARLY_S = 0.28  # a robot that crashes so early leaves little to go by
EFFECTS = ["wing_damage", "battery_sag", "added_mass", "driver_bandwidth", "com_offset", "spring_hardening", "wind", "body_drag", "gear_backlash", "mocap_delay"]


def run(*arguments, accept=(0,)):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    if done.returncode not in accept:
        raise SystemExit(f"{' '.join(str(a) for a in arguments)}\n{done.stderr.strip()}")
    return done


def export(a, source, to, *more):
    if not (to / "contract.json").exists():
        run(a.bin / "flappy-export", source, "--out", to, *more)
    return to


def with_another_gain(exported, to):
    """The same export, the roll's first gain multiplied by 0.7."""
    if not to.exists():
        shutil.copytree(exported, to)
        header = to / "flappy_controller.h"
        line = re.compile(r"(\n *\{?)(-?0x[0-9a-fp.+-]+)(F.*/\* roll \*/)")
        text, count = line.subn(lambda m: m[1] + float.hex(float.fromhex(m[2]) * 0.7) + m[3], header.read_text(), count=1)
        if count != 1:
            raise SystemExit(f"{header}: no gain of this name")
        header.write_text(text)
    return to


def fly(a, family, seed, exported, mistake, out, effects=()):
    log = out / "flight"
    if not (out / "fly.json").exists():
        out.mkdir(parents=True, exist_ok=True)
        # from where the escape begins, its heading turned by 180 degrees
        run(a.bin / "flappy-blind", "fly", "--family", family, "--seed", seed, "--own-parameters", "--exported", exported, "--firmware", mistake,
            "--begin", 0.15, "--start", -0.21, 0, 0.3, 3.14159, "--duration", 3,
            "--out", log, "--json", out / "fly.json", *[x for e in effects for x in ("--effect", e)])
    return log


def check(a, log, out, name="flown"):
    answer = out / f"{name}.json"
    if not answer.exists():
        before = time.monotonic()
        run(a.bin / "flappy-gap", "check", log, "--flown", a.out / "exported", "--json", answer, accept=(0, 1))
        (out / f"{name}.s").write_text(f"{time.monotonic() - before:.3f}")
    return json.loads(answer.read_text())["flights"][0], float((out / f"{name}.s").read_text())


def rewritten(log, to, change):
    """A copy of the log; change(name of the file, rows without the head): its rows."""
    if not to.exists():
        shutil.copytree(log, to)
        for file in to.glob("*.csv"):
            head, *rows = csv.reader(file.open())
            with file.open("w", newline="") as f:
                csv.writer(f, lineterminator="\n").writerows([head, *change(file.name, rows)])
    return to


def coarse(log, to):
    """The log as a real one: five digits, and every second sample of the IMU."""
    return rewritten(log, to, lambda name, rows: [row[:1] + [f"{float(x):.5g}" for x in row[1:]] for row in (rows[1::2] if name == "imu.csv" else rows)])


def early(log, to):
    """The log of a robot that crashes after EARLY_S."""
    return rewritten(log, to, lambda _, rows: [row for row in rows if float(row[0]) < EARLY_S])


def verdict(answer, kind, words, number=None):
    """right, kind, wrong, silent or unexplained."""
    if answer["as_exported"]:
        return "silent"
    if not answer["mistakes"]:
        return "unexplained"
    first = answer["mistakes"][0]
    found = re.search(words, first["words"])
    if len(answer["mistakes"]) == 1 and found and (number is None or abs(float(found[1]) - number) <= NEAR * number):
        return "right"
    return "kind" if first["kind"] == kind else "wrong"


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("bin", "project", "run", "other_run", "out"):
        p.add_argument(name, type=pathlib.Path)
    p.add_argument("--robots", type=int, default=1, help="of each family")
    p.add_argument("--first-seed", type=int, default=1)
    p.add_argument("--families", nargs="+", default=["a", "b", "c"])
    p.add_argument("--only", nargs="+", default=list(ANSWERS))
    p.add_argument("--effects", type=int, default=60, help="flights without a mistake but with an effect")
    a = p.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    exported = export(a, a.run, a.out / "exported", "--int8")
    others = {"another_policy": export(a, a.other_run, a.out / "other"), "another_gain": with_another_gain(exported, a.out / "gain")}
    rows, times = {}, []
    print("| mistake | full log | five digits, half the samples | first 0.28 s | answers that were not right |\n|---|---|---|---|---|")
    for mistake in a.only:
        full, thin, cut, others_said = [], [], [], []
        for family in a.families:
            for seed in range(a.first_seed, a.first_seed + a.robots):
                out = a.out / "flights" / mistake / f"{family}_{seed}"
                log = fly(a, family, seed, others.get(mistake, exported), "none" if mistake in others else mistake, out)
                answer, took = check(a, log, out)
                full.append(verdict(answer, *ANSWERS[mistake]))
                times.append(took)
                if full[-1] not in ("right", "silent"):
                    said = answer["mistakes"][0]["words"] if answer["mistakes"] else answer["unexplained"]
                    others_said.append(f"{family}{seed}: {said}")
                thin.append(verdict(check(a, coarse(log, out / "coarse"), out, "coarse")[0], *ANSWERS[mistake]))
                cut.append(verdict(check(a, early(log, out / "early"), out, "early")[0], *ANSWERS[mistake]))
        rows[mistake] = (full, thin, cut)

        def share(list_):
            counted = [v for v in list_ if v != "silent"]
            return f"{sum(v == 'right' for v in counted)} of {len(counted)}"

        print(f"| {mistake} | {share(full)} | {share(thin)} | {share(cut)} | {'; '.join(others_said)} |", flush=True)
    everything = {k: [v for row in rows.values() for v in row[i]] for i, k in enumerate(("full", "thin", "first 0.28 s"))}
    for name, list_ in everything.items():
        counted = [v for v in list_ if v != "silent"]
        right, of_kind = sum(v == "right" for v in counted), sum(v in ("right", "kind") for v in counted)
        print(f"{name}: right {right} of {len(counted)}, kind right {of_kind}, no change beyond the digits {len(list_) - len(counted)}")
    if times:
        print(f"time of a check: median {sorted(times)[len(times) // 2]:.2f} s, longest {max(times):.2f} s")
    as_exported, times, wrong = 0, [], []
    for i in range(a.effects):
        family, effect, size = a.families[i % len(a.families)], EFFECTS[i // len(a.families) % len(EFFECTS)], 1 + i // (len(EFFECTS) * len(a.families)) % 2
        out = a.out / "effects" / f"{family}_{effect}_{size}_{i}"
        log = fly(a, family, a.first_seed + 100 + i, exported, "none", out, [f"{effect}={size}"])
        answer, took = check(a, log, out)
        as_exported += answer["as_exported"]
        times.append(took)
        if not answer["as_exported"]:
            wrong.append(out.name)
    if times:
        print(f"no mistake, an effect: {as_exported} of {len(times)} flew what was exported; a check takes {sorted(times)[len(times) // 2]:.2f} s; not: {' '.join(wrong) or 'none'}")


if __name__ == "__main__":
    main()
