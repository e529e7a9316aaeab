#!/usr/bin/env python3
"""How policy.pt and policy.onnx act next to the float actor: prints the table of docs/results/export.md for five networks.

    scripts/results/policy_files.py BIN ROOT OUT

BIN holds the programs, ROOT is the project, OUT takes runs and exports. python3 in PATH has onnxruntime. Each network learns the escape for a few updates, enough for weights
that are not those of the start.
"""

import json
import pathlib
import subprocess
import sys

BIN, ROOT, OUT = (pathlib.Path(a).resolve() for a in sys.argv[1:4])
UPDATES = 3000
TORCH = "learn.engine=libtorch"
NETWORKS = {  # name: overrides of configs/train/escape.toml
    "relu, 32, 32": [],
    "tanh, 64, 64": [TORCH, "networks.actor=[64,64]", "networks.activation=tanh"],
    "elu, layer norm, 32, 32, 32": [TORCH, "networks.actor=[32,32,32]", "networks.activation=elu", "networks.layer_norm=true"],
    "silu, history of 3, 24, 40, 9": [TORCH, "networks.actor=[24,40,9]", "networks.activation=silu", "task.history=3"],
    "relu, layer norm, 256, 256": [TORCH, "networks.actor=[256,256]", "networks.layer_norm=true"],
}


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")


print("| actor | file | outputs that differ | ulp: median, 99 %, largest | largest, ulp of half the range | flights that end alike | apart, m |")
print("|---|---|---|---|---|---|---|")
for number, (name, overrides) in enumerate(NETWORKS.items()):
    folder, exported, report = (OUT / f"{kind}_{number}{end}" for kind, end in (("run", ""), ("exported", ""), ("proof", ".json")))
    if not (folder / "summary.json").exists():
        sets = [f"learn.updates={UPDATES}", f"evaluate.every={UPDATES}", "evaluate.vehicles=64", f"checkpoint.every={UPDATES}", *overrides]
        run(BIN / "flappy-train", ROOT / "configs/train/escape.toml", "--out", folder, *(word for s in sets for word in ("--set", s)))
    run(BIN / "flappy-export", folder, "--out", exported, "--prove", "--json", report)
    for row in json.loads(report.read_text())["agreement"]:
        print(f"| {name} | `{row['file']}`, {row['runtime']} | {row['differing']} of {row['outputs']} | {row['median_ulp']:.3g}, "
              f"{row['percentile_99_ulp']:.3g}, {row['largest_ulp']:.3g} | {row['largest_ulp_of_range']:.3g} | {row['ended_alike']} of {row['flights']} | "
              f"{row['largest_distance_m']:.2g} |")
