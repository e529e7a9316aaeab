"""A policy of any Python library as a C header for a microcontroller, proven before it is written."""

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _core

#: Largest difference to the module that is let pass, of the range [-1, 1] of an action: rounding in another order of sums.
TOLERANCE = 1e-4

_HIDDEN = {"ReLU": "relu", "Tanh": "tanh", "ELU": "elu", "SiLU": "silu"}
_ACCEPTED = "Linear layers with ReLU, Tanh, ELU or SiLU between them, LayerNorm before these, and Tanh, Hardtanh or nothing at the end"


def _flat(module: Any) -> list[Any]:
    """The layers of a module in the order in which Sequential calls them; what does nothing in evaluation is left out."""
    if type(module).__name__ == "Sequential":
        return [layer for child in module for layer in _flat(child)]
    return [] if type(module).__name__ in ("Identity", "Flatten", "Dropout") else [module]


def _network(module: Any) -> dict[str, Any]:
    """Widths, activation and weights of a torch module, as an actor has them."""

    def refuse(what: str) -> ValueError:
        return ValueError(f"module: {what}; accepted: torch.nn.Sequential of {_ACCEPTED}")

    def numbers(tensor: Any) -> Any:
        return tensor.detach().cpu().double().numpy()

    layers = _flat(module)
    names = [type(layer).__name__ for layer in layers]
    widths: list[int] = []
    weights: list[Any] = []
    hidden: set[str] = set()
    norms = 0
    last = max((k for k, name in enumerate(names) if name == "Linear"), default=-1)
    for k, (layer, name) in enumerate(zip(layers, names, strict=True)):
        before = names[k - 1] if k else ""
        if name == "Linear":
            if before in ("Linear", "LayerNorm"):
                raise refuse(f"layer {k} is Linear right after {before}")
            if widths and widths[-1] != layer.in_features:
                raise refuse(f"layer {k} has {layer.in_features} inputs after {widths[-1]} outputs")
            widths += [layer.out_features] if widths else [layer.in_features, layer.out_features]
            bias = numbers(layer.bias) if layer.bias is not None else np.zeros(layer.out_features)
            weights.append(np.concatenate([bias[:, None], numbers(layer.weight)], axis=1).ravel())
        elif name == "LayerNorm" and before == "Linear" and k < last:
            if abs(layer.eps - 1e-5) > 1e-12 or layer.weight is None or layer.bias is None:
                raise refuse(f"layer {k} is LayerNorm with eps = {layer.eps} or without weight and bias; of it eps = 1e-5 with both")
            norms += 1
            weights += [numbers(layer.weight), numbers(layer.bias)]
        elif name in _HIDDEN and before in ("Linear", "LayerNorm") and k < last:
            if name == "ELU" and layer.alpha != 1:
                raise refuse(f"layer {k} is ELU with alpha = {layer.alpha}; of it alpha = 1")
            hidden.add(_HIDDEN[name])
        elif not (k == last + 1 and name in ("Tanh", "Hardtanh") and before == "Linear"):
            raise refuse(f"layer {k} is {name}" + (f" after {before}" if before else ""))
    inner = len(widths) - 2
    if inner < 0:
        raise refuse("it has no Linear layer")
    if len(hidden) > 1 or sum(name in _HIDDEN for name in names[: last + 1]) != inner or norms not in (0, inner):
        raise refuse("hidden layers differ in their activation or LayerNorm: one kind for all")
    if names[-1] == "Hardtanh" and (layers[-1].min_val, layers[-1].max_val) != (-1, 1):
        raise refuse("Hardtanh has other ends than -1 and 1")
    return {
        "widths": widths,
        "hidden": hidden.pop() if hidden else "relu",
        "layer_norm": norms > 0,
        "linear": names[-1] != "Tanh",
        "weights": np.concatenate(weights).tolist(),
    }


def export(
    module: Any,
    task: Any,
    out: str | Path,
    *,
    overrides: Sequence[str] = (),
    mean: ArrayLike | None = None,
    scale: ArrayLike | None = None,
    clip: float = 1e30,
    everywhere: bool = False,
) -> dict[str, Any]:
    """Writes flappy_policy.h, contract.json, README.md and, where the task has a controller that can be exported, flappy_controller.h.

    Args:
        module: a torch.nn.Sequential from observations (n, observations) to actions (n, actions) in [-1, 1]. What it makes beyond that
            is clipped, as environments of many libraries do.
        task: configuration of flappy-fly, as a file or one of the package's own ("fly/hover_direct.toml"), or an environment of it.
        out: folder.
        overrides: as `--set` takes them; an environment has its own.
        mean: (observations,): the module sees clip((observation - mean) * scale, -clip, clip), as running normalisation leaves it.
        scale: (observations,).
        clip: the end of both sides.
        everywhere: proves on every gcc and clang at hand and on a Cortex-M4F, not on `cc` alone.

    Returns:
        "files"; "largest_difference" to the module on observations of 64 flights, of [-1, 1]; "parity", a row for each compiler:
        numbers compared ("outputs") and those of which a bit differs ("differing": none). Without a compiler it warns, and the row
        has "available": False.

    Raises:
        ValueError: a module that cannot be exported, or of other sizes than the task's; `everywhere` without a compiler.
        RuntimeError: what was exported does not compute what the module does; nothing is written.
    """
    import torch

    if not isinstance(task, str | Path):
        own = task.unwrapped
        task, overrides = own.config, own.overrides
    network = _network(module)
    inputs, outputs = _core.task_sizes(Path(task), list(overrides))
    if (network["widths"][0], network["widths"][-1]) != (inputs, outputs):
        made = f"{network['widths'][0]} observations to {network['widths'][-1]} actions"
        raise ValueError(f"module: makes {made}; accepted: {inputs} to {outputs}, as the task has")
    shift = np.zeros(inputs) if mean is None else np.asarray(mean, np.float64)
    factor = np.ones(inputs) if scale is None else np.asarray(scale, np.float64)
    for name, given in (("mean", shift), ("scale", factor)):
        if given.shape != (inputs,) or not np.isfinite(given).all():
            raise ValueError(f"{name}: is of shape {given.shape}; accepted: finite numbers of shape ({inputs},)")
    result = _core.Export(Path(task), list(overrides), **network, mean=shift.tolist(), scale=factor.tolist(), clip=float(clip))
    observation, action = result.flown()
    seen = np.clip((observation - shift.astype(np.float32)) * factor.astype(np.float32), -clip, clip).astype(np.float32)
    parameter = next(module.parameters())
    training = module.training
    module.eval()
    with torch.no_grad():
        wanted = module(torch.from_numpy(seen).to(parameter.device, parameter.dtype)).float().cpu().numpy()
    module.train(training)
    largest = float(np.abs(np.clip(wanted, -1, 1) - action).max())
    if not largest <= TOLERANCE:
        raise RuntimeError(f"the header differs from the module by {largest:.2g}; nothing is written")
    parity = json.loads(result.prove(everywhere))
    if not any(row["available"] for row in parity):
        warnings.warn("flappy_policy.h is not proven: cc is not in PATH; its self-test is to pass on the target", stacklevel=2)
    return {"files": result.write(Path(out)), "largest_difference": largest, "parity": parity}
