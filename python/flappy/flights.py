"""Flight logs as NumPy arrays or pandas frames, and as pages to look at."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _core


def read_flight(folder: str | Path, *, frames: bool = False) -> dict[str, Any]:
    """Reads a flight log.

    Returns:
        "header", the text of flight.toml, and the streams "command", "mocap", "imu", "power", "wings" and "attitude", those that the
        log has: each a dict of columns, float64 (samples,), or a pandas frame (`frames`). Names of columns end with their units.

    Raises:
        InputError: "folder/file:line: what is wrong; what is accepted".
    """
    flight: dict[str, Any] = _core.read_flight(Path(folder))
    if frames:
        import pandas

        flight = {name: part if name == "header" else pandas.DataFrame(part) for name, part in flight.items()}
    return flight


class Page:
    """A page that opens anywhere: notebooks show it, `save` writes it."""

    def __init__(self, html: str) -> None:
        self.html = html

    def save(self, path: str | Path) -> None:
        """Writes the HTML file, which needs nothing else."""
        Path(path).write_text(self.html, encoding="utf-8")

    def _repr_html_(self) -> str:
        text = self.html.replace("&", "&amp;").replace('"', "&quot;")
        return f'<iframe title="flight" sandbox="allow-scripts" style="width: 100%; height: 800px; border: 0" srcdoc="{text}"></iframe>'


def show(*flights: str | Path | Mapping[str, Any], vehicle: str | Path | None = None, goal_m: Sequence[float] | None = None) -> Page:
    """Flights as the page of `flappy-report`: the robot in 3D, its streams beside it; two or more are overlaid.

    Args:
        flights: folders, or what `read_flight` returns, arrays or frames.
        vehicle: file of the vehicle of flights whose folder has none; else the shipped one of the name that they declare.
        goal_m: where they were to go, (3,) in W.

    Raises:
        InputError: a log that cannot be read, a vehicle that is nowhere, or more flights than a page shows.
    """
    if not flights:
        raise ValueError("show: no flight is given; accepted: folders of flights, or what read_flight returns")
    paths = [dict(flight) if isinstance(flight, Mapping) else Path(flight) for flight in flights]
    return Page(_core.flights_page(paths, vehicle, goal_m))


def to_rerun(flight: str | Path | Mapping[str, Any], file: str | Path, *, name: str = "flight") -> None:
    """Writes a flight log as a recording of Rerun (.rrd), by Rerun's own SDK (`pip install rerun-sdk`).

    The robot's pose and path by motion capture are /robot and /path; each other column of a stream is a scalar /stream/column, such as
    /imu/gyro_x_rad_s. The timeline t_s is the log's clock: samples stand where they arrived, later by the latency that the log declares.

    Args:
        flight: a folder, or what `read_flight` returns, arrays or frames.
        file: where to; the viewer shows it with `rerun FILE`.
        name: of the recording.

    Raises:
        InputError: a log that cannot be read.
        ImportError: the package is missing.
    """
    import numpy as np
    import rerun as rr

    streams = flight if isinstance(flight, Mapping) else read_flight(flight)
    with rr.RecordingStream(f"flappy-{name}") as recording:
        recording.save(file)
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for stream in (each for each in streams if each != "header"):
            columns = {key: np.asarray(values, dtype=float) for key, values in streams[stream].items()}
            clock = rr.TimeColumn("t_s", duration=columns.pop("t_s"))
            if stream == "mocap":
                at = np.stack([columns[key] for key in ("x_m", "y_m", "z_m")], axis=1)
                turned = np.stack([columns[key] for key in ("qx", "qy", "qz", "qw")], axis=1)  # Rerun has w last
                recording.send_columns("/robot", [clock], rr.Transform3D.columns(translation=at, quaternion=turned))
                recording.log("/robot", rr.TransformAxes3D(0.1), static=True)
                seen = np.isfinite(at).all(axis=1)
                strips = [
                    at[part] for part in np.split(np.arange(len(at)), np.flatnonzero(np.diff(seen)) + 1) if len(part) and seen[part[0]]
                ]
                recording.log("/path", rr.LineStrips3D(strips), static=True)  # with a gap where tracking was lost
            for key, values in columns.items():
                recording.send_columns(f"/{stream}/{key}", [clock], rr.Scalars.columns(scalars=values))
