"""How well a policy flies: the same measure for every learner."""

from collections.abc import Callable

import gymnasium
import numpy as np
from numpy.typing import NDArray

#: No training uses it.
SEED = 1_000_000


def evaluate(
    policy: Callable[[NDArray[np.float32]], NDArray[np.float32]],
    env_id: str = "flappy:flappy/Hover-v0",
    flights: int = 1000,
    seed: int = SEED,
) -> tuple[float, float]:
    """Flies one episode in each of `flights` environments.

    Args:
        policy: observations (flights, n) to actions (flights, m) in [-1, 1].
        env_id: of the environment.
        flights: how many.
        seed: of the starts and of the sensors' noise.

    Returns:
        The fraction of flights that succeed, and the mean return.
    """
    env = gymnasium.make_vec(env_id, num_envs=flights)
    ended, success, returns = np.zeros(flights, bool), np.zeros(flights, bool), np.zeros(flights)
    observation, _ = env.reset(seed=seed)
    while not ended.all():
        observation, _, _, _, info = env.step(policy(observation))
        if info:
            first = info["_final_info"] & ~ended
            success[first] = info["final_info"]["is_success"][first]
            returns[first] = info["final_info"]["return"][first]
            ended |= first
    env.close()
    return float(success.mean()), float(returns.mean())
