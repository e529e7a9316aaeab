"""Follows run folders of flappy-train, while they train and after, and hands them to MLflow or Weights & Biases.

    python -m flappy.follow RUN... --mlflow URI [--experiment NAME]
    python -m flappy.follow RUN... --wandb PROJECT [--offline]

A process of its own: training never waits for it. What was told stands in RUN/follow_mlflow.json or RUN/follow_wandb.json, so it goes on
where it was stopped and tells nothing twice. While a server does not answer, it tries again every --every seconds. It ends when every
training has; one that was stopped has ended, too: follow it again when it is resumed.
"""

import argparse
import fcntl
import hashlib
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

#: Least time between two uploads of a best policy that goes on changing, s.
POLICY_EVERY_S = 60.0


class InputError(Exception):
    """A mistake of the user, in one line."""


def flatten(value: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Yields dotted names and values of nested tables; an array of tables counts from 0."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from flatten(inner, f"{name}.{key}" if name else str(key))
    elif isinstance(value, list) and value and all(isinstance(inner, dict) for inner in value):
        for k, inner in enumerate(value):
            yield from flatten(inner, f"{name}.{k}")
    else:
        yield name, value


class Run:
    """A run folder of flappy-train."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        whole = folder.resolve()
        name = f"{whole.parent.name}-{whole.name}" if whole.name.startswith("seed_") else whole.name
        self.name = re.sub(r"[^A-Za-z0-9_.-]", "-", name)  # MLflow and W&B accept these characters
        self.to = ""  # its id at the logger, once this process has begun there
        self._lock: int | None = None
        self._made: tuple[int, tempfile.TemporaryDirectory[str], list[tuple[Path, str]]] | None = None

    def lock(self, logger: str) -> None:
        """Keeps other followers off until this process ends; InputError where there is one."""
        if self._lock is None:
            self._lock = os.open(self.folder / f".follow_{logger}.lock", os.O_RDWR | os.O_CREAT, 0o644)
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise InputError(f"{self.folder}: another flappy.follow tells {logger} of this run") from error

    def made(self, programs: Path | None, updates: int) -> list[tuple[Path, str]]:
        """Headers and page of a training that has ended, made once; and the folder of each at the logger."""
        if self._made is None or self._made[0] != updates:
            into = tempfile.TemporaryDirectory()
            self._made = (updates, into, _exported(self, programs, Path(into.name)))
        return self._made[2]

    def json(self, name: str) -> dict[str, Any]:
        """An empty table if the file is not there yet."""
        file = self.folder / name
        found: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
        return found

    def rows(self, after: int, began_ms: int) -> list[tuple[int, int, dict[str, float]]]:
        """Update, time in ms since 1970 and metrics of each evaluation after an update.

        The time follows from the beginning and the files, so that a row that is told twice is the same row to a server.
        """
        timing = {row["update"]: row for row in self._lines("timing.jsonl")}
        found = []
        for row in self._lines("metrics.jsonl"):
            update = int(row["update"])
            if update <= after or update not in timing:
                continue
            numbers = {key: value for key, value in (timing[update] | row).items() if isinstance(value, int | float) and key != "update"}
            elapsed_s = numbers.get("wall_s", 0.0) + numbers.get("evaluation_s", 0.0)
            values = {key: float(value) for key, value in numbers.items() if math.isfinite(value)}
            found.append((update, began_ms + int(1000 * elapsed_s), values))
        return found

    def ended(self) -> bool:
        """Whether there is a summary that is not older than the last evaluation."""
        summary, last = self.json("summary.json"), self._lines("metrics.jsonl")
        return bool(summary) and (not last or summary["updates"] >= last[-1]["update"])

    def configuration(self) -> dict[str, Any]:
        """Every key of every file of the configuration, named FILE.TABLE.KEY."""
        return {
            name: value
            for file in sorted((self.folder / "config").glob("*.toml"))
            for name, value in flatten(tomllib.loads(file.read_text()), file.stem)
        }

    def _lines(self, name: str) -> list[dict[str, Any]]:
        file = self.folder / name
        whole = file.read_text().rpartition("\n")[0] if file.exists() else ""  # a last line without its end is still being written
        return [json.loads(line) for line in whole.splitlines()]


class MlflowServer:
    """An experiment of an MLflow server."""

    name = "mlflow"

    def __init__(self, uri: str, experiment: str) -> None:
        os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "0")  # follow() tries again by itself
        os.environ.setdefault("MLFLOW_HTTP_REQUEST_TIMEOUT", "20")
        os.environ.setdefault("MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT", "true")
        try:
            import mlflow
        except ImportError as error:
            raise InputError("--mlflow: needs the package mlflow: pip install mlflow") from error
        self._entities = mlflow.entities
        self._client = mlflow.MlflowClient(tracking_uri=uri)
        self._experiment = experiment
        self.where = f"{uri}, experiment {experiment}"

    def begin(self, run: Run, key: str) -> str:
        """Returns the id of the run that has this key, which is made where there is none."""
        found = self._client.get_experiment_by_name(self._experiment)
        experiment = found.experiment_id if found else self._client.create_experiment(self._experiment)
        same = self._client.search_runs([experiment], f"tags.`flappy.follow` = '{key}'")
        if same:
            to = str(same[0].info.run_id)
            self._client.update_run(to, status="RUNNING")  # it may have been stopped, and resumed
            return to
        tags = {f"flappy.{name}": str(value) for name, value in run.json("run.json").items()} | {"flappy.follow": key}
        return str(self._client.create_run(experiment, run_name=run.name, tags=tags).info.run_id)

    def last(self, to: str, update: int) -> int:
        """The last update that is safe: all that were told."""
        return update

    def configuration(self, to: str, values: dict[str, Any]) -> None:
        """Tells the configuration."""
        params = [self._entities.Param(key, str(value)[:6000]) for key, value in values.items()]
        for k in range(0, len(params), 100):
            self._client.log_batch(to, params=params[k : k + 100])

    def rows(self, to: str, rows: list[tuple[int, int, dict[str, float]]]) -> None:
        """Tells evaluations, as Run.rows has them."""
        metrics = [self._entities.Metric(key, value, ms, update) for update, ms, values in rows for key, value in values.items()]
        for k in range(0, len(metrics), 1000):
            self._client.log_batch(to, metrics=metrics[k : k + 1000])

    def file(self, to: str, file: Path, folder: str) -> None:
        """Uploads a file into a folder of the run; "" is its root."""
        self._client.log_artifact(to, str(file), folder or None)

    def end(self, to: str, summary: dict[str, Any]) -> None:
        """Tells the summary of a training that has ended."""
        for key, value in flatten(summary, "summary"):
            if isinstance(value, int | float):
                self._client.log_metric(to, key, float(value), timestamp=0, step=int(summary["updates"]))
        self._client.set_terminated(to, "KILLED" if summary.get("stopped") else "FINISHED")

    def close(self) -> None:
        """Nothing is left open."""


def _has_wandb_key(wandb: Any) -> bool:
    try:
        return bool(wandb.login(prompt=False, verify=False))
    except TypeError:  # before 0.31, whose login() would ask
        return bool(wandb.api.api_key)


class WandbProject:
    """A project of Weights & Biases."""

    name = "wandb"

    def __init__(self, project: str, offline: bool) -> None:
        try:
            import wandb
        except ImportError as error:
            raise InputError("--wandb: needs the package wandb: pip install wandb") from error
        if not offline and not _has_wandb_key(wandb):
            raise InputError("--wandb: no API key; accepted: one of `wandb login`, or --offline")
        self._wandb, self._project, self._offline = wandb, project, offline
        self._runs: dict[str, Any] = {}
        self.where = f"{project}, offline" if offline else project

    def begin(self, run: Run, key: str) -> str:
        """Returns the id of the run, which is the key."""
        self._runs[key] = self._wandb.init(
            project=self._project,
            id=key,
            name=run.name,
            resume="allow",
            reinit="create_new",
            mode="offline" if self._offline else "online",
            dir=str(run.folder),
            config={"flappy": run.json("run.json")},
            settings=self._wandb.Settings(console="off", silent=True),
        )
        return key

    def last(self, to: str, update: int) -> int:
        """The last update that is safe: online the client may have lost what it was still sending when it was killed."""
        return update if self._offline else min(update, int(self._runs[to].starting_step) - 1)

    def configuration(self, to: str, values: dict[str, Any]) -> None:
        """Tells the configuration."""
        self._runs[to].config.update(values, allow_val_change=True)

    def rows(self, to: str, rows: list[tuple[int, int, dict[str, float]]]) -> None:
        """Tells evaluations, as Run.rows has them."""
        for update, _, values in rows:
            self._runs[to].log(values, step=update, commit=True)

    def file(self, to: str, file: Path, folder: str) -> None:
        """Uploads a file, as an artefact named RUN-FOLDER-FILE."""
        run = self._runs[to]
        artifact = self._wandb.Artifact(f"{run.name}-{(folder + '-' if folder else '') + file.name}", type=folder or "run")
        artifact.add_file(str(file))
        run.log_artifact(artifact)

    def end(self, to: str, summary: dict[str, Any]) -> None:
        """Tells the summary of a training that has ended; returns when all is written, or sent."""
        self._runs[to].summary.update(dict(flatten(summary, "summary")))
        self._runs.pop(to).finish()

    def close(self) -> None:
        """Writes, or sends, what is open."""
        for run in self._runs.values():
            run.finish()


Logger = MlflowServer | WandbProject


def _exported(run: Run, programs: Path | None, into: Path) -> list[tuple[Path, str]]:
    """Headers and page of a run that has ended, made by the programs where they are to be had; and the folder of each at the logger."""

    def program(name: str) -> str | None:
        return shutil.which(name, path=str(programs) if programs else None)

    found: list[tuple[Path, str]] = []
    export, report = program("flappy-export"), program("flappy-report")
    if not export or not report:
        print("flappy-export and flappy-report are not on PATH: headers and page are left out (--programs DIR)", file=sys.stderr)
        return found
    headers, page = into / "headers", into / "report.html"
    for command in ([export, str(run.folder), "--out", str(headers)], [report, str(run.folder), "--out", str(page)]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            reason = (done.stderr.strip().splitlines() or [f"ended with {done.returncode}"])[-1]
            print(f"{run.folder}: {Path(command[0]).name}: {reason}", file=sys.stderr)
    found += [(file, "headers") for file in sorted(headers.glob("*"))] if headers.exists() else []
    return found + ([(page, "")] if page.exists() else [])


def tell(run: Run, logger: Logger, programs: Path | None = None) -> bool:
    """Tells a logger what it does not know of a run yet.

    Args:
        run: The run folder.
        logger: Where to.
        programs: Folder of flappy-export and flappy-report; None: of PATH.

    Returns:
        Whether the training has ended and all of it is told.

    Raises:
        Exception: what the client raises where a server does not answer; what was told until then is kept.
    """
    file = run.folder / f"follow_{logger.name}.json"
    told: dict[str, Any] = {"where": logger.where, "key": "", "began_ms": 0, "configuration": False, "update": -1, "files": {}}
    told |= {"policy_s": 0.0, "ended": -1}  # time of the last upload of a policy; updates of the summary that was told
    if file.exists():
        told |= json.loads(file.read_text())
        if told["where"] != logger.where:
            raise InputError(f"{file}: this run is told to {told['where']}; delete the file to tell it to {logger.where} anew")

    def keep() -> None:
        new = file.with_suffix(".new")
        new.write_text(json.dumps(told, indent=1))
        new.replace(file)

    def upload(path: Path, folder: str) -> None:
        name = f"{folder}/{path.name}"
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        if told["files"].get(name) != digest:
            logger.file(run.to, path, folder)
            told["files"][name] = digest
            keep()

    if not run.json("run.json"):
        return False
    run.lock(logger.name)
    ended, summary = run.ended(), run.json("summary.json")
    if ended and told["ended"] == summary["updates"]:
        return True
    if not told["key"]:
        told["key"], told["began_ms"] = uuid.uuid4().hex[:16], int(1000 * (run.folder / "run.json").stat().st_mtime)
        keep()  # before it is used: whatever is lost from here on is found by it
    if not run.to:
        to = logger.begin(run, told["key"])
        told["update"] = logger.last(to, told["update"])
        run.to = to
    if not told["configuration"]:
        logger.configuration(run.to, run.configuration())
        told["configuration"] = True
        keep()
    for config in sorted((run.folder / "config").glob("*")):
        upload(config, "config")
    rows = run.rows(told["update"], told["began_ms"])
    for k in range(0, len(rows), 50):
        logger.rows(run.to, rows[k : k + 50])
        told["update"] = rows[min(k + 50, len(rows)) - 1][0]
        keep()
    best = run.folder / "best.json"
    if best.exists() and (ended or time.time() - told["policy_s"] >= POLICY_EVERY_S):
        upload(best, "policy")
        told["policy_s"] = time.time()
        keep()
    if not ended:
        return False
    for path, folder in run.made(programs, summary["updates"]) if best.exists() else []:
        upload(path, folder)
    logger.end(run.to, summary)
    run.to = ""
    told["ended"] = summary["updates"]
    keep()
    return True


def _runs_of(folder: Path, known: dict[Path, Run]) -> tuple[list[Run], bool]:
    """Runs of a folder so far, and whether more are to come: flappy-train --seeds makes one after another, then curve.csv."""
    seeds = sorted(folder.glob("seed_*"))
    runs = [known.setdefault(each, Run(each)) for each in seeds or [folder]]
    stopped = any(run.json("summary.json").get("stopped") for run in runs)
    return runs, bool(seeds) and not stopped and not (folder / "curve.csv").exists()


def follow(folders: list[Path], logger: Logger, every_s: float = 10.0, programs: Path | None = None) -> None:
    """Tells a logger of run folders, or of those of --seeds, until each training has ended; what a server misses, when it is back."""
    known: dict[Path, Run] = {}
    over: set[Path] = set()

    def look(run: Run) -> str:
        """Tells of a run; returns what is in the way."""
        try:
            if tell(run, logger, programs):
                over.add(run.folder)
                print(f"{run.folder}: told to {logger.where}", flush=True)
                return ""
            return "" if run.json("run.json") else "no run.json yet; it is waited for"
        except InputError:
            raise
        except Exception as error:  # whatever a client raises while its server is away
            reason = (str(error).strip().splitlines() or [""])[0][:200]
            return f"not told to {logger.where}; tried again every {every_s:g} s: {type(error).__name__}: {reason}"

    said: dict[Path, str] = {}
    try:
        while True:
            found = [_runs_of(folder, known) for folder in folders]
            for run in (run for runs, _ in found for run in runs if run.folder not in over):
                problem = look(run)
                if problem and said.get(run.folder) != problem:
                    print(f"{run.folder}: {problem}", file=sys.stderr, flush=True)
                said[run.folder] = problem
            if all(run.folder in over for runs, _ in found for run in runs) and not any(to_come for _, to_come in found):
                return
            time.sleep(every_s)
    finally:
        logger.close()


def main(arguments: list[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m flappy.follow", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="run folder of flappy-train, or that of --seeds")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument(
        "--mlflow", metavar="URI", help="tracking server, such as http://127.0.0.1:5000, or a database, such as sqlite:///mlflow.db"
    )
    where.add_argument("--wandb", metavar="PROJECT", help="project of Weights & Biases")
    parser.add_argument("--experiment", default="flappy", metavar="NAME", help="experiment of --mlflow (default: flappy)")
    parser.add_argument("--offline", action="store_true", help="--wandb writes below RUN/wandb, for `wandb sync`")
    parser.add_argument("--every", type=float, default=10.0, metavar="S", help="seconds between two looks (default: 10)")
    parser.add_argument("--programs", type=Path, metavar="DIR", help="folder of flappy-export and flappy-report (default: those of PATH)")
    args = parser.parse_args(arguments)
    try:
        if args.offline and not args.wandb:
            raise InputError("--offline: only with --wandb")
        if args.every <= 0:
            raise InputError(f"--every: {args.every:g}; accepted: more than 0 s")
        for run in args.runs:
            if not run.is_dir():
                raise InputError(f"{run}: no such folder; accepted: a run folder of flappy-train")
        logger: Logger = MlflowServer(args.mlflow, args.experiment) if args.mlflow else WandbProject(args.wandb, args.offline)
        follow(args.runs, logger, args.every, args.programs)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
