"""Pictures of a flapper: `draw` one moment of an environment, `show` a flight in a notebook. Needs Pillow.

Three views beside each other, parallel projections to one scale: from the front (y to the right), from its right side (x to the right),
and from above (x up, y to the left). Wings and shoulders are those of the hummingbird robot; the body's outline is free.
"""

import base64
import io
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

try:
    from PIL import Image, ImageDraw
except ImportError as error:
    raise ImportError("flappy.render needs Pillow: pip install flappy[render]") from error

Doubles = NDArray[np.float64]

#: Rows: what points right, up and to the viewer.
VIEWS = {
    "front": np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "side": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "top": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
}
SHOULDER_M = (0.0, 0.01395, 0.0189913)  # left; configs/vehicles/hummingbird_nominal.toml
#: Outline of a wing of 70 mm and a mean chord of 21 mm: along the span, and down from the leading edge.
WING_M = np.array([[0, 0], [0.066, 0], [0.069, 0.001], [0.070, 0.004], [0.069, 0.0145], [0.067, 0.0157], [0.004, 0.0268]])
#: Outline of the body, which is round: height and radius.
BODY_M = np.array(
    [
        *([-0.040, 0], [-0.030, 0.004], [-0.016, 0.009], [0.0, 0.0105], [0.012, 0.0085], [0.022, 0.0045]),
        *([0.026, 0.0062], [0.031, 0.0068], [0.036, 0.0048], [0.0375, 0]),
    ]
)
BEAK_M = np.array([[0.0, 0, 0.031], [0.022, 0, 0.029]])
SMALLEST_M = 0.13  # half of what a view shows: the span and a rim
FINE = 3  # drawn so much larger, then averaged

GREY, WING, EDGE, TRAIL, TARGET, TEXT = (125, 133, 144), (47, 129, 247, 110), (31, 94, 190), (150, 190, 240), (224, 112, 44), (60, 66, 75)


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


def wing(side: int, stroke_rad: float, rotation_rad: float) -> Doubles:
    """Outline of a wing in the body's frame, (points, 3) in m.

    The wing hangs down from its leading edge, which points sideways at stroke 0. Stroke turns it about the body's z (left, `side` 1) or
    -z (right, `side` -1), rotation about the leading edge's y: both move it backwards on either side.
    """
    span, chord = WING_M.T
    beta = side * stroke_rad
    x = -chord * np.sin(rotation_rad)
    outline = np.stack([x, side * span, -chord * np.cos(rotation_rad)])
    turn = np.array([[np.cos(beta), -np.sin(beta), 0], [np.sin(beta), np.cos(beta), 0], [0, 0, 1]])
    turned: Doubles = (turn @ outline).T + np.multiply(SHOULDER_M, (1, side, 1))
    return turned


def _window(points: Doubles, centre: Doubles) -> float:
    """Half of what views show, in m: steps of a quarter, so that pictures of one flight rarely change their scale."""
    need = np.abs(points - centre).max() + 0.09
    steps = np.ceil(max(0.0, np.log(need / SMALLEST_M) / np.log(1.25)))
    return float(SMALLEST_M * 1.25**steps)


def _picture(pose: Mapping[str, Any], trail: Doubles, size: tuple[int, int], centre: Doubles, half_m: float) -> Image.Image:
    position, R = np.asarray(pose["position_m"], float), _rotation(pose["attitude"])  # noqa: N806
    wings = [wing(s, *angles) for s, angles in zip((1, -1), zip(pose["stroke_rad"], pose["rotation_rad"], strict=True), strict=True)]
    height = np.linspace(BODY_M[0, 0], BODY_M[-1, 0], 80)
    middle = np.outer(height, R[:, 2]) + position
    beak, bar = BEAK_M @ R.T + position, np.multiply(SHOULDER_M, [[1, 1, 1], [1, -1, 1]]) @ R.T + position
    wings = [w @ R.T + position for w in wings]

    panel, high = size[0] // 3 * FINE, size[1] * FINE
    pixels = min(panel, high) / 2 / half_m
    radius = np.interp(height, *BODY_M.T) * pixels
    image = Image.new("RGB", (size[0] * FINE, high), "white")
    for k, view in enumerate(VIEWS.values()):
        part = Image.new("RGB", (panel, high), "white")
        pen = ImageDraw.Draw(part, "RGBA")

        def at(points: Doubles, view: Doubles = view) -> list[tuple[float, float]]:
            right, up, _ = view @ (points - centre).T
            return list(zip((panel / 2 + right * pixels).tolist(), (high / 2 - up * pixels).tolist(), strict=True))

        if len(trail) > 1:
            thin = [*range(0, len(trail) - 1, len(trail) // 400 + 1), len(trail) - 1]
            pen.line(at(trail[thin]), TRAIL, 2 * FINE, "curve")
        depths = [(w @ view[2]).mean() for w in wings]
        behind = [w for w, depth in zip(wings, depths, strict=True) if depth < view[2] @ position]
        before = [w for w, depth in zip(wings, depths, strict=True) if depth >= view[2] @ position]
        for points in [*behind, None, *before]:
            if points is None:
                pen.line(at(beak), GREY, 2 * FINE)
                pen.line(at(bar), GREY, 4 * FINE)
                for (u, v), r in zip(at(middle), radius, strict=True):
                    pen.ellipse((u - r, v - r, u + r, v + r), GREY)
            else:
                pen.polygon(at(points), WING)
                pen.line(at(points[[*range(len(points)), 0]]), EDGE, FINE)
                pen.line(at(points[:2]), EDGE, 2 * FINE)
        if "target_m" in pose:
            ((u, v),), arm = at(np.array([pose["target_m"]], float)), 6 * FINE
            pen.line([(u - arm, v), (u + arm, v)], TARGET, 2 * FINE)
            pen.line([(u, v - arm), (u, v + arm)], TARGET, 2 * FINE)
        image.paste(part, (k * panel, 0))
    image = image.resize(size, Image.Resampling.BOX)

    pen = ImageDraw.Draw(image)
    for k, (name, view) in enumerate(VIEWS.items()):
        left, down = k * panel // FINE, size[1] - 12
        if k:
            pen.line([(left, 8), (left, size[1] - 8)], (225, 228, 232))
        pen.text((left + 8, 6), name, TEXT)
        corner = left + panel // FINE - 36
        for letter, (right, up, depth) in zip("xyz", view.T, strict=True):
            if not depth:
                pen.line([(corner, down), (corner + 14 * right, down - 14 * up)], GREY)
                pen.text((corner + 21 * right, down - 20 * up), letter, TEXT, anchor="mm")
    if "t_s" in pose:
        pen.text((size[0] - 8, 6), f"{float(pose['t_s']):.2f} s", TEXT, anchor="ra")
    long_m = 10 ** np.floor(np.log10(0.6 * half_m))
    long_m *= max(f for f in (1, 2, 5) if f * long_m <= 0.6 * half_m)
    end = 8 + long_m * pixels / FINE
    pen.line([(8, size[1] - 10), (end, size[1] - 10)], TEXT, 2)
    pen.text((end + 6, size[1] - 10), f"{long_m * 1e3:.0f} mm" if long_m < 1 else f"{long_m:.0f} m", TEXT, anchor="lm")
    return image


def draw(pose: Mapping[str, Any], trail: ArrayLike | None = None, size: tuple[int, int] = (640, 240)) -> NDArray[np.uint8]:
    """A picture of one moment.

    Args:
        pose: as of `env.pose(i)`: position_m (3,), attitude (4,), stroke_rad (2,), rotation_rad (2,), and, where known, target_m (3,), t_s.
        trail: positions so far, (n, 3) in m.
        size: width and height in pixels.

    Returns:
        uint8 (height, width, 3): from the front, from the side and from above; the target in the middle.
    """
    position = np.asarray(pose["position_m"], float)
    way = np.zeros((0, 3)) if trail is None else np.asarray(trail, float).reshape(-1, 3)
    centre = np.asarray(pose["target_m"], float) if "target_m" in pose else position
    return np.asarray(_picture(pose, way, size, centre, _window(np.vstack([way, position]), centre)))


class Film:
    """Pictures of a flight, which notebooks play."""

    def __init__(self, pictures: Sequence[Image.Image], fps: float) -> None:
        self.pictures = pictures
        self.fps = fps

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes an animation: .gif, .webp or .png, by the name."""
        with open(path, "wb") as file:
            self._write(file, os.path.splitext(path)[1].lstrip(".").lower())

    def _write(self, file: Any, kind: str) -> None:
        if kind not in ("gif", "webp", "png"):
            raise ValueError(f"path: ends in {kind!r}; accepted: .gif, .webp, .png")
        first, *rest = self.pictures
        if kind == "gif":
            first = first.quantize(64)
            rest = [p.quantize(palette=first, dither=Image.Dither.NONE) for p in rest]
        first.save(file, kind, save_all=True, append_images=rest, duration=round(1000 / self.fps), loop=0)

    def _repr_html_(self) -> str:
        data = io.BytesIO()
        self._write(data, "gif")
        return f'<img alt="flight" src="data:image/gif;base64,{base64.b64encode(data.getvalue()).decode()}">'


def show(flight: Mapping[str, Any], fps: float = 25, size: tuple[int, int] = (640, 240)) -> Film:
    """A flight as a film: `show(flappy.read_flight(folder))`.

    Args:
        flight: "mocap" with t_s, x_m, y_m, z_m, qw, qx, qy, qz, and, where recorded, "wings" with t_s, left_stroke_rad, left_rotation_rad,
            right_stroke_rad, right_rotation_rad; dicts of arrays or pandas frames. Without wings, they are drawn spread.
        fps: pictures for each second of flight; a wing beat is shorter than the time between two.
        size: width and height in pixels.

    Returns:
        What a notebook plays; `save("flight.gif")` writes it.
    """
    mocap, wings = flight["mocap"], flight.get("wings")
    t_s = np.asarray(mocap["t_s"], float)
    way = np.stack([np.asarray(mocap[name], float) for name in ("x_m", "y_m", "z_m")], 1)
    attitude = np.stack([np.asarray(mocap[name], float) for name in ("qw", "qx", "qy", "qz")], 1)
    moments = np.arange(t_s[0], t_s[-1] + 1e-9, 1 / fps)
    angles = np.zeros((len(moments), 4))  # left stroke, right stroke, left rotation, right rotation
    if wings is not None and len(wings["t_s"]):
        names = ("left_stroke_rad", "right_stroke_rad", "left_rotation_rad", "right_rotation_rad")
        angles = np.stack([np.interp(moments, np.asarray(wings["t_s"], float), np.asarray(wings[name], float)) for name in names], 1)
    centre = (way.min(0) + way.max(0)) / 2
    half_m = _window(way, centre)
    pictures = []
    for t, angle in zip(moments, angles, strict=True):
        k = int(np.searchsorted(t_s, t + 1e-9)) - 1
        pose = {"position_m": way[k], "attitude": attitude[k], "stroke_rad": angle[:2], "rotation_rad": angle[2:], "t_s": t}
        pictures.append(_picture(pose, way[: k + 1], size, centre, half_m))
    return Film(pictures, fps)
