#!/usr/bin/env python3
"""Learns anew, from robots of the families, all files that say what models get wrong and what differs between sessions.

    scripts/results/learn_laboratory.py OUT [--robots 4] [--pairs 12] [--cases 12] [--steps discrepancy sessions verdict]

Robots are flown with seeds that no benchmark uses, and kept in OUT; after any stop, the same command goes on. In the end configs/lab and
configs/gap hold what was learnt: for each family from the other two, and for users from all three. A build that is not of a commit is refused.
"""
import argparse
import random
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONFIGS = ROOT / "configs"
VEHICLE = CONFIGS / "vehicles" / "hummingbird_nominal.toml"
FAMILIES = ["a", "b", "c"]
FIRST_SEED = 900_000  # below those of benchmarks, beyond those that are spent


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--robots", type=int, default=4, help="of each family, as their file, for what models get wrong (4)")
    parser.add_argument("--pairs", type=int, default=12, help="of sessions of each family, half of them with an effect (12)")
    parser.add_argument("--cases", type=int, default=12, help="of each part and family, for the verdict (12)")
    parser.add_argument("--steps", nargs="+", default=["discrepancy", "sessions", "verdict"],
                        choices=["discrepancy", "sessions", "verdict"])
    parser.add_argument("--programs", type=Path, default=ROOT / "build" / "release" / "bin", help="of a build with -DFLAPPY_FAMILIES=ON")
    o = parser.parse_args()
    blind, gap = o.programs / "flappy-blind", o.programs / "flappy-gap"
    version = subprocess.run([blind, "--version"], capture_output=True, text=True, check=True).stdout
    if "-dirty" in version:
        sys.exit(f"{version.splitlines()[1]}: is of no commit; accepted: a build of a commit")

    def run(output, *command):
        """Runs a command that writes `output`, unless it is there."""
        if output.exists():
            return
        print(" ".join(map(str, command)), flush=True)
        if subprocess.run(list(map(str, command)), stdout=subprocess.DEVNULL).returncode != 0 or not output.exists():
            sys.exit(f"{output}: was not written; the same command goes on")

    def others(family):
        return [f for f in FAMILIES if f != family]

    def learn(name, families, shipped, command):
        """Learns `name` from robots of families; `command` makes the options of flappy-gap of them. What is shipped is replaced by it."""
        output = o.out / name
        run(output, gap, "learn-discrepancy", "--vehicle", VEHICLE, *command(families), "--out", output)
        shutil.copyfile(output, shipped)

    def robot(family, number):
        """Flights of a robot as its file, each of another session: what differs between days belongs to what models get wrong."""
        folder = o.out / "robots" / f"{family}{number}"
        run(folder / "flight_3", blind, "fly", "--family", family, "--seed", FIRST_SEED + number, "--power", "--reference", folder,
            "--reference-sessions", 3, "--out", o.out / "later" / f"{family}{number}")
        return folder

    def pair(family, number):
        """Two sessions of a robot of its own; every second one has an effect in the later one."""
        folder, effect = o.out / "pairs" / f"{family}{number}", ""
        if number % 2 == 1:
            effects = sorted(e for e in effects_of(family) if not e.startswith("outside_"))
            random.Random(7).shuffle(effects)
            effect = effects[(number // 2) % len(effects)]
        options = ["--effect", f"{effect}=1"] if effect else []
        run(folder / "test" / "flight_3", blind, "fly", "--family", family, "--seed", FIRST_SEED + 1000 + number, "--own-parameters",
            "--conventions", "--reference", folder / "reference", "--reference-sessions", 3, *options, "--out", folder / "test")
        return f"{folder / 'reference'}:{folder / 'test'}" + (f":{effect}" if effect else "")

    def effects_of(family):
        text = subprocess.run([blind, "effects", "--family", family], capture_output=True, text=True, check=True).stdout
        return [line.split()[0] for line in text.splitlines() if line and not line.startswith(" ")]

    if "discrepancy" in o.steps:
        base = CONFIGS / "gap" / "model_discrepancy.toml"

        def robots(families):
            return ["--discrepancy", base, "--robots", *[robot(f, n) for f in families for n in range(o.robots)]]

        for family in FAMILIES:
            learn(f"discrepancy_without_{family}.toml", others(family), CONFIGS / "lab" / "discrepancy" / f"without_{family}.toml", robots)
        learn("model_discrepancy.toml", FAMILIES, base, robots)
    if "sessions" in o.steps:
        for family in [*FAMILIES, ""]:
            shipped = CONFIGS / "lab" / "sessions" / f"without_{family}.toml" if family else CONFIGS / "gap" / "session_variation.toml"
            discrepancy = CONFIGS / "lab" / "discrepancy" / f"without_{family}.toml" if family else CONFIGS / "gap" / "model_discrepancy.toml"
            learn(f"sessions_without_{family or 'none'}.toml", others(family), shipped, lambda families: [
                "--sessions", shipped, "--discrepancy", discrepancy, "--pairs", *[pair(f, n) for f in families for n in range(o.pairs)]])
    if "verdict" in o.steps:
        for family in FAMILIES:
            folder = o.out / f"cases_{family}"
            run(folder / "manifest.json", blind, "make", "--family", family, "--contrast", "--set", "development", "--part", "changed", "unchanged",
                "--cases", o.cases, "--out", folder)
            run(folder / "cases.jsonl", blind, "score", folder, "--discrepancy", CONFIGS / "lab" / "discrepancy" / f"without_{family}.toml",
                "--sessions", CONFIGS / "lab" / "sessions" / f"without_{family}.toml", "--verdict", CONFIGS / "gap" / "contrast_verdict.toml")
        for family in [*FAMILIES, ""]:
            name = f"verdict_without_{family or 'none'}.toml"
            run(o.out / name, blind, "calibrate", *[o.out / f"cases_{f}" for f in others(family)], "--verdict",
                CONFIGS / "gap" / "contrast_verdict.toml", "--out", o.out / name)
        for family in FAMILIES:
            shutil.copyfile(o.out / f"verdict_without_{family}.toml", CONFIGS / "lab" / "sessions" / f"verdict_without_{family}.toml")
        shutil.copyfile(o.out / "verdict_without_none.toml", CONFIGS / "gap" / "contrast_verdict.toml")


if __name__ == "__main__":
    main()
