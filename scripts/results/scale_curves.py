#!/usr/bin/env python3
"""Draws how time and memory grow with the work: scale_curves.py FIGURE.svg FILE.json..., of flappy-bench --json FILE.json scale."""
import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt

plt.switch_backend("svg")
plt.rcParams |= {"svg.hashsalt": "flappy", "svg.fonttype": "none"}  # the same bytes for the same figures
curves = {}
for name in sys.argv[2:]:
    for row in json.loads(Path(name).read_text())["rows"]:
        curves.setdefault(row["what"], []).append(row)
figure, axes = plt.subplots(1, 2, figsize=(9, 3.6))
for what, rows in curves.items():
    size = [row["size"] / rows[0]["size"] for row in rows]
    axes[0].plot(size, [row["seconds"] for row in rows], marker="o", markersize=3, linewidth=1.2, label=what)
    axes[1].plot(size, [row["peak_bytes"] / 1e6 for row in rows], marker="o", markersize=3, linewidth=1.2)
for axis, title in zip(axes, ("seconds", "peak memory, MB"), strict=True):
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlabel("size over the smallest")
    axis.set_ylabel(title)
    axis.spines[["top", "right"]].set_visible(False)
axes[0].plot([1, 1e4], [0.1, 1e3], color="#7d8590", linewidth=0.8, linestyle=":", label="as the work")
figure.legend(frameon=False, loc="lower center", ncols=3, fontsize=8, bbox_to_anchor=(0.5, 0))
figure.tight_layout(rect=(0, 0.2, 1, 1))
figure.savefig(sys.argv[1], metadata={"Date": None})
