#!/bin/bash
# A C3D with 70,000 frames, written and read by ezc3d, and read by c3d: two minutes of a camera at 500 Hz.
# Expected: as many frames as were written. The format counts them in 16 bits, and has POINT:LONG_FRAMES and
# TRIAL:ACTUAL_END_FIELD for more.
# Seen: ezc3d reads back 65,535 frames, without a warning; the other 4,465 are in the file. c3d, with NumPy 2, reads none
# of the same file: the number after the last frame overflows its 16 bits.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
cat > "$work/long.py" <<'PYTHON'
import os
import sys
import warnings
from importlib.metadata import version

import c3d
import ezc3d
import numpy

warnings.simplefilter("ignore")
frames, path = 70000, sys.argv[1]
file = ezc3d.c3d()
file["parameters"]["POINT"]["RATE"]["value"] = [500.0]
file["parameters"]["POINT"]["LABELS"]["value"] = ["wing_tip"]
points = numpy.ones((4, 1, frames))
points[0, 0] = numpy.arange(frames)
file["data"]["points"] = points
file.write(path)
read = ezc3d.c3d(path)["data"]["points"].shape[2]
with open(path, "rb") as stream:
    others = sum(1 for _ in c3d.Reader(stream).read_frames())
print(f"ezc3d {version('ezc3d')}: {frames} frames written, {read} read, of {os.path.getsize(path)} bytes")
print(f"c3d {version('c3d')}, numpy {version('numpy')}: {others} read")
assert os.path.getsize(path) > 16 * frames and read == 65535 and others == 0
PYTHON
"$work/venv/bin/python" "$work/long.py" "$work/long.c3d"
