#!/bin/bash
# A TDMS file (National Instruments) with a force at 1 kHz and an angle at 100 Hz, as a table by npTDMS.
# Expected of TdmsFile.as_dataframe(): numbers in one row belong to one instant, or it says that they do not.
# Seen: row k has sample k of each channel. The angle of 0.095 s stands beside the force of 0.009 s, without a warning;
# after a tenth of the file there is no angle. With time_index=True each sample stands at its own time.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install nptdms==1.13.0 pandas==2.3.3 numpy==2.4.6
"$work/venv/bin/python" - "$work/rig.tdms" <<'PYTHON'
import sys
import warnings

import nptdms
import numpy

warnings.simplefilter("error", UserWarning)
FORCE_S, ANGLE_S, LATE_S = 1e-3, 1e-2, 5e-3


def channel(name, count, step_s, start_s):
    times_s = start_s + step_s * numpy.arange(count)  # its numbers are their own times
    return nptdms.ChannelObject("rig", name, times_s, {"wf_increment": step_s, "wf_start_offset": start_s, "wf_samples": count})


with nptdms.TdmsWriter(sys.argv[1]) as out:
    out.write_segment([channel("force", 100, FORCE_S, 0.0), channel("angle", 10, ANGLE_S, LATE_S)])
file = nptdms.TdmsFile(sys.argv[1])
table = file.as_dataframe()
force, angle = table.columns
row = table.iloc[9]
print(f"npTDMS {nptdms.__version__}: row 9 has the force of {row[force]:.3f} s and the angle of {row[angle]:.3f} s;",
      f"{int(table[angle].notna().sum())} of {len(table)} rows have an angle")
assert abs(row[angle] - row[force] - 0.086) < 1e-9 and table[angle].notna().sum() == 10
by_time = file.as_dataframe(time_index=True)
assert abs(by_time[angle].dropna().index.to_numpy() - by_time[angle].dropna().to_numpy()).max() < 1e-9
PYTHON
