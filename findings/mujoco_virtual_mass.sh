#!/bin/bash
# The virtual mass of MuJoCo's ellipsoid fluid model, on a thin disc of radius 0.1 m in water, without drag or lift.
# Expected: both parts of Kirchhoff's equations. Its virtual mass, 8/3 density radius^3 = 2.67 kg (Lamb), slows the disc down when it is
# pushed along its normal; and moving obliquely at 1 m/s and 1 m/s it feels Munk's moment, virtual mass times both speeds, 2.67 N m.
# Seen: the moment is there, the inertia is not: pushed by 1 N, a disc of 0.1 kg accelerates by 10 m/s^2 in water as in a vacuum. A model whose
# wing relies on `fluidshape` has the products of added mass without added mass.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat > "$work/disc.py" <<'PYTHON'
import mujoco

MODEL = """<mujoco><option gravity='0 0 0' density='{}' viscosity='0'/><worldbody><body><freejoint/>
<inertial pos='0 0 0' mass='0.1' diaginertia='2e-4 2e-4 4e-4'/>
<geom type='ellipsoid' size='0.1 0.1 0.0005' mass='0' fluidshape='ellipsoid' fluidcoef='0 0 0 0 0'/></body></worldbody></mujoco>"""


def answer(density, velocity, force):
    model = mujoco.MjModel.from_xml_string(MODEL.format(density))
    data = mujoco.MjData(model)
    data.qvel[0], data.qvel[2] = velocity
    data.xfrc_applied[1, 2] = force
    mujoco.mj_forward(model, data)
    return data.qacc[2], data.qfrc_passive[4]


pushed = [answer(density, (0, 0), 1)[0] for density in (0, 1000)]
moment = answer(1000, (1, 1), 0)[1]
print(f"mujoco {mujoco.__version__}: pushed {pushed[0]:.3f} m/s^2 in a vacuum, {pushed[1]:.3f} in water; moment {moment:.3f} N m")
assert abs(pushed[0] - 10) < 1e-6 and abs(pushed[1] - 10) < 1e-6
assert abs(abs(moment) - 8 / 3) < 0.1
PYTHON
for version in 2.3.7 3.17.0; do
  python3 -m venv "$work/venv"
  "$work/venv/bin/pip" -q install mujoco=="$version" numpy==2.4.6
  "$work/venv/bin/python" "$work/disc.py"
  rm -rf "$work/venv"
done
