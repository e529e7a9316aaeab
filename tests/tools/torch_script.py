"""policy.pt in Python's torch: the same actions as those of flappy_policy.h beside it, which are the trained actor's.

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
void step(const float *observation, float *action) { flappy_policy_step(observation, action); }
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
    inputs, outputs = header.inputs(), header.outputs()

    policy = torch.jit.load(str(folder / "policy.pt"))
    torch.manual_seed(1)
    half = dict(policy.named_buffers())["half"]  # half of each output's range; a module's own half is a method
    observation = policy.mean + BEYOND * (2 * torch.rand(ROWS, inputs) - 1) / policy.scale
    observation[0, 0] = float("nan")  # adds nothing
    wanted = []
    for row in observation.tolist():
        action = (ctypes.c_float * outputs)()
        header.step((ctypes.c_float * inputs)(*row), action)
        wanted.append(list(action))
    wanted = torch.tensor(wanted)
    action = policy(observation)

    assert action.shape == (ROWS, outputs), action.shape
    assert not action[0].any(), action[0]
    assert (wanted.std(0) > 0.01 * half).all(), "the observations move no output"
    difference = (action - wanted).abs()
    print(f"torch {torch.__version__}: differs by at most {difference.max():.2g} of {2 * half.max():.2g}")
    assert (difference <= OF_RANGE * 2 * half).all(), difference.max(0)


for name in sys.argv[1:]:
    check(Path(name))
