"""Draws learning curves: `python curve.py figure.svg "Stable-Baselines3=sb3_*.csv" "CleanRL=cleanrl_*.csv"`.

Each file is what sb3_hover.py or cleanrl_hover.py wrote, one for each seed. Beside the figure, it leaves all rows in one CSV.
"""

import csv
import glob
import itertools
import sys
from pathlib import Path

import matplotlib.pyplot as plt

plt.switch_backend("svg")
plt.rcParams |= {"svg.hashsalt": "flappy", "svg.fonttype": "none"}  # the same bytes for the same curves
figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True)
rows = []
colours = itertools.cycle(("#2f81f7", "#e0702c", "#3fa45b", "#8250df"))
for colour, argument in zip(colours, sys.argv[2:], strict=False):
    name, pattern = argument.split("=", 1)
    for seed, path in enumerate(sorted(glob.glob(pattern)), 1):
        with open(path, newline="") as file:
            curve = [{"learner": name, "run": seed, **row} for row in csv.DictReader(file)]
        rows += curve
        for axis, column in zip(axes, ("steps", "wall_s"), strict=True):
            x, y = [float(row[column]) for row in curve], [100 * float(row["success"]) for row in curve]
            axis.plot(x, y, color=colour, linewidth=1.2, label=name if seed == 1 else None)
for axis, title in zip(axes, ("steps of all environments", "wall-clock time without evaluation, s"), strict=True):
    axis.set_xscale("log")
    axis.axhline(90, color="#7d8590", linewidth=0.8, linestyle=":")
    axis.set_xlabel(title)
    axis.spines[["top", "right"]].set_visible(False)
axes[0].set_ylabel("success, % of 1,000 flights")
axes[0].legend(frameon=False, loc="upper left", bbox_to_anchor=(0, 0.95))
figure.tight_layout()
figure.savefig(sys.argv[1], metadata={"Date": None})
with open(Path(sys.argv[1]).with_suffix(".csv"), "w", newline="") as file:
    writer = csv.DictWriter(file, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
