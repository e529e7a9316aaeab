"""Flapping-wing micro air vehicles by the thousand.

`gymnasium.make("flappy/Hover-v0")` and `gymnasium.make_vec("flappy/Hover-v0", num_envs=4096)` are the environments (`flappy.envs`).
Below them: `Batch` flies open loop, `Fleet` in closed loop. `read_flight` and `write_flight` are flight logs, `Policy` is what
`flappy-train` or `flappy-export` left, `export` writes a torch module as C, `diagnose` and `identify` are what `flappy-gap` and
`flappy-identify` say. SI units; quaternions w, x, y, z, body to world; left before right.
"""

from ._core import InputError
from .envs import FlappyEnv, FlappyVectorEnv
from .register import register

register()

__all__ = ["FlappyEnv", "FlappyVectorEnv", "InputError"]
