#!/usr/bin/env python3
"""The air on strips of src/model against strips.py, at random instants of the shipped animals' gaits and random motions of their bodies.

    tests/reference/strips_peer_test.py PEER ROOT
"""

import pathlib
import random
import re
import subprocess
import sys
import tempfile

from flight import Vehicle
from strips import add, apply, cross, scaled

PEER, ROOT = sys.argv[1], pathlib.Path(sys.argv[2])


def compare(text, name):
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
        file.write(text)
        file.flush()
        v = Vehicle(file.name, samples=4)
        v.wings, v.air["added_mass"] = {side: v.wing(side) for side in (1, -1)}, 0.0
        instants = [[random.random()] + [random.uniform(-5, 5) for _ in range(6)] for _ in range(20)]
        lines = "".join(" ".join(map(repr, i)) + "\n" for i in instants)
        done = subprocess.run([PEER, file.name], input=lines, capture_output=True, text=True, check=True)
    *loads, added = [list(map(float, line.split())) for line in done.stdout.splitlines()]
    sizes, gaps = [0.0, 0.0], [0.0, 0.0]
    for (x, *motion), theirs in zip(instants, loads, strict=True):
        velocity, rate = tuple(motion[:3]), tuple(motion[3:])
        at_com = add(velocity, cross(rate, v.com))
        for side, got in ((1, theirs[:6]), (-1, theirs[6:])):
            force, moment, _, R = v.side_load(side, x, at_com, rate)
            for k, (ours, peer) in enumerate(((apply(R, force), got[:3]), (apply(R, moment), got[3:]))):
                sizes[k] = max(sizes[k], *map(abs, ours))
                gaps[k] = max(gaps[k], *(abs(a - b) for a, b in zip(ours, peer)))
    worst = max(gap / size for gap, size in zip(gaps, sizes))
    # of the largest load: about 25 roundings a strip, 20 strips, and sine and cosine of either side
    assert worst < 2e-13, f"{name}: loads differ by {worst:.1e} of themselves"
    for side, got in ((1, added[:6]), (-1, added[6:])):
        unit = lambda dv, dw: v.wings[side].load((0, 0, 0), (0, 0, 0), dv, dw)["added mass"]
        rows = [unit((1, 0, 0), (0, 0, 0)), unit((0, 0, 0), (0, 1, 0)), unit((0, 0, 0), (0, 0, 1))]
        K = [[-f[0], -m[1], -m[2]] for f, m in rows]
        ours = (K[0][0], K[1][1], K[2][2], K[0][1], K[1][2], K[0][2])
        for a, b in zip(ours, got, strict=True):
            assert abs(a - b) <= 1e-12 * max(map(abs, ours)), f"{name}: added mass {ours} {got}"
    return worst


def main():
    random.seed(11)
    for name in ("bumblebee", "fruit_fly", "hawkmoth", "hummingbird_magnificent", "hummingbird_ruby_throated"):
        text = (ROOT / "configs/vehicles" / (name + ".toml")).read_text()
        heavier = re.sub(r"added_mass = 0.0", "added_mass = 0.35", text)
        assert heavier != text
        ahead = re.sub(r"(\[[^],]+, [^],]+, )([^],]+), [^],]+\]", lambda m: f"{m[1]}{m[2]}, {-0.2 * float(m[2])!r}]", text, count=3)  # axis before the edge
        assert ahead != text
        tilting = text.replace("mean_rad = 0.0\ncos_rad = [0.0]", "mean_rad = 0.2\ncos_rad = [0.1]\nsin_rad = [0.0, 0.05]", 1)
        assert tilting != text
        print(name, *(f"{compare(t, name):.1e}" for t in (text, heavier, ahead, tilting)))


main()
