"""Learns to hover with PPO of Stable-Baselines3: `python sb3_hover.py`.

Prints how many of 1,000 flights of another seed succeed as it learns, and writes the same as CSV.
"""

import argparse
import csv
import time

import numpy as np
import torch
from evaluation import evaluate
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize

from flappy.sb3 import FlappyVecEnv


class Curve(BaseCallback):
    """Evaluates before every rollout and at the end, and writes the curve; its own time does not count."""

    def __init__(self, path: str) -> None:
        super().__init__()
        self.path = path
        self.rows: list[dict[str, float]] = []
        self.start_s = 0.0

    def policy(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """As it is now, without exploration."""
        action, _ = self.model.predict(env.normalize_obs(observation), deterministic=True)
        return action

    def add_row(self) -> None:
        """Evaluates and writes."""
        wall_s = time.monotonic() - self.start_s
        success, mean_return = evaluate(self.policy)
        self.rows.append({"steps": self.num_timesteps, "wall_s": round(wall_s, 1), "success": success, "return": round(mean_return, 2)})
        print(f"{self.num_timesteps:>10} steps {wall_s:7.1f} s   success {success:6.1%}   return {mean_return:6.1f}", flush=True)
        with open(self.path, "w", newline="") as file:
            writer = csv.DictWriter(file, self.rows[0])
            writer.writeheader()
            writer.writerows(self.rows)
        self.start_s = time.monotonic() - wall_s

    def _on_training_start(self) -> None:
        self.start_s = time.monotonic()

    def _on_rollout_start(self) -> None:
        self.add_row()

    def _on_training_end(self) -> None:
        self.add_row()

    def _on_step(self) -> bool:
        return True


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
parser.add_argument("--steps", type=int, default=300_000, help="of all environments together")
parser.add_argument("--envs", type=int, default=256)
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--curve", default="sb3_hover.csv")
args = parser.parse_args()

torch.set_num_threads(1)
env = VecNormalize(FlappyVecEnv("flappy/Hover-v0", args.envs))
model = PPO(
    "MlpPolicy",
    env,
    n_steps=32,
    batch_size=1024,
    n_epochs=10,
    learning_rate=lambda left: 1e-3 * left,
    policy_kwargs={"log_std_init": -1},  # a standard deviation of 0.37 of half the range
    seed=args.seed,
    device="cpu",
)
model.learn(args.steps, callback=Curve(args.curve))
