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

SHIPPED = "configs/design/hummingbird.toml"
GENERATIONS = 45  # of that file


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


def verified(train):
    """Searches once more, with everything that follows a search."""
    out = OUT / "verified"
    seconds = design(out, *(["--train", ROOT / "configs/train/escape.toml"] if train else []))
    results = json.loads((out / "design.json").read_text())
    print(f"\nsearched again, {same_bytes(out, OUT / f'nsga2_1_{GENERATIONS}')}; verified{' and trained' if train else ''} in {seconds:.0f} s\n")
    means = ("hover_power_W",)
    shares = ("hover_success", "escape_success")
    print("| design | " + " | ".join(f"{f}: as flown, at 25 us, change" for f in (*means, *shares)) + " | policy |")
    print("|---" * (len(means) + len(shares) + 2) + "|")
    worst = {f: 0.0 for f in (*means, *shares)}
    for d in results["designs"]:
        cells = []
        for f in (*means, *shares):
            a, b = d["verified"][f], d["fine"][f]
            change = abs(b / a - 1) if f in means else abs(b - a)
            worst[f] = max(worst[f], change)
            cells.append(f"{a:.4g}, {b:.4g}, {100 * change:.2f} {'%' if f in means else 'points'}")
        policy = d["policy"]
        cells.append("–" if policy[0] is None else f"{100 * policy[0]:.2f} % ({100 * policy[1]:.2f} to {100 * policy[2]:.2f})")
        print(f"| {d['name']} | " + " | ".join(cells) + " |")
    print("\nlargest change: " + ", ".join(f"{f} {100 * w:.2f} {'%' if f in means else 'points'}" for f, w in worst.items()))
    print("given away: " + ", ".join(f"{o['words']} {'nothing' if g is None else f'{100 * g:.1f} %'}" for o, g in zip(results["objectives"], results["given_away"])))


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("folders", nargs=3, type=pathlib.Path)
parser.add_argument("--seeds", default="0-4")
parser.add_argument("--train", action="store_true")
options = parser.parse_args()
BIN, ROOT, OUT = (f.resolve() for f in options.folders)
OUT.mkdir(parents=True, exist_ok=True)
first, last = options.seeds.split("-")
against_random(range(int(first), int(last) + 1))
verified(options.train)
