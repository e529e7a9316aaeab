#!/usr/bin/env python3
"""Plans beside simulated diagnoses. Prints a table of docs/results/plan.md.

    scripts/results/plan_check.py BIN ROOT OUT [ROBOTS]

Each of ROBOTS (50) simulated robots has one effect of the catalogue at 0.5, 1 or 2 times its typical magnitude, and parameters drawn from
configs/gap/priors.toml. It flies the manoeuvre tour. `flappy-gap plan --like` of the flight gives the expected nats of the effect over its best
rival and the probability that it is named; `flappy-gap diagnose` gives both for this flight. OUT keeps every robot: the
same command goes on.
"""

import concurrent.futures
import json
import math
import pathlib
import random
import statistics
import subprocess
import sys

BIN, ROOT, OUT = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
ROBOTS = int(sys.argv[4]) if len(sys.argv) > 4 else 50
VEHICLE = ROOT / "configs/vehicles/hummingbird_nominal.toml"
SEED = 59


def run(*arguments):
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr.strip()}")
    return done.stdout


def catalogue():
    """{effect: {parameter: (role, typical)}} of what flappy-gap effects lists."""
    effects = {}
    for line in run(BIN / "flappy-gap", "effects").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 9 and cells[2].startswith("`"):
            effects.setdefault(cells[0], {})[cells[2].strip("`")] = (cells[3], float(cells[4]))
    return effects


def realised(diagnosis, effect):
    """Evidence for the effect, alone or beside others, over its best rival, and whether it is named first; none: not weighed."""
    own, rival = None, None
    for h in diagnosis["hypotheses"]:
        nats = h["log_evidence"] - h["log_prior"]
        if effect in h["effects"]:
            own = nats if own is None else max(own, nats)
        else:
            rival = nats if rival is None else max(rival, nats)
    verdict = diagnosis["verdict"]
    named = verdict["kind"] == "effect" and verdict["effects"] == [effect]
    return None if own is None or rival is None else own - rival, named


def robot(number, effect, parameters, times):
    folder = OUT / f"{number:03d}"
    folder.mkdir(parents=True, exist_ok=True)
    overrides = [f"randomisation={json.dumps(str(ROOT / 'configs/gap/priors.toml'))}"]
    overrides += [f"vehicle.effects.{effect}.{name}={typical * (times if role == 'magnitude' else 1)!r}"
                  for name, (role, typical) in parameters.items()]
    sets = [part for o in overrides for part in ("--set", o)]
    if not (folder / "flight/flight.toml").exists():
        run(BIN / "flappy-fly", ROOT / "configs/gap/experiments/tour.toml", "--seed", SEED * 1000 + number, "--log", folder / "flight", *sets)
    if subprocess.run([BIN / "flappy-gap", "check", folder / "flight"], capture_output=True).returncode != 0:
        return None  # it cannot be flown with this effect
    if not (folder / "plan/plan.json").exists():
        run(BIN / "flappy-gap", "plan", "--vehicle", VEHICLE, "--like", folder / "flight", "--magnitude", f"{effect}={times}", "--out", folder / "plan",
            "--threads", 1)
    if not (folder / "diagnosis/diagnosis.json").exists():
        run(BIN / "flappy-gap", "diagnose", "--vehicle", VEHICLE, "--flights", folder / "flight", "--out", folder / "diagnosis", "--threads", 1)
    plan = json.loads((folder / "plan/plan.json").read_text())
    nats, named = realised(json.loads((folder / "diagnosis/diagnosis.json").read_text()), effect)
    expected = next((e for e in plan["effects"] if e["effect"] == effect), None)
    if expected is not None:
        over = min(n for rival, n in expected["nats"].items() if rival != effect)
        expected = {"nats": over, "probability": expected["probability"]}
    return {"robot": number, "effect": effect, "times": times, "expected": expected, "nats": nats, "named": named}


def ranks(values):
    return [sum(v < x for v in values) + (sum(v == x for v in values) - 1) / 2 for x in values]


def main():
    effects = catalogue()
    draw = random.Random(SEED)
    names = sorted(effects)
    draw.shuffle(names)
    jobs = [(i, names[i % len(names)], draw.choice([0.5, 1, 2])) for i in range(ROBOTS)]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        flown = list(pool.map(lambda j: robot(j[0], j[1], effects[j[1]], j[2]), jobs))
    rows = [row for row in flown if row]
    print(f"{len(rows)} of {len(flown)} robots fly with their effect\n")
    print("| robot | effect | times typical | expected nats | realised nats | expected probability | named |\n|---|---|---|---|---|---|---|")
    for r in rows:
        e = r["expected"]
        print(f"| {r['robot']} | {r['effect']} | {r['times']:g} | " + (f"{e['nats']:.1f}" if e else "unseen") + " | " +
              ("-" if r["nats"] is None else f"{r['nats']:.1f}") + " | " + (f"{e['probability']:.2f}" if e else "-") + f" | {'yes' if r['named'] else 'no'} |")
    seen = [r for r in rows if r["expected"] and r["nats"] is not None]
    x, y = [r["expected"]["nats"] for r in seen], [r["nats"] for r in seen]
    print(f"\nrank correlation of {len(seen)}: {statistics.correlation(ranks(x), ranks(y)):.2f}")
    factors = [math.log(a / b) for a, b in zip(x, y) if a > 3 and b > 3]
    print(f"expected over realised nats, where both exceed 3 ({len(factors)}): median {math.exp(statistics.median(factors)):.2f}, "
          f"quartiles {', '.join(f'{math.exp(q):.2f}' for q in statistics.quantiles(factors, n=4)[::2])}")
    right = [r["expected"]["probability"] for r in seen if r["named"]]
    wrong = [r["expected"]["probability"] for r in seen if not r["named"]]
    if right and wrong:
        area = sum((a > b) + 0.5 * (a == b) for a in right for b in wrong) / len(right) / len(wrong)
        print(f"area under the curve of the expected probability for \"named\": {area:.2f} ({len(right)} named, {len(wrong)} not)")


main()
