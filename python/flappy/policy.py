"""Policies that were trained or exported."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core


class Policy:
    """What acts upon observations: a run folder of `flappy-train`, a C header (.h), which is compiled, ONNX (.onnx) or TorchScript (.pt).

    ONNX and TorchScript files are read by the onnxruntime or torch of this Python, and raise their errors. `policy(observation)`: float32
    (n, observations) or (observations,), raw and in SI units, to float32 of as many rows: what is added to the controller's output or,
    without one, set: V and fractions of a beat. `env.unwrapped.to_action(...)` makes an action of it.

    A recurrent policy remembers `units` numbers of each row from call to call, in `memory`, float32 (n, units). `reset()` forgets them
    all before a flight, and `reset(rows)` those of rows whose flight begins, a boolean mask or indices. Of other policies, units is 0.

    Raises:
        InputError: one line, where a run folder or header is no policy, does not compile or fails its own test.
        ValueError: an observation that has another number of dimensions or, of a recurrent policy, of rows than it remembers.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path = Path(path)
        self._script: Any = None
        self._session: Any = None
        self.units = 0
        self.memory = np.zeros((0, 0), np.float32)
        if path.suffix == ".onnx":
            from onnxruntime import InferenceSession

            self._session = InferenceSession(str(path), providers=["CPUExecutionProvider"])
            self.units = sum(int(value.shape[1]) for value in self._session.get_inputs()[1:])
            return
        if path.suffix == ".pt":
            from torch import jit

            load: Any = jit.load
            self._script = load(str(path))
            units = getattr(self._script, "memory", 0)
            self.units = units if isinstance(units, int) else 0
            return
        sizes = {"OBS": 0, "ACT": 0}
        if path.suffix == ".h" and path.is_file():
            text = path.read_text(errors="replace")
            for name in sizes:
                if not (found := re.search(rf"#\s*define\s+FLAPPY_POLICY_{name}\s+(\d+)", text)) or int(found[1]) < 1:
                    raise _core.InputError(f"{path}: FLAPPY_POLICY_{name} is missing; accepted: a header of flappy-export")
                sizes[name] = int(found[1])
        self._own = _core.Policy(path, sizes["OBS"], sizes["ACT"])
        self.units = self._own.memory

    def __reduce__(self) -> tuple[Any, ...]:
        """Read again from its file."""
        return type(self), (self._path,)

    def reset(self, rows: Any = None) -> None:
        """Forgets what it remembers, of all rows or of these."""
        if rows is None:
            self.memory = self.memory[:0]
        elif len(self.memory):
            self.memory[rows] = 0

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Acts."""
        if np.ndim(observation) not in (1, 2):
            raise ValueError(f"observation: has {np.ndim(observation)} dimensions; accepted: (n, observations) or (observations,)")
        rows = np.atleast_2d(np.asarray(observation, np.float32))
        if self.units and not len(self.memory):
            self.memory = np.zeros((len(rows), self.units), np.float32)
        if self.units and len(self.memory) != len(rows):
            raise ValueError(f"observation: has {len(rows)} rows; accepted: {len(self.memory)}, as before, or reset() first")
        parts = [rows, self.memory] if self.units else [rows]
        action: NDArray[np.float32]
        if self._session is not None:
            names = [value.name for value in self._session.get_inputs()]
            action, *memory = self._session.run(None, dict(zip(names, parts, strict=True)))
        elif self._script is None:
            both = self._own.act(np.concatenate(parts, 1))
            width = both.shape[1] - self.units
            action, *memory = both[:, :width], both[:, width:]
        else:
            import torch

            with torch.no_grad():
                made = self._script(*map(torch.from_numpy, parts))
            action, *memory = (part.numpy() for part in (made if self.units else [made]))
        if self.units:
            self.memory = memory[0]
        return action if np.ndim(observation) == 2 else action[0]
