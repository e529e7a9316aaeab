"""Flapping-wing micro air vehicles by the thousand.

`gymnasium.make("flappy/Hover-v0")` and `gymnasium.make_vec("flappy/Hover-v0", num_envs=4096)` are the environments (`flappy.envs`).
Below them: `Batch` flies open loop, `Fleet` in closed loop. `read_flight` and `write_flight` are flight logs, `show` is their page,
`Policy` is what `flappy-train` or `flappy-export` left, `export` writes a torch module as C, `diagnose` and `identify` are what
`flappy-gap` and `flappy-identify` say. SI units; quaternions w, x, y, z, body to world; left before right.
"""

from importlib.util import find_spec

from ._core import Batch, Fleet, InputError, Vehicle, Wall, World, diagnose, fly, identify, instruction_sets, write_flight
from .export import export
from .flights import Page, read_flight, show, to_rerun
from .policy import Policy

__all__ = [
    "Batch",
    "Fleet",
    "InputError",
    "Page",
    "Policy",
    "Vehicle",
    "Wall",
    "World",
    "diagnose",
    "export",
    "fly",
    "identify",
    "instruction_sets",
    "read_flight",
    "show",
    "to_rerun",
    "write_flight",
]


if find_spec("gymnasium") is not None:  # pip installs it; the rest does without
    from .envs import CAUSES, FlappyEnv, FlappyVectorEnv, register

    register()
    __all__ += ["CAUSES", "FlappyEnv", "FlappyVectorEnv"]
