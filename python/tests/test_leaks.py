"""Memory stays where it is: 200,000 random steps, or as many as FLAPPY_STEPS says (10000000 under the address sanitizer)."""

import os
import resource
from pathlib import Path

import numpy as np

from flappy import _core

COUNT = 4096


def resident_mb() -> float:
    """Of this process, now."""
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
    fly(steps // 20, True, random)
    fly(steps // 20, False, random)
    before = resident_mb()
    for k in range(8):
        fly(steps // 8, k % 2 == 0, random)
    # a buffer of a step is 0.3 MB, of which a leak of one step in a hundred would leave 0.8 MB for each million steps
    assert resident_mb() - before < 8 + steps / 1e6
