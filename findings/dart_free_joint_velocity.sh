#!/bin/bash
# The axes of the generalised velocity of DART's FreeJoint, of a body turned by 90 degrees about z.
# Expected: the same meaning in two minor releases of one major one.
# Seen: setVelocities([0, 0, 0, 1, 0, 0]) moves the body along its own x axis up to 6.16, along the world's from 6.17 on;
# the angular part likewise. No warning tells of it. getSpatialVelocity() and setSpatialVelocity() state their frames.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cat > "$work/axes.py" <<'PYTHON'
import sys
from importlib.metadata import version

import dartpy
import numpy

skeleton = dartpy.dynamics.Skeleton()
joint, body = skeleton.createFreeJointAndBodyNodePair()
joint.setPositions([0, 0, numpy.pi / 2, 0, 0, 0])  # body x is world y
joint.setVelocities([0, 0, 0, 1, 0, 0])
linear = body.getLinearVelocity()
joint.setVelocities([1, 0, 0, 0, 0, 0])
angular = body.getAngularVelocity()
print(f"dartpy {version('dartpy')}: in world axes, velocity {linear.round(6)}, angular velocity {angular.round(6)}")
expected = [0, 1, 0] if sys.argv[1] == "body" else [1, 0, 0]
assert numpy.allclose(linear, expected) and numpy.allclose(angular, expected)
PYTHON
for version in 6.16.7:body 6.17.0:world 6.20.0:world; do
  python3 -m venv "$work/venv"
  "$work/venv/bin/pip" -q install dartpy=="${version%:*}" numpy==2.4.6
  "$work/venv/bin/python" "$work/axes.py" "${version#*:}"
  rm -rf "$work/venv"
done
