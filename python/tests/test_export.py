"""flappy.export: a torch module as C, compared with the module by a compiler of its own."""

import ctypes
import itertools
import subprocess
from pathlib import Path

import numpy as np
import pytest

import flappy

torch = pytest.importorskip("torch")
TASK = "fly/hover_direct.toml"


def module(*widths: int) -> "torch.nn.Sequential":
    torch.manual_seed(1)
    layers = [layer for n, m in itertools.pairwise(widths) for layer in (torch.nn.Linear(n, m), torch.nn.Tanh())]
    return torch.nn.Sequential(*layers)


@pytest.fixture
def sizes() -> tuple[int, int]:
    with pytest.raises(ValueError, match="accepted: ") as refused:
        flappy.export(module(2, 1), TASK, "none")
    inputs, outputs = str(refused.value).split("accepted: ")[1].split(",")[0].split(" to ")
    return int(inputs), int(outputs)


def test_c_computes_what_the_module_does(sizes: tuple[int, int], tmp_path: Path) -> None:
    policy = module(sizes[0], 16, sizes[1])
    said = flappy.export(policy, TASK, tmp_path, mean=np.full(sizes[0], 0.25), scale=np.full(sizes[0], 0.5), clip=2)
    assert {Path(f).name for f in said["files"]} >= {"flappy_policy.h", "contract.json", "README.md"}
    assert said["largest_difference"] < 1e-4
    assert [(row["available"], row["failed"], row["differing"]) for row in said["parity"]] == [(True, False, 0)]
    assert said["parity"][0]["outputs"] > 100
    # by a compiler and a caller that the package does not know
    caller = b'#include "flappy_policy.h"\nvoid act(const float *o, float *a) { flappy_policy_step(o, a); }\n'
    library = tmp_path / "act.so"
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-I", tmp_path, "-x", "c", "-", "-o", library, "-lm"], input=caller, check=True)
    observation = np.random.default_rng(1).normal(0, 3, (50, sizes[0])).astype(np.float32)
    action = np.zeros((50, sizes[1]), np.float32)
    act = ctypes.CDLL(str(library)).act
    for row, result in zip(observation, action, strict=True):
        act(row.ctypes.data_as(ctypes.c_void_p), result.ctypes.data_as(ctypes.c_void_p))
    with torch.no_grad():
        wanted = policy(torch.from_numpy(np.clip((observation - 0.25) * 0.5, -2, 2).astype(np.float32))).numpy()
    # the header gives inputs of the vehicle: those of the module, of [-1, 1], between two ends
    middle, half = action.mean(0) - wanted.mean(0), action.std(0) / wanted.std(0)
    assert (half > 0).all(), middle
    assert np.allclose(action - action.mean(0), (wanted - wanted.mean(0)) * half, atol=1e-4 * half.max())


def test_refuses_what_it_cannot_write(sizes: tuple[int, int], tmp_path: Path) -> None:
    inputs, outputs = sizes
    with pytest.raises(ValueError, match=r"makes \d+ observations to \d+ actions; accepted: "):
        flappy.export(module(inputs + 1, outputs), TASK, tmp_path / "out")
    with pytest.raises(ValueError, match="mean: is of shape"):
        flappy.export(module(inputs, outputs), TASK, tmp_path / "out", mean=np.zeros(inputs + 1))
    with pytest.raises(ValueError, match="layer 1 is GELU"):
        flappy.export(torch.nn.Sequential(torch.nn.Linear(inputs, 4), torch.nn.GELU(), torch.nn.Linear(4, outputs)), TASK, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_without_a_compiler_nothing_is_proven(sizes: tuple[int, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.warns(UserWarning, match="flappy_policy.h is not proven: cc is not in PATH"):
        said = flappy.export(module(*sizes), TASK, tmp_path / "out")
    assert (tmp_path / "out/flappy_policy.h").exists()
    assert [row["available"] for row in said["parity"]] == [False]
    with pytest.raises(ValueError, match="everywhere: there is no compiler in PATH; accepted: a C compiler"):
        flappy.export(module(*sizes), TASK, tmp_path / "other", everywhere=True)
    assert not (tmp_path / "other").exists()
