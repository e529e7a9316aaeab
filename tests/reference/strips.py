"""Quasi-steady air on flapping wings by strips, and the mechanics that comes with it: an independent reference for
src/model/strip_aerodynamics.hpp and the vehicles of configs/vehicles. It shares no code with them: vectors and cross
products here, components there. Plain Python, no package.

Wing axes W: x the plate's normal, y along the span (+y to the animal's left on both wings), z towards the leading edge.
A strip at y, of chord c, its leading edge l above the axis of rotation (so its chord spans l - c .. l), width dr, moves
at a point p of the plate with V(p) = v + w x p relative to the air; V_n = V.x, V_c = V.z at the quarter chord.

  translation   1/2 rho c dr U^2 C_N(a) against V_n, sin a = V_n/U, cos a = V_c/U, at d_cp(cos a) c behind the edge [1]
  rotation      k_R pi/2 rho c^2 dr V_c w_y along x, at mid-chord: what a pitching plate's flow at 3/4 chord adds to that
                at the quarter chord in thin-aerofoil theory, pi (3/4 - x_0) about an axis at x_0 [2]; k_R = 1/2 is its
                Wagner value at onset, k_R = 1 its value when settled
  pitching      1/2 rho C_rd |w_y z| (-w_y z) dz dr at every z of the chord: a plate's drag in its own pitching, whose
                moment is the M_rd of [1]
  added mass    -k_A rho pi/4 c^2 dr d/dt V_n(mid-chord) along x, and -k_A rho pi/128 c^4 dr w_y' about y [2]

C_N = sin a (0.6 cos^2 a + 3.45), d_cp = 0.46 - 0.332 cos a - 0.037 cos 3a - 0.013 cos 5a [1], unless series are given.

[1] Fei et al., ICRA 2019, arXiv 1902.09628. [2] Sane, Dickinson, J. Exp. Biol. 205:1087, 2002.
Assumes a rigid flat wing, no wake and no flow along the span.
"""

import math

TERMS = ("translation", "rotation", "pitching", "added mass")


def add(*vectors):
    return tuple(map(sum, zip(*vectors)))


def scaled(k, a):
    return tuple(k * x for x in a)


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def turned(axis, angle):
    """Matrix of the turn by `angle` about "x", "y" or "z"; its columns are the turned axes."""
    c, s = math.cos(angle), math.sin(angle)
    return {"x": ((1, 0, 0), (0, c, -s), (0, s, c)), "y": ((c, 0, s), (0, 1, 0), (-s, 0, c)), "z": ((c, -s, 0), (s, c, 0), (0, 0, 1))}[axis]


def times(A, B):
    return tuple(tuple(sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)) for i in range(3))


def apply(A, a):
    return tuple(dot(row, a) for row in A)


def transposed(A):
    return tuple(zip(*A))


def published_normal(sin_a, cos_a):
    return sin_a * (0.6 * cos_a**2 + 3.45)


def published_pressure_centre(cos_a):
    a = math.acos(max(-1.0, min(1.0, cos_a)))
    return 0.46 - 0.332 * math.cos(a) - 0.037 * math.cos(3 * a) - 0.013 * math.cos(5 * a)


class Wing:
    """`strips`: (distance from the shoulder, width, chord, leading edge above the axis), m; `side`: +1 left, -1 right;
    `normal`(sin a, cos a): C_N; `tangential`(cos a): C_T along the chord, towards the trailing edge where cos a > 0; `at_axis`: velocities there, and pi (3/4 - l/c) in place of pi/2."""

    def __init__(self, strips, side=1, density=1.2, rotational_lift=0.0, added_mass=0.0, pitching_drag=0.0, normal=published_normal,
                 tangential=None, at_axis=False):
        self.strips, self.side, self.density = [tuple(s) for s in strips], side, density
        self.rotational_lift, self.added_mass, self.pitching_drag = rotational_lift, added_mass, pitching_drag
        self.normal, self.tangential, self.at_axis = normal, tangential, at_axis

    def load(self, v, w, dv=(0, 0, 0), dw=(0, 0, 0)):
        """Of each term (force, moment about the shoulder) in W. `v`: velocity of the shoulder, `w`: angular velocity of
        the wing, both in W and relative to the air; `dv`, `dw`: the derivatives of their components."""
        rho, total = self.density, {term: [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)] for term in TERMS}

        def act(term, force, at, moment=(0.0, 0.0, 0.0)):
            total[term][0] = add(total[term][0], force)
            total[term][1] = add(total[term][1], cross(at, force), moment)

        for r, dr, c, lead in self.strips:
            y = self.side * r
            V = add(v, cross(w, (0.0, y, 0.0 if self.at_axis else lead - c / 4)))
            normal, chordwise = V[0], V[2]
            speed = math.hypot(normal, chordwise)
            if speed > 0:
                sin_a, cos_a = normal / speed, chordwise / speed
                pressure = 0.5 * rho * c * dr * speed**2
                act("translation", (-pressure * self.normal(sin_a, cos_a), 0.0, 0.0), (0.0, y, lead - c * published_pressure_centre(cos_a)))
                if self.tangential:
                    act("translation", (0.0, 0.0, -pressure * self.tangential(cos_a)), (0.0, y, 0.0))
            circulation = self.rotational_lift * math.pi * (0.75 - lead / c if self.at_axis else 0.5) * c**2 * w[1]
            act("rotation", (rho * circulation * chordwise * dr, 0.0, 0.0), (0.0, y, lead - c / 2))
            top, bottom = lead, lead - c
            drag = -0.5 * rho * self.pitching_drag * abs(w[1]) * w[1] * dr
            force = drag * (abs(top) ** 3 - abs(bottom) ** 3) / 3
            act("pitching", (force, 0.0, 0.0), (0.0, y, 0.0), (0.0, drag * (top * abs(top) ** 3 - bottom * abs(bottom) ** 3) / 4, 0.0))
            mass = self.added_mass * rho * math.pi / 4 * c**2 * dr
            middle = (0.0, y, lead - c / 2)
            acceleration = add(dv, cross(dw, middle))[0]
            act("added mass", (-mass * acceleration, 0.0, 0.0), middle, (0.0, -mass * c**2 / 32 * dw[1], 0.0))
        return total


def total(loads, terms=TERMS):
    return add(*(loads[t][0] for t in terms)), add(*(loads[t][1] for t in terms))


class Gait:
    """One angle of a beat: mean + sum a_k cos(2 pi k x) + b_k sin(2 pi k x), x in beats."""

    def __init__(self, mean=0.0, cos=(), sin=()):
        self.mean, self.cos, self.sin = mean, tuple(cos), tuple(sin)

    def at(self, x, frequency):
        """Angle, rate, acceleration."""
        q = [self.mean, 0.0, 0.0]
        for k, (a, b) in enumerate(zip(self.cos + (0.0,) * (len(self.sin) - len(self.cos)), self.sin + (0.0,) * (len(self.cos) - len(self.sin))), 1):
            n, c, s = 2 * math.pi * k * frequency, math.cos(2 * math.pi * k * x), math.sin(2 * math.pi * k * x)
            q[0] += a * c + b * s
            q[1] += n * (b * c - a * s)
            q[2] -= n * n * (a * c + b * s)
        return q

    @staticmethod
    def fitted(values, harmonics):
        """To equally spaced samples of one beat, its end left out."""
        n = len(values)
        wave = lambda f, k: 2 / n * sum(v * f(2 * math.pi * k * i / n) for i, v in enumerate(values))
        return Gait(sum(values) / n, [wave(math.cos, k) for k in range(1, harmonics + 1)], [wave(math.sin, k) for k in range(1, harmonics + 1)])


def pose(side, angles):
    """R_BW of (stroke-plane offset, stroke, deviation, rotation): R_y(-Phi) R_z(s psi) R_x(s phi) R_y(theta)."""
    plane, stroke, deviation, rotation = angles
    R = times(turned("y", -plane), turned("z", side * stroke))
    return times(times(R, turned("x", side * deviation)), turned("y", rotation))


def angular_velocity(side, angles, rates):
    """Of the wing relative to the body, in W: each rate about its axis, carried through the turns that follow it."""
    plane, stroke, deviation, rotation = angles
    w = (0.0, -rates[0], 0.0)
    w = add(apply(transposed(turned("z", side * stroke)), w), (0.0, 0.0, side * rates[1]))
    w = add(apply(transposed(turned("x", side * deviation)), w), (side * rates[2], 0.0, 0.0))
    return add(apply(transposed(turned("y", rotation)), w), (0.0, rates[3], 0.0))
