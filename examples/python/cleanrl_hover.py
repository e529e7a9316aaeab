"""Runs CleanRL's ppo_continuous_action.py as it stands, and measures its policy as it learns.

    python cleanrl_hover.py ppo_continuous_action.py --env-id flappy:flappy/Hover-v0

All that follows the file is given to it. Without this program, the file learns the same; it then prints returns alone.
"""

import csv
import runpy
import sys
import time
from typing import Any

import gymnasium
import numpy as np
import torch
import torch.utils.tensorboard
from evaluation import evaluate
from numpy.typing import NDArray

CURVE = "cleanrl_hover.csv"
EVERY = 10_000


class TransformObservation(gymnasium.wrappers.TransformObservation[Any, Any, Any]):
    """Gymnasium 1.x wants the space after the function; the file names none."""

    def __init__(self, env: gymnasium.Env[Any, Any], func: Any, observation_space: gymnasium.Space[Any] | None = None) -> None:
        super().__init__(env, func, observation_space)


class Writer(torch.utils.tensorboard.SummaryWriter):
    """Sees the end of each iteration, when the file writes its speed; `agent` and `envs` are globals of the file."""

    rows: list[dict[str, float]]

    def add_scalar(self, tag: str, scalar_value: Any, global_step: int = 0, *args: Any, **kwargs: Any) -> None:
        """As the base's; evaluates every EVERY steps."""
        super().add_scalar(tag, scalar_value, global_step, *args, **kwargs)
        if tag != "charts/SPS":
            return
        self.rows = getattr(self, "rows", [])
        self.start_s = getattr(self, "start_s", began)
        if self.rows and global_step < self.rows[-1]["steps"] + EVERY:
            return
        wall_s = time.monotonic() - self.start_s
        file = sys._getframe(1).f_globals
        seen = file["envs"].envs[0].get_wrapper_attr("obs_rms")

        def policy(observation: NDArray[np.float32]) -> NDArray[np.float32]:
            normal = np.clip((observation - seen.mean) / np.sqrt(seen.var + 1e-8), -10, 10)
            with torch.no_grad():
                action: NDArray[np.float32] = file["agent"].actor_mean(torch.Tensor(normal)).clamp(-1, 1).numpy()
            return action

        success, mean_return = evaluate(policy, file["args"].env_id)
        self.rows.append({"steps": global_step, "wall_s": round(wall_s, 1), "success": success, "return": round(mean_return, 2)})
        print(f"{global_step:>10} steps {wall_s:7.1f} s   success {success:6.1%}   return {mean_return:6.1f}", flush=True)
        with open(CURVE, "w", newline="") as out:
            writer = csv.DictWriter(out, self.rows[0])
            writer.writeheader()
            writer.writerows(self.rows)
        self.start_s += time.monotonic() - self.start_s - wall_s


gymnasium.wrappers.TransformObservation = TransformObservation  # type: ignore[misc]
torch.utils.tensorboard.SummaryWriter = Writer  # type: ignore[misc]
torch.set_num_threads(1)
began = time.monotonic()
sys.argv = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
