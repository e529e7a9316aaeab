#!/usr/bin/env python3
"""Diagnoses flights that others measured: a Flapper Nimble+ and a Crazyflie 2.1, from a folder with flapper/*.csv.gz and
nanobench/*.csv.gz. Prints the tables of docs/results/real_flights.md; keeps every diagnosis in OUT.

    scripts/results/real_flights.py BIN PROJECT DATA OUT
"""

import itertools
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import time

BIN, PROJECT, DATA, OUT = (pathlib.Path(a).resolve() for a in sys.argv[1:5])

# What is withheld of the fitted vehicle: name, channel, entry, its parameters (all: the whole entry), entries of the same form, and what else
# is a right answer.
CASES = [
    ("drag", "specific_force_x", "flapping_counter_force", ["x_per_s"], ["body_drag"], []),
    ("dihedral", "specific_force_x", "stroke_plane_actuation", None, [], []),
    ("lever arm", "specific_force_x", "marker_offset", None, ["com_offset", "payload", "slung_load"], ["com_offset"]),
    ("drag", "specific_force_y", "flapping_counter_force", ["y_per_s"], ["body_drag"], []),
    ("lever arm", "specific_force_y", "marker_offset", None, ["com_offset", "payload", "slung_load"], ["com_offset"]),
    ("wind or tilt", "specific_force_y", "mocap_tilt", None, ["wind", "thrust_axis_tilt", "tether"], ["wind", "thrust_axis_tilt"]),
    ("battery", "specific_force_z", "battery_thrust", None, [], []),
    ("heave damping", "specific_force_z", "flapping_counter_force", ["z_per_s"], ["body_drag"], []),
    ("v_h^2", "specific_force_z", "translational_lift", None, [], []),
]


def run(*arguments):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def imported(kind, mapping):
    folders = []
    for file in sorted((DATA / kind).glob("*.csv.gz")):
        folder = OUT / "logs" / file.name.removesuffix(".csv.gz")
        code, _, err = run(BIN / "flappy-gap", "import", file, "--mapping", PROJECT / "configs/mapping" / mapping, "--out", folder)
        if code != 0:
            sys.exit(err)
        folders.append(folder)
    return folders


def diagnose(name, vehicle, flights, *more):
    begin = time.monotonic()
    code, out, err = run(BIN / "flappy-gap", "diagnose", "--vehicle", vehicle, "--flights", *flights, "--out", OUT / name, *more)
    if code != 0:
        return None, err.strip().splitlines()[-1] if code == 2 else out.strip().splitlines()[0], 0
    return json.loads((OUT / name / "diagnosis.json").read_text()), out, time.monotonic() - begin


def ladder(d):
    for rung in d["validation"]["ladder"]:
        print(f"  {rung['added']:28s}" + "".join(f"  {e['rms']:.3f} ({e['low']:.3f}..{e['high']:.3f}; {e['by_type']:.3f})" for e in rung["held_out"].values()))
    for c in d["validation"]["controls"]:
        print(f"  {c['effect']:28s}  takes {100 * c['gain']:.1f} % off {c['channel']}; shifted in time, at best {100 * c['best_of_shifted']:.1f} %")
    for a in d["validation"]["agreements"]:
        print(f"  {a['name']:36s}  " + " ".join(f"{v:.3g}+-{s:.1g}" for v, s in zip(a["value"], a["sd"])))
    v = d["verdict"]
    print(f"  verdict: {v['kind']} {', '.join(v['effects'])}{' and more' if v['remainder'] else ''} at {v['probability']:.3f}")


def base_of(corrected, entry, parameters):
    """The fitted vehicle without an entry, or some of its parameters, and what is uncertain of it."""
    text = corrected.split("posterior.names")[0]
    lines, draws = [], []
    for line in text.splitlines():
        match = re.match(r"effects\.(\w+)\.(\w+) = (\S+)", line)
        if not match:
            lines.append(line)
            continue
        effect, parameter, value = match.group(1), match.group(2), float(match.group(3))
        if effect == entry and parameters is None:
            continue
        if effect == entry and parameter in parameters:
            lines.append(f"effects.{effect}.{parameter} = 0.0")
            continue
        lines.append(line)
        if value != 0:
            draws.append((f"effects.{effect}.{parameter}", 0.05 * abs(value)))
    priors = (PROJECT / "configs/gap/beat_averaged/priors.toml").read_text()
    for path, sd in draws:
        priors += f'\n[[randomise]]\nparameters = ["{path}"]\nlaw = "add_normal"\nsd = {sd:.6g}\ncut_sd = 2.0\n'
    return "\n".join(lines) + "\n", priors


def first_named(d):
    effects = [c for c in d["hypotheses"] if c["effects"]]
    return effects[0]["effects"][0] if effects else ""


def withheld(flights, corrected, sets):
    rows = []
    for number, (what, channel, entry, parameters, form, also) in enumerate(CASES):
        vehicle, priors = base_of(corrected, entry, parameters)
        folder = OUT / f"case_{number}"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "vehicle.toml").write_text(vehicle)
        (folder / "priors.toml").write_text(priors)
        for subset in sets:
            name = f"case_{number}/" + "_".join(str(i) for i in subset)
            chosen = [flights[i] for i in subset]
            common = ("--priors", folder / "priors.toml", "--channels", channel)
            d, _, _ = diagnose(name, folder / "vehicle.toml", chosen, *common)
            u, _, _ = diagnose(name + "_without", folder / "vehicle.toml", chosen, *common, "--withhold", entry, *form)
            named = d["verdict"]["effects"]
            sizes = next((c["parameters"] for c in d["hypotheses"] if entry in c["effects"]), {})
            rows.append({"what": what, "channel": channel, "entry": entry, "whole": len(subset) == len(flights),
                         "first": first_named(d), "right": first_named(d) in [entry, *also], "named": named,
                         "kind": d["verdict"]["kind"], "probability": d["verdict"]["probability"],
                         "sizes": {k.split(".")[1]: v for k, v in sizes.items() if k.startswith(entry + ".")},
                         "without": u["verdict"]})
            if not rows[-1]["whole"]:
                continue
            w = rows[-1]["without"]
            size = ", ".join(f"{k} {v['value']:.3g} ({v['low']:.3g}..{v['high']:.3g})" for k, v in rows[-1]["sizes"].items())
            print(f"  {channel[-1]} {what:14s} first {rows[-1]['first']:24s} {'right' if rows[-1]['right'] else 'WRONG'}  "
                  f"{d['verdict']['kind']} {'+'.join(named)} {d['verdict']['probability']:.3f}; {size}; "
                  f"withheld: {w['kind']} {'+'.join(w['effects'])}{' and more' if w['remainder'] else ''} {w['probability']:.3f}")
    return rows


def shifted_inputs(flights):
    """Copies of flights whose inputs are those of half a flight later."""
    for flight in flights:
        to = OUT / "shifted" / flight.name
        shutil.rmtree(to, ignore_errors=True)
        shutil.copytree(flight, to)
        head, *rows = (flight / "command.csv").read_text().splitlines()
        times, inputs = zip(*(row.split(",", 1) for row in rows), strict=True)
        half = len(rows) // 2
        (to / "command.csv").write_text("\n".join([head, *(f"{t},{u}" for t, u in zip(times, inputs[half:] + inputs[:half], strict=True))]) + "\n")
    return [OUT / "shifted" / f.name for f in flights]


def trained(name, vehicle):
    shutil.rmtree(OUT / name, ignore_errors=True)
    code, _, err = run(BIN / "flappy-train", PROJECT / "configs/train/flapper_dash.toml", "--out", OUT / name, "--set", f'vehicle="{vehicle}"')
    if code != 0:
        sys.exit(err)
    return OUT / name / "best.json"


def flown(policy, vehicle):
    """Rms distance from where it is meant to be, m, and how many of 100 flights ended early."""
    code, out, err = run(BIN / "flappy-fly", PROJECT / "configs/fly/flapper_dash.toml", "--count", "100", "--set", f'vehicle="{vehicle}"', "--set",
                         f'actor="{policy}"')
    if code != 0:
        sys.exit(err)
    axes = re.search(r"from 1 s on +\S+ +\S+ +\S+ +(\S+) +(\S+) +(\S+)", out)
    ended = re.search(r"out_of_bounds: (\d+)", out)
    return math.hypot(*(float(x) / 1000 for x in axes.groups())), int(ended.group(1)) if ended else 0


def policies(flights, file):
    """Whether a policy that was trained on what some flights corrected flies what others did better than one trained on the file."""
    halves = {"A": flights[::2], "B": flights[1::2]}
    vehicles = {}
    for name, some in halves.items():
        diagnose(f"half_{name}", file, some)
        vehicles[name] = (OUT / f"half_{name}" / "vehicle_corrected.toml").resolve()
    by_file = trained("policy_file", file.resolve())
    print(f"  trained on the file, flown on it: {flown(by_file, file.resolve())[0]:.3f} m")
    for name, other in (("A", "B"), ("B", "A")):
        policy = trained(f"policy_{name}", vehicles[name])
        (on_file, lost), (corrected, lost_too) = flown(by_file, vehicles[other]), flown(policy, vehicles[other])
        print(f"  flown on what flights {', '.join(f.name for f in halves[other])} correct: trained on the file {on_file:.3f} m ({lost} of 100 ended early), "
              f"on what {', '.join(f.name for f in halves[name])} correct {corrected:.3f} m ({lost_too}): {corrected / on_file:.2f} times")


def main():
    OUT.mkdir(parents=True, exist_ok=True)
    flapper, nano = imported("flapper", "flapper_nimble.toml"), imported("nanobench", "crazyflie.toml")
    nimble, crazyflie = PROJECT / "configs/vehicles/flapper_nimble.toml", PROJECT / "configs/vehicles/crazyflie.toml"
    print("rms of the specific force in flights held out, m/s^2 (90 %; kinds of flights held out): x, y, z")
    d, _, seconds = diagnose("flapper", nimble, flapper)
    print(f"Flapper, {len(flapper)} flights, {seconds:.1f} s")
    ladder(d)
    _, _, seconds = diagnose("one", nimble, flapper[:1])
    print(f"  one flight alone: {seconds:.1f} s")
    n, _, seconds = diagnose("nanobench", crazyflie, nano)
    print(f"NanoBench, {len(nano)} flights, {seconds:.1f} s")
    ladder(n)
    print("controls")
    _, said, _ = diagnose("wrong_robot", nimble, nano)
    print(f"  Crazyflie's logs, Flapper's vehicle: {said}")
    corrected = (OUT / "flapper" / "vehicle_corrected.toml").read_text()
    (OUT / "known.toml").write_text(corrected.split("posterior.names")[0])
    c, _, _ = diagnose("shifted_inputs", OUT / "known.toml", shifted_inputs(flapper))
    print(f"  inputs of half a flight later, the corrected vehicle: {c['verdict']['kind']} {', '.join(c['verdict']['effects'])} at {c['verdict']['probability']:.3f}; "
          f"rms held out " + ", ".join(f"{e['rms']:.3f}" for e in c["validation"]["ladder"][-1]["held_out"].values()))
    print("an effect of the Flapper withheld")
    everyone = tuple(range(len(flapper)))
    sets = [everyone] + [s for s in itertools.combinations(everyone, len(flapper) - 1)]
    rows = withheld(flapper, corrected, sets)
    whole = [r for r in rows if r["whole"]]
    print(f"  first: {sum(r['right'] for r in whole)} of {len(whole)}; over subsets of flights {sum(r['right'] for r in rows)} of {len(rows)}")
    print(f"  without all of its form: unknown {sum(r['without']['kind'] == 'unknown' for r in whole)} of {len(whole)}; "
          f"a wrong name above 0.8: {sum(r['without']['kind'] in ('effect', 'group') and r['without']['probability'] > 0.8 for r in whole)}")
    stated = [(r["probability"], r["kind"] in ("effect", "group") and r["right"]) for r in rows if r["kind"] in ("effect", "group")]
    if stated:
        print(f"  stated {sum(p for p, _ in stated) / len(stated):.3f} on average, right {sum(s for _, s in stated) / len(stated):.3f} of {len(stated)}")
    (OUT / "withheld.json").write_text(json.dumps(rows, indent=1))
    print("rms distance of a Flapper from the point that it follows")
    policies(flapper, nimble)


main()
