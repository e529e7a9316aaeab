#!/usr/bin/env python3
"""Another commit's speed beside this one's: builds it, runs flappy-bench of both in turn, and says what lost more than its interval.

    scripts/bench compare COMMIT [--rounds 9] [COMMAND]

COMMAND is one of flappy-bench (default: the figures without one; learner). Each round runs both builds, the first of them in turn. The ratio of a figure is
that of the two runs of a round; its interval is Student's, of 95 %, on the logarithm. A figure has lost where the interval leaves 1 on the wrong side.
Exit code 1: something has lost.
"""

import argparse
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
STUDENT = {4: 3.182, 5: 2.776, 6: 2.571, 7: 2.447, 8: 2.365, 9: 2.306, 10: 2.262, 12: 2.201, 15: 2.145, 20: 2.093}  # 97.5 % for n rounds
MORE_IS_BETTER = ("_per_s", "scaling", "share", "success")
LESS_IS_BETTER = ("_s", "_bytes", "ns_per_step", "ns_per_step_1000", "ns_per_step_100000", "bytes_per_flapper", "bytes_per_flapper_closed_loop")

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("commit")
parser.add_argument("command", nargs="?", choices=["learner"])
parser.add_argument("--rounds", type=int, default=9, choices=sorted(STUDENT))
parser.add_argument("--seconds", type=float, default=0.1, help="of each measurement")
args = parser.parse_args()


def run(*command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, **options)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip()}")
    return done.stdout.strip()


def built(commit):
    """The other flappy-bench, in a tree of its own below build."""
    name = run("git", "-C", ROOT, "rev-parse", "--short=12", f"{commit}^{{commit}}")
    tree = ROOT / "build/compare" / name
    if not tree.exists():
        run("git", "clone", "--quiet", ROOT, tree)
    run("git", "-C", tree, "checkout", "--quiet", name)
    run("cmake", "--preset", "release", "-DBUILD_TESTING=OFF", "-DCMAKE_UNITY_BUILD=ON", cwd=tree)
    run("cmake", "--build", "--preset", "release", "--target", "flappy-bench", cwd=tree)
    return name, tree / "build/release/bin/flappy-bench"


def measured(program):
    """{figure: value} of one run."""
    with tempfile.TemporaryDirectory() as folder:
        run(program, "--rounds", "1", "--seconds", args.seconds, "--no-peers", "--json", f"{folder}/r.json", *([args.command] if args.command else []))
        found = {}

        def collect(value, at):
            if isinstance(value, dict):
                for key, inner in value.items():
                    collect(inner, f"{at}.{key}" if at else key)
            elif isinstance(value, list):
                for place, inner in enumerate(value):
                    texts = " ".join(v for v in inner.values() if isinstance(v, str)) if isinstance(inner, dict) else ""
                    collect(inner, f"{at}.{texts or place}")
            elif isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0:
                found[at] = float(value)

        collect(json.loads(pathlib.Path(f"{folder}/r.json").read_text()), "")
        return found


name, other = built(args.commit)
own = ROOT / "build/release/bin/flappy-bench"
rounds = []
for number in range(args.rounds):
    pair = [own, other] if number % 2 else [other, own]
    found = {program: measured(program) for program in pair}
    rounds.append((found[own], found[other]))
    print(f"round {number + 1} of {args.rounds}", file=sys.stderr)

lost = []
print(f"this build over {name}: ratio [95 % interval]")
for figure in sorted(set.intersection(*(set(a) & set(b) for a, b in rounds))):
    logs = [math.log(a[figure] / b[figure]) for a, b in rounds]
    middle, half = statistics.mean(logs), STUDENT[args.rounds] * statistics.stdev(logs) / math.sqrt(args.rounds)
    low, high = math.exp(middle - half), math.exp(middle + half)
    more, less = figure.endswith(MORE_IS_BETTER), figure.endswith(LESS_IS_BETTER) and not figure.endswith("_per_s")
    word = "lost" if (more and high < 1) or (less and low > 1) else "won" if (more and low > 1) or (less and high < 1) else ""
    if more or less:
        print(f"  {figure:<50} {math.exp(middle):6.3f} [{low:.3f} .. {high:.3f}] {word}")
    if word == "lost":
        lost.append(figure)
print("lost: " + (", ".join(lost) or "nothing"))
sys.exit(bool(lost))
