"""Run folders that MLflow and Weights & Biases are told of."""

import json
import os
import shutil
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from flappy import follow

mlflow = pytest.importorskip("mlflow")
pytest.importorskip("wandb")

PROGRAMS = Path(__file__).parents[2] / "build" / "release" / "bin"
CONFIG = Path(__file__).parents[2] / "configs" / "train" / "quadrotor.toml"


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])


def serve(folder: Path, port: int) -> subprocess.Popen[bytes]:
    """A tracking server on loopback, once it answers."""
    store = ["--backend-store-uri", f"sqlite:///{folder}/store.db", "--artifacts-destination", str(folder / "artifacts")]
    server = subprocess.Popen(
        [sys.executable, "-m", "mlflow", "server", "--host", "127.0.0.1", "--port", str(port), "--workers", "1", *store],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    for _ in range(600):
        with socket.socket() as s:
            if s.connect_ex(("127.0.0.1", port)) == 0:
                return server
        time.sleep(0.1)
    raise AssertionError("the server does not come up")


def stop(server: subprocess.Popen[bytes]) -> None:
    os.killpg(server.pid, 15)
    server.wait()


class Growing:
    """A run folder that grows evaluation by evaluation, as flappy-train writes it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "config").mkdir(parents=True)
        (folder / "config" / "train.toml").write_text("seed = 3\n[learn]\nbatch = 128\n[[stage]]\nupdates = 5\n")
        (folder / "run.json").write_text('{"schema": 1, "task": "quadrotor", "seed": 3, "commit": "abc"}')
        self.update = 0

    def grow(self, rows: int) -> None:
        """More evaluations, 100 updates and 1 s apart."""
        for _ in range(rows):
            self.update += 100
            with (self.folder / "metrics.jsonl").open("a") as metrics, (self.folder / "timing.jsonl").open("a") as timing:
                timing.write(json.dumps({"update": self.update, "wall_s": self.update / 100, "evaluation_s": 0.5}) + "\n")
                metrics.write(json.dumps({"update": self.update, "success_rate": self.update / 1e4, "critic_loss": None}) + "\n")

    def end(self) -> None:
        """The training has ended."""
        (self.folder / "summary.json").write_text(json.dumps({"updates": self.update, "best_success_rate": 0.5, "stopped": False}))


@pytest.fixture
def growing(tmp_path: Path) -> Growing:
    return Growing(tmp_path / "run")


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("trained") / "run"
    short = [f"--set={one}" for one in ("learn.updates=600", "evaluate.every=150", "evaluate.vehicles=32", "checkpoint.every=600")]
    subprocess.run([PROGRAMS / "flappy-train", CONFIG, "--out", folder, *short], check=True, capture_output=True)
    yield folder


def records(data: bytes) -> Iterator[bytes]:
    """Records of W&B's file: LevelDB's log format after a head of 7 bytes."""
    at, whole = 7, b""
    while at + 7 <= len(data):
        if 32768 - at % 32768 < 7:  # a block's end is padded
            at += 32768 - at % 32768
            continue
        _, length, kind = struct.unpack_from("<IHB", data, at)
        whole += data[at + 7 : at + 7 + length]
        at += 7 + length
        if kind in (1, 4):  # full, last; 2 and 3 go on
            yield whole
            whole = b""


def command(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-m", "flappy.follow", *map(str, arguments)]


def test_a_server_that_is_away_misses_nothing(growing: Growing, tmp_path: Path) -> None:
    """The server comes late, goes and returns; the follower is killed and started again."""
    port = free_port()
    uri = f"http://127.0.0.1:{port}"
    growing.grow(3)
    err = (tmp_path / "err").open("w+")

    def start() -> subprocess.Popen[bytes]:
        return subprocess.Popen(command(growing.folder, "--mlflow", uri, "--every", "0.3"), stderr=err)

    def wait_until_told(update: int) -> None:
        state = growing.folder / "follow_mlflow.json"
        for _ in range(600):
            if state.exists() and json.loads(state.read_text())["update"] >= update:
                return
            time.sleep(0.1)
        raise AssertionError(f"update {update} is not told; {Path(err.name).read_text()}")

    follower = start()
    time.sleep(8)  # imports, and some attempts without a server
    assert follower.poll() is None
    server = serve(tmp_path, port)
    wait_until_told(300)
    assert f"not told to {uri}, experiment flappy; tried again every 0.3 s: " in Path(err.name).read_text()
    stop(server)
    growing.grow(4)
    time.sleep(2)
    assert follower.poll() is None
    follower.kill()
    follower.wait()
    server = serve(tmp_path, port)
    try:
        follower = start()
        wait_until_told(700)
        growing.grow(120)
        growing.end()
        assert follower.wait(60) == 0
        state = json.loads((growing.folder / "follow_mlflow.json").read_text())
        client = mlflow.MlflowClient(tracking_uri=uri)
        runs = client.search_runs([client.get_experiment_by_name("flappy").experiment_id])
        assert [run.data.tags["flappy.follow"] for run in runs] == [state["key"]]
        to = runs[0].info.run_id
        run = client.get_run(to)
        history = client.get_metric_history(to, "success_rate")
        assert [row.step for row in history] == [100 * k for k in range(1, 128)]
        assert [row.value for row in history] == pytest.approx([0.01 * k for k in range(1, 128)])
        assert history[1].timestamp - history[0].timestamp == 1000
        assert run.data.params == {"train.seed": "3", "train.learn.batch": "128", "train.stage.0.updates": "5"}
        assert run.data.tags["flappy.commit"] == "abc"
        assert run.data.metrics["summary.best_success_rate"] == 0.5
        assert run.info.status == "FINISHED"
        before = client.get_run(to).data
        subprocess.run(command(growing.folder, "--mlflow", uri), check=True, capture_output=True)
        assert client.get_run(to).data.to_dictionary() == before.to_dictionary()
        assert len(client.get_metric_history(to, "success_rate")) == 127
    finally:
        stop(server)


def test_a_training_is_told_whole(trained: Path, tmp_path: Path) -> None:
    port = free_port()
    uri = f"http://127.0.0.1:{port}"
    run = tmp_path / "run"
    shutil.copytree(trained, run)
    server = serve(tmp_path, port)
    try:
        subprocess.run(command(run, "--mlflow", uri, "--programs", PROGRAMS), check=True)
        client = mlflow.MlflowClient(tracking_uri=uri)
        (only,) = client.search_runs([client.get_experiment_by_name("flappy").experiment_id])
        to = only.info.run_id

        def names(path: str = "") -> list[str]:
            return [file.path for file in client.list_artifacts(to, path or None)]

        assert names() == ["config", "headers", "policy", "report.html"]
        assert "headers/flappy_policy.h" in names("headers")
        assert len(names("config")) == len(list((run / "config").iterdir()))
        here = Path(client.download_artifacts(to, "policy/best.json", str(tmp_path)))
        assert here.read_bytes() == (run / "best.json").read_bytes()
        assert len(client.get_metric_history(to, "success_rate")) == len((run / "metrics.jsonl").read_text().splitlines())
    finally:
        stop(server)


def test_seeds_are_followed_as_they_come(tmp_path: Path) -> None:
    """flappy-train --seeds makes the second folder when the first has ended; a stopped training is followed on when it is resumed."""
    first = Growing(tmp_path / "five" / "seed_0")
    first.grow(2)
    first.end()
    uri = f"sqlite:///{tmp_path}/store.db"
    follower = subprocess.Popen(command(tmp_path / "five", "--mlflow", uri, "--every", "0.2"), cwd=tmp_path)
    for _ in range(300):
        if (first.folder / "follow_mlflow.json").exists() and json.loads((first.folder / "follow_mlflow.json").read_text())["ended"] == 200:
            break
        time.sleep(0.1)
    second = subprocess.run(command(first.folder, "--mlflow", uri), cwd=tmp_path, capture_output=True, text=True)
    assert second.returncode == 2 and "another flappy.follow tells mlflow of this run" in second.stderr
    assert follower.poll() is None
    later = Growing(tmp_path / "five" / "seed_1")
    later.grow(3)
    later.end()
    (tmp_path / "five" / "curve.csv").write_text("")
    assert follower.wait(60) == 0
    (first.folder / "summary.json").unlink()  # as --resume does
    first.grow(3)
    first.end()
    subprocess.run(command(tmp_path / "five", "--mlflow", uri), check=True, cwd=tmp_path)
    client = mlflow.MlflowClient(tracking_uri=uri)
    runs = {run.info.run_name: run.info.run_id for run in client.search_runs([client.get_experiment_by_name("flappy").experiment_id])}
    assert sorted(runs) == ["five-seed_0", "five-seed_1"]
    steps = {name: [row.step for row in client.get_metric_history(to, "success_rate")] for name, to in runs.items()}
    assert steps == {"five-seed_0": [100, 200, 300, 400, 500], "five-seed_1": [100, 200, 300]}


def test_wandb_offline_has_all_of_it(trained: Path, tmp_path: Path) -> None:
    from wandb.proto import wandb_internal_pb2

    run = tmp_path / "run"
    shutil.copytree(trained, run)
    subprocess.run(command(run, "--wandb", "robots", "--offline", "--programs", PROGRAMS), check=True)
    (file,) = run.glob("wandb/offline-run-*/*.wandb")
    steps, files = [], []
    for data in records(file.read_bytes()):
        record = wandb_internal_pb2.Record()
        record.ParseFromString(data)
        if record.WhichOneof("record_type") == "history":
            keys = {item.key or ".".join(item.nested_key): item.value_json for item in record.history.item}
            steps += [int(keys["_step"])] if "success_rate" in keys else []
        if record.WhichOneof("record_type") == "request" and record.request.WhichOneof("request_type") == "log_artifact":
            files.append(record.request.log_artifact.artifact.name)
        if record.WhichOneof("record_type") == "artifact":
            files.append(record.artifact.name)
    assert steps == [json.loads(line)["update"] for line in (run / "metrics.jsonl").read_text().splitlines()]
    assert {"run-policy-best.json", "run-report.html", "run-headers-flappy_policy.h", "run-config-train.toml"} <= set(files)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["nowhere", "--mlflow", "http://127.0.0.1:1"], "error: nowhere: no such folder; accepted: a run folder of flappy-train"),
        ([".", "--mlflow", "http://127.0.0.1:1", "--offline"], "error: --offline: only with --wandb"),
        ([".", "--wandb", "p", "--offline", "--every", "0"], "error: --every: 0; accepted: more than 0 s"),
    ],
)
def test_mistakes_get_one_line(arguments: list[str], line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert follow.main(arguments) == 2
    assert capsys.readouterr().err == line + "\n"


def test_wandb_needs_a_key_or_offline(tmp_path: Path) -> None:
    stranger = {name: value for name, value in os.environ.items() if not name.startswith("WANDB_")} | {"HOME": str(tmp_path)}
    refused = subprocess.run(command(tmp_path, "--wandb", "robots"), env=stranger, capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert refused.stderr == "error: --wandb: no API key; accepted: one of `wandb login`, or --offline\n"
    found = "import wandb; from flappy import follow; print(follow._has_wandb_key(wandb))"
    key = {"WANDB_API_KEY": "0123456789" * 4}
    assert subprocess.run([sys.executable, "-c", found], env=stranger | key, capture_output=True, text=True, check=True).stdout == "True\n"


def test_another_server_is_refused(growing: Growing, capsys: pytest.CaptureFixture[str]) -> None:
    (growing.folder / "follow_mlflow.json").write_text('{"where": "http://other", "to": "1"}')
    assert follow.main([str(growing.folder), "--mlflow", "http://127.0.0.1:1"]) == 2
    assert "is told to http://other; delete the file" in capsys.readouterr().err


def test_a_line_that_is_being_written_waits(growing: Growing) -> None:
    growing.grow(2)
    with (growing.folder / "metrics.jsonl").open("a") as metrics:
        metrics.write('{"update": 300, "succ')
    assert [update for update, _, _ in follow.Run(growing.folder).rows(-1, 0)] == [100, 200]
    assert [update for update, _, _ in follow.Run(growing.folder).rows(100, 0)] == [200]
