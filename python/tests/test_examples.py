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
