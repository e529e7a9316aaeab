#!/usr/bin/env python3
"""Whole tools that learn the same tasks on this machine: trains, one cell at a time, and prints the table of docs/results/training.md.

    scripts/results/learners.py BIN ROOT OUT [--seconds 600] [--cells PATTERN] [--seeds 0,1] [--table]

BIN holds the programs, ROOT is the project, OUT keeps each cell as JSON: what is there is not run again. A cell is a tool, a task, a variant ("own": its
defaults; "recipe": what it can take of configs/train) and a seed. It uses all processors that the process may use: with `taskset -c 0` before it, one. Only training is timed; processor time of ours includes evaluations. Unseen robots: 500 flights of another seed,
of the same tasks, by each tool's own policy without exploration. The quadrotor is flown by each tool's own simulator (rltools_quadrotor.cpp). Python needs the modules of requirements() and flappy.
"""

import argparse
import fnmatch
import json
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys
import time
import tomllib

SHARES = (0.5, 0.8, 0.9, 0.95)
FLIGHTS, UNSEEN = 500, 1_000_000
TASKS = {"escape": ("flappy/Escape-v0", "escape"), "hover": ("flappy/Hover-v0", "hover_direct"), "quadrotor": (None, "quadrotor")}  # environment; configs/train
RECIPE = {"learning_rate": 1e-3, "batch_size": 128, "gamma": 0.98, "tau": 0.02}
RECIPE_TD3 = {"target_policy_noise": 0.1, "target_noise_clip": 0.3, "n_steps": 5}
NETWORKS = {"pi": [32, 32], "qf": [128, 128]}
FLAPPERS, UPDATES_A_STEP = 256, 6


def requirements():
    """What pip installs for all cells."""
    return ["stable-baselines3", "sbx-rl", "rltools", "pybind11", "gymnasium", "numpy"]


class Clock:
    """Time of training: of the wall and of all processors, evaluations left out."""

    def __init__(self):
        self.rows, self.wall, self.cpu, self.next = [], 0.0, 0.0, 0.0
        self.resume()

    def resume(self):
        self.since, self.since_cpu = time.monotonic(), time.process_time()

    def look(self, steps, success):
        """Stops, evaluates, goes on; whether to go on training."""
        self.wall += time.monotonic() - self.since
        self.cpu += time.process_time() - self.since_cpu
        begun = time.monotonic()
        self.rows.append({"steps": int(steps), "wall_s": self.wall, "cpu_s": self.cpu, "success": success()})
        self.next = self.wall + max(1.0, 0.1 * self.wall, time.monotonic() - begun)  # evaluations last no longer than training
        self.resume()
        last = [row["success"] for row in self.rows[-3:]]
        return self.wall < SECONDS and not (len(last) == 3 and min(last) >= SHARES[-1])

    def due(self):
        return self.wall + time.monotonic() - self.since >= min(self.next, SECONDS)


def unseen(env_id, policy):
    """The share of unseen flights that succeed."""
    sys.path.insert(0, str(ROOT / "examples/python"))
    from evaluation import evaluate

    return evaluate(policy, f"flappy:{env_id}", FLIGHTS, UNSEEN)[0]


def by_sb3(library, algorithm, env_id, variant, seed):
    from flappy.sb3 import FlappyVecEnv
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.vec_env import VecNormalize

    recipe, off_policy = variant == "recipe", algorithm != "PPO"
    env = VecNormalize(FlappyVecEnv(env_id, FLAPPERS if recipe else 1), norm_reward=False) if recipe else FlappyVecEnv(env_id, 1)
    options = {}
    if recipe and off_policy:
        options = RECIPE | {"gradient_steps": UPDATES_A_STEP, "learning_starts": 20 * FLAPPERS, "policy_kwargs": {"net_arch": NETWORKS}}
        options |= RECIPE_TD3 if algorithm == "TD3" and library == "stable_baselines3" else {}
    elif recipe:
        options = {"n_steps": 32, "batch_size": 1024, "n_epochs": 10, "learning_rate": 1e-3, "gamma": 0.98, "policy_kwargs": {"log_std_init": -1, "net_arch": [32, 32]}}
    if algorithm == "TD3":
        import numpy as np
        from stable_baselines3.common.noise import NormalActionNoise

        actions = env.action_space.shape[0]
        options["action_noise"] = NormalActionNoise(np.zeros(actions), 0.1 * np.ones(actions))
    module = __import__(library)
    model = getattr(module, algorithm)("MlpPolicy", env, seed=seed, **options)
    clock = Clock()

    class Watch(BaseCallback):
        def _on_step(self):
            if not clock.due():
                return True
            seen = (lambda o: env.normalize_obs(o)) if recipe else (lambda o: o)
            return clock.look(self.num_timesteps, lambda: unseen(env_id, lambda o: self.model.predict(seen(o), deterministic=True)[0]))

    model.learn(10**9, callback=Watch())
    return clock, module.__version__


def by_rltools(algorithm, env_id, config, variant, seed):
    import importlib.metadata

    import gymnasium
    import numpy as np
    import rltools

    options = {"STEP_LIMIT": 10_000_000, "REPLAY_BUFFER_CAP": 1_000_000, "interface_name": f"{algorithm}_{variant}".lower(), "evaluation_interval": 10_000_000, "num_evaluation_episodes": 1}
    if variant == "recipe":
        options |= {"GAMMA": 0.98, "ACTOR_BATCH_SIZE": 128, "CRITIC_BATCH_SIZE": 128, "ACTOR_HIDDEN_DIM": 32, "CRITIC_HIDDEN_DIM": 128, "ACTOR_POLYAK": 0.98, "CRITIC_POLYAK": 0.98}
        options |= {"TARGET_NEXT_ACTION_NOISE_STD": 0.1, "TARGET_NEXT_ACTION_NOISE_CLIP": 0.3} if algorithm == "TD3" else {}
    # RLtools reads no `truncated` of an environment, only a number of steps: the task's own
    task = tomllib.loads((ROOT / f"configs/tasks/{config}.toml").read_text())

    class OwnEnd(gymnasium.Wrapper):
        over = False

        def reset(self, **given):
            self.over = False
            return super().reset(**given)

        def step(self, action):
            assert not self.over, "a step past the end of an episode"
            result = super().step(action)
            self.over = result[2] or result[3]
            return result

    def env():
        made = OwnEnd(gymnasium.make(f"flappy:{env_id}"))
        return gymnasium.wrappers.TimeLimit(made, round(task["end"]["time_s"] / made.unwrapped.step_s))

    state = getattr(rltools, algorithm)(env, **options).State(seed)
    clock, steps = Clock(), 0
    while True:
        for _ in range(200):
            state.step()
        steps += 200
        if clock.due() and not clock.look(steps, lambda: unseen(env_id, lambda o: np.stack([np.clip(state.action(row), -1, 1).ravel() for row in o]).astype(np.float32))):
            return clock, importlib.metadata.version("rltools")


def build_rltools_loop():
    import rltools

    program, headers = OUT / "rltools_quadrotor", pathlib.Path(rltools.__file__).parent / "external/rl_tools/include"
    command = ["g++", "-std=c++17", "-Ofast", "-march=native", "-DRL_TOOLS_BACKEND_ENABLE_OPENBLAS", "-I", headers, ROOT / "scripts/results/rltools_quadrotor.cpp"]
    if not program.exists():
        subprocess.run([*command, "-o", program, "-lopenblas"], check=True)


def by_rltools_loop(seed):
    """RLtools' own loop, environment and published parameters."""
    import importlib.metadata

    done = subprocess.run([OUT / "rltools_quadrotor", str(seed)], capture_output=True, text=True, check=True, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
    clock = Clock()
    clock.rows = [json.loads(line) for line in done.stdout.splitlines()]
    clock.wall, clock.cpu = clock.rows[-1]["wall_s"], clock.rows[-1]["cpu_s"]
    return clock, importlib.metadata.version("rltools")


def by_flappy(engine, config, seed, folder):
    overrides = [f"learn.engine={engine}", f"seed={seed}", f"evaluate.every={250 if config == 'quadrotor' else 1000}", f"evaluate.vehicles={FLIGHTS}"]
    shutil.rmtree(folder, ignore_errors=True)  # an interrupted cell left it
    done = subprocess.run([BIN / "flappy-train", ROOT / f"configs/train/{config}.toml", "--out", folder, *(w for o in overrides for w in ("--set", o))], capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    summary = json.loads((folder / "summary.json").read_text())
    version = json.loads((folder / "run.json").read_text())["commit"]
    cpu_s = resource.getrusage(resource.RUSAGE_CHILDREN)
    return summary, version, cpu_s.ru_utime + cpu_s.ru_stime


def cell(name, task, variant, seed):
    """Trains one; the result goes to stdout as JSON."""
    start = time.monotonic()
    env_id, config = TASKS[task]
    if name.startswith("flappy"):
        summary, version, cpu_s = by_flappy(name.split("-")[1], config, seed, OUT / f"{name}_{task}_{seed}")
        to = {str(s): summary[f"time_to_{round(100 * s)}_s"] for s in SHARES}
        found = {"version": version, "to_s": to, "best": summary["best_success_rate"], "wall_s": summary["wall_s"], "cpu_s": cpu_s, "steps": summary["env_steps"],
                 "start_s": time.monotonic() - start - summary["wall_s"] - summary["evaluation_s"], "peak_MB": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024}
    else:
        library, algorithm = name.split("-")
        if name == "rltools-loop":
            clock, version = by_rltools_loop(seed)
        elif library == "rltools":
            clock, version = by_rltools(algorithm.upper(), env_id, config, variant, seed)
        else:
            clock, version = by_sb3({"sb3": "stable_baselines3"}.get(library, library), algorithm.upper(), env_id, variant, seed)
        to = {str(s): next((row["wall_s"] for row in clock.rows if row["success"] >= s), None) for s in SHARES}
        found = {"version": version, "to_s": to, "best": max(row["success"] for row in clock.rows), "wall_s": clock.wall, "cpu_s": clock.cpu, "steps": clock.rows[-1]["steps"],
                 "peak_MB": max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)) / 1024, "curve": clock.rows}
        found["start_s"] = time.monotonic() - start - clock.wall
    print(json.dumps({"tool": name, "task": task, "variant": variant, "seed": seed} | found))


def table():
    """Medians over seeds; what was not reached is a bound."""
    rows = [json.loads(path.read_text()) for path in sorted(OUT.glob("cell_*.json"))]
    print("| task | tool | variant | seeds | " + " | ".join(f"to {round(100 * s)} %, s" for s in SHARES) + " | best, % | environment steps | processor s | MB |")
    print("|---|---|---|---|" + "---|" * (len(SHARES) + 4))
    groups = {}
    for row in rows:
        groups.setdefault((row["task"], row["tool"] + " " + row["version"], row["variant"]), []).append(row)
    for (task, tool, variant), same in sorted(groups.items()):
        def middle(values):
            return statistics.median_low(values)

        def reached(share):
            times = [row["to_s"][str(share)] for row in same]
            shown = [t if t is not None else float("inf") for t in times]
            m = middle(shown)
            text = f"> {min(row['wall_s'] for row in same):.0f}" if m == float("inf") else f"{m:.1f}"
            return text + (f" ({min(shown):.1f} to {max(shown):.1f})".replace("inf", "not") if len(same) > 1 and m < float("inf") else "")

        print(f"| {task} | {tool} | {variant} | {len(same)} | " + " | ".join(reached(s) for s in SHARES) +
              f" | {100 * middle([r['best'] for r in same]):.1f} | {middle([r['steps'] for r in same]):,} | {middle([r['cpu_s'] for r in same]):.0f} | {middle([r['peak_MB'] for r in same]):.0f} |")


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("bin", type=pathlib.Path)
parser.add_argument("root", type=pathlib.Path)
parser.add_argument("out", type=pathlib.Path)
parser.add_argument("--seconds", type=float, default=600, help="of training at most, for each cell of another tool")
parser.add_argument("--cells", default="*", help="pattern of TOOL_TASK_VARIANT, such as 'sb3-*_escape_*'")
parser.add_argument("--seeds", default="0", help="numbers: 0,3 or 0-19")
parser.add_argument("--table", action="store_true", help="print what is there alone")
parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
args = parser.parse_args()
BIN, ROOT, OUT, SECONDS = args.bin.resolve(), args.root.resolve(), args.out.resolve(), args.seconds
if args.one:
    cell(args.one[0], args.one[1], args.one[2], int(args.one[3]))
    sys.exit()
OUT.mkdir(parents=True, exist_ok=True)
OWN = [(f"flappy-{engine}", "own") for engine in ("lanes", "libtorch")]
OTHERS = [("rltools-loop", "own")] + [(tool, variant) for variant in ("recipe", "own") for tool in ("sb3-td3", "sb3-sac", "sb3-ppo", "sbx-td3", "sbx-sac", "rltools-td3", "rltools-sac")]
FIRST, _, LAST = args.seeds.partition("-")
SEEDS = map(str, range(int(FIRST), int(LAST) + 1)) if LAST else args.seeds.split(",")
for seed in SEEDS if not args.table else []:
    for tool, variant in OWN + OTHERS:
        for task in (t for t in TASKS if (t == "quadrotor") == (tool == "rltools-loop") or tool.startswith("flappy")):
            file = OUT / f"cell_{tool}_{task}_{variant}_{seed}.json"
            if file.exists() or not fnmatch.fnmatch(f"{tool}_{task}_{variant}", args.cells):
                continue
            print(f"{tool}, {task}, {variant}, seed {seed} ...", end=" ", flush=True)
            if tool == "rltools-loop":
                build_rltools_loop()
            done = subprocess.run([sys.executable, __file__, args.bin, args.root, args.out, "--seconds", str(SECONDS), "--one", tool, task, variant, seed], capture_output=True, text=True,
                                  env=os.environ | {"OMP_NUM_THREADS": str(len(os.sched_getaffinity(0)))})
            if done.returncode:
                print(done.stderr.strip().split("\n")[-1])
                continue
            file.write_text(done.stdout.strip().split("\n")[-1])
            found = json.loads(file.read_text())
            print(f"best {100 * found['best']:.1f} %, {found['wall_s']:.0f} s, to 90 %: {found['to_s']['0.9']}")
table()
