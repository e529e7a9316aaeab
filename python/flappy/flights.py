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
