"""Environments for Stable-Baselines3: `PPO("MlpPolicy", FlappyVecEnv("flappy/Hover-v0", 1024))`.

All environments step in one batch. Nothing here runs for each environment and step, but for those whose episode ended.
"""

import time
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvStepReturn

from .envs import FlappyVectorEnv, Floats


class FlappyVecEnv(VecEnv):
    """Many environments, with Stable-Baselines3's conventions.

    Args:
        env_id: a name that Gymnasium knows ("flappy/Hover-v0").
        num_envs: how many.
        **options: as of `FlappyVectorEnv`: overrides, first, threads, ...

    The info of an environment whose episode ended has `terminal_observation`, `TimeLimit.truncated`, `episode` (`r`, `l`, `t`: no Monitor
    is needed), `is_success` and `causes` (bits of `flappy.envs.CAUSES`); other infos are empty. Environment i depends on the seed and on i,
    so `seed(s)` gives all the same s.
    """

    def __init__(self, env_id: str, num_envs: int, **options: Any) -> None:
        env = gymnasium.make_vec(env_id, num_envs=num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        if not isinstance(env, FlappyVectorEnv):
            raise ValueError(f"env_id: is {env_id!r}; accepted: names that begin with 'flappy/'")
        self.env = env
        super().__init__(num_envs, env.single_observation_space, env.single_action_space)
        self.metadata = {**env.metadata, "render_modes": self.metadata["render_modes"]}
        self._actions: Floats = np.zeros((num_envs, len(env.action_names)), np.float32)
        self._nothing: list[dict[str, Any]] = [{} for _ in range(num_envs)]
        self._start_s = time.monotonic()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """The next reset starts episode 0 of `seed`, a random one where None is given."""
        first = super().seed(seed)[0]
        self._seeds = [first] * self.num_envs
        return self._seeds

    def reset(self) -> Floats:
        """Starts all anew; float32 (num_envs, observations)."""
        observation, _ = self.env.reset(seed=self._seeds[0])
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keeps one action of each, (num_envs, actions) in [-1, 1]."""
        self._actions = np.asarray(actions, np.float32)

    def step_wait(self) -> VecEnvStepReturn:
        """Steps: observation float32 (num_envs, observations), reward float32 (num_envs,), done bool (num_envs,), a dict for each."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        if any(self._nothing):  # a caller wrote into one
            self._nothing = [{} for _ in range(self.num_envs)]
        infos = self._nothing.copy()
        done = terminated | truncated
        if info:
            elapsed_s = round(time.monotonic() - self._start_s, 6)
            episode, final = info["final_info"], info["final_obs"]
            for i in np.flatnonzero(done).tolist():
                infos[i] = {
                    "terminal_observation": final[i],
                    "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                    "episode": {"r": float(episode["return"][i]), "l": int(episode["length"][i]), "t": elapsed_s},
                    "is_success": bool(episode["is_success"][i]),
                    "causes": int(episode["causes"][i]),
                }
        return observation, reward, done, infos

    def close(self) -> None:
        """Frees the simulator."""
        self.env.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Images of the first environments, uint8 (height, width, 3) each."""
        return self.env.render() or []

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the batch, once for each index."""
        value = getattr(self.env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Sets an attribute of the batch, which all environments share."""
        if set(self._get_indices(indices)) != set(range(self.num_envs)):
            raise ValueError("indices: accepted: None; the environments of a batch share their attributes")
        setattr(self.env, attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any) -> list[Any]:
        """Calls a method of the batch; `pose` once for each index, with it."""
        method = getattr(self.env, method_name)
        if method_name == "pose" and not method_args and not method_kwargs:
            return [method(i) for i in self._get_indices(indices)]
        value = method(*method_args, **method_kwargs)
        return [value for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None) -> list[bool]:
        """True for Monitor, whose part is done here, and for nothing else."""
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]
