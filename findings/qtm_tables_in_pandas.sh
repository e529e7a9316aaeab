#!/bin/bash
# An export of QTM (Qualisys, TSV, 3D) in pandas.read_csv(), as is usual: skiprows=4, sep="\t".
# Expected: the column "nose X" has the numbers below this name, 100, 101 and 102 mm, or there is an error or a warning.
# Seen: rows of QTM's end with a tab, the line of names does not. pandas takes the first column for an index then and moves
# every name by one: "nose X" has the numbers of y, "Time" those of x, without a warning. numpy.genfromtxt() keeps them.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install pandas==2.3.3 numpy==2.4.6
"$work/venv/bin/python" - <<'PYTHON'
import io
import warnings

import numpy
import pandas

warnings.simplefilter("error")
HEAD = "NO_OF_FRAMES\t3\nFREQUENCY\t100\nDATA_INCLUDED\t3D\nMARKER_NAMES\tnose\n"
NAMES = ["Frame", "Time", "nose X", "nose Y", "nose Z"]
rows = "".join(f"{i + 1}\t{0.01 * i:.5f}\t{100 + i}.000\t200.000\t300.000\t\n" for i in range(3))
text = HEAD + "\t".join(NAMES) + "\n" + rows
read = pandas.read_csv(io.StringIO(text), sep="\t", skiprows=4)
plain = numpy.genfromtxt(io.StringIO(text), skip_header=5, delimiter="\t")
print("pandas", pandas.__version__, {name: read[name].tolist() for name in NAMES})
print("numpy", numpy.__version__, {name: plain[:, k].tolist() for k, name in enumerate(NAMES)})
right = [100, 101, 102]
assert plain[:, 2].tolist() == right
assert read["nose X"].tolist() == [200] * 3 and read["Time"].tolist() == right
# the remedy
assert pandas.read_csv(io.StringIO(text), sep="\t", skiprows=4, index_col=False)["nose X"].tolist() == right
PYTHON
