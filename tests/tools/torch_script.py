"""policy.pt in Python's torch: the same actions as those of flappy_policy.h beside it, which are the trained actor's.

A memory is that of torch's own GRUCell with the same weights.

python3 torch_script.py FOLDER..., which flappy-export left.
"""

import ctypes
import subprocess
import sys
import tempfile
from pathlib import Path

import torch

WRAPPER = """#include "flappy_policy.h"
int inputs(void) { return FLAPPY_POLICY_OBS; }
int outputs(void) { return FLAPPY_POLICY_ACT; }
int units(void) { return FLAPPY_POLICY_MEMORY; }
void step(const float *in, float *out) { flappy_policy_of(in, out); }
"""
ROWS = 2000
BEYOND = 12.0  # observations are clipped at 10
OF_RANGE = 1e-5  # as flappy-export allows: sums of single precision in another order


def check(folder):
    with tempfile.TemporaryDirectory() as work:
        library = f"{work}/policy.so"
        subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-I", folder, "-x", "c", "-", "-o", library, "-lm"],
                       input=WRAPPER, text=True, check=True)
        header = ctypes.CDLL(library)
    inputs, outputs, units = header.inputs(), header.outputs(), header.units()

    policy = torch.jit.load(str(folder / "policy.pt"))
    torch.manual_seed(1)
    half = dict(policy.named_buffers())["half"]  # half of each output's range; a module's own half is a method
    observation = policy.mean + BEYOND * (2 * torch.rand(ROWS, inputs) - 1) / policy.scale
    observation[0, 0] = float("nan")  # adds nothing
    memory = 2 * torch.rand(ROWS, units) - 1
    wanted = []
    for row in torch.cat([observation, memory], 1).tolist():
        out = (ctypes.c_float * (outputs + units))()
        header.step((ctypes.c_float * (inputs + units))(*row), out)
        wanted.append(list(out))
    wanted, remembered = torch.tensor(wanted).split([outputs, units], 1)
    action = policy(observation) if units == 0 else check_memory(policy, observation, memory, remembered)

    assert action.shape == (ROWS, outputs), action.shape
    assert not action[0].any(), action[0]
    assert (wanted.std(0) > 0.01 * half).all(), "the observations move no output"
    difference = (action - wanted).abs()
    print(f"torch {torch.__version__}: differs by at most {difference.max():.2g} of {2 * half.max():.2g}")
    assert (difference <= OF_RANGE * 2 * half).all(), difference.max(0)


def check_memory(policy, observation, memory, remembered):
    """Checks the next memory, and returns the action."""
    action, after = policy(observation, memory)
    weights = dict(policy.named_parameters())
    cell = torch.nn.GRUCell(observation.shape[1], memory.shape[1])
    with torch.no_grad():
        for name, of in ("ih", "seen"), ("hh", "kept"):
            getattr(cell, f"weight_{name}").copy_(weights[f"weight_{of}"].T)
            getattr(cell, f"bias_{name}").copy_(weights[f"bias_{of}"])
        clipped = ((observation - policy.mean) * policy.scale).clamp(-10, 10)
        own = cell(clipped, memory)
    own[0] = memory[0]  # the policy refuses an observation with a NaN and keeps its memory
    for name, is_ in ("policy.pt", after), ("flappy_policy.h", remembered):
        assert (is_ - own).abs().max() <= OF_RANGE, (name, (is_ - own).abs().max())
    return action


for name in sys.argv[1:]:
    check(Path(name))
