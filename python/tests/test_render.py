"""Pictures of flappers."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("PIL")

from flappy.render import draw, show, wing

WING = (np.array([47, 129, 247]) * 110 + 255 * 145) // 255  # as drawn on white


def pose(roll_rad: float = 0, **other: Any) -> dict[str, Any]:
    """At the target, level but for its roll."""
    attitude = [np.cos(roll_rad / 2), np.sin(roll_rad / 2), 0, 0]
    wings = {"stroke_rad": [0.4, 0.4], "rotation_rad": [0.5, 0.5]}
    return {"position_m": [0, 0, 0], "attitude": attitude, "target_m": [0, 0, 0]} | wings | other


def wings(image: np.ndarray) -> np.ndarray:
    """Where wings are."""
    return np.abs(image.astype(int) - WING).sum(-1) < 8


def flight() -> dict[str, Any]:
    """A second of climbing turns."""
    t = np.linspace(0, 1, 201)
    mocap = {"t_s": t, "x_m": 0.1 * t, "y_m": 0 * t, "z_m": 0.2 * t, "qw": np.cos(t), "qx": 0 * t, "qy": 0 * t, "qz": np.sin(t)}
    names = ("left_stroke_rad", "left_rotation_rad", "right_stroke_rad", "right_rotation_rad")
    return {"mocap": mocap, "wings": {"t_s": t} | {name: np.sin(200 * t) for name in names}}


def test_picture_has_its_size_and_three_views() -> None:
    image = draw(pose(), size=(480, 200))
    assert image.shape == (200, 480, 3)
    assert image.dtype == np.uint8
    assert all((image[50:150, k * 160 + 20 : k * 160 + 140] == (125, 133, 144)).any() for k in range(3))


def test_level_wings_are_symmetrical_from_the_front_and_from_above() -> None:
    image = wings(draw(pose(), size=(630, 240)))
    for view in (image[:, :210], image[:, 420:]):
        assert np.mean(view != view[:, ::-1]) < 0.005
        assert view.sum() > 300


def test_roll_to_the_right_lowers_the_right_wing() -> None:
    """From the front, the right wing is on the left."""
    high, wide = np.nonzero(wings(draw(pose(roll_rad=0.5), size=(630, 240))[:, :210]))
    assert high[wide < 80].mean() > high[wide > 130].mean() + 20


@pytest.mark.parametrize("side", [1, -1])
def test_wing_hangs_down_and_strokes_backwards(side: int) -> None:
    still, back, turned = wing(side, 0, 0), wing(side, 0.5, 0), wing(side, 0, 0.5)
    assert np.ptp(still[:, 0]) == 0
    assert still[:, 2].max() == pytest.approx(0.0189913)
    assert np.abs(still[:, 1]).max() == pytest.approx(0.08395)
    assert back[:, 0].min() == pytest.approx(-0.07 * np.sin(0.5))
    assert turned[:, 0].min() == pytest.approx(-0.0268 * np.sin(0.5))


def test_target_and_trail_are_drawn_where_they_are() -> None:
    near, far = draw(pose(position_m=[0, 0.1, 0])), draw(pose(position_m=[0, 0.1, 0]), trail=[[0, 0, -0.1], [0, 0.1, 0]])
    assert (near[120, 106] == (224, 112, 44)).all()
    assert (near != far).any()
    without = pose()
    del without["target_m"]
    assert not (draw(without) == (224, 112, 44)).all(-1).any()


def test_film_is_embedded_and_saved(tmp_path: Any) -> None:
    from PIL import Image

    film = show(flight(), fps=10, size=(240, 90))
    assert film._repr_html_().startswith('<img alt="flight" src="data:image/gif;base64,')
    for kind in ("gif", "png"):
        film.save(tmp_path / f"flight.{kind}")
        with Image.open(tmp_path / f"flight.{kind}") as image:
            assert (image.n_frames, image.size) == (11, (240, 90))
    with pytest.raises(ValueError, match=r"accepted: \.gif"):
        film.save(tmp_path / "flight.mp4")


def test_film_of_frames_and_without_wings() -> None:
    whole = flight()
    pandas = pytest.importorskip("pandas")
    frames = show({name: pandas.DataFrame(stream) for name, stream in whole.items()}, fps=5, size=(240, 90))
    assert all((np.asarray(a) == np.asarray(b)).all() for a, b in zip(frames.pictures, show(whole, 5, (240, 90)).pictures, strict=True))
    assert len(show({"mocap": whole["mocap"]}, fps=5, size=(240, 90)).pictures) == 6


def test_environment_renders() -> None:
    gymnasium = pytest.importorskip("gymnasium")
    env = gymnasium.make("flappy:flappy/Hover-v0", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    env.step(np.ones(4, np.float32))
    assert before.shape == (240, 640, 3)
    assert (env.render() != before).any()
    env.close()
