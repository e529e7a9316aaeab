"""A vehicle file's wings driven along its gait, by strips.py: mean loads over a beat, power, hover trim, stability derivatives and their modes.
Independent of src, plain Python; for files of model = "jointed" whose angles are all fixed or driven and whose wings have strips; of those whose
rotation alone is free, hinged_beat() has a beat of a wing on a body that stands still.

The body stands still or moves steadily; a beat is averaged (rigid-body approximation [1]). Derivatives are central differences. Modes are those of
  m u' = X_u u + X_w w + X_q q - m g theta,  m w' = Z_u u + Z_w w + Z_q q,  I q' = M_u u + M_w w + M_q q,  theta' = q
and of their lateral peers, in the usual axes of flight: x forward, y right, z down, moments about the centre of mass [1, 2].
Power: the muscles of a wing give dK/dt + what the air takes, K the wing's kinetic energy; with perfect elastic storage the mean is the air's, with
none the mean of the positive part.

[1] Sun, Xiong, J. Exp. Biol. 208:447, 2005. [2] Zhang, Sun, Acta Mech. Sin. 26:175, 2010.
"""

import math
import tomllib

from strips import Gait, Wing, add, angular_velocity, apply, cross, dot, pose, scaled, total, transposed

GRAVITY = 9.81
ANGLES = ("stroke_plane", "stroke", "deviation", "rotation")


def vector(table):
    return (table["x"], table["y"], table["z"])


def tensor(t):
    return ((t["xx"], t["xy"], t["xz"]), (t["xy"], t["yy"], t["yz"]), (t["xz"], t["yz"], t["zz"]))


def about(inertia, mass, com):
    """Inertia about a point from which the centre of mass is at `com`."""
    r2 = dot(com, com)
    return tuple(tuple(inertia[i][j] + mass * ((r2 if i == j else 0.0) - com[i] * com[j]) for j in range(3)) for i in range(3))


class Vehicle:
    """Symmetric: the right side is the left one in a mirror."""

    def __init__(self, path, samples=100):
        with open(path, "rb") as f:
            table = tomllib.load(f)
        left = table["left"]
        self.name, self.samples, self.frequency = table["name"], samples, table["gait"]["frequency_Hz"]
        self.muscle_mass = table["gait"].get("muscle_mass_kg")
        self.gaits = {}
        for angle in ANGLES:
            a = left[angle]
            if a["mode"] == "free":
                self.hinge, self.gaits[angle] = a, Gait(a["rest_rad"])
                continue
            self.gaits[angle] = Gait(a["angle_rad"]) if a["mode"] == "fixed" else Gait(a["mean_rad"], a.get("cos_rad", ()), a.get("sin_rad", ()))
        air = left["aerodynamics"]
        self.air = {"strips": [(y, c, d, e) for y, c, d, e in air["strips_m"]], "density": table["air"]["density_kg_m3"],
                    "rotational_lift": air.get("rotational_lift", 0.0), "added_mass": air.get("added_mass", 0.0),
                    "pitching_drag": air.get("rotational_damping_coefficient", 0.0)}
        if "normal_sin" in air:
            self.air["normal"] = lambda s, c: sum(b * math.sin((k + 1) * math.atan2(s, c)) for k, b in enumerate(air["normal_sin"]))
        if "tangential_cos" in air:
            self.air["tangential"] = lambda c: sum(b * math.cos((k + 1) * math.acos(max(-1.0, min(1.0, c)))) for k, b in enumerate(air["tangential_cos"]))
        self.shoulder, torso, wing = vector(left["shoulder_m"]), table["torso"], left["wing"]
        self.wing_mass, self.wing_com = wing["mass_kg"], vector(wing["com_m"])
        self.wing_inertia = about(tensor(wing["inertia_kg_m2"]), wing["mass_kg"], self.wing_com)
        self.mass = torso["mass_kg"] + 2 * wing["mass_kg"]
        self.torso_mass, self.torso_com, self.torso_inertia = torso["mass_kg"], vector(torso["com_m"]), tensor(torso["inertia_kg_m2"])
        self.settle()

    def settle(self):
        """Centre of mass and inertia with the wings at their mean over a beat; call it after a change of gait."""
        moment, inertia = scaled(self.torso_mass, self.torso_com), about(self.torso_inertia, self.torso_mass, self.torso_com)
        inertia = [list(row) for row in inertia]
        for side in (1, -1):
            for i in range(self.samples):
                R = pose(side, self.angles(i / self.samples)[0])
                at = add(self.mirrored(side, self.shoulder), apply(R, self.mirrored(side, self.wing_com)))
                moment = add(moment, scaled(self.wing_mass / self.samples, at))
                point = about(((0, 0, 0),) * 3, self.wing_mass / self.samples, at)
                for j in range(3):
                    for k in range(3):
                        inertia[j][k] += point[j][k]
        self.com = scaled(1 / self.mass, moment)
        r2 = dot(self.com, self.com)
        self.inertia = [[inertia[j][k] - self.mass * ((r2 if j == k else 0.0) - self.com[j] * self.com[k]) for k in range(3)] for j in range(3)]

    @staticmethod
    def mirrored(side, a):
        return (a[0], side * a[1], a[2])

    def angles(self, x):
        at = [self.gaits[angle].at(x, self.frequency) for angle in ANGLES]
        return [a[0] for a in at], [a[1] for a in at]

    def wing(self, side):
        return Wing(side=side, **self.air)

    def side_load(self, side, x, velocity=(0, 0, 0), rate=(0, 0, 0)):
        """Force and moment about the shoulder of the air on a wing, and the wing's own angular velocity, in W; R_BW. `velocity` of the
        centre of mass and `rate` of the body relative to the air, in B."""
        shoulder = self.mirrored(side, self.shoulder)
        v = add(velocity, cross(rate, add(shoulder, scaled(-1, self.com))))

        def state(phase):
            angles, rates = self.angles(phase)
            R = pose(side, angles)
            own = angular_velocity(side, angles, rates)
            return R, own, add(own, apply(transposed(R), rate)), apply(transposed(R), v)

        R, own, w, v_W = state(x)
        dv = dw = (0.0, 0.0, 0.0)
        if self.air["added_mass"]:
            h = 1e-4
            after, before = state(x + h), state(x - h)
            dw = scaled(self.frequency / (2 * h), add(after[2], scaled(-1, before[2])))
            dv = scaled(self.frequency / (2 * h), add(after[3], scaled(-1, before[3])))
        return total(self.wings[side].load(v_W, w, dv, dw)) + (own, R)

    def mean_load(self, velocity=(0, 0, 0), rate=(0, 0, 0)):
        """Of both wings over a beat: force and moment about the centre of mass, in B."""
        self.wings = {side: self.wing(side) for side in (1, -1)}
        force, moment = (0.0,) * 3, (0.0,) * 3
        for side in (1, -1):
            arm = add(self.mirrored(side, self.shoulder), scaled(-1, self.com))
            for i in range(self.samples):
                f, m, _, R = self.side_load(side, i / self.samples, velocity, rate)
                f, m = apply(R, f), apply(R, m)
                force, moment = add(force, f), add(moment, m, cross(arm, f))
        return scaled(1 / self.samples, force), scaled(1 / self.samples, moment)

    def power(self):
        """W of both wings: of the air, of the muscles without elastic storage, and the share of lift made while the stroke goes forward."""
        self.wings = {1: self.wing(1)}
        air, energy, down, up = [], [], 0.0, 0.0
        for i in range(self.samples):
            f, m, own, R = self.side_load(1, i / self.samples)
            air.append(-dot(m, own))
            energy.append(0.5 * dot(own, apply(self.wing_inertia, own)))
            lift = apply(R, f)[2]
            if self.angles(i / self.samples)[1][1] < 0:
                down += lift
            else:
                up += lift
        n, step = self.samples, 1 / (self.frequency * self.samples)
        whole = [air[i] + (energy[(i + 1) % n] - energy[i - 1]) / (2 * step) for i in range(n)]
        return 2 * sum(air) / n, 2 * sum(max(p, 0.0) for p in whole) / n, down / (down + up)


def hinged_beat(vehicle, beats=8, steps=800):
    """A left wing whose rotation is free, the body still: lift of both wings over a beat, N, rotation's extremes, rad, and power of both strokes,
    W, as means over the last two of `beats` from rest. Euler's equation of the wing about its span, semi-implicit steps."""
    a, wing, I, f = vehicle.hinge, vehicle.wing(1), vehicle.wing_inertia, vehicle.frequency
    theta, rate, h = 0.0, 0.0, 1 / (f * steps)
    lift = power = low = high = 0.0
    for i in range(beats * steps):
        (plane, stroke, deviation), t = (vehicle.gaits[n].at(i / steps, f) for n in ANGLES[:3]), i / steps
        angles, rates = (plane[0], stroke[0], deviation[0], theta), (plane[1], stroke[1], deviation[1], rate)
        w = angular_velocity(1, angles, rates)
        force, moment = total(wing.load((0, 0, 0), w))
        # w' without theta'': the slope of w along the motion
        e = 1e-6 / f
        ahead = [gait.at(t + e * f, f) for gait in (vehicle.gaits[n] for n in ANGLES[:3])]
        w_ahead = angular_velocity(1, tuple(b[0] for b in ahead) + (theta + e * rate,), tuple(b[1] for b in ahead) + (rate,))
        dw = scaled(1 / e, add(w_ahead, scaled(-1, w)))
        torque = moment[1] - a["stiffness_Nm_rad"] * (theta - a["rest_rad"]) - a["damping_Nm_s"] * rate
        for limit, sign in ((a.get("lower_rad"), -1), (a.get("upper_rad"), 1)):
            if limit is not None and sign * (theta - limit) > 0:
                torque -= a["stop_stiffness_Nm_rad"] * (theta - limit) + a["stop_damping_Nm_s"] * rate
        turning = add(apply(I, dw), cross(w, apply(I, w)))
        rate += h * (torque - turning[1]) / I[1][1]
        theta += h * rate
        if i >= (beats - 2) * steps:
            lift += 2 * apply(pose(1, angles), force)[2] / (2 * steps)
            power += 2 * -(dot(moment, w) - moment[1] * rate) / (2 * steps)
            low, high = min(low, theta), max(high, theta)
    return lift, (low, high), power


def solved(rows, right):
    """x of rows x = right, by Gauss."""
    n = len(rows)
    M = [list(r) + [b] for r, b in zip(rows, right)]
    for i in range(n):
        p = max(range(i, n), key=lambda k: abs(M[k][i]))
        M[i], M[p] = M[p], M[i]
        M[i] = [x / M[i][i] for x in M[i]]
        for k in range(n):
            if k != i:
                M[k] = [x - M[k][i] * y for x, y in zip(M[k], M[i])]
    return [row[n] for row in M]


def trim(vehicle, knobs, steps=12):
    """Turns three knobs, functions of (vehicle, change), until lift is the weight, and thrust and pitching moment vanish; returns the changes."""
    at = [0.0] * 3

    def residual(change):
        for knob, c in zip(knobs, change):
            knob(vehicle, c)
        vehicle.settle()
        force, moment = vehicle.mean_load()
        weight = vehicle.mass * GRAVITY
        out = (force[2] / weight - 1, force[0] / weight, moment[1] / (weight * vehicle.air["strips"][-1][0]))
        for knob, c in zip(knobs, change):
            knob(vehicle, -c)
        return out

    for _ in range(steps):
        r = residual(at)
        if max(map(abs, r)) < 1e-9:
            break
        h = 1e-4
        J = [[(b - a) / h for a, b in zip(r, residual([c + (h if i == k else 0) for i, c in enumerate(at)]))] for k in range(3)]
        step = solved(transposed(J), [-x for x in r])
        shrink = min(1.0, 0.3 / max(map(abs, step)))
        at = [a + shrink * s for a, s in zip(at, step)]
    for knob, c in zip(knobs, at):
        knob(vehicle, c)
    vehicle.settle()
    return at, residual([0.0] * 3)


def derivatives(vehicle):
    """In the axes of flight (x forward, y right, z down): d(X, Y, Z, L, M, N)/d(u, v, w, p, q, r), SI, about the centre of mass."""
    flight = lambda a: (a[0], -a[1], -a[2])
    # steps: a hundredth of the mean speed of the tip, and of the beat
    stroke = vehicle.gaits["stroke"]
    tip = 4 * vehicle.frequency * math.hypot(stroke.cos[0], stroke.sin[0]) * vehicle.air["strips"][-1][0]
    out = []
    for i in range(6):
        h = 0.01 * tip if i < 3 else 0.01 * vehicle.frequency
        axis = tuple(h if j == i % 3 else 0.0 for j in range(3))
        still = (0.0, 0.0, 0.0)
        sides = []
        for sign in (1, -1):
            a = flight(scaled(sign, axis))
            force, moment = vehicle.mean_load(a, still) if i < 3 else vehicle.mean_load(still, a)
            sides.append(flight(force) + flight(moment))
        out.append([(a - b) / (2 * h) for a, b in zip(*sides)])
    return [list(row) for row in zip(*out)]


def system(vehicle, D, lateral=False):
    """Matrix of (u, w, q, theta) or (v, p, r, phi)."""
    m, I = vehicle.mass, vehicle.inertia
    if not lateral:
        X, Z, M = (D[k] for k in (0, 2, 4))
        return [[X[0] / m, X[2] / m, X[4] / m, -GRAVITY], [Z[0] / m, Z[2] / m, Z[4] / m, 0.0],
                [M[0] / I[1][1], M[2] / I[1][1], M[4] / I[1][1], 0.0], [0.0, 0.0, 1.0, 0.0]]
    Y, L, N = (D[k] for k in (1, 3, 5))
    Ix, Iz, Ixz = I[0][0], I[2][2], I[0][2]  # the product keeps its sign: both axes that it joins turn over but one
    Ixz = -Ixz
    rows = [[Y[k] / m for k in (1, 3, 5)] + [GRAVITY]]
    both = [solved([[Ix, Ixz], [Ixz, Iz]], [L[k], N[k]]) for k in (1, 3, 5)]
    rows += [[b[0] for b in both] + [0.0], [b[1] for b in both] + [0.0], [0.0, 1.0, 0.0, 0.0]]
    return rows


def eigenvalues(A):
    """Of a small matrix: roots of its characteristic polynomial (Faddeev, LeVerrier) by Durand and Kerner's iteration."""
    n = len(A)
    scale = max(abs(x) for row in A for x in row)
    A = [[x / scale for x in row] for row in A]
    M, coefficients = [[0.0] * n for _ in range(n)], [1.0]
    for k in range(1, n + 1):
        M = [[sum(A[i][j] * M[j][l] for j in range(n)) + (coefficients[-1] if i == l else 0.0) for l in range(n)] for i in range(n)]
        coefficients.append(-sum(A[i][j] * M[j][i] for i in range(n) for j in range(n)) / k)
    roots = [(0.4 + 0.9j) ** k for k in range(n)]
    for _ in range(2000):
        for i in range(n):
            p = 0
            for c in coefficients:
                p = p * roots[i] + c
            q = 1
            for j in range(n):
                if j != i:
                    q *= roots[i] - roots[j]
            roots[i] -= p / q
    return sorted((scale * (r if abs(r.imag) > 1e-9 * abs(r) + 1e-12 else complex(r.real, 0.0)) for r in roots), key=lambda r: (-round(r.real / scale, 9), -r.imag))
