#!/bin/bash
# The Kutta lift of MuJoCo's ellipsoid fluid model on a plate of 10 mm x 4 mm x 0.1 mm at 1 m/s and 30 degrees, an insect's wing.
# Expected: lift grows with the square of the speed, and is of the order of density * speed^2 * area (here 3e-5 N).
# Seen: up to 3.13 it is some hundred thousand times smaller, and grows with a higher power, because a denominator in
# m^8 has a floor of 1e-15; from 3.14 on it is as expected.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat > "$work/lift.py" <<'PYTHON'
import sys

import mujoco

MODEL = """<mujoco><option gravity='0 0 0' density='1.2' viscosity='0'/><worldbody><body euler='0 -30 0'><freejoint/>
<inertial pos='0 0 0' mass='1e-4' diaginertia='1e-9 1e-9 1e-9'/>
<geom type='ellipsoid' size='0.005 0.002 0.00005' mass='0' fluidshape='ellipsoid' fluidcoef='0 0 0 1 0'/></body></worldbody></mujoco>"""


def lift(speed):
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.qvel[0] = speed
    mujoco.mj_forward(model, data)
    return data.qfrc_passive[2]


slow, fast = lift(1), lift(2)
print(f"mujoco {mujoco.__version__}: {slow:.3e} N at 1 m/s, {fast / slow:.4g} times as much at 2 m/s")
has_floor = sys.argv[1] == "floor"
assert (slow < 1e-9 and fast / slow > 16) if has_floor else (1e-5 < slow < 1e-4 and abs(fast / slow - 4) < 1e-6)
PYTHON
for version in 2.3.7:floor 3.13.0:floor 3.14.0:none 3.17.0:none; do
  python3 -m venv "$work/venv"
  "$work/venv/bin/pip" -q install mujoco=="${version%:*}" numpy==2.4.6
  "$work/venv/bin/python" "$work/lift.py" "${version#*:}"
  rm -rf "$work/venv"
done
