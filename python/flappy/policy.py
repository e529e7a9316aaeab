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

    Raises:
        InputError: one line, where a run folder or header is no policy, does not compile or fails its own test.
        ValueError: an observation that has another number of dimensions.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = path = Path(path)
        self._script: Any = None
        self._session: Any = None
        if path.suffix == ".onnx":
            from onnxruntime import InferenceSession

            self._session = InferenceSession(str(path), providers=["CPUExecutionProvider"])
            return
        if path.suffix == ".pt":
            from torch import jit

            load: Any = jit.load
            self._script = load(str(path))
            return
        sizes = {"OBS": 0, "ACT": 0}
        if path.suffix == ".h" and path.is_file():
            text = path.read_text(errors="replace")
            for name in sizes:
                if not (found := re.search(rf"#\s*define\s+FLAPPY_POLICY_{name}\s+(\d+)", text)) or int(found[1]) < 1:
                    raise _core.InputError(f"{path}: FLAPPY_POLICY_{name} is missing; accepted: a header of flappy-export")
                sizes[name] = int(found[1])
        self._own = _core.Policy(path, sizes["OBS"], sizes["ACT"])

    def __reduce__(self) -> tuple[Any, ...]:
        """Read again from its file."""
        return type(self), (self._path,)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Acts."""
        if np.ndim(observation) not in (1, 2):
            raise ValueError(f"observation: has {np.ndim(observation)} dimensions; accepted: (n, observations) or (observations,)")
        rows = np.atleast_2d(np.asarray(observation, np.float32))
        action: NDArray[np.float32]
        if self._session is not None:
            action = self._session.run(None, {self._session.get_inputs()[0].name: rows})[0]
        elif self._script is None:
            action = self._own.act(rows)
        else:
            import torch

            with torch.no_grad():
                action = self._script(torch.from_numpy(rows)).numpy()
        return action if np.ndim(observation) == 2 else action[0]
