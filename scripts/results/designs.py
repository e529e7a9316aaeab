#!/usr/bin/env python3
"""Searches for robots as docs/results/design.md reports them: prints its tables.

    scripts/results/designs.py BIN ROOT OUT [--seeds 0-4] [--train]

BIN holds the programs, ROOT is the project, OUT takes the searches; one that was stopped goes on. Each seed of configs/design/hummingbird.toml is searched by NSGA-II
and at random, with the same flights. Its own seed, 1, is then searched again, verified and, with --train, trained.
"""

import argparse
import csv
import filecmp
import json
import pathlib
import statistics
import subprocess
import sys
import time
import tomllib

SHIPPED = "configs/design/hummingbird.toml"


def design(out, *more):
    start = time.monotonic()
    command = [BIN / "flappy-design", ROOT / SHIPPED, "--out", out, *more]
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")
    return time.monotonic() - start


def rows(file):
    with open(file) as f:
        return list(csv.DictReader(f))


def searched(seed, method, generations):
    out = OUT / f"{method}_{seed}_{generations}"
    design(out, "--set", f"search.seed={seed}", "--set", f"search.method={method}", "--set", f"search.generations={generations}", "--set", "verify.designs=0")
    return [(float(r["flown_s"]), float(r["hypervolume"])) for r in rows(out / "search.csv")]


def same_bytes(first, second):
    same = all(filecmp.cmp(first / name, second / name, shallow=False) for name in ("designs.csv", "front.csv", "search.csv"))
    return "the same bytes" if same else "OTHER BYTES"


def against_random(seeds):
    """Both with the same flights: random points cost fewer each, as most of them cannot fly, so there are more of them."""
    print("\n| seed | flown by each, s | hypervolume, random | NSGA-II | flights of NSGA-II to random's, as a share |")
    print("|---|---|---|---|---|")
    shares = []
    for seed in seeds:
        nsga2 = searched(seed, "nsga2", GENERATIONS)
        budget, generations = nsga2[-1][0], 10 * GENERATIONS
        while (random := searched(seed, "random", generations))[-1][0] < budget:
            generations = int(1.1 * generations * budget / random[-1][0])
        final = max(volume for flown, volume in random if flown <= budget)
        shares.append(next((flown for flown, volume in nsga2 if volume >= final), float("inf")) / budget)
        print(f"| {seed} | {budget:.0f} | {final:.4f} | {nsga2[-1][1]:.4f} | {shares[-1]:.3f} |", flush=True)
    print(f"\nmedian {statistics.median(shares):.3f}, largest {max(shares):.3f}", flush=True)


def both(d, figure, digits):
    return f"{d['verified'][figure]:.{digits}f}, {d['fine'][figure]:.{digits}f}"


def flown_again(designs):
    print("| design | power in hover, W | hover success | escape success, PID | escape, s | lift over weight | hover success with an effect |")
    print("|---" * 7 + "|")
    for d in designs:
        v = d["verified"]
        cells = [both(d, "hover_power_W", 3), both(d, "hover_success", 3), both(d, "escape_success", 3), f"{v['escape_time_s']:.3f}"]
        cells += [f"{v['lift_over_weight']:.2f}", f"{v['effects_success']:.3f}"]
        print(f"| {d['name']} | " + " | ".join(cells) + " |")
    for f in ("hover_power_W", "hover_success", "escape_success"):
        power = f == "hover_power_W"
        worst = max(abs(d["fine"][f] / d["verified"][f] - 1) if power else abs(d["fine"][f] - d["verified"][f]) for d in designs)
        print(f"\nthe step changes {f} by at most {100 * worst:.2f} {'%' if power else 'points'}")


def to_build(designs):
    columns = {"wing, mm": ("wing_length_m", 1e3), "mean chord, mm": ("mean_chord_m", 1e3), "at the root": ("root_chord", 1), "at the tip": ("tip_chord", 1)}
    columns |= {"spring, mNm/rad": ("spring_Nm_rad", 1e3), "gear": ("gear_ratio", 1), "beat, Hz": ("flapping_Hz", 1), "rotation stops, rad": ("rotation_stop_rad", 1)}
    columns |= {"shoulder y, mm": ("shoulder_y_m", 1e3), "shoulder z, mm": ("shoulder_z_m", 1e3)}
    print("\n| design | " + " | ".join(columns) + " | motor |")
    print("|---" * (len(columns) + 2) + "|")
    for d in designs:
        print(f"| {d['name']} | " + " | ".join(f"{times * d['values'][name]:.4g}" for name, times in columns.values()) + f" | {d['values']['motor']} |")


def gained(designs, objectives):
    """The largest gain in one objective without loss in the others, of the designs flown again."""
    better = {o["figure"]: 1 if o["more_is_better"] else -1 for o in objectives}
    published = designs[0]["verified"]
    for o in objectives:
        gains = []
        for d in designs[1:]:
            share = {f: sign * (d["verified"][f] / published[f] - 1) for f, sign in better.items()}
            if min(share.values()) >= 0:
                gains.append((share[o["figure"]], d["name"]))
        print(f"{o['figure']}: {100 * max(gains)[0]:.1f} % by {max(gains)[1]}" if gains else f"{o['figure']}: nothing")


def verified(train):
    """Searches once more, with everything that follows a search."""
    out = OUT / "verified"
    seconds = design(out, *(["--train", ROOT / "configs/train/escape.toml"] if train else []))
    results = json.loads((out / "design.json").read_text())
    print(f"\nsearched again, {same_bytes(out, OUT / f'nsga2_1_{GENERATIONS}')}; verified{' and trained' if train else ''} in {seconds:.0f} s\n")
    designs = results["designs"]
    flown_again(designs)
    to_build(designs)
    gained(designs, results["objectives"])
    for d in designs if train else []:
        print(f"{d['name']}: policy {100 * d['policy'][0]:.2f} % ({100 * d['policy'][1]:.2f} to {100 * d['policy'][2]:.2f})")


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("folders", nargs=3, type=pathlib.Path)
parser.add_argument("--seeds", default="0-4")
parser.add_argument("--train", action="store_true")
options = parser.parse_args()
BIN, ROOT, OUT = (f.resolve() for f in options.folders)
GENERATIONS = tomllib.loads((ROOT / SHIPPED).read_text())["search"]["generations"]
OUT.mkdir(parents=True, exist_ok=True)
first, last = options.seeds.split("-")
against_random(range(int(first), int(last) + 1))
verified(options.train)
