#!/bin/bash
# The residual of a point of a C3D file that two cameras saw, read by ezc3d and by c3d.
# Expected (c3d.org, The C3D File Format, 3D data): of the fourth word of a point the lower byte is the residual, in units
# of POINT:SCALE, and the upper one has a bit for each camera. Here 6 x 0.5 mm = 3 mm, and cameras 1 and 2.
# Seen: c3d reads 3 mm. ezc3d takes the upper byte for the residual and the lower one for the cameras: 1.5 mm, and cameras
# 2 and 3. So whoever leaves out points by their residual leaves out others. Integers and floats alike.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
cat > "$work/residual.py" <<'PYTHON'
import io
import struct
import sys
from importlib.metadata import version

import c3d
import ezc3d


def group(number, name):
    return struct.pack("<bb", len(name), -number) + name.encode() + struct.pack("<H", 3) + b"\0"


def parameter(number, name, kind, sizes, data):
    rest = struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + data + b"\0"
    return struct.pack("<bb", len(name), number) + name.encode() + struct.pack("<H", len(rest) + 2) + rest


def file_of_one_point(real, scale_mm=0.5, residual=6, cameras=0b11):
    stored = -scale_mm if real else scale_mm
    of_point = [("USED", 2, [], struct.pack("<H", 1)), ("FRAMES", 2, [], struct.pack("<H", 2)), ("DATA_START", 2, [], struct.pack("<H", 3)),
                ("SCALE", 4, [], struct.pack("<f", stored)), ("RATE", 4, [], struct.pack("<f", 100)),
                ("LABELS", -1, [12, 1], b"nose".ljust(12)), ("UNITS", -1, [2, 1], b"mm")]
    of_analog = [("USED", 2, [], struct.pack("<H", 0)), ("RATE", 4, [], struct.pack("<f", 100)), ("GEN_SCALE", 4, [], struct.pack("<f", 1))]
    parameters = group(1, "POINT") + group(2, "ANALOG")
    parameters += b"".join(parameter(1, *p) for p in of_point) + b"".join(parameter(2, *p) for p in of_analog)
    head = b"\x02\x50" + struct.pack("<HHHHHfHHf", 1, 0, 1, 2, 0, stored, 3, 1, 100)
    word = cameras << 8 | residual
    frame = struct.pack("<4f", 50, 100, 150, word) if real else struct.pack("<3hH", 100, 200, 300, word)
    return head.ljust(512, b"\0") + (b"\1\x50\1\x54" + parameters).ljust(512, b"\0") + (2 * frame).ljust(512, b"\0")


for real in (False, True):
    written = file_of_one_point(real)
    with open(sys.argv[1], "wb") as out:
        out.write(written)
    of_ezc3d = ezc3d.c3d(sys.argv[1])["data"]
    residual_mm = float(of_ezc3d["meta_points"]["residuals"].ravel()[0])
    cameras = [k + 1 for k, seen in enumerate(of_ezc3d["meta_points"]["camera_masks"][:, 0, 0]) if seen]
    other = next(iter(c3d.Reader(io.BytesIO(written)).read_frames()))[1][0]
    assert list(other[:3]) == [50, 100, 150] and list(of_ezc3d["points"][:3, 0, 0]) == [50, 100, 150]
    print("floats:" if real else "integers:", f"ezc3d {version('ezc3d')} residual {residual_mm} mm, cameras {cameras};",
          f"c3d {version('c3d')} residual {other[3]} mm")
    assert residual_mm == 1.5 and cameras == [2, 3] and other[3] == 3
PYTHON
"$work/venv/bin/python" -W ignore "$work/residual.py" "$work/one.c3d"
