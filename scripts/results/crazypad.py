#!/usr/bin/env python3
"""Contrasts of a Crazyflie with faults that somebody else put into it (CrazyPAD), from a folder with a folder of microSD logs for each condition.
Prints the tables of docs/results/faults.md; keeps every diagnosis in OUT. --normal: only normal flights against normal ones.

    scripts/results/crazypad.py BIN PROJECT DATA OUT [--normal]
"""

import csv
import itertools
import json
import pathlib
import statistics
import subprocess
import sys

BIN, PROJECT, DATA, OUT = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
NORMAL = "normal_flight"
# The effect that is taken out of the catalogue, by condition.
WITHHELD = {
    "cut_propeller_M3_2mm_2mm_43mm": "actuator_loss",
    "cut_m3_2mm_2mm": "actuator_loss",
    "cut_propeller_M3_3mm": "actuator_loss",
    "add_weight_W3_near_M3": "payload",
    "weight_on_string_W3_near_M3": "slung_load",
}


def run(*arguments):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    return done.stdout


def imported(condition):
    folders = []
    for file in sorted((DATA / condition).glob("*_log*")):
        folder = OUT / "logs" / condition / file.name
        if not folder.exists():
            run(BIN / "flappy-gap", "import", file, "--mapping", PROJECT / "configs/mapping/crazyflie_sd.toml", "--out", folder)
        folders.append(folder)
    return folders


def contrast(name, reference, flights, *more):
    out = OUT / "diagnoses" / name
    if not (out / "diagnosis.json").exists():
        vehicle = PROJECT / "configs/vehicles/crazyflie_sd.toml"
        run(BIN / "flappy-gap", "diagnose", "--vehicle", vehicle, "--reference", *reference, "--flights", *flights, "--out", out, *more)
    return json.loads((out / "diagnosis.json").read_text())


def mean_commands(folders):
    """Means of the motors' commands over the middle three fifths of each flight, then over flights."""
    flights = []
    for folder in folders:
        rows = [[float(x) for x in row[1:]] for row in list(csv.reader((folder / "command.csv").open()))[1:]]
        middle = rows[len(rows) // 5 : len(rows) * 4 // 5]
        flights.append([statistics.fmean(column) for column in zip(*middle)])
    return [statistics.fmean(column) for column in zip(*flights)]


def named(verdict):
    if verdict["kind"] not in ("effect", "group"):
        return {"none": "unchanged", "parameters": "unchanged"}.get(verdict["kind"], verdict["kind"])
    return (" or " if verdict["kind"] == "group" else " + ").join(verdict["effects"]) + (" and more" if verdict["remainder"] else "")


def row(name, diagnosis):
    """The verdict, and the most probable effect with its magnitudes and their 90 % intervals."""
    verdict = diagnosis["verdict"]
    first = max((h for h in diagnosis["hypotheses"] if h["effects"]), key=lambda h: h["probability"])
    sizes = "; ".join(f"{name.split('.')[-1]} {p['value']:.3g} ({p['low']:.3g} to {p['high']:.3g})" for name, p in first["parameters"].items())
    print(f"| {name} | {named(verdict)}, {verdict['probability']:.2f} | {' + '.join(first['effects'])}, {first['probability']:.2f} | {sizes} |", flush=True)


def normal_against_normal(flights):
    print("| reference, test | verdict | first effect | magnitudes |\n|---|---|---|---|")
    wrong = 0
    splits = [(r, t) for n in (1, 2) for t in itertools.combinations(range(len(flights)), n) for r in [[i for i in range(len(flights)) if i not in t]]]
    for reference, test in splits:
        name = "normal_" + "".join(map(str, reference)) + "_" + "".join(map(str, test))
        d = contrast(name, [flights[i] for i in reference], [flights[i] for i in test])
        wrong += named(d["verdict"]) != "unchanged"
        row(name, d)
    print(f"{len(splits)} splits of normal flights, anything named in {wrong}")


def main():
    (OUT / "diagnoses").mkdir(parents=True, exist_ok=True)
    normal = imported(NORMAL)
    normal_against_normal(normal)
    if "--normal" in sys.argv[5:]:
        return
    conditions = sorted(p.name for p in DATA.iterdir() if p.is_dir() and p.name != NORMAL)
    print("\n| condition | mean commands of motors 1 to 4, less normal ones |\n|---|---|")
    usual = mean_commands(normal)
    for condition in conditions:
        print(f"| {condition} | " + ", ".join(f"{m - u:+.3f}" for m, u in zip(mean_commands(imported(condition)), usual)) + " |")
    print("\n| condition | verdict | first effect | magnitudes |\n|---|---|---|---|")
    for condition in conditions:
        row(condition, contrast(condition, normal, imported(condition)))
    print("\n| condition, withheld | verdict | first effect | magnitudes |\n|---|---|---|---|")
    for condition, effect in WITHHELD.items():
        row(f"{condition}, {effect}", contrast(f"{condition}_without", normal, imported(condition), "--withhold", effect))


if __name__ == "__main__":
    main()
