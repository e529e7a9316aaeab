#!/bin/bash
# hdf5storage.savemat(), which writes MATLAB files of version 7.3 in place of scipy.io.savemat(), to a file that is there.
# Expected: as scipy.io.savemat() and MATLAB's save (without -append): the file holds what was saved last.
# Seen: the variables of the call before stay in the file. Of a second flight without "wings", those of the first are read.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install hdf5storage==0.2.2 scipy==1.17.1 numpy==2.4.6
cd "$work"
venv/bin/python - <<'PYTHON'
from importlib.metadata import version

import hdf5storage
import numpy
import scipy.io

first = {"t": numpy.arange(4.0), "wings": numpy.ones(4)}
second = {"t": numpy.arange(3.0)}
found = {}
for name, package in (("hdf5storage", hdf5storage), ("scipy", scipy.io)):
    for flight in (first, second):
        package.savemat(f"{name}.mat", flight)
    found[name] = {key: value.shape for key, value in package.loadmat(f"{name}.mat").items() if not key.startswith("__")}
    print(name, version(name), "after a second flight without wings:", found[name])
assert found["scipy"] == {"t": (1, 3)}
assert set(found["hdf5storage"]) == {"t", "wings"} and found["hdf5storage"]["t"][-1] == 3 and found["hdf5storage"]["wings"][-1] == 4
PYTHON
