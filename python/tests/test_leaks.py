"""Memory stays where it is: 200,000 random steps, or as many as FLAPPY_STEPS says (10000000 under the address sanitizer)."""

import ctypes
import os
import resource
from pathlib import Path

import numpy as np

from flappy import _core

COUNT = 4096


def resident_mb() -> float:
    """Of this process, now, without what the allocator keeps for itself."""
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


def fly(steps: int, copy: bool, random: np.random.Generator) -> None:
    """Environments from their making to their end, arrays kept for a while."""
    env = _core.Environments(Path("fly/hover_direct.toml"), [], COUNT, "same_step", copy)
    env.reset(1)
    kept = []
    for _ in range(steps // COUNT):
        kept.append(env.step(random.uniform(-1, 1, (COUNT, 4)).astype(np.float32)))
        if kept[-1][4]:
            kept.append(env.ended())
        kept = kept[-5:]
    env.close()


def test_memory_stays():
    random = np.random.default_rng(0)
    steps = int(os.environ.get("FLAPPY_STEPS", "200000"))
    resident = []
    for k in range(12):
        fly(steps // 8, k % 2 == 0, random)
        resident.append(resident_mb())
    # what threads and their arenas take comes once, a leak with every round: a step's arrays of 0.3 MB in 24,000 steps leave 1.7 MB
    rounds = np.array(resident[4:])
    assert np.median(rounds[4:]) - np.median(rounds[:4]) < 2 + steps / 1e6, resident
