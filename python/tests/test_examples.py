"""Examples run as they stand."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("gymnasium")

PROJECT = Path(__file__).parents[2]
EXAMPLES = PROJECT / "examples" / "python"
PROGRAMS = PROJECT / "build" / "release" / "bin"


def test_pid_hovers_in_twenty_lines() -> None:
    assert len((EXAMPLES / "hover_pid.py").read_text().splitlines()) <= 20
    said = subprocess.run([sys.executable, EXAMPLES / "hover_pid.py"], capture_output=True, text=True, check=True).stdout
    assert said.startswith("success True")


def test_wings_make_a_counter_force_by_themselves() -> None:
    said = subprocess.run([sys.executable, EXAMPLES / "counter_force.py"], capture_output=True, text=True, check=True).stdout
    at_hover = said.split("amplitude")[2]
    per_s = {line.split(":")[0].strip(): float(line.split()[1]) for line in at_hover.splitlines()[1:]}
    # a drag along the stroke, half of it across, next to none along the lift
    assert 1 < per_s["x"] < 2 and 0.3 < per_s["y"] < per_s["x"] and 0 < per_s["z"] < 0.3


def sweep(out: Path, config: str, trials: int, updates: int, *more: str) -> str:
    """What a search of so many trials prints at its end; its seed makes it the same each time."""
    short = [f"learn.updates={updates}", "evaluate.every=500", "evaluate.vehicles=50", f"checkpoint.every={updates}"]
    command = [
        sys.executable,
        EXAMPLES / "optuna_sweep.py",
        config,
        f"--trials={trials}",
        "--seed=1",
        f"--out={out}",
        *(f"--set={one}" for one in short),
        *more,
    ]
    env = os.environ | {"PATH": f"{PROGRAMS}:{os.environ['PATH']}"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_sweep_prunes_what_stays_behind(tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    assert sweep(tmp_path, str(PROJECT / "configs/train/quadrotor.toml"), 6, 6000).startswith(
        "6 trials, 2 pruned; best success 100.0 %, trial 4:"
    )
    summaries = [json.loads((tmp_path / f"trial_{k}" / "summary.json").read_text()) for k in range(6)]
    assert [s["stopped"] for s in summaries] == [False, False, False, True, False, True]
    assert summaries[5]["updates"] < 6000


def test_a_sweep_by_a_server(tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    domain = f"domain={200 + os.getpid() % 30}"
    overrides = ["dds.enabled=true", f"dds.{domain}", f"jobs.output={tmp_path / 'jobs'}"]
    command = [PROGRAMS / "flappy-server", PROJECT / "configs/server/local.toml", *(f"--set={one}" for one in overrides)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as server:
        time.sleep(2)
        try:
            assert sweep(tmp_path, "train/quadrotor.toml", 2, 2000, "--job", f"--dds={domain}").startswith("2 trials, 0 pruned")
            assert len(list((tmp_path / "jobs").glob("**/summary.json"))) == 2
        finally:
            server.terminate()
