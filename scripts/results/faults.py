#!/usr/bin/env python3
"""Contrasts of real robots into which others put faults, from a folder with their logs: crazypad/, slung_load/ and gains/. Prints the tables of
docs/results/faults.md; keeps every log and diagnosis in OUT. What DATA lacks is left out.

    scripts/results/faults.py BIN PROJECT DATA OUT [--normal | --unseen | --learn FILE]

--normal: only flights without a fault. --unseen: each robot by a file that was learnt from the others. --learn: writes FILE as
configs/gap/beat_averaged/session_scatter.toml, learnt from flights without a fault of these robots and flapper/, and contrasts nothing.
"""

import csv
import gzip
import itertools
import json
import pathlib
import re
import statistics
import subprocess
import sys

BIN, PROJECT, DATA, OUT = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
NORMAL_ONLY = "--normal" in sys.argv[5:]
UNSEEN = "--unseen" in sys.argv[5:]
NORMAL = "normal_flight"
# The effect that is taken out of the catalogue, by condition.
WITHHELD = {
    "cut_propeller_M3_2mm_1.5mm_43.5mm": "actuator_loss",
    "cut_propeller_M3_2mm_2mm_43mm": "actuator_loss",
    "cut_propeller_M3_3mm": "actuator_loss",
    "cut_propeller_M3_1.5mm_1mm_44.5mm": "actuator_loss",
    "add_weight_W1_near_M3": "actuator_loss",
    "add_weight_W3_near_M3": "actuator_loss",
}
LOAD_G, LINE_M, HOOK_G = 4.7, 0.52, 2.7


def imported(folder, mapping):
    """The flights of a folder, by the order of their names."""
    logs = []
    for file in sorted(f for f in (DATA / folder).iterdir() if "log" in f.name or f.name.startswith("eckart") or ".csv" in f.name):
        out = OUT / "logs" / folder / file.name.removesuffix(".gz")
        if file.name.endswith(".csv.gz"):
            file = unpacked(file)
        if not out.exists():
            done = subprocess.run([BIN / "flappy-gap", "import", file, "--mapping", PROJECT / "configs/mapping" / mapping, "--out", out], capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(done.stderr.strip())
        logs.append(out)
    return logs


def unpacked(file):
    out = OUT / file.name.removesuffix(".gz")
    out.write_bytes(gzip.decompress(file.read_bytes()))
    return out


# Flights without a fault, by the part of the tables: vehicle, mapping, and folders in which the robot flew the same.
ROBOTS = {
    "crazypad": ("crazyflie_sd", "crazyflie_sd", [f"crazypad/{NORMAL}"]),
    "slung_load": ("crazyflie_rpm", "crazyflie_rpm", ["slung_load/without_figure8_1.0", "slung_load/without_figure8_0.8"]),
    "gains": ("crazyflie_lee", "crazyflie_lee", ["gains/translation_y_upgraded_0.0375", "gains/translation_y_standard_0.032", "gains/translation_y_standard_0.033"]),
    "flapper": ("flapper_nimble", "flapper_nimble", ["flapper/level", "flapper/wAlt"]),
}


def learnt(out, without=()):
    """Has session_scatter.toml learnt from the robots that DATA has."""
    robots = []
    for name, (vehicle, mapping, folders) in ROBOTS.items():
        if name in without or not (DATA / name).is_dir():
            continue
        if name == "flapper":  # two manoeuvres in one folder
            for log in imported(name, f"{mapping}.toml"):
                group = OUT / "logs" / next(f for f in folders if log.name.startswith(pathlib.Path(f).name)) / log.name
                group.parent.mkdir(parents=True, exist_ok=True)
                if not group.exists():
                    group.symlink_to(log)
        else:
            for f in folders:
                imported(f, f"{mapping}.toml")
        robots.append(":".join([f"{PROJECT}/configs/vehicles/{vehicle}.toml", *(str(OUT / "logs" / f) for f in folders)]))
    done = subprocess.run([BIN / "flappy-gap", "learn-sessions", "--robots", *robots, "--out", out], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    return done.stdout


def contrast(name, robot, reference, flights, *more):
    if UNSEEN:
        part = next(n for n, (vehicle, _, _) in ROBOTS.items() if robot == f"{vehicle}.toml")
        file = OUT / f"without_{part}.toml"
        if not file.exists():
            learnt(file, (part,))
        more, name = (*more, "--sessions", file), f"{name}_unseen"
    out = OUT / "diagnoses" / name
    if not (out / "diagnosis.json").exists():
        vehicle = PROJECT / "configs/vehicles" / robot
        done = subprocess.run([BIN / "flappy-gap", "diagnose", "--vehicle", vehicle, "--reference", *reference, "--flights", *flights, "--out", out, *more], capture_output=True, text=True)
        if not (out / "diagnosis.json").exists():
            sys.exit(done.stderr.strip())
    return json.loads((out / "diagnosis.json").read_text())


def named(verdict):
    if verdict["kind"] not in ("effect", "group"):
        return {"none": "unchanged", "parameters": "unchanged", "data": "faulty data"}.get(verdict["kind"], verdict["kind"])
    return (" or " if verdict["kind"] == "group" else " + ").join(verdict["effects"])


def is_named(diagnosis):
    return diagnosis["verdict"]["kind"] in ("effect", "group")


def first_of(diagnosis):
    return max((h for h in diagnosis["hypotheses"] if h["effects"]), key=lambda h: h["probability"], default=None)


def sizes(hypothesis):
    shown = {n: p for n, p in hypothesis["parameters"].items() if any(w in n for w in ("loss_", "mass_kg", "length_m")) and p["value"] > 1e-6}
    unit = lambda n: (1e3, " g") if "mass_kg" in n else (1, " m") if "length_m" in n else (100, " %")
    return "; ".join(f"{n.split('.')[-1]} {unit(n)[0] * p['value']:.3g} ({unit(n)[0] * p['low']:.3g} to {unit(n)[0] * p['high']:.3g}){unit(n)[1]}" for n, p in shown.items())


def seen(diagnosis):
    most = sorted(diagnosis.get("seen", []), key=lambda s: -abs(s["times"]))[:2]
    return "; ".join(f"{s['name']} {s['times']:+.1f}" for s in most)


def row(name, diagnosis):
    """What is seen most, the verdict, and the most probable effects with their magnitudes and 90 % intervals."""
    verdict, first = diagnosis["verdict"], first_of(diagnosis)
    effects = f"{' + '.join(first['effects'])}, {first['probability']:.2f} | {sizes(first)}" if first else " | "
    print(f"| {name} | {seen(diagnosis)} | {named(verdict)}, {verdict['probability']:.2f} | {effects} |", flush=True)


def head(what):
    print(f"\n| {what} | seen, times what sessions differ by | verdict | first effect | its magnitude (90 %) |\n|---|---|---|---|---|")


def splits(flights):
    for n in (1, 2):
        for t in itertools.combinations(range(len(flights)), n):
            yield "_".join(map(str, t)), [f for i, f in enumerate(flights) if i not in t], [flights[i] for i in t]


def mean_commands(folders):
    """Means of the motors' commands over the middle three fifths of each flight: [flight][motor]."""
    flights = []
    for folder in folders:
        rows = [[float(x) for x in row[1:]] for row in list(csv.reader((folder / "command.csv").open()))[1:]]
        flights.append([statistics.fmean(column) for column in zip(*rows[len(rows) // 5 : len(rows) * 4 // 5])])
    return flights


def crazypad():
    robot = "crazyflie_sd.toml"
    flights = lambda condition: imported(f"crazypad/{condition}", "crazyflie_sd.toml")
    normal = flights(NORMAL)
    wrong = [name for name, reference, test in splits(normal) if is_named(contrast(f"crazypad_normal_{name}", robot, reference, test))]
    print(f"normal against normal, all splits of 1 and 2 flights: anything named in {len(wrong)} of {len(list(splits(normal)))}")
    if NORMAL_ONLY:
        return
    head("CrazyPAD, condition")
    usual = list(zip(*mean_commands(normal)))
    told = []
    for condition in sorted(p.name for p in (DATA / "crazypad").iterdir() if p.is_dir() and p.name != NORMAL):
        d = contrast(f"crazypad_{condition}", robot, normal, flights(condition))
        row(condition, d)
        change = [(statistics.fmean(now) - statistics.fmean(was)) / statistics.stdev(was) for now, was in zip(zip(*mean_commands(flights(condition))), usual)]
        cut = re.fullmatch(r"cut_propeller_M3_(\d\.?\d?)mm.*", condition)
        if cut and float(cut[1]) >= 1.5 and max(map(abs, change)) >= 3:
            first = first_of(d)
            losses = {n: p["value"] for n, p in first["parameters"].items() if "loss_" in n}
            right = "actuator_loss" in first["effects"] and max(losses, key=losses.get).endswith("loss_3")
            told.append((condition, right, "actuator_loss" in d["verdict"]["effects"]))
    print(f"\ncuts of 1.5 mm and more whose command changes by three times the normal scatter: {len(told)}; actuator_loss at motor 3 first in {sum(t[1] for t in told)}, named in {sum(t[2] for t in told)}")
    head("CrazyPAD, withheld")
    for condition, effect in WITHHELD.items():
        row(f"{condition}, {effect}", contrast(f"crazypad_{condition}_without_{effect}", robot, normal, flights(condition), "--withhold", effect))


def slung_load():
    robot = "crazyflie_rpm.toml"
    scales = [s for s in ("1.0", "0.8") if (DATA / f"slung_load/without_figure8_{s}").is_dir()]
    flights = {(w, s): imported(f"slung_load/{w}_figure8_{s}", "crazyflie_rpm.toml") for w in ("without", "with") for s in scales}
    wrong = total = 0
    for s in scales:
        for name, reference, test in splits(flights["without", s]):
            d = contrast(f"slung_normal_{s}_{name}", robot, reference, test)
            total += d["verdict"]["kind"] != "data"
            wrong += is_named(d)
    print(f"\nwithout a load, all splits of 1 and 2 flights: anything named in {wrong} of {total}")
    if NORMAL_ONLY:
        return
    head(f"{LOAD_G} g on a line of {LINE_M} m, and {HOOK_G} g of hook")
    right = mass = length = sets = 0
    for s in scales:
        w = flights["with", s]
        for name, test in (("all", w), ("first half", w[: len(w) // 2]), ("second half", w[len(w) // 2 :])):
            d = contrast(f"slung_{s}_{name.replace(' ', '_')}", robot, flights["without", s], test)
            row(f"{s}, {name}", d)
            sets += 1
            first = first_of(d)
            if "slung_load" not in first["effects"] or not set(first["effects"]) <= {"slung_load", "payload"}:
                continue
            p = {n: v["value"] for n, v in first["parameters"].items()}
            right += 1
            mass += abs(1e3 * p["slung_load.mass_kg"] / LOAD_G - 1) < 0.25
            length += abs(p["slung_load.length_m"] / LINE_M - 1) < 0.25
    print(f"\nslung_load (with payload) first in {right} of {sets}; its mass within 25 % in {mass}, its length in {length}")


def gains():
    robot = "crazyflie_lee.toml"
    folder = "gains/translation_y_upgraded_0.0375"
    flights = imported(folder, "crazyflie_lee.toml")
    sets = []
    for f in flights:
        number = re.findall(r"\d+", f.name)[0]
        own = re.findall(r"^K\S+ (\S+)", (DATA / folder / f"info{number}.yaml").read_text(), re.M)
        if not sets or sets[-1][0] != own:
            sets.append((own, []))
        sets[-1][1].append(f)
    before, wrong, total = [], [], 0
    for _, own in sets:
        if len(before) >= 3:
            d = contrast(f"gains_{own[0].name}", robot, before, own)
            total += 1
            if is_named(d):
                wrong.append(f"{own[0].name}: {named(d['verdict'])} {d['verdict']['probability']:.2f}")
        before = before + own
    print(f"\nother gains against all flights before them: anything named in {len(wrong)} of {total} ({'; '.join(wrong)})")
    if NORMAL_ONLY or not (DATA / "gains/payload_with_figure8").is_dir():
        return
    head("crazyswarm2-tools")
    without, loaded = (imported(f"gains/payload_{w}_figure8", "crazyflie_lee.toml") for w in ("without", "with"))
    row("5 g of payload, against two flights of a figure 8", contrast("gains_payload", robot, without, loaded))
    along_y = imported("gains/translation_y_standard_0.032", "crazyflie_lee.toml")
    row("against twelve flights along y", contrast("gains_payload_along_y", robot, along_y, loaded))


(OUT / "diagnoses").mkdir(parents=True, exist_ok=True)
if "--learn" in sys.argv[5:]:
    print(learnt(pathlib.Path(sys.argv[sys.argv.index("--learn") + 1]).resolve()), end="")
    sys.exit()
for part in (crazypad, slung_load, gains):
    if (DATA / part.__name__).is_dir():
        part()
