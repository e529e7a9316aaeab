#!/usr/bin/env python3
"""The table of the blind benchmark: every part, on new robots, of one commit.

    scripts/results/blind_table.py OUT [--cases 4] [--skip 0] [--families a b c] [--kinds contrast alone bench both] [--launch "mpirun -n 4"] [--add cases.jsonl ...]

Makes and scores the robots of each family, with what is learnt from the other two, and writes OUT/table.md, and score.csv and cases.jsonl
of robots in flight and on a bench, OUT/flight and OUT/bench. After any stop, the same command goes on. --launch runs the programs on several ranks, which may be on several machines that
share OUT. --add takes in cases.jsonl of this table's other parts. With reported seeds, a build that is of no commit is refused.
"""
import argparse
import json
import shlex
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LAB = ROOT / "configs" / "lab"
#: Faults that a bench can show: those of drive, hinges, stops and wings. Tether, ground, walls, wind and sensors in flight are not among them.
OF_THE_BENCH = ["spring_hardening", "gear_backlash", "coulomb_friction", "winding_heating", "battery_sag", "driver_dead_zone", "driver_bandwidth",
                "command_delay", "stop_compliance", "wing_inertia", "wing_flexibility", "wing_damage", "added_mass", "rotational_lift"]
ALONE = ["singles", "singles_current", "redeclared", "none", "parameters", "own_parameters", "conventions", "withheld", "outside", "pairs", "hover"]
KINDS = {
    "contrast": ["--contrast"],
    "alone": ["--part", *ALONE],
    "both": ["--part", "singles", "singles_bench", "own_parameters_bench", "--effects", *OF_THE_BENCH],
    "bench": ["--contrast", "--bench", "--part", "changed", "unchanged", "--effects", *OF_THE_BENCH],
}


def learnt(kind, family):
    """Options for what is learnt from the other two families."""
    options = ["--discrepancy", LAB / "discrepancy" / f"without_{family}.toml"]
    if kind not in ("alone", "both"):
        options += ["--verdict", LAB / "sessions" / f"verdict_without_{family}.toml"]
        sessions = LAB / "sessions" / f"{'bench_' if kind == 'bench' else ''}without_{family}.toml"
        if not sessions.exists():
            sys.exit(f"{sessions}: is not there; scripts/results/learn_laboratory.py --steps bench learns it")
        options += ["--sessions", sessions]
    return options


def is_of_bench(cases):
    """Whether a cases.jsonl is of a table with clamped robots."""
    return any(json.loads(line)["bench"] for line in cases.read_text().splitlines())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--cases", type=int, default=4, help="of each part at most (4)")
    parser.add_argument("--skip", type=int, default=0, help="of each part, so many cases before: robots whose labels are open (0)")
    parser.add_argument("--families", nargs="+", default=["a", "b", "c"], choices=["a", "b", "c"])
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--set", default="reported", choices=["reported", "development"])
    parser.add_argument("--program", type=Path, default=ROOT / "build" / "release" / "bin" / "flappy-blind")
    parser.add_argument("--launch", default="", help='what starts several ranks: "mpirun -n 4"')
    parser.add_argument("--add", nargs="*", default=[], type=Path, help="cases.jsonl of parts that were scored elsewhere")
    o = parser.parse_args()
    if not o.program.exists():
        sys.exit(f"--program {o.program}: is not there; accepted: flappy-blind of a build with -DFLAPPY_FAMILIES=ON")
    version = subprocess.run([o.program, "--version"], capture_output=True, text=True, check=True).stdout.strip()
    if o.set == "reported" and "-dirty" in version:
        sys.exit(f"{version}: is of no commit; accepted: a build of a commit, or --set development")
    o.out.mkdir(parents=True, exist_ok=True)
    spent = o.out / "seconds.json"
    seconds = json.loads(spent.read_text()) if spent.exists() else {}

    def run(name, *arguments):
        start = time.time()
        command = [*shlex.split(o.launch), o.program, *map(str, arguments)]
        print(f"{name}: {' '.join(map(str, command))}", flush=True)
        code = subprocess.run(command, stdout=subprocess.DEVNULL).returncode
        seconds[name] = seconds.get(name, 0) + time.time() - start
        spent.write_text(json.dumps(seconds, indent=1))
        if code != 0:
            sys.exit(f"{name}: rc {code}; the same command goes on")

    # robots of A cannot be clamped
    parts = [(kind, family) for kind in o.kinds for family in o.families if kind not in ("bench", "both") or family != "a"]
    options = {part: learnt(*part) for part in parts}
    for kind, family in parts:
        folder = o.out / f"{family}.{kind}"
        if (folder / "cases.jsonl").exists():
            continue
        if not (folder / "manifest.json").exists():
            run(f"make {folder.name}", "make", "--family", family, "--set", o.set, *KINDS[kind], "--cases", o.cases, "--skip", o.skip, "--out", folder)
            if not (folder / "manifest.json").exists():
                sys.exit(f"{folder}: stopped; the same command goes on")
        run(f"score {folder.name}", "score", folder, *options[kind, family])
        if not (folder / "cases.jsonl").exists():
            sys.exit(f"{folder}: stopped; the same command goes on")
    text = f"{version}; {sum(seconds.values()) / 3600:.1f} h on this machine.\n"
    # robots on a bench have tables of their own: their parts are called as those that fly
    for name, kinds in (("flight", ["contrast", "alone"]), ("bench", ["bench", "both"])):
        files = [o.out / f"{f}.{k}" / "cases.jsonl" for k in kinds for f in o.families]
        files = [f for f in files if f.exists()] + [a for a in o.add if is_of_bench(a) == (name == "bench")]
        if not files:
            continue
        subprocess.run([o.program, "score", "--cases", *files, "--out", o.out / name], check=True, stdout=subprocess.DEVNULL)
        text += f"\n## Robots {'in flight' if name == 'flight' else 'on a bench'}\n\n{(o.out / name / 'score.md').read_text()}"
    (o.out / "table.md").write_text(text)
    print(o.out / "table.md")


if __name__ == "__main__":
    main()
