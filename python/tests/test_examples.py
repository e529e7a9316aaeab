"""Examples run as they stand."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("gymnasium")

EXAMPLES = Path(__file__).parents[2] / "examples" / "python"


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
