#!/usr/bin/env python3
"""Animals beside what was published of them. Prints the tables of docs/results/animals.md.

    scripts/results/animals.py BIN ROOT FOLDER

BIN holds the programs, ROOT is the project, FOLDER the published figures: bumblebee_cfd_right_wing.csv and bumblebee_wing.csv (computed flow of a
bumblebee), hydei_hover.csv and hydei_wing.csv (kinematics and planform of D. hydei). What is missing is left out and said.
"""

import csv
import math
import pathlib
import subprocess
import sys
import tempfile

BIN, ROOT, FOLDER = (pathlib.Path(a) for a in sys.argv[1:4])
sys.path.insert(0, str(ROOT / "tests/reference"))

import flight  # noqa: E402
from strips import TERMS, Gait, Wing, add, angular_velocity, apply, pose, scaled, times, total, transposed, turned  # noqa: E402

GRAVITY = 9.81


def columns(name):
    with open(FOLDER / name, newline="") as f:
        rows = list(csv.DictReader(f))
    return {key: [float(row[key]) for row in rows] for key in rows[0]}


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def correlation(a, b):
    n, ma, mb = len(a), sum(a) / len(a), sum(b) / len(b)
    return sum((x - ma) * (y - mb) for x, y in zip(a, b)) / n / rms([x - ma for x in a]) / rms([y - mb for y in b])


def slopes(t, values):
    """Second order on uneven steps."""
    out = []
    for i in range(len(t)):
        j = min(max(i, 1), len(t) - 2)
        h, k = t[j] - t[j - 1], t[j + 1] - t[j]
        a, b, c = values[j - 1], values[j], values[j + 1]
        x = t[i] - t[j]
        first = (c * h * h + b * (k * k - h * h) - a * k * k) / (h * k * (h + k))
        second = 2 * (c * h - b * (h + k) + a * k) / (h * k * (h + k))
        out.append(first + second * x)
    return out


def least_squares(rows, right):
    product = lambda a, b: sum(x * y for x, y in zip(a, b))
    return flight.solved([[product(a, b) for b in rows] for a in rows], [product(a, right) for a in rows])


# --- bumblebee: normal force of the right wing against computed flow ---------------------------------------------------------------------------


def bumblebee():
    flow, plan = columns("bumblebee_cfd_right_wing.csv"), columns("bumblebee_wing.csv")
    t = flow["time_beats"]
    width = plan["r"][1] - plan["r"][0]
    strips = [(r, width, a - b, a) for r, a, b in zip(plan["r"], plan["leading_edge_x"], plan["trailing_edge_x"])]
    wing = Wing(strips, density=1.0, rotational_lift=1.0, added_mass=1.0, pitching_drag=1.0)
    wind = (1.246, 0.0, 0.0)

    # The file's axes are passive turns: x to the leading edge, y to the tip, z = x cross y. Ours: (-z, y, x).
    def body_of(i):
        back = lambda axis, angle: transposed(turned(axis, angle))
        to_stroke = times(back("x", math.pi), back("y", flow["eta_rad"][i]))
        relative = times(times(times(back("y", -flow["alpha_r_rad"][i]), back("z", flow["theta_r_rad"][i])), back("x", -flow["phi_r_rad"][i])), to_stroke)
        body = times(times(back("x", flow["psi_rad"][i]), back("y", flow["beta_rad"][i])), back("z", flow["gamma_rad"][i]))
        return relative, times(relative, body)

    ours = lambda a: (-a[2], a[1], a[0])
    poses = [body_of(i) for i in range(len(t))]
    entries = [slopes(t, [p[0][i][j] for p in poses]) for i in range(3) for j in range(3)]
    worst = 0.0
    for k in range(2, len(t) - 2):
        dR = [[entries[3 * i + j][k] for j in range(3)] for i in range(3)]
        S = times(dR, transposed(poses[k][0]))  # dR R' = -[w]x
        w = (-S[2][1], -S[0][2], -S[1][0])
        worst = max(worst, math.dist(w, (flow["w_rel_x"][k], flow["w_rel_y"][k], flow["w_rel_z"][k])))
    print(f"rates from the angles of the file differ from its own by at most {worst:.3f} rad a beat, of {max(map(abs, flow['w_rel_y'])):.1f}")

    w = [ours((flow["w_rel_x"][k], flow["w_rel_y"][k], flow["w_rel_z"][k])) for k in range(len(t))]
    v = [ours(apply(p[1], scaled(-1, wind))) for p in poses]
    dw = list(zip(*(slopes(t, [a[i] for a in w]) for i in range(3))))
    dv = list(zip(*(slopes(t, [a[i] for a in v]) for i in range(3))))
    force = [ours(apply(p[1], (flow["force_x"][k], flow["force_y"][k], flow["force_z"][k]))) for k, p in enumerate(poses)]
    late = [k for k in range(len(t)) if t[k] >= 1]

    def by_term(wing):
        loads = [wing.load(v[k], w[k], dv[k], dw[k]) for k in late]
        return {name: [load[name][0][0] for load in loads] for name in TERMS}

    terms = by_term(wing)
    truth = [force[k][0] for k in late]
    print(f"rms of the computed force: normal {rms(truth):.3f}, along the chord {rms([force[k][2] for k in late]):.3f}, "
          f"along the span {rms([force[k][1] for k in late]):.3f} (density x length^4 / beat^2)")

    def row(label, *figures):
        model = [sum(f * x for f, x in zip(figures, at)) for at in zip(*(terms[name] for name in TERMS))]
        print(f"| {label} | " + " | ".join(f"{f:g}" for f in figures)
              + f" | {100 * rms([a - b for a, b in zip(model, truth)]) / rms(truth):.1f} % | {correlation(model, truth):.3f} |")

    print("| normal force, beats 2 and 3 | translation | k_R | C_rd | k_A | error, of rms | r |\n|---|---|---|---|---|---|---|")
    row("translation", 1, 0, 0, 0)
    row("and rotational lift, settled", 1, 1, 0, 0)
    row("and added mass", 1, 1, 0, 1)
    row("rotational lift at its onset", 1, 0.5, 0, 0)
    row("and a plate's drag in pitching", 1, 0.5, 2.0, 0)
    row("and a third of the added mass", 1, 0.5, 2.0, 0.35)
    lagged = Lag(strips, wing).force(t, v, w)
    model = [a + b + 2.0 * c for a, b, c in zip(terms["translation"], [lagged[k] for k in late], terms["pitching"])]
    print(f"| rotational lift with Jones's two states of lag | 1 | 1, lags | 2 | 0 | {100 * rms([a - b for a, b in zip(model, truth)]) / rms(truth):.1f} % | "
          f"{correlation(model, truth):.3f} |")
    fit = least_squares([terms[name] for name in TERMS], truth)
    row("least squares", *(round(f, 3) for f in fit))
    terms = by_term(Wing(strips, density=1.0, rotational_lift=1.0, added_mass=1.0, pitching_drag=1.0, at_axis=True))
    row("velocity at the axis: translation", 1, 0, 0, 0)
    row("and rotational lift about it, settled", 1, 1, 0, 0)
    row("at its onset, and pitching drag", 1, 0.5, 2.0, 0)
    row("least squares", *(round(f, 3) for f in least_squares([terms[name] for name in TERMS], truth)))


class Lag:
    """Rotational circulation of each strip behind Wagner's function, 1 - 0.165 exp(-0.0455 s) - 0.335 exp(-0.3 s), s in half chords travelled
    (R. T. Jones, NACA Report 681, 1940)."""

    def __init__(self, strips, wing):
        self.strips, self.density = strips, wing.density

    def force(self, t, v, w):
        out = [0.0] * len(t)
        for r, dr, c, lead in self.strips:
            states, before = [0.0, 0.0], None
            for k in range(len(t)):
                V = add(v[k], (w[k][1] * (lead - c / 4) - w[k][2] * r, 0.0, w[k][0] * r))
                now = (math.pi / 2 * c**2 * w[k][1], math.hypot(V[0], V[2]))
                if before:
                    middle, way = (now[0] + before[0]) / 2, (now[1] + before[1]) * (t[k] - t[k - 1]) / c
                    states = [middle + (z - middle) * math.exp(-b * way) for z, b in zip(states, (0.0455, 0.3))]
                before = now
                out[k] += self.density * dr * V[2] * (0.5 * now[0] + 0.165 * states[0] + 0.335 * states[1])
        return out


# --- D. hydei: weight supported with measured kinematics ----------------------------------------------------------------------------------------


def hydei():
    beat, plan = columns("hydei_hover.csv"), columns("hydei_wing.csv")
    frequency, mass, width = 188.7, 1.8e-6, (plan["r_mm"][1] - plan["r_mm"][0]) * 1e-3
    strips = [(r * 1e-3, width, c * 1e-3, 0.25 * c * 1e-3) for r, c in zip(plan["r_mm"], plan["chord_mm"])]
    gaits = [Gait.fitted([math.radians(a) for a in beat[key]], 8) for key in ("stroke_deg", "deviation_deg", "rotation_deg")]
    plate = Wing(strips, density=1.2, rotational_lift=1.0, added_mass=1.0, pitching_drag=1.0)
    polar = flight.Vehicle(ROOT / "configs/vehicles/fruit_fly.toml").air
    fly = Wing(strips, density=1.2, rotational_lift=1.0, added_mass=1.0, pitching_drag=1.0, normal=polar["normal"], tangential=polar["tangential"])
    print("| lift of both wings / weight | " + " | ".join(TERMS) + " | k_R 0.5, C_rd 2 | and k_A 0.35 |\n|---|" + "---|" * 6)
    stroke = [gaits[0].at(i / 200, 1)[0] for i in range(200)]
    induced = math.sqrt(mass * GRAVITY / (2 * 1.2 * (max(stroke) - min(stroke)) * (strips[-1][0] + width / 2) ** 2))
    for label, wing, up, sink in (("deviation measured", plate, 1.0, 0.0), ("deviation neglected", plate, 1e-9, 0.0),
                                  ("deviation of the other sign", plate, -1.0, 0.0), (f"measured, induced flow {induced:.2f} m/s", plate, 1.0, induced),
                                  ("measured, C_N and C_T of a model fly", fly, 1.0, 0.0)):
        lift = dict.fromkeys(TERMS, 0.0)
        for i in range(200):
            at = lambda x: motion(gaits, up, x, frequency)
            R, w, _ = at(i / 200)
            h = 1e-4
            dw = scaled(frequency / (2 * h), add(at(i / 200 + h)[1], scaled(-1, at(i / 200 - h)[1])))
            v = lambda x: apply(transposed(at(x)[0]), (0.0, 0.0, sink))
            dv = scaled(frequency / (2 * h), add(v(i / 200 + h), scaled(-1, v(i / 200 - h))))
            for name, (force, _) in wing.load(v(i / 200), w, dv, dw).items():
                lift[name] += 2 * apply(R, force)[2] / 200 / (mass * GRAVITY)
        plain = lift["translation"] + 0.5 * lift["rotation"] + 2 * lift["pitching"]
        print(f"| {label} | " + " | ".join(f"{lift[name]:.3f}" for name in TERMS) + f" | {plain:.3f} | {plain + 0.35 * lift['added mass']:.3f} |")


def motion(gaits, up, x, frequency):
    stroke, deviation, rotation = (g.at(x, frequency) for g in gaits)
    angles = (0.0, stroke[0], up * deviation[0], rotation[0])
    rates = (0.0, stroke[1], up * deviation[1], rotation[1])
    return pose(1, angles), angular_velocity(1, angles, rates), rates


# --- vehicles: hover, power, stability -------------------------------------------------------------------------------------------------------------


def animals():
    for path in sorted((ROOT / "configs/vehicles").glob("*.toml")):
        text = path.read_text()
        if 'model = "jointed"' in text and 'mode = "free"' not in text and "[left.aerodynamics]" in text:
            yield flight.Vehicle(path)


def degrees(gait):
    values = [gait.at(i / 360, 1)[0] for i in range(360)]
    return math.degrees(max(values) - min(values)), math.degrees(gait.mean)


def hover():
    print("| vehicle | mass, g | beats, Hz | stroke, deg | mean | lift / weight | thrust / weight | pitching moment / (weight x wing) | lift while forward |\n|---|"
          + "---|" * 8)
    for v in animals():
        force, moment = v.mean_load()
        weight, (amplitude, mean) = v.mass * GRAVITY, degrees(v.gaits["stroke"])
        print(f"| {v.name} | {1e3 * v.mass:.4g} | {v.frequency:.1f} | {amplitude:.1f} | {mean:.1f} | {force[2] / weight:.4f} | {force[0] / weight:.4f} | "
              f"{moment[1] / weight / v.air['strips'][-1][0]:.4f} | {v.power()[2]:.2f} |")


def power():
    print("| vehicle | air, W/kg of body | without elastic storage | air, W/kg of muscle | without elastic storage |\n|---|---|---|---|---|")
    for v in animals():
        air, whole, _ = v.power()
        muscle = f"{air / v.muscle_mass:.1f} | {whole / v.muscle_mass:.1f}" if v.muscle_mass else "- | -"
        print(f"| {v.name} | {air / v.mass:.1f} | {whole / v.mass:.1f} | {muscle} |")


def shown(root):
    return f"{root.real:.2f}" if root.imag == 0 else f"{root.real:.2f} +- {abs(root.imag):.2f}i"


def stability():
    print("Derivatives without dimension: velocities over U = 2 Phi f r2, rates times the beat, forces over 1/2 rho U^2 S, moments besides over the mean chord.\n")
    names = ("X_u", "Z_u", "M_u", "X_w", "Z_w", "M_w", "X_q", "Z_q", "M_q")
    print("| vehicle | " + " | ".join(names) + " |\n|---|" + "---|" * 9)
    modes = []
    for v in animals():
        D = flight.derivatives(v)
        strips, stroke = v.air["strips"], degrees(v.gaits["stroke"])[0]
        area = sum(dr * c for _, dr, c, _ in strips)
        r2 = math.sqrt(sum(dr * c * r * r for r, dr, c, _ in strips) / area)
        chord, U = area / (strips[-1][0] + strips[-1][1] / 2), 2 * math.radians(stroke) * v.frequency * r2
        push = 0.5 * v.air["density"] * U**2 * 2 * area
        figures = []
        for name in names:
            row, column = {"X": 0, "Z": 2, "M": 4}[name[0]], {"u": 0, "w": 2, "q": 4}[name[2]]
            figures.append(D[row][column] * (v.frequency if column == 4 else U) / push / (chord if row == 4 else 1.0))
        print(f"| {v.name} | " + " | ".join(f"{x:.2f}" for x in figures) + " |")
        modes.append((v.name, flight.eigenvalues(flight.system(v, D)), flight.eigenvalues(flight.system(v, D, True))))
    print("\n| vehicle | longitudinal modes, 1/s | lateral modes, 1/s |\n|---|---|---|")
    for name, *both in modes:
        print(f"| {name} | " + " | ".join("; ".join(shown(r) for r in roots if r.imag >= 0) for roots in both) + " |")


def robots():
    print("| vehicle | mass, g | beats, Hz | stroke, deg | rotation, deg | lift / weight | air at the strokes, mW |\n|---|---|---|---|---|---|---|")
    for path in sorted((ROOT / "configs/vehicles").glob("*_like.toml")):
        v = flight.Vehicle(path)
        lift, extremes, power = flight.hinged_beat(v)
        print(f"| {v.name} | {1e3 * v.mass:.4g} | {v.frequency:.1f} | {degrees(v.gaits['stroke'])[0]:.1f} | "
              f"{math.degrees(extremes[0]):.0f} to {math.degrees(extremes[1]):.0f} | {lift / v.mass / GRAVITY:.3f} | {1e3 * power:.3g} |")


def closed_loop():
    print("| vehicle | never farther than 0.3 m | flap at hover | work of air, W/kg of body | reference | positive work, W/kg of body | reference |\n|---|"
          + "---|" * 6)
    program = (BIN / "flappy-fly").resolve()
    if not program.exists():
        raise FileNotFoundError(2, "", str(program))
    for v in animals():
        with tempfile.TemporaryDirectory() as folder:
            log = pathlib.Path(folder) / "log"
            own = [word for key, path in (("vehicle", f"vehicles/{v.name}.toml"), ("controller", f"controllers/pid_{v.name}.toml"))
                   for word in ("--set", f"{key}={(ROOT / 'configs' / path).resolve()}")]
            said = subprocess.run([program, ROOT / "configs/fly/hover.toml", *own, "--log", log], check=True, capture_output=True, text=True).stdout
            near = said.split("never farther than 0.3 m: ")[1].split(";")[0]
            late = []
            for name in ("command.csv", "joints.csv"):
                with open(log / name, newline="", encoding="utf-8") as f:
                    late.append([row for row in csv.DictReader(f) if float(row["t_s"]) >= 5])
        commands, joints = late
        flap = sum(float(row["flap"]) for row in commands) / len(commands)
        time = float(joints[-1]["t_s"]) - float(joints[0]["t_s"])
        work, positive = ((float(joints[-1][k]) - float(joints[0][k])) / time / v.mass for k in ("work_J", "positive_work_J"))
        air, whole, _ = v.power()
        print(f"| {v.name} | {near} | {flap:.3f} | {work:.1f} | {air / v.mass:.1f} | {positive:.1f} | {whole / v.mass:.1f} |")


for title, table in (("Bumblebee, computed flow", bumblebee), ("D. hydei, hover", hydei), ("Hover", hover), ("Power", power), ("Stability", stability),
                     ("Closed loop", closed_loop), ("Robots", robots)):
    print(f"\n## {title}\n")
    try:
        table()
    except FileNotFoundError as missing:
        print(f"missing: {missing.filename}")
