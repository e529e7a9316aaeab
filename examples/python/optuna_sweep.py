"""Searches settings of a training with Optuna; what stays behind in success on validation vehicles is pruned.

    python examples/python/optuna_sweep.py configs/train/quadrotor.toml --out sweep
    python examples/python/optuna_sweep.py train/quadrotor.toml --job            # by a flappy-server, over DDS

A run folder stays of each trial, 0.1 to 0.5 GB. Trials are kept in --storage (default: memory; sqlite:///sweep.db goes on where it was
stopped). The programs are those of PATH.
"""

import argparse
import json
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import optuna


def settings(trial: optuna.Trial) -> list[str]:
    """What is searched: add a line, and any key of docs/reference/configuration.md is."""
    return [
        f"learn.critic_rate={trial.suggest_float('critic_rate', 5e-4, 5e-3, log=True):.3g}",
        f"learn.actor_rate={trial.suggest_float('actor_rate', 5e-4, 5e-3, log=True):.3g}",
        f"learn.batch={trial.suggest_categorical('batch', [64, 128, 256])}",
        f"collect.noise_high={trial.suggest_float('noise_high', 0.1, 0.6):.3g}",
    ]


def sets(values: list[str]) -> list[str]:
    return [word for value in values for word in ("--set", value)]


class Training:
    """A run of flappy-train as it goes: step and success of each evaluation."""

    def __init__(self, config: str, values: list[str], out: Path) -> None:
        self.out = out
        self.process = subprocess.Popen(
            ["flappy-train", config, "--out", str(out), *sets(values)], stdout=subprocess.DEVNULL, start_new_session=True
        )

    def evaluations(self) -> Iterator[tuple[int, float]]:
        """Yields each as it comes, until the training ends."""
        told = 0
        while True:
            running = self.process.poll() is None
            text = (self.out / "metrics.jsonl").read_text() if (self.out / "metrics.jsonl").exists() else ""
            rows = text.rpartition("\n")[0].splitlines()
            for row in map(json.loads, rows[told:]):
                yield row["update"], row["success_rate"]
            told = len(rows)
            if not running:
                break
            time.sleep(0.1)
        if self.process.returncode:
            raise RuntimeError(f"flappy-train ended with {self.process.returncode}")

    def stop(self) -> None:
        """Ends what still runs."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)  # as Ctrl-C, which reaches this process alone: it ends cleanly
        self.process.wait()


class Job:
    """The same, of a job of a flappy-server; a step is a per cent of the training."""

    def __init__(self, config: str, values: list[str], dds: list[str]) -> None:
        self.dds = dds
        self.number = int(self.ask("submit", "train", config, *sets(values))["job"])

    def ask(self, *words: str) -> dict:
        """The answer to a command of flappy-job. Raises RuntimeError if the server does not answer within a minute."""
        command, until_s = ["flappy-job", *self.dds, "--json"], time.monotonic() + 60
        with tempfile.NamedTemporaryFile(suffix=".json") as answer:
            while subprocess.run([*command, answer.name, *words], stdout=subprocess.DEVNULL).returncode:
                if words[0] != "list" or time.monotonic() > until_s:
                    raise RuntimeError(f"flappy-job {words[0]} fails")
                time.sleep(1)  # the server may be starting anew
            return json.loads(Path(answer.name).read_text())

    def evaluations(self) -> Iterator[tuple[int, float]]:
        """Yields each as it comes, until the job ends."""
        told = -1
        while True:
            job = next(job for job in self.ask("list")["jobs"] if job["id"] == self.number)
            step, success = round(100 * job["progress"]), re.search(r"success ([\d.]+) %", job["message"])
            if success and step > told:
                told = step
                yield step, float(success[1]) / 100
            if job["state"] in ("failed", "cancelled"):
                raise RuntimeError(f"job {self.number} is {job['state']}: {job['message']}")
            if job["state"] == "done":
                return
            time.sleep(0.5)

    def stop(self) -> None:
        """Ends what still runs."""
        job = next(job for job in self.ask("list")["jobs"] if job["id"] == self.number)
        if job["state"] not in ("done", "failed", "cancelled"):
            with contextlib.suppress(RuntimeError):  # it may just have ended
                self.ask("cancel", str(self.number))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("config", help="training file; with --job its name below the server's folder")
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--out", type=Path, default=Path("sweep"), help="folder of the runs")
    parser.add_argument("--seed", type=int, help="of the search: the same one tries the same settings")
    parser.add_argument("--storage", help="database of the trials")
    parser.add_argument("--job", action="store_true", help="by a flappy-server")
    parser.add_argument("--dds", action="append", default=[], help="where the server is: domain=3")
    parser.add_argument("--set", action="append", default=[], dest="fixed", help="a key for all trials: learn.updates=6000")
    args = parser.parse_args()

    if not shutil.which(program := "flappy-job" if args.job else "flappy-train"):
        sys.exit(f"error: {program} is not on PATH; accepted: PATH=build/release/bin:$PATH")

    def objective(trial: optuna.Trial) -> float:
        values = [*args.fixed, *settings(trial)]
        training: Training | Job
        if args.job:
            training = Job(args.config, values, [word for key in args.dds for word in ("--dds", key)])
        else:
            training = Training(args.config, values, args.out / f"trial_{trial.number}")
        best = 0.0
        try:
            for step, success in training.evaluations():
                best = max(best, success)
                trial.report(success, step)
                if trial.should_prune():
                    raise optuna.TrialPruned()
        finally:
            training.stop()
        return best

    how = {"sampler": optuna.samplers.TPESampler(seed=args.seed), "pruner": optuna.pruners.MedianPruner(n_startup_trials=3)}
    study = optuna.create_study(study_name="flappy", storage=args.storage, load_if_exists=True, direction="maximize", **how)
    if (there := args.out / f"trial_{len(study.trials)}").exists() and not args.job:
        sys.exit(f"error: {there}: is there already; accepted: another --out, or the --storage that it was made with")
    study.optimize(objective, n_trials=args.trials, catch=RuntimeError)  # one that diverges is a failed trial
    pruned = sum(trial.state == optuna.trial.TrialState.PRUNED for trial in study.trials)
    print(f"{len(study.trials)} trials, {pruned} pruned; best success {100 * study.best_value:.1f} %, trial {study.best_trial.number}:")
    for name, value in study.best_params.items():
        print(f"  {name} = {value:.3g}")


if __name__ == "__main__":
    main()
