"""Gymnasium environments, one (`FlappyEnv`) or many at once (`FlappyVectorEnv`), on the simulator itself.

Environment i depends on (seed, first + i, episode) and its actions: not on `num_envs`, threads or the machine. Episode 0 of
`reset(seed=s)` is the flight of `flappy-fly` with that seed. Actions are float32 in [-1, 1] and stand for the ranges of the task
(`env.unwrapped.action_low`, `action_high`: V, V, V and fractions of a beat, or V and V); observations are float32 in SI units, by the
names in `env.unwrapped.observation_names`.
"""

import json
import operator
from collections.abc import Sequence
from copy import deepcopy
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from . import _core

Floats = NDArray[np.float32]
Bools = NDArray[np.bool_]

#: Why an episode ended: bits of `causes`; none where the controller was handed back to.
CAUSES = ("time_out", "contact", "not_finite", "out_of_bounds", "heading_late", "arrival_late")


def _whole(name: str, value: Any, accepted: str) -> int:
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: is {value!r}; accepted: {accepted}") from None


def _seed(seed: Any) -> int | None:
    """A seed of 64 bits. Gymnasium's own have 128: what is larger is hashed."""
    if seed is None:
        return None
    whole = _whole("seed", seed, "a whole number from 0, or None")
    if whole < 0:
        raise ValueError(f"seed: is {seed!r}; accepted: a whole number from 0, or None")
    return whole if whole < 2**64 else int(np.random.SeedSequence(whole).generate_state(1, np.uint64)[0])


def _core_of(
    config: str | Path,
    overrides: Sequence[str],
    count: int,
    mode: AutoresetMode,
    copy: bool,
    first: int,
    threads: int | None,
) -> _core.Environments:
    if isinstance(overrides, str):
        raise TypeError(f"overrides: is {overrides!r}; accepted: a sequence of such, [{overrides!r}]")
    own = [f"flight.first_flapper={_whole('first', first, 'a whole number')}"] if first else []
    if threads is not None:
        own.append(f"flight.threads={_whole('threads', threads, 'a whole number, or None')}")
    modes = {AutoresetMode.SAME_STEP: "same_step", AutoresetMode.NEXT_STEP: "next_step", AutoresetMode.DISABLED: "disabled"}
    return _core.Environments(Path(config), [*overrides, *own], count, modes[mode], copy)


def _spaces(core: _core.Environments) -> tuple[Any, Any]:
    high = np.array([s["high"] for s in core.observed], np.float32)
    ones = np.ones(len(core.actions), np.float32)
    return Box(-high, high), Box(-ones, ones)


def _made_again(of: type, options: dict[str, Any], spec: Any) -> Any:
    env = of(**options)
    env.spec = spec
    return env


class _Named:
    """What one environment and many have in common: names, ranges, and how they are pickled and copied."""

    _core: _core.Environments
    _options: dict[str, Any]  # arguments of the constructor
    spec: Any

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled is what makes the environment, not where it flies."""
        return _made_again, (type(self), self._options, self.spec)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """A copy flies on from the same state, to the same bytes."""
        twin = object.__new__(type(self))
        memo[id(self)] = twin
        twin.__dict__.update(deepcopy(self.__dict__, memo))
        return twin

    def __copy__(self) -> Self:
        return deepcopy(self)

    @property
    def observation_names(self) -> list[str]:
        """Of each number of an observation."""
        return [s["name"] for s in self._core.observed]

    @property
    def action_names(self) -> list[str]:
        """Of each number of an action."""
        return [s["name"] for s in self._core.actions]

    @property
    def action_low(self) -> Floats:
        """What -1 stands for, in the unit of each action: V, and fractions of a beat."""
        return np.array([s["low"] for s in self._core.actions], np.float32)

    @property
    def action_high(self) -> Floats:
        """What +1 stands for."""
        return np.array([s["high"] for s in self._core.actions], np.float32)

    def to_action(self, physical: Any) -> Floats:
        """The action that stands for these inputs, in the units of `action_low`; beyond the ranges it is clipped."""
        low, high = self.action_low, self.action_high
        action: Floats = np.clip(2 * (np.asarray(physical, np.float32) - low) / (high - low) - 1, -1, 1)
        return action

    @property
    def step_s(self) -> float:
        """Duration of a step."""
        return self._core.step_s

    def pose(self, i: int = 0) -> dict[str, Any]:
        """True motion and wings of environment `i`: position_m (3,), attitude (4,), stroke_rad (2,), target_m (3,), ..., t_s."""
        return self._core.pose(i)

    @cached_property
    def scene(self) -> dict[str, Any]:
        """What stays the same while it flies: the vehicle's shape, and "ambient": ground, ceiling and walls."""
        scene: dict[str, Any] = json.loads(self._core.scene())
        return scene

    def hash(self, first: int = 0, last: int | None = None) -> int:
        """Of how vehicles [first, last) move, as `flappy-fly` prints it."""
        return self._core.hash(first, self._core.count if last is None else last)


class FlappyEnv(_Named, gymnasium.Env[Floats, Floats]):
    """One environment of a configuration of `flappy-fly`.

    Args:
        config: its file, or the name of one of the package's own ("fly/hover_direct.toml").
        overrides: "task.end.time_s=2", as `--set` takes them.
        first: its number: which start, noise and vehicle it has.
        render_mode: "rgb_array" or None.

    `info` of the step that ends an episode has `is_success` and `causes` (names of `CAUSES`).
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 100}  # noqa: RUF012 as Gymnasium has it

    def __init__(self, config: str | Path, overrides: Sequence[str] = (), first: int = 0, render_mode: str | None = None) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: is {render_mode!r}; accepted: None, 'rgb_array'")
        self.render_mode = render_mode
        self.config, self.overrides = config, [*overrides]
        self._options = {"config": config, "overrides": self.overrides, "first": first, "render_mode": render_mode}
        self._core = _core_of(config, overrides, 1, AutoresetMode.DISABLED, True, first, 1)
        self.metadata = {**self.metadata, "render_fps": round(1 / self._core.step_s)}
        self.observation_space, self.action_space = _spaces(self._core)
        self._shape = (len(self._core.actions),)
        self._trail: list[Any] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Starts episode 0 of `seed`, or the next episode; without a seed from the first on, that of the configuration."""
        seed = _seed(seed)
        super().reset(seed=seed)
        self._trail.clear()
        return self._core.reset(seed)[0], {}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """One action, float32 (actions,) in [-1, 1], held for `step_s`."""
        action = np.asarray(action)
        if action.shape != self._shape:
            raise ValueError(f"action: is {action.dtype} of shape {action.shape}; accepted: float32 of shape {self._shape}")
        observation, reward, terminated, truncated, ended = self._core.step(action[None])
        info: dict[str, Any] = {}
        if ended:
            episode = self._core.ended()
            causes = int(episode["causes"][0])
            info["is_success"] = bool(episode["is_success"][0])
            info["causes"] = [name for k, name in enumerate(CAUSES) if causes >> k & 1]
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), info

    def render(self) -> NDArray[np.uint8] | None:
        """An image, uint8 (480, 640, 3): the robot in its flight page's scene, with the way flown since the last reset."""
        if self.render_mode is None:
            return None
        from .render import draw

        pose = self.pose()
        self._trail.append(pose["position_m"])
        return draw(pose, self.scene, np.array(self._trail))

    def close(self) -> None:
        """Frees the simulator. Calls after it raise RuntimeError."""
        self._core.close()


class FlappyVectorEnv(_Named, gymnasium.vector.VectorEnv[Floats, Floats, Any]):
    """Many environments of a configuration, in one batch.

    Args:
        num_envs: how many.
        config, overrides, first: as of `FlappyEnv`; environment i has the number first + i.
        autoreset_mode: SAME_STEP (default; `info["final_obs"]` with mask `_final_obs`), NEXT_STEP, or DISABLED
            (`reset(options={"reset_mask": ...})`).
        copy: True: arrays of each step are Python's, for as long as it wants them; their memory is used again after that. False: views,
            which the step after the next overwrites.
        threads: None: one for each processor, fewer where there are few environments.
        max_episode_steps: ends an episode after so many steps, if the task's own `end.time_s` does not end it before.

    Arrays are NumPy's: observation float32 (num_envs, observations), reward float32 (num_envs,), terminated and truncated bool
    (num_envs,). They speak DLPack (`torch.from_dlpack(observation)`); actions may come from any producer of it. The interpreter is free
    while the batch steps. Where episodes end, `info` has arrays `is_success`, `causes` (bits of `CAUSES`), `return` and `length` (steps),
    each with a mask (`_is_success`, ...); with SAME_STEP they are in `info["final_info"]`, beside `info["final_obs"]`, as Gymnasium has it.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        config: str | Path,
        overrides: Sequence[str] = (),
        first: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        copy: bool = True,
        threads: int | None = None,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode: is {render_mode!r}; accepted: None, 'rgb_array'")
        mode = AutoresetMode(autoreset_mode)
        num_envs = _whole("num_envs", num_envs, "a whole number from 1 to 1000000")
        self.num_envs = num_envs
        self.autoreset_mode = mode  # as Gymnasium's own have it: TorchRL reads it
        self.render_mode = render_mode
        self.config, self.overrides = config, [*overrides]
        self._options = {
            "num_envs": num_envs,
            "config": config,
            "overrides": self.overrides,
            "first": first,
            "autoreset_mode": mode,
            "copy": copy,
            "threads": threads,
            "max_episode_steps": max_episode_steps,
            "render_mode": render_mode,
        }
        self._core = _core_of(config, overrides, num_envs, mode, copy, first, threads)
        if max_episode_steps is not None:
            steps = _whole("max_episode_steps", max_episode_steps, "a whole number from 1, or None")
            if steps < 1:
                raise ValueError(f"max_episode_steps: is {max_episode_steps!r}; accepted: a whole number from 1, or None")
            if steps * self._core.step_s < self._core.longest_s:
                shorter = [*overrides, f"task.end.time_s={max((1 - 1e-6) * steps, 1) * self._core.step_s!r}"]
                self._core.close()
                self._core = _core_of(config, shorter, num_envs, mode, copy, first, threads)
        self._same_step = mode == AutoresetMode.SAME_STEP
        self.metadata = {"autoreset_mode": mode, "render_modes": ["rgb_array"], "render_fps": round(1 / self._core.step_s)}
        self.single_observation_space, self.single_action_space = _spaces(self._core)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def _seed_of_all(self, seed: Any) -> int | None:
        if not isinstance(seed, Sequence | np.ndarray):
            return _seed(seed)
        if len(seed) != self.num_envs:
            raise ValueError(f"seed: is a list of {len(seed)}; accepted: a whole number, or one for each of {self.num_envs} environments")
        if any((s is None) != (seed[0] is None) for s in seed):
            raise ValueError(f"seed: is {list(seed)!r}; accepted: a list of whole numbers, or one of None")
        seeds = [s for s in map(_seed, seed) if s is not None]
        if not seeds:
            return None
        if seeds == list(range(seeds[0], seeds[0] + self.num_envs)):
            return seeds[0]
        return int(np.random.SeedSequence(seeds).generate_state(1, np.uint64)[0])

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Starts episode 0 of `seed` everywhere, or everywhere the next episode; `options["reset_mask"]`: only there, bool (num_envs,).

        A list of seeds, one for each environment, as Gymnasium's own vector environments take it, makes one seed of all: the same
        list, the same flights.
        The list s, s + 1, s + 2, ... is the seed s.
        """
        seed = self._seed_of_all(seed)
        super().reset(seed=seed)
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return self._core.reset(seed), {}
        if self.metadata["autoreset_mode"] != AutoresetMode.DISABLED or seed is not None:
            raise ValueError("reset_mask: accepted with autoreset_mode DISABLED and without a seed")
        marked = np.asarray(mask)
        if marked.dtype != np.bool_ or marked.shape != (self.num_envs,):
            raise ValueError(f"reset_mask: is {marked.dtype} of shape {marked.shape}; accepted: bool of shape ({self.num_envs},)")
        return self._core.reset_some(marked), {}

    def step(self, actions: Floats) -> tuple[Floats, Floats, Bools, Bools, dict[str, Any]]:
        """One action of each, float32 (num_envs, actions) in [-1, 1]."""
        observation, reward, terminated, truncated, ended = self._core.step(actions)
        info: dict[str, Any] = {}
        if ended:
            episode = self._core.ended()
            mask = episode["ended"]
            how: dict[str, Any] = {}
            for name in ("is_success", "causes", "return", "length"):
                how[name], how["_" + name] = episode[name], mask
            if self._same_step:
                info = {"final_obs": episode["observation"], "_final_obs": mask, "final_info": how, "_final_info": mask}
            else:
                info = how
        return observation, reward, terminated, truncated, info

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """The first environments' images, at most 16, uint8 (480, 640, 3) each."""
        if self.render_mode is None:
            return None
        from .render import draw

        return tuple(draw(self.pose(i), self.scene) for i in range(min(self.num_envs, 16)))

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the simulator. Calls after it raise RuntimeError."""
        self._core.close()


#: Each name and its configuration. Hover-v0: the four inputs of the wing beat, nobody else steers. Hover-v1: both motors' voltages.
#: Escape-v0 and Waypoints-v0: what a policy adds to the controller. Fly-v0: any configuration, `config="my_fly.toml"`.
CONFIGS = {
    "Hover-v0": "fly/hover_direct.toml",
    "Hover-v1": "fly/hover_voltages.toml",
    "Escape-v0": "fly/escape.toml",
    "Waypoints-v0": "fly/waypoints.toml",
    "Fly-v0": None,
}


def register() -> None:
    """Registers `flappy/...`; `import flappy` has done it."""
    for name, config in CONFIGS.items():
        full = f"flappy/{name}"
        if full in gymnasium.registry:
            continue
        gymnasium.register(
            full,
            entry_point="flappy.envs:FlappyEnv",
            vector_entry_point="flappy.envs:FlappyVectorEnv",
            kwargs={} if config is None else {"config": config},
        )
