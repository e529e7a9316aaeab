#!/bin/bash
# MJX and a geom with fluidshape="ellipsoid".
# Expected: the forces of MuJoCo's ellipsoid model, or a refusal, as for other features that MJX lacks.
# Seen with mujoco-mjx 3.17.0: put_model() takes the model without a word, and forward() computes the forces of the
# inertia-box model, which MuJoCo itself computes for the same body without that attribute.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install mujoco==3.17.0 mujoco-mjx==3.17.0 jax==0.10.2 jaxlib==0.10.2 numpy==2.4.6
JAX_PLATFORMS=cpu "$work/venv/bin/python" - <<'PYTHON'
import warnings

import mujoco
import numpy
from mujoco import mjx

MODEL = """<mujoco><option gravity='0 0 0' density='1.2' viscosity='0'/><worldbody><body euler='0 -30 0'><freejoint/>
<inertial pos='0 0 0' mass='1e-4' diaginertia='2e-9 3e-9 4e-9'/>
<geom type='ellipsoid' size='0.005 0.002 0.00005' mass='0' fluidshape='ellipsoid' fluidcoef='0.5 0.25 1.5 1 1'/></body></worldbody></mujoco>"""


def setup(text):
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qvel[0] = 1
    mujoco.mj_forward(model, data)
    return model, data


model, data = setup(MODEL)
_, box = setup(MODEL.replace("fluidshape='ellipsoid' fluidcoef='0.5 0.25 1.5 1 1'", ""))
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    of_mjx = mjx.forward(mjx.put_model(model), mjx.put_data(model, data))
told = [str(w.message) for w in told if "fluid" in str(w.message).lower() or "ellipsoid" in str(w.message).lower()]
force = numpy.array(of_mjx.qfrc_passive[:3])
print("mujoco", mujoco.__version__, "ellipsoid, N:", data.qfrc_passive[:3])
print("mujoco", mujoco.__version__, "inertia box, N:", box.qfrc_passive[:3])
print("mujoco-mjx, the model with the ellipsoid, N:", force, "warnings of it:", told)
assert not told
assert numpy.allclose(force, box.qfrc_passive[:3], rtol=1e-4, atol=1e-12)  # MJX computes in float
assert not numpy.allclose(force, data.qfrc_passive[:3], rtol=0.5)
PYTHON
