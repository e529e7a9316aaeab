"""What a step costs in Python, beside the C++ fleet's own: `python -m flappy.bench`."""

import argparse
import statistics
import time
from collections.abc import Callable

import gymnasium
import numpy as np

from . import _core, instruction_sets


def _seconds(step: Callable[[], object], steps: int) -> float:
    for _ in range(max(3, steps // 10)):
        step()
    start = time.perf_counter()
    for _ in range(steps):
        step()
    return (time.perf_counter() - start) / steps


def main() -> None:
    """Times rounds in turn, so that each is beside the others in the same noise, and prints medians and their ratios."""
    parser = argparse.ArgumentParser(prog="python -m flappy.bench", description=__doc__)
    parser.add_argument("--num-envs", type=int, default=4096)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--repeat-s", type=float, default=0.01, help="of an action; 0.002 is one control period")
    given = parser.parse_args()
    overrides = [f"task.action.repeat_s={given.repeat_s}"]
    config, periods, count = "fly/hover_direct.toml", round(given.repeat_s * 500), given.num_envs

    # what the controls of a hovering vehicle look like: small, so that few fall and are started anew in C++ too
    action = np.zeros((count, 4), np.float32)
    envs = {
        name: gymnasium.make_vec("flappy/Hover-v0", num_envs=count, copy=name == "copies", overrides=overrides)
        for name in ("views", "copies")
    }
    single = gymnasium.make("flappy/Hover-v0", overrides=overrides, disable_env_checker=True).unwrapped
    for env in envs.values():
        env.reset(seed=1)
    single.reset(seed=1)

    def one() -> None:
        if any(single.step(action[0])[2:4]):
            single.reset()

    figures: dict[str, list[float]] = {name: [] for name in ("fleet", "views", "copies", "single")}
    for _ in range(given.rounds):
        figures["fleet"].append(_core.fleet_seconds(config, overrides, count, periods, given.steps) / given.steps)
        for name, env in envs.items():
            figures[name].append(_seconds(lambda env=env: env.step(action), given.steps))  # type: ignore[misc]
        figures["single"].append(_seconds(one, 20 * given.steps))
    names = {
        "fleet": f"C++ fleet, {periods} control periods",
        "views": "make_vec, copy=False",
        "copies": "make_vec, copy=True",
        "single": "make, one environment",
    }
    print(f"{count} environments of Hover-v0, {instruction_sets()[-1]}; medians of {given.rounds} rounds in turn")
    for name, seconds in figures.items():
        median = statistics.median(seconds)
        ratio = statistics.median(mine / fleet for mine, fleet in zip(seconds, figures["fleet"], strict=True))
        size, beside = (1, "") if name == "single" else (count, f"  {ratio:5.2f} x")
        print(f"  {names[name]:32s} {1e3 * median:8.4f} ms/step  {size / median:12,.0f} steps/s{beside}")


if __name__ == "__main__":
    main()
