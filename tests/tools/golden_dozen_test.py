#!/usr/bin/env python3
"""A dozen blind robots, made, diagnosed and scored as a person does it, give what they gave before: every diagnosis.json but for its list of all residuals, and
the verdicts of the scored benchmark. --contrast: the verdicts of a dozen robots that flew two sessions. Where a change of the diagnosis is meant to change
them, --write makes the golden files anew.

    golden_dozen_test.py BIN PROJECT WORK [--contrast] [--write]
"""

import csv
import json
import math
import pathlib
import shutil
import subprocess
import sys

PARTS = ["singles", "singles_current", "none", "parameters", "withheld", "pairs"]
CONTRASTS = ["changed", "changed_short_test", "unchanged", "changed_withheld", "changed_outside", "changed_pairs"]
VERDICT = ["case", "part", "effects", "verdict", "named"]
# libm takes other instructions on other processors, and its last bits differ.
RELATIVE, ABSOLUTE = 1e-6, 1e-9


def differences(is_, was, path=""):
    """One line for each place in which two values differ."""
    if isinstance(is_, bool) or isinstance(was, bool) or type(is_) is not type(was) and not all(isinstance(x, int | float) for x in (is_, was)):
        return [] if is_ == was and type(is_) is type(was) else [f"{path}: is {is_!r}, was {was!r}"]
    if isinstance(is_, int | float):
        return [] if math.isclose(is_, was, rel_tol=RELATIVE, abs_tol=ABSOLUTE) else [f"{path}: is {is_!r}, was {was!r}"]
    if isinstance(is_, dict):
        lines = [f"{path}/{key}: is {'new' if key in is_ else 'gone'}" for key in is_.keys() ^ was.keys()]
        return lines + [line for key in is_ if key in was for line in differences(is_[key], was[key], f"{path}/{key}")]
    if isinstance(is_, list) and len(is_) == len(was):
        return [line for i, pair in enumerate(zip(is_, was)) for line in differences(*pair, f"{path}/{i}")]
    return [] if is_ == was else [f"{path}: is {is_!r}, was {was!r}"]


def run(work, *words):
    done = subprocess.run([str(w) for w in words], cwd=work, capture_output=True, text=True)
    faulty_data = words[1] == "diagnose" and done.returncode == 1 and "The data are at fault" in done.stdout  # an answer, too
    if done.returncode != 0 and not faulty_data:
        sys.exit(f"{words[0].name} {words[1]}: exit code {done.returncode}: {done.stderr}")


def folders_of(case):
    return sorted({str(pathlib.Path("bench", file).parent) for file in case["files"]})


def diagnoses(tools, project, work, golden, write):
    """One line for each place in which the diagnosis of a case differs."""
    found = []
    for case in json.loads((work / "bench/manifest.json").read_text())["cases"]:
        number = f"{case['number']:04}"
        flights = folders_of(case)
        withheld = ["--withhold", *case["withheld"]] if case["withheld"] else []
        vehicle = project / "configs/vehicles/hummingbird_nominal.toml"
        run(work, tools / "flappy-gap", "diagnose", "--vehicle", vehicle, "--flights", *flights, *withheld, "--out", number)
        diagnosis, file = json.loads((work / number / "diagnosis.json").read_text()), golden / f"{number}.json"
        del diagnosis["locations"]  # a thousand
        if write:
            file.write_text(json.dumps(diagnosis, indent=1) + "\n")
        else:
            found += [f"{number}{line}" for line in differences(diagnosis, json.loads(file.read_text()))]
    return found


def main():
    tools, project, work = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
    contrast, write = "--contrast" in sys.argv[4:], "--write" in sys.argv[4:]
    golden = project / "tests/data/golden_dozen"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    parts = ["--contrast", "--part", *CONTRASTS] if contrast else ["--part", *PARTS]
    run(work, tools / "flappy-blind", "make", "--out", "bench", "--set", "development", "--cases", 2, *parts)
    found = [] if contrast else diagnoses(tools, project, work, golden, write)
    table = golden / ("contrasts.csv" if contrast else "verdicts.csv")
    run(work, tools / "flappy-blind", "score", "bench", "--json", "bench.json")
    with open(work / "bench/score.csv", newline="") as stream:
        verdicts = [[row[key] for key in VERDICT] for row in csv.DictReader(stream)]
    if write:
        with open(table, "w", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerows([VERDICT, *verdicts])
    else:
        with open(table, newline="") as stream:
            found += [f"verdicts: {line}" for line in differences(verdicts, list(csv.reader(stream))[1:])]
    print("\n".join(found[:50]) or "as before")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
