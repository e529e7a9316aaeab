#!/usr/bin/env python3
"""Learns anew, from robots of the families, all files that say what models get wrong and what differs between sessions.

    scripts/results/learn_laboratory.py OUT [--robots 3] [--pairs 12] [--cases 6] [--steps discrepancy sessions bench verdict]

Robots are flown with seeds that no benchmark uses, but for the last step, whose robots are development robots, and kept in OUT. After any
stop, the same command goes on. In the end configs/lab and configs/gap hold what was learnt: for each family from the other two, starting
from the file for this family, and for users from all three. On a bench there are B and C, and laws start from those of flights. The last
step learns the constants of the verdict. A build of no commit is refused.
"""
import argparse
import os
import random
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from blind_table import OF_THE_BENCH

ROOT = Path(__file__).resolve().parents[2]
CONFIGS = ROOT / "configs"
LAB = CONFIGS / "lab"
VEHICLE = CONFIGS / "vehicles" / "hummingbird_nominal.toml"
FAMILIES = ["a", "b", "c"]
ON_BENCH = ["b", "c"]  # those that can be clamped
STEPS = ["discrepancy", "sessions", "bench", "verdict"]
FIRST_SEED = 900_000  # below those of benchmarks, beyond those that are spent


def with_bench(text, learnt):
    """A file of what models get wrong with the shares and backgrounds of runs on a bench that another one has learnt."""
    tables = re.compile(r"^\[bench_share\..*?\n\n", re.S | re.M)
    commit = re.search(r"commit (\w+)", learnt).group(1)
    text = re.sub(r" Shares of a bench: commit \w+\.", "", tables.sub("", text))
    text = re.sub(r"^(# Learnt: .*)$", rf"\1 Shares of a bench: commit {commit}.", text, count=1, flags=re.M)
    meaning = " bench_share: of runs on a bench, where it differs."
    if meaning not in text:
        text = text.replace("from which learning started.", "from which learning started." + meaning, 1)
    text = re.sub(r"^(?=# Priors of the scales)", "".join(tables.findall(learnt)), text, count=1, flags=re.M)
    of_flights, names = text.split("[background_sd]\n")
    lines = [line for line in names.splitlines() if "_on_bench" not in line]
    for line in learnt.split("[background_sd]\n")[1].splitlines():
        name, value = line.split(" = ")
        if name != "other" and "_on_bench" not in name:
            lines.append(f"{name}_on_bench = {value}")
    return of_flights + "[background_sd]\n" + "\n".join(sorted(lines)) + "\n"


def with_laws(text, of_flights):
    """Replaces the errors of laws by those of flights, from which learning on a bench starts."""
    table = re.compile(r"^\[law_error\]\n.*?\n\n", re.S | re.M)
    new, count = table.subn(lambda _: table.search(of_flights).group(), text, count=1)
    if count == 0:
        sys.exit("[law_error] is not there; accepted: a file of what differs between sessions")
    return new


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--robots", type=int, default=3, help="of each family, as their file, for what models get wrong (3)")
    parser.add_argument("--pairs", type=int, default=12, help="of sessions of each family, half of them with an effect (12)")
    parser.add_argument("--cases", type=int, default=6, help="of each part and family, for the verdict (6)")
    parser.add_argument("--steps", nargs="+", default=STEPS, choices=STEPS)
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

    def shipped_file(kind, family):
        """What is learnt for judges of a family; without one: for users."""
        names = {"discrepancy": ("discrepancy/", "model_discrepancy"), "sessions": ("sessions/", "session_variation"),
                 "bench": ("sessions/bench_", "bench_session_variation"), "verdict": ("sessions/verdict_", "contrast_verdict")}
        return LAB / f"{names[kind][0]}without_{family}.toml" if family else CONFIGS / "gap" / f"{names[kind][1]}.toml"

    def others(family):
        return [f for f in FAMILIES if f != family]

    def learn(name, families, shipped, command):
        """Learns `name` from robots of families; `command` makes the options of flappy-gap of them. What is shipped is replaced by it."""
        output = o.out / name
        run(output, gap, "learn-discrepancy", "--vehicle", VEHICLE, *command(families), "--out", output)
        shutil.copyfile(output, shipped)

    def robot(family, number, bench=False):
        """Flights of a robot as its file, of three sessions: what differs between days belongs to what models get wrong."""
        name = f"{'bench_' if bench else ''}{family}{number}"
        folder = o.out / "robots" / name
        run(folder / f"flight_{9 if bench else 3}", blind, "fly", "--family", family, "--seed", FIRST_SEED + number, "--bench" if bench else "--power",
            "--reference", folder, "--reference-sessions", 3, "--out", o.out / "later" / name)
        return folder

    def effects_of(family):
        text = subprocess.run([blind, "effects", "--family", family], capture_output=True, text=True, check=True).stdout
        effects = sorted(line.split()[0] for line in text.splitlines() if line and not line.startswith((" ", "outside_")))
        random.Random(7).shuffle(effects)
        return effects

    effects = {f: effects_of(f) for f in FAMILIES}

    def pair(family, number, bench=False):
        """Sessions of a robot of its own. Every second robot has an effect in its last session; families have different effects."""
        folder, effect = o.out / ("benches" if bench else "pairs") / f"{family}{number}", ""
        if number % 2 == 1:
            families = ON_BENCH if bench else FAMILIES
            known = [e for e in effects[family] if e in OF_THE_BENCH] if bench else effects[family]
            effect = known[(number // 2 * len(families) + families.index(family)) % len(known)]
        options = ["--effect", f"{effect}=1"] if effect else []
        run(folder / "test" / "flight_3", blind, "fly", "--family", family, "--seed", FIRST_SEED + 1000 + number, "--own-parameters",
            "--conventions", "--reference", folder / "reference", "--reference-sessions", 3, *options, *(["--bench"] if bench else []),
            "--out", folder / "test")
        return f"{folder / 'reference'}:{folder / 'test'}" + (f":{effect}" if effect else "")

    def fly_all(fly, *arguments):
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(fly, *arguments))

    if "discrepancy" in o.steps:
        fly_all(robot, [f for f in FAMILIES for _ in range(o.robots)], [n for _ in FAMILIES for n in range(o.robots)])
        for family in [*FAMILIES, ""]:
            shipped = shipped_file("discrepancy", family)
            learn(f"discrepancy_without_{family or 'none'}.toml", others(family), shipped, lambda families: [
                "--discrepancy", shipped, "--robots", *[robot(f, n) for f in families for n in range(o.robots)]])
    if "sessions" in o.steps:
        fly_all(pair, [f for f in FAMILIES for _ in range(o.pairs)], [n for _ in FAMILIES for n in range(o.pairs)])
        for family in [*FAMILIES, ""]:
            shipped, discrepancy = shipped_file("sessions", family), shipped_file("discrepancy", family)
            learn(f"sessions_without_{family or 'none'}.toml", others(family), shipped, lambda families: [
                "--sessions", shipped, "--discrepancy", discrepancy, "--pairs", *[pair(f, n) for f in families for n in range(o.pairs)]])
    if "bench" in o.steps:
        fly_all(robot, [f for f in ON_BENCH for _ in range(o.robots)], [n for _ in ON_BENCH for n in range(o.robots)],
                [True] * o.robots * len(ON_BENCH))
        for family in [*ON_BENCH, ""]:
            shipped = shipped_file("discrepancy", family)
            output = o.out / f"bench_discrepancy_without_{family or 'none'}.toml"
            run(output, gap, "learn-discrepancy", "--vehicle", VEHICLE, "--discrepancy", shipped, "--robots",
                *[robot(f, n, True) for f in ON_BENCH if f != family for n in range(o.robots)], "--out", output)
            shipped.write_text(with_bench(shipped.read_text(), output.read_text()))
        fly_all(pair, [f for f in ON_BENCH for _ in range(o.pairs)], [n for _ in ON_BENCH for n in range(o.pairs)],
                [True] * o.pairs * len(ON_BENCH))
        for family in [*ON_BENCH, ""]:
            shipped, discrepancy = shipped_file("bench", family), shipped_file("discrepancy", family)
            start = o.out / f"before_bench_without_{family or 'none'}.toml"
            if not start.exists():
                start.write_text(with_laws(shipped.read_text(), shipped_file("sessions", family).read_text()))
            learn(f"bench_without_{family or 'none'}.toml", [f for f in ON_BENCH if f != family], shipped, lambda families: [
                "--sessions", start, "--discrepancy", discrepancy,
                "--pairs", *[pair(f, n, True) for f in families for n in range(o.pairs)]])
    if "verdict" in o.steps:
        for f in FAMILIES:
            folder = o.out / f"cases_{f}"
            run(folder / "manifest.json", blind, "make", "--family", f, "--contrast", "--set", "development", "--part", "changed",
                "unchanged", "--cases", o.cases, "--out", folder)
            # judged as reported robots are: by what has not seen their family
            run(folder / "cases.jsonl", blind, "score", folder,
                *(x for kind in ("discrepancy", "sessions", "verdict") for x in (f"--{kind}", shipped_file(kind, f))))
        for family in [*FAMILIES, ""]:
            shipped = shipped_file("verdict", family)
            start, output = (o.out / f"verdict_{which}{family or 'none'}.toml" for which in ("before_", "without_"))
            if not start.exists():
                shutil.copyfile(shipped, start)
            run(output, blind, "calibrate", *[o.out / f"cases_{f}" for f in others(family)], "--verdict", start, "--out", output)
            shutil.copyfile(output, shipped)


if __name__ == "__main__":
    main()
