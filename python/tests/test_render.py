"""Pictures of flappers, and pages of flights."""

import html
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flappy
from flappy import _core

SCENE = json.loads(_core.Environments(Path("fly/hover_direct.toml"), [], 1, "disabled", True).scene())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short flight's."""
    log = tmp_path_factory.mktemp("flights") / "hover"
    flappy.fly("fly/hover.toml", overrides=["flight.duration_s=0.3"], log=log)
    return log


def report(page: flappy.Page) -> dict[str, Any]:
    """The data of a page."""
    text = page.html.split('id="report">')[1].split("</script>")[0]
    data: dict[str, Any] = json.loads(text)["sections"][0]["blocks"][0]
    return data


def test_page_of_a_folder_is_that_of_its_arrays_and_frames(folder: Path) -> None:
    whole, arrays = flappy.show(folder, goal_m=(1, 2, 3)), flappy.show(flappy.read_flight(folder))
    (flight,), (same,) = report(whole)["flights"], report(arrays)["flights"]
    assert (flight["name"], same["name"], report(whole)["goal_m"]) == ("hover", "flight 1", [1, 2, 3])
    assert flight["vehicle"] == SCENE["vehicle"] | {"name": "hummingbird_identified"}
    assert flight["streams"] == same["streams"]
    packed = [page.html.split('id="packed">')[1].split("</script>")[0] for page in (whole, arrays)]
    assert len(packed[0]) > 1000
    assert packed[0] == packed[1]
    pytest.importorskip("pandas")
    assert flappy.show(flappy.read_flight(folder, frames=True)).html == arrays.html
    assert [f["name"] for f in report(flappy.show(folder, folder))["flights"]] == ["hover", "hover"]


def test_page_stands_in_a_notebook_and_is_saved(folder: Path, tmp_path: Path) -> None:
    page = flappy.show(folder)
    cell = page._repr_html_()
    source = cell.split('srcdoc="')[1].split('"')[0]
    assert html.unescape(source) == page.html
    assert cell.endswith('"></iframe>')
    page.save(tmp_path / "flight.html")
    assert (tmp_path / "flight.html").read_text(encoding="utf-8") == page.html


def test_what_cannot_be_shown_is_said(folder: Path) -> None:
    with pytest.raises(ValueError, match="no flight is given"):
        flappy.show()
    with pytest.raises(flappy.InputError, match="none: cannot be read"):
        flappy.show(folder.parent / "none")
    flight = flappy.read_flight(folder)
    flight["header"] = flight["header"].replace("hummingbird_identified", "bird")
    with pytest.raises(flappy.InputError, match=r"flight 1/flight\.toml: vehicle: there is no bird\.toml .* vehicle=FILE"):
        flappy.show(flight)
    assert report(flappy.show(flight, vehicle="vehicles/hummingbird_nominal.toml"))["flights"][0]["vehicle"] == SCENE["vehicle"]


pytest.importorskip("PIL")

from flappy.render import GOAL, WING, draw, wing


def pose(**other: Any) -> dict[str, Any]:
    """Level, at the goal."""
    wings = {"stroke_rad": [0.4, 0.4], "rotation_rad": [0.5, 0.5]}
    return {"position_m": [0, 0, 0], "attitude": [1, 0, 0, 0]} | wings | other


def near(image: np.ndarray, colour: Any, tolerance: int = 60) -> np.ndarray:
    """Where a colour is, (n, 2): right and down."""
    return np.argwhere(np.abs(image.astype(int) - colour).sum(-1) < tolerance)[:, ::-1]


def wings(image: np.ndarray) -> np.ndarray:
    """Where wings are: their blue, on the sky."""
    return near(image, 0.55 * np.array(WING) + 0.45 * 248)


def pixel(point_m: Any, watched_m: Any, size: tuple[int, int] = (640, 480)) -> np.ndarray:
    """Where the page's chase camera sees a point: 35 degrees high, 0.55 m from the robot, from azimuth -2.3 and elevation 0.35."""
    away = np.array([np.cos(0.35) * np.cos(-2.3), np.cos(0.35) * np.sin(-2.3), np.sin(0.35)])
    right = np.cross([0, 0, 1], away) / np.cos(0.35)
    p = np.subtract(point_m, watched_m) - 0.55 * away
    scale = size[1] / 2 / np.tan(np.radians(17.5)) / -(p @ away)
    return np.array([size[0] / 2 + scale * (p @ right), size[1] / 2 - scale * (p @ np.cross(away, right))])


@pytest.mark.parametrize(("name", "sign"), [("left", 1), ("right", -1)])
def test_wing_hangs_down_and_strokes_backward(name: str, sign: int) -> None:
    side = SCENE["vehicle"][name]
    still, back, turned = wing(side, sign, 0, 0), wing(side, sign, 0.5, 0), wing(side, sign, 0, 0.5)
    assert np.ptp(still[:, 0]) == 0
    assert still[:, 2].max() == pytest.approx(0.0189913)
    assert np.abs(still[:, 1]).max() == pytest.approx(0.08395)
    assert back[:, 0].min() == pytest.approx(-0.07 * np.sin(0.5))
    assert turned[:, 0].min() == pytest.approx(-side["outline_m"][0][1] * np.sin(0.5))


@pytest.mark.parametrize(("stroke", "rotation"), [(-0.6, 0.5), (0.0, 0.5), (0.6, 0.5), (0.0, -0.8)])
def test_wings_are_where_they_beat(stroke: float, rotation: float) -> None:
    image = draw(pose(stroke_rad=[stroke, stroke], rotation_rad=[rotation, rotation]), SCENE)
    blue = near(image, WING, 200)
    assert len(wings(image)) > 500
    for name, sign in (("left", 1), ("right", -1)):
        outline = wing(SCENE["vehicle"][name], sign, stroke, rotation)
        for corner in (outline[-1], outline[-3]):  # the tip before and behind
            assert np.abs(blue - pixel(corner, [0, 0, 0])).sum(-1).min() < 5


def test_robot_is_watched_and_turns_with_its_attitude() -> None:
    image = draw(pose(position_m=[3, -2, 5], stroke_rad=[-1, -1]), SCENE).astype(int)
    for height, there in ((-0.05, False), (-0.03, True), (0.0, True), (0.03, True), (0.05, False)):
        x, y = pixel([3, -2, 5 + height], [3, -2, 5]).astype(int)
        assert (abs(image[y, x] - [98, 107, 116]).max() < 30) == there, height
    upright, upside_down = (wings(draw(pose(attitude=q), SCENE)).mean(0)[1] for q in ([1, 0, 0, 0], [0, 1, 0, 0]))
    assert upright < 240 - 5
    assert upside_down > 240 + 5


@pytest.mark.parametrize("position", [[0, 0, 0], [0.05, -0.03, 0.04]])
def test_goal_trail_and_ground_are_where_they_are(position: list[float]) -> None:
    with_goal = pose(position_m=position, target_m=[0, 0.1, 0.05])
    ring = near(draw(with_goal, SCENE), GOAL, 15)
    assert len(ring) > 100
    assert np.abs((ring.min(0) + ring.max(0)) / 2 - pixel([0, 0.1, 0.05], position)).max() < 4
    assert len(near(draw(pose(position_m=position), SCENE), GOAL, 15)) == 0
    start = np.add(position, [-0.05, 0.1, 0.1])
    with_trail = draw(with_goal, SCENE, trail=[start, position])
    changed = np.argwhere((with_trail != draw(with_goal, SCENE, trail=[start, start])).any(-1))[:, ::-1]
    assert np.abs(changed - pixel(start, position)).sum(-1).min() < 5
    ground = SCENE | {"ambient": {"ground_z_m": position[2] - 0.1, "ceiling_z_m": 1e3, "walls": []}}
    x, y = pixel(np.add(position, [0.03, -0.13, -0.1]), position).astype(int)
    assert np.abs(draw(with_goal, ground)[y - 2 : y + 3, x - 2 : x + 3].astype(int) - (235, 239, 243)).sum(-1).min() < 3


def test_robot_without_wings_is_its_ellipsoid() -> None:
    scene = SCENE | {"vehicle": {"name": "ball", "mass_kg": 0.03, "body_m": [0.04, 0.02, 0.02]}}
    image = draw({"position_m": [0, 0, 0], "attitude": [1, 0, 0, 0]}, scene).astype(int)
    blue = image[..., 2] - image[..., 0]
    scale = 0.04 / 0.084  # the camera is as much nearer
    for point, there in (([0, 0, 0], True), ([-0.035, 0, 0], True), ([0, 0, 0.018], True), ([0, 0, 0.03], False), ([0, 0.05, 0], False)):
        x, y = pixel(np.divide(point, scale), [0, 0, 0]).astype(int)
        assert (blue[y, x] > 20) == there, point


def test_environment_renders() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    env = gymnasium.make("flappy:flappy/Hover-v0", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    env.step(np.ones(4, np.float32))
    assert (before.shape, before.dtype) == ((480, 640, 3), np.uint8)
    assert not np.array_equal(wings(env.render()), wings(before))
    env.close()
