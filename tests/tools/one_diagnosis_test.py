#!/usr/bin/env python3
"""One robot's flights, diagnosed by everything that diagnoses: flappy-gap, the blind benchmark, a job of the server, and Python. All say the same.

one_diagnosis_test.py BIN PROJECT WORK PYTHON [MODULE]: programs, the project, a folder to use, an interpreter, and the folder of the built module
"""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

from golden_dozen_test import differences

PATIENCE_S = 300


def run(*words, **more):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, **more)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(w) for w in words[:3])}: exit code {done.returncode}: {done.stderr}")
    return done.stdout


def by_server(tools, project, work, vehicle, flights):
    """The result of a job."""
    more = ["--set", f'jobs.configs="{project}/configs"', "--set", f'jobs.output="{work}/server"', "--set", f'jobs.data="{flights[0].parent}"']
    server = subprocess.Popen([tools / "flappy-server", project / "configs/server/local.toml", *more], stdout=subprocess.DEVNULL)
    try:
        while not (work / "server/jobs.sock").exists():
            time.sleep(0.05)
        overrides = [word for f in flights for word in ("--set", f"flight={f.name}")]
        run(tools / "flappy-job", "--jobs", work / "server", "submit", "diagnose", vehicle.relative_to(project / "configs"), *overrides)
        result, end = work / "server/1/result.json", time.monotonic() + PATIENCE_S
        while not result.exists() and time.monotonic() < end:
            time.sleep(0.5)
        return json.loads(result.read_text())
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(timeout=60)


def main():
    tools, project, work, python = (pathlib.Path(a).absolute() for a in sys.argv[1:5])
    vehicle = project / "configs/vehicles/hummingbird_nominal.toml"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    run(tools / "flappy-blind", "make", "--out", work / "bench", "--set", "development", "--cases", 1, "--part", "singles")
    flights = sorted((work / "bench/cases/0001").iterdir())
    said = {}
    run(tools / "flappy-gap", "diagnose", "--vehicle", vehicle, "--flights", *flights, "--json", work / "program.json")
    said["flappy-gap"] = json.loads((work / "program.json").read_text())
    run(tools / "flappy-blind", "score", work / "bench")
    said["flappy-blind"] = json.loads((work / "bench/predictions/0001.json").read_text())["diagnosis"]
    said["flappy-server"] = by_server(tools, project, work, vehicle, flights)
    if len(sys.argv) > 5:
        code = f"import flappy, json, sys; print(json.dumps(flappy.diagnose({str(vehicle)!r}, sys.argv[1:])))"
        said["Python"] = json.loads(run(python, "-c", code, *flights, env={**os.environ, "PYTHONPATH": sys.argv[5]}))
    found = []
    for name, diagnosis in said.items():
        for ahead in ("closed_loop", "next_experiment"):  # the benchmark asks for these where it abstains
            del diagnosis[ahead]
        found += [f"{name} beside flappy-gap{line}" for line in differences(diagnosis, said["flappy-gap"])]
    print("\n".join(found[:50]) or f"{', '.join(said)} say the same")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
