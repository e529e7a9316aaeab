#!/bin/bash
# A force plate's 16-bit samples in a C3D file whose ANALOG:FORMAT is UNSIGNED, read by ezc3d and by c3d.
# Expected (c3d.org, The C3D File Format, ANALOG:FORMAT): samples and offsets are from 0 to 65,535 then. Samples of 30,000,
# 32,768 and 40,000 at an offset of 32,768 are -2,768, 0 and 7,232.
# Seen: c3d reads that. ezc3d takes samples for signed ones whatever ANALOG:FORMAT says, without a warning: those above
# the middle of the range come out lower by 65,536, and the force of a plate that is pushed jumps to the other sign.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
cat > "$work/unsigned.py" <<'PYTHON'
import io
import struct
import sys
from importlib.metadata import version

import c3d
import ezc3d

SAMPLES, OFFSET = [30000, 32768, 40000], 32768


def group(number, name):
    return struct.pack("<bb", len(name), -number) + name.encode() + struct.pack("<H", 3) + b"\0"


def parameter(number, name, kind, sizes, data):
    rest = struct.pack("<bB", kind, len(sizes)) + bytes(sizes) + data + b"\0"
    return struct.pack("<bb", len(name), number) + name.encode() + struct.pack("<H", len(rest) + 2) + rest


def written():
    of_point = [("USED", 2, [], struct.pack("<H", 1)), ("FRAMES", 2, [], struct.pack("<H", 3)), ("DATA_START", 2, [], struct.pack("<H", 4)),
                ("SCALE", 4, [], struct.pack("<f", 0.5)), ("RATE", 4, [], struct.pack("<f", 100)),
                ("LABELS", -1, [4, 1], b"nose"), ("UNITS", -1, [2, 1], b"mm")]
    of_analog = [("USED", 2, [], struct.pack("<H", 1)), ("RATE", 4, [], struct.pack("<f", 100)), ("BITS", 2, [], struct.pack("<H", 16)),
                 ("FORMAT", -1, [8, 1], b"UNSIGNED"), ("GEN_SCALE", 4, [], struct.pack("<f", 1)), ("SCALE", 4, [1], struct.pack("<f", 1)),
                 ("OFFSET", 2, [1], struct.pack("<H", OFFSET)), ("LABELS", -1, [2, 1], b"Fz"), ("UNITS", -1, [1, 1], b"N")]
    parameters = group(1, "POINT") + group(2, "ANALOG")
    parameters += b"".join(parameter(1, *p) for p in of_point) + b"".join(parameter(2, *p) for p in of_analog)
    head = b"\x02\x50" + struct.pack("<HHHHHfHHf", 1, 1, 1, 3, 0, 0.5, 4, 1, 100)
    data = b"".join(struct.pack("<3hHH", 100, 200, 300, 0, sample) for sample in SAMPLES)
    return head.ljust(512, b"\0") + (b"\1\x50\2\x54" + parameters).ljust(1024, b"\0") + data.ljust(512, b"\0")


with open(sys.argv[1], "wb") as out:
    out.write(written())
of_ezc3d = [float(v) for v in ezc3d.c3d(sys.argv[1])["data"]["analogs"].ravel()]
of_c3d = [float(frame[2].ravel()[0]) for frame in c3d.Reader(io.BytesIO(written())).read_frames()]
print(f"samples {SAMPLES} at offset {OFFSET}: c3d {version('c3d')} {of_c3d}, ezc3d {version('ezc3d')} {of_ezc3d}")
assert of_c3d == [sample - OFFSET for sample in SAMPLES]
assert of_ezc3d != of_c3d and of_ezc3d[2] == SAMPLES[2] - 65536 - OFFSET
PYTHON
"$work/venv/bin/python" -W ignore "$work/unsigned.py" "$work/plate.c3d"
