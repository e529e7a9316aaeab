#!/bin/bash
# pagmo's NSGA-II with an objective that is the same for all points of a front.
# Expected (Deb et al., IEEE T-EC 6, 2002): such an objective says nothing of crowding; the ends of a front survive.
# Seen with pygmo 2.20.0: crowding_distance() divides by the objective's range, 0; points inside the front get nan, which
# select_best_N_mo() ranks above the infinite distance of the ends. Over generations the front loses its ends.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" -q install pygmo==2.20.0 numpy==2.4.6
"$work/venv/bin/python" - <<'PYTHON'
import math
import pygmo

print("pygmo", pygmo.__version__)
front = [[i / 4, 1 - i / 4] for i in range(5)]
constant = [[*f, 0.5] for f in front]
distance = pygmo.crowding_distance(constant)
print("crowding distances, two objectives:          ", pygmo.crowding_distance(front))
print("the same front with a third that is constant:", distance)
kept, kept_constant = (sorted(int(i) for i in pygmo.select_best_N_mo(f, 3)) for f in (front, constant))
print("the best three of five:", kept, "and with the constant objective:", kept_constant)
assert all(math.isnan(d) for d in distance[1:4]) and 0 in kept and 4 in kept and kept_constant == [1, 2, 3]


class Line:
    """The front is the whole line from (0, 1) to (1, 0); its extent in the first objective is 1."""

    def __init__(self, constant):
        self.constant = constant

    def fitness(self, x):
        far = 1 + sum(x[1:])
        return [x[0] * far, (1 - x[0]) * far] + ([0.25] if self.constant else [])

    def get_nobj(self):
        return 3 if self.constant else 2

    def get_bounds(self):
        return [0] * 4, [1] * 4


extents = {}
for is_constant in (False, True):
    of_seeds = []
    for seed in range(1, 6):
        population = pygmo.population(pygmo.problem(Line(is_constant)), size=24, seed=seed)
        population = pygmo.algorithm(pygmo.nsga2(gen=200, seed=seed)).evolve(population)
        best = [population.get_f()[i][0] for i in pygmo.fast_non_dominated_sorting(population.get_f())[0][0]]
        of_seeds.append(max(best) - min(best))
    extents[is_constant] = sorted(float(e) for e in of_seeds)
    print("extent of the front, 24 points, 200 generations, 5 seeds,", "with" if is_constant else "without",
          "a constant objective:", [round(e, 3) for e in extents[is_constant]])
assert extents[False][0] > 0.95 and extents[True][2] < 0.8
PYTHON
