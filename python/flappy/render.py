"""Pictures of a flapper without a browser: the scene of the flight page, drawn by NumPy and Pillow in a few milliseconds.

The robot's shape is the page's (src/view/shape.hpp), and so are the chase camera, the colours, the grid of decimetres, trail and goal
(src/view/web/scene.js). What is nearer is drawn later: there is no depth buffer.
"""

from collections.abc import Callable, Mapping
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

try:
    from PIL import Image, ImageDraw
except ImportError as error:
    raise ImportError("flappy.render needs Pillow: pip install flappy[render]") from error

Doubles = NDArray[np.float64]
Colour = tuple[int, ...]

FINE = 2  # drawn so much larger, then averaged
FIELD_RAD, NEAR_M = np.radians(35), 0.01  # of the camera, from bottom to top
AZIMUTH_RAD, ELEVATION_RAD, DISTANCE_M = -2.3, 0.35, 0.55  # from which the robot is followed
FAR_M = 50  # what lies farther away is not there
FLOOR_STEP_M = 0.1  # without a ground the grid is below the flight, and goes down with it in such steps
VELOCITY_ARROW_S = 0.12
HALF_SPAN_M = 0.084  # of the robot that distances and arrows are made for
TRAIL_POINTS = 400
BALL = tuple((float(-np.cos(a)), float(np.sin(a))) for a in np.linspace(0, np.pi, 13))  # height and radius
SUN = np.array([-1, -2, 4]) / np.sqrt(21)

SKY, FLOOR, GRID, GRID_IN_AIR = (246, 248, 250), (235, 239, 243), (196, 204, 212), (216, 222, 228)
CEILING, WALL, SHADOW = (175, 184, 193, 64), (140, 149, 159, 77), (87, 96, 106)
WING, TRAIL, DARK, BODY = (0, 114, 178), (49, 141, 192), (36, 41, 47), np.array([139, 152, 165])
VELOCITY, GOAL, GOAL_TEXT = (0, 158, 115), (204, 121, 167), (138, 61, 102)
AXES = (("x", (213, 94, 0)), ("y", VELOCITY), ("z", WING))


def _rotation(attitude: ArrayLike) -> Doubles:
    """Of a quaternion w, x, y, z: body to world."""
    w, x, y, z = np.asarray(attitude, float) / np.linalg.norm(attitude)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def wing(side: Mapping[str, Any], sign: int, stroke_rad: float, rotation_rad: float) -> Doubles:
    """Outline of a wing in the body's frame, (points, 3) in m: root, trailing edge, tip, leading edge.

    It hangs down from its leading edge, which points sideways at stroke 0. Stroke turns it about the body's z (left, `sign` 1) or -z
    (right, `sign` -1), rotation about the leading edge: both move it backward on either side.
    """
    outline = np.asarray(side["outline_m"], float)
    span, chord = np.vstack([[outline[0, 0], 0], outline, [outline[-1, 0], 0]]).T
    x, y, z = -chord * np.sin(rotation_rad), sign * span, -chord * np.cos(rotation_rad)
    c, s = np.cos(sign * stroke_rad), np.sin(sign * stroke_rad)
    turned: Doubles = np.stack([c * x - s * y, s * x + c * y, z], 1) + side["shoulder_m"]
    return turned


@cache
def _body(profile: tuple[tuple[float, float], ...], sides: int = 16) -> tuple[Doubles, Doubles]:
    """Faces of the body (n, 4, 3), and their normals (n, 3), in its frame."""
    height, radius = np.array(profile).T
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    ring = np.stack([np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle)), np.repeat(height[:, None], sides + 1, 1)], 2)
    faces = np.stack([ring[:-1, :-1], ring[:-1, 1:], ring[1:, 1:], ring[1:, :-1]], 2).reshape(-1, 4, 3)
    normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    return faces, normals / np.linalg.norm(normals, axis=1, keepdims=True)


class _Pen:
    """Draws things of the world as a camera sees them."""

    def __init__(self, size: tuple[int, int], target: Doubles, distance_m: float) -> None:
        self.wide, self.high = size[0] * FINE, size[1] * FINE
        self.image = Image.new("RGB", (self.wide, self.high), SKY)
        self.ink = ImageDraw.Draw(self.image, "RGBA")
        level = np.cos(ELEVATION_RAD)
        away = np.array([level * np.cos(AZIMUTH_RAD), level * np.sin(AZIMUTH_RAD), np.sin(ELEVATION_RAD)])
        right = np.array([-np.sin(AZIMUTH_RAD), np.cos(AZIMUTH_RAD), 0])
        self.eye = target + distance_m * away
        self.view = np.stack([right, np.cross(away, right), -away])  # rows: right, up, ahead
        self.focal = self.high / 2 / np.tan(FIELD_RAD / 2)

    def seen(self, points: ArrayLike) -> Doubles:
        """Points (..., 3) in W, as right, up, ahead of the camera."""
        seen: Doubles = (np.asarray(points, float) - self.eye) @ self.view.T
        return seen

    def at(self, seen: Doubles) -> Doubles:
        """Pixels (..., 2) of what is ahead."""
        across = self.focal * seen[..., :2] / seen[..., 2:]
        return np.stack([self.wide / 2 + across[..., 0], self.high / 2 - across[..., 1]], -1)

    def area(self, points: ArrayLike, colour: Colour) -> None:
        """A flat polygon, cut where it is behind the camera."""
        seen = self.seen(points)
        if (seen[:, 2] < NEAR_M).any():
            kept = []
            for a, b in zip(seen, np.roll(seen, -1, 0), strict=True):
                if a[2] >= NEAR_M:
                    kept.append(a)
                if (a[2] >= NEAR_M) != (b[2] >= NEAR_M):
                    kept.append(a + (b - a) * (NEAR_M - a[2]) / (b[2] - a[2]))
            seen = np.array(kept).reshape(-1, 3)
        if len(seen) > 2:
            self.ink.polygon(self.at(seen).ravel().tolist(), colour)

    def line(self, points: ArrayLike, colour: Colour, wide_m: float = 0) -> None:
        """A path, as wide as it is there, and a pixel at least; what is behind the camera is left out."""
        seen = self.seen(points)
        ahead = seen[:, 2] >= NEAR_M
        if not ahead.any():
            return
        wide = max(FINE, round(wide_m * self.focal / seen[ahead, 2].mean())) if wide_m > 0 else FINE
        if ahead.all():
            self.ink.line(self.at(seen).ravel().tolist(), colour, wide, "curve" if wide > 4 * FINE else None)
            return
        for a, b in pairwise(seen):
            if max(a[2], b[2]) <= NEAR_M:
                continue
            ends = [p if p[2] >= NEAR_M else p + (o - p) * (NEAR_M - p[2]) / (o[2] - p[2]) for p, o in ((a, b), (b, a))]
            self.ink.line(self.at(np.array(ends)).ravel().tolist(), colour, wide)

    def dot(self, centre: Doubles, radius_m: float, colour: Colour) -> None:
        seen = self.seen(centre)
        if seen[2] >= NEAR_M:
            (x, y), radius = self.at(seen), max(FINE, radius_m * self.focal / seen[2])
            self.ink.ellipse((x - radius, y - radius, x + radius, y + radius), colour)

    def arrow(self, start: Doubles, along: Doubles, colour: Colour) -> None:
        length = float(np.linalg.norm(along))
        if length < 0.004:
            return
        way = along / length
        neck, tip = start + way * max(1e-4, length - 0.012), start + way * length
        aside = np.cross(way, self.view[2])
        aside *= 0.0042 / max(1e-9, float(np.linalg.norm(aside)))
        self.line([start, neck], colour, 0.0026)
        self.area([neck + aside, tip, neck - aside], colour)


def _draw_place(pen: _Pen, ambient: Mapping[str, Any], way: Doubles) -> tuple[float, list[tuple[Doubles, str, Colour]]]:
    """Ground, grid, ceiling and walls; the floor's height, and names that are to stand beside things."""
    low, high = way.min(0), way.max(0)
    middle, extent = (low + high) / 2, max(0.25, float((high - low).max()))
    ground = abs(ambient["ground_z_m"] - low[2]) < FAR_M
    floor = ambient["ground_z_m"] if ground else FLOOR_STEP_M * np.floor((low[2] - 0.12) / FLOOR_STEP_M)
    half = np.ceil(5 * extent + 5) / 10 + 0.4
    x, y = np.round(middle[:2], 1)
    corners = np.array([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])

    def level(z: float) -> Doubles:
        return np.column_stack([corners, np.full(4, z)])

    if ground:
        pen.area(level(floor), FLOOR)
    for k in np.linspace(-half, half, round(20 * half) + 1):
        for line in ([[x + k, y - half, floor], [x + k, y + half, floor]], [[x - half, y + k, floor], [x + half, y + k, floor]]):
            pen.line(line, GRID if ground else GRID_IN_AIR)
    if abs(ambient["ceiling_z_m"] - high[2]) < FAR_M:
        pen.area(level(ambient["ceiling_z_m"]), CEILING)
    for wall_x, wall_y, normal_x, normal_y in ambient["walls"]:
        away = (middle[0] - wall_x) * normal_x + (middle[1] - wall_y) * normal_y
        if abs(away) <= FAR_M:
            foot, along = middle[:2] - away * np.array([normal_x, normal_y]), half * np.array([-normal_y, normal_x])
            pen.area([[*(foot + s * along), z] for s, z in ((-1, floor), (1, floor), (1, high[2] + 0.3), (-1, high[2] + 0.3))], WALL)
    corner = np.array([x - half + 0.1, y - half + 0.1, floor])
    names: list[tuple[Doubles, str, Colour]] = []
    for (name, colour), axis in zip(AXES, np.eye(3), strict=True):
        pen.arrow(corner, 0.1 * axis, colour)
        names.append((corner + 0.125 * axis, name, DARK))
    return float(floor), names


def _draw_body(pen: _Pen, shape: Mapping[str, Any], position: Doubles, turn: Doubles) -> None:
    faces, normals = _body(BALL if "body_m" in shape else tuple(map(tuple, shape["profile_m"])))
    colour = BODY
    if "body_m" in shape:
        faces, normals = faces * shape["body_m"], normals / shape["body_m"]
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        colour = np.array(WING)
    faces, normals = faces @ turn.T + position, normals @ turn.T
    towards = ((pen.eye - faces.mean(1)) * normals).sum(1) > 0
    faces, normals = faces[towards], normals[towards]
    # the page's two lights on three.js's standard material, which is half a metal; its gloss is left out
    light = 0.625 * (0.892 + 0.108 * (0.5 + 0.5 * normals[:, 1])) + 0.275 * np.maximum(0, normals @ SUN)
    lit = light[:, None] * colour
    if "body_m" in shape:
        lit = 0.4 * lit + 0.6 * np.array(SKY)
    seen, colours = pen.seen(faces), lit.astype(int).tolist()
    pixels = pen.at(seen).reshape(-1, 8).tolist()
    for k in np.argsort(-seen[:, :, 2].mean(1)):
        pen.ink.polygon(pixels[k], tuple(colours[k]))


def _draw_robot(pen: _Pen, shape: Mapping[str, Any], pose: Mapping[str, Any]) -> None:
    position, turn = np.asarray(pose["position_m"], float), _rotation(pose["attitude"])
    if "body_m" in shape:  # the ellipsoid of its inertia, with a nose
        nose, long = shape["body_m"][0], 0.3 * max(shape["body_m"])
        beak = np.array([[nose, 0, 0], [nose + long / 2, 0, 0], [nose + long, 0, 0]])
        width = 0.3 * long
    else:
        size = shape["left"]["outline_m"][-1][0] / 0.07
        beak = size * np.array([[0.005, 0, 0.03], [0.017, 0, 0.03], [0.029, 0, 0.03]])
        width = 0.003 * size
    beak = beak @ turn.T + position

    def draw_beak() -> None:
        pen.line(beak[:2], DARK, width)
        pen.line(beak[1:], DARK, width / 2)

    parts: list[tuple[Doubles, Callable[[], None]]] = [(position, lambda: _draw_body(pen, shape, position, turn)), (beak[1], draw_beak)]
    for k, (name, sign) in enumerate((("left", 1), ("right", -1)) if "left" in shape else ()):
        outline = wing(shape[name], sign, pose["stroke_rad"][k], pose["rotation_rad"][k]) @ turn.T + position
        root = turn @ shape[name]["shoulder_m"] + position

        def membrane(outline: Doubles = outline, root: Doubles = root) -> None:
            pen.area(outline, (*WING, 140))
            pen.line(outline[1:], WING)
            pen.line([root, outline[-1]], DARK, 0.0021)

        parts.append((outline.mean(0), membrane))
    for _, draw_part in sorted(parts, key=lambda part: -float(pen.seen(part[0])[2])):
        draw_part()


def draw(
    pose: Mapping[str, Any], scene: Mapping[str, Any], trail: ArrayLike | None = None, size: tuple[int, int] = (640, 480)
) -> NDArray[np.uint8]:
    """A picture of one moment, the robot in the middle.

    Args:
        pose: as of `env.unwrapped.pose(i)`: position_m (3,), attitude (4,), stroke_rad (2,), rotation_rad (2,), and, where known,
            velocity_m_s (3,), target_m (3,), t_s. Without modelled wings, position and attitude are enough.
        scene: as of `env.unwrapped.scene`: the vehicle's shape and what is around it.
        trail: positions so far, (n, 3) in m.
        size: width and height in pixels.

    Returns:
        uint8 (height, width, 3).
    """
    position = np.asarray(pose["position_m"], float)
    path = np.zeros((0, 3)) if trail is None else np.asarray(trail, float).reshape(-1, 3)
    scale = max(scene["vehicle"].get("body_m", [HALF_SPAN_M])) / HALF_SPAN_M  # of things that are drawn beside the robot
    pen = _Pen(size, position, DISTANCE_M * scale)
    way = np.vstack([path, position, *([pose["target_m"]] if "target_m" in pose else [])])
    floor, names = _draw_place(pen, scene["ambient"], way)
    round_ = np.linspace(0, 2 * np.pi, 33)[:-1]
    circle = 0.03 * np.stack([np.cos(round_), np.sin(round_), 0 * round_], 1)
    opacity = 0.35 / (1 + 4 * max(0.0, position[2] - floor))
    pen.area(np.add(scale * circle, (position[0], position[1], floor)), (*SHADOW, round(255 * opacity)))
    if len(path) > 1:
        extent = max(0.25, float(np.ptp(way, 0).max()))
        pen.line(path[np.unique(np.linspace(0, len(path) - 1, TRAIL_POINTS).astype(int))], TRAIL, 2 * min(0.003, 0.0005 + 0.0006 * extent))
    if "target_m" in pose:
        goal = np.asarray(pose["target_m"], float)
        pen.line(np.vstack([circle, circle[:2]]) + goal, GOAL, 0.0032)
        pen.dot(goal, 0.004, GOAL)
        names.append((np.add(goal, (0, 0, 0.06)), "goal", GOAL_TEXT))
    along = scale * VELOCITY_ARROW_S * np.asarray(pose.get("velocity_m_s", np.zeros(3)), float)
    behind = pen.view[2] @ along > 0
    if behind:
        pen.arrow(position, along, VELOCITY)
    _draw_robot(pen, scene["vehicle"], pose)
    if not behind:
        pen.arrow(position, along, VELOCITY)

    image = pen.image.reduce(FINE)
    ink = ImageDraw.Draw(image)
    for where, name, colour in names:
        seen = pen.seen(where)
        if seen[2] > NEAR_M:
            ink.text(tuple(pen.at(seen) / FINE), name, colour, anchor="mm")
    if "t_s" in pose:
        ink.text((size[0] - 8, 6), f"{float(pose['t_s']):.2f} s", DARK, anchor="ra")
    return np.asarray(image)
