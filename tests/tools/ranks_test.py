"""Work by several ranks: the same bytes for any number of them, after kills and hangs too; what is refused.

  ranks_test.py FLAPPY_TRAIN CONFIG WORK [--full] [LAUNCHER...]

--full: with LibTorch too, ten kills in place of one, and hangs. Launchers: torchrun, mpirun, srun.
"""
import hashlib
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

program, config, work = sys.argv[1], sys.argv[2], Path(sys.argv[3])
full, launchers = "--full" in sys.argv, [word for word in sys.argv[4:] if word != "--full"]
updates = 600 if full else 200
small = [f"learn.updates={updates}", f"evaluate.every={updates // 2}", f"evaluate.vehicles={101 if full else 37}", f"checkpoint.every={150 if full else 100}", "collect.vehicles=32",
         "collect.flappers=200", "learn.replay=20000"]
lost = 75


def free_port():
    """One that is free, as is the one above it."""
    while True:
        with socket.socket() as a, socket.socket() as b:
            a.bind(("127.0.0.1", 0))
            port = a.getsockname()[1]
            try:
                b.bind(("", port + 1))
                return port
            except OSError:
                continue


def start(rank, size, arguments, name="flappy-train", **variables):
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("RANK", "WORLD", "MASTER", "OMPI", "SLURM", "LOCAL"))}
    own = {} if size is None else {"RANK": str(rank), "WORLD_SIZE": str(size), "LOCAL_WORLD_SIZE": str(size)}
    return subprocess.Popen([str(Path(program).with_name(name)), *arguments], env={**clean, **own, **variables}, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def fresh(folder, engine="lanes", more=()):
    words = [config, "--out", str(folder)]
    for word in [*small, f"learn.engine={engine}", *more]:
        words += ["--set", word]
    return words


def end(processes, seconds=300):
    return [(p.communicate(timeout=seconds), p.returncode) for p in processes]


def together(size, arguments, name="flappy-train", **variables):
    if size == 1:
        return [start(0, None, arguments, name)]
    port = str(free_port())
    return [start(r, size, arguments, name, MASTER_PORT=port, **variables) for r in range(size)]


def succeed(processes):
    for rank, ((out, err), code) in enumerate(end(processes)):
        assert code == 0, (rank, code, err)
        assert rank == 0 or out == "", out
        assert err == "" or rank == 0, err


def digest(folder):
    files = sorted(p for p in folder.iterdir() if p.suffix == ".flappy" or p.name in ("best.json", "last.json", "metrics.jsonl"))
    assert files
    # a checkpoint's header holds wall time: its payload is hashed in summary.json
    text = [hashlib.sha256(p.read_bytes()).hexdigest() for p in files if p.suffix != ".flappy"]
    summary = (folder / "summary.json").read_text()
    return text + [line for line in summary.splitlines() if "payload" in line]


def refused(what, expected, size, arguments, ranks=None, **variables):
    processes = [start(r, size, arguments, **variables) for r in (ranks or [0])]
    for (_, err), code in end(processes):
        assert code == 2 and expected in err and err.count("\n") == 1, (what, code, err)


shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)

# ---- the same bytes for any number of ranks
(p,) = [start(0, None, fresh(work / "one"))]
succeed([p])
for size in (2, 3, 4) if full else (3,):
    succeed(together(size, fresh(work / f"of_{size}")))
    assert digest(work / f"of_{size}") == digest(work / "one"), size
if full:  # of LibTorch, the same for the same number of ranks
    succeed(together(2, fresh(work / "torch", "libtorch")))
    succeed(together(2, fresh(work / "torch_again", "libtorch")))
    assert digest(work / "torch") == digest(work / "torch_again")

# ---- a rank dies or hangs: the others say which within 30 s, and another number of ranks goes on
randomness = random.Random(7)
for kill in range(10 if full else 1):
    folder, size = work / f"kill_{kill}", randomness.choice((2, 3, 4))
    victim, hangs = randomness.randrange(size), kill % 5 == 1
    processes = together(size, fresh(folder))
    deadline = time.monotonic() + 60
    while not list(folder.glob(f"checkpoint_*{15 if full else 10}*")):
        assert time.monotonic() < deadline and processes[0].poll() is None, folder
        time.sleep(0.02)
    time.sleep(randomness.uniform(0, 0.3))
    processes[victim].send_signal(signal.SIGSTOP if hangs else signal.SIGKILL)
    since = time.monotonic()
    if all(p.poll() is None for i, p in enumerate(processes) if i != victim):
        for i, p in enumerate(processes):
            if i == victim:
                continue
            _, err = p.communicate(timeout=40)
            seconds = time.monotonic() - since
            if p.returncode == 0:
                continue  # it was through already
            assert p.returncode == lost and f"rank {victim} of {size}" in err and err.count("\n") == 1, (kill, i, p.returncode, err)
            assert seconds < 30, seconds
    processes[victim].kill()
    for p in processes:
        p.communicate()
    if not (folder / "summary.json").exists():
        again = randomness.choice((1, 2, 3))
        succeed(together(again, ["--resume", str(folder)]))
    assert digest(folder) == digest(work / "one"), kill
    print(f"kill {kill}: rank {victim} of {size} {'hung' if hangs else 'died'}; resumed", flush=True)

# ---- work that is many pieces: the same files for any number of ranks


def alike(what, files, arguments, name, sizes=(1, 3)):
    """`arguments` of a folder for the results, in which `files` are to be the same."""
    seen = []
    for size in sizes:
        folder = work / f"{what}_{size}"
        folder.mkdir()
        succeed(together(size, arguments(folder), name))
        seen.append([(folder / file).read_bytes() for file in files])
    assert all(one == seen[0] for one in seen), what


configs = Path(config).parents[1]
alike("eval", ["e.json"], lambda f: [str(work / "one"), "--episodes", "70", "--no-baselines", "--json", str(f / "e.json")], "flappy-eval")


def sweep(folder, seeds="0-2"):
    return [*fresh(folder, more=["learn.updates=60", "evaluate.every=60", "checkpoint.every=30"]), "--seeds", seeds]


left = [f"seed_{seed}/{file}" for seed in range(3) for file in ("best.json", "metrics.jsonl")]
alike("seeds", [f"r/{file}" for file in left], lambda f: sweep(f / "r"), "flappy-train")
# killed, it goes on where it was; of other options, it is refused
(p,) = together(1, sweep(work / "sweep"))
while not (work / "sweep" / "seed_1" / "run.json").exists():
    time.sleep(0.02)
p.kill()
p.communicate()
succeed(together(2, sweep(work / "sweep")))
assert (work / "sweep" / "curve.csv").exists()
for file in left:
    assert (work / "sweep" / file).read_bytes() == (work / "seeds_1" / "r" / file).read_bytes(), file
refused("another sweep", "holds a run of another configuration; accepted: a new folder, or the same options", None,
        [*sweep(work / "sweep"), "--set", "reward.scale=2.0"])
if full:
    alike("tune", ["c.toml"], lambda f: [str(configs / "tune" / "pid.toml"), str(f / "c.toml"), "--set", "generations=2", "--set",
                                         "population=5"], "flappy-tune")
    vehicles = configs / "vehicles"
    found = ["calibrate", "--vehicle", str(vehicles / "hummingbird_nominal.toml"), "--truth", str(vehicles / "hummingbird_identified.toml"),
             "--seeds", "3"]
    said = [end(together(size, found, "flappy-identify"))[0][0][0] for size in (1, 2)]
    assert said[0] == said[1] and "3 noise seeds" in said[0], said
    alike("make", ["b/manifest.json"], lambda f: ["make", "--out", str(f / "b"), "--set", "development", "--part", "none", "--cases", "3"],
          "flappy-blind")
    for size in (1, 3):
        succeed(together(size, ["score", str(work / f"make_{size}" / "b")], "flappy-blind"))
    assert (work / "make_1/b/score.md").read_bytes() == (work / "make_3/b/score.md").read_bytes()

# ---- what is refused
new = work / "refused"
refused("no size", "WORLD_SIZE: is missing; accepted: a whole number from 1 to 65536", None, fresh(new), RANK="0")
refused("no number", "RANK=x; accepted: a whole number from 0 to 1", None, fresh(new), RANK="x", WORLD_SIZE="2")
refused("too high", "RANK=2; accepted: a whole number from 0 to 1", None, fresh(new), RANK="2", WORLD_SIZE="2")
refused("several machines", "MASTER_ADDR: is missing, and ranks run on several machines", None, fresh(new), RANK="0", WORLD_SIZE="2",
        LOCAL_WORLD_SIZE="1")
refused("a network", "MASTER_ADDR=192.0.2.1: is not this machine alone", 2, fresh(new), MASTER_ADDR="192.0.2.1")
with socket.socket() as taken:
    taken.bind(("", 0))
    taken.listen()
    port = str(taken.getsockname()[1] - 1)
    refused("a port in use", f"MASTER_PORT={port}: the port above it is in use", 2, fresh(new), MASTER_PORT=port)
port = str(free_port())
processes = [start(0, 2, fresh(new), MASTER_PORT=port), start(1, 2, fresh(new, more=["seed=5"]), MASTER_PORT=port)]
for (_, err), code in end(processes):
    assert code == 2 and "rank 1 has configuration: " in err and err.endswith("accepted: the same on all ranks\n"), (code, err)
assert not new.exists() or not list(new.glob("checkpoint*")), "nothing was begun"

for (_, err), code in end(together(2, fresh(work / "one"))):
    assert code == 2 and "holds a run; accepted: a new folder" in err, (code, err)
# one rank's own mistake: the other says that it ended, not that it died
port = str(free_port())
processes = [start(0, 2, fresh("/dev/null/run"), MASTER_PORT=port), start(1, 2, fresh(new), MASTER_PORT=port)]
(first, second) = end(processes)
assert first[1] == 2 and "/dev/null" in first[0][1], first
assert second[1] == lost and second[0][1] == "rank 0 ended: it says why\n", second

# ---- the launchers themselves
for launcher in launchers:
    folder = work / Path(launcher).name
    command = {
        "torchrun": [launcher, "--nproc_per_node=2", "--master_port", str(free_port()), "--no_python"],
        "mpirun": [launcher, "-np", "2", "--allow-run-as-root", "--oversubscribe", "-x", f"MASTER_PORT={free_port()}"],
        "srun": [launcher, "-n", "2", "--overcommit"],
    }[Path(launcher).name]
    done = subprocess.run([*command, program, *fresh(folder)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, (launcher, done.stderr)
    assert digest(folder) == digest(work / "one"), launcher
    print(f"{launcher}: the same bytes", flush=True)
