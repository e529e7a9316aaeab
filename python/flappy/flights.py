"""Flight logs as NumPy arrays or pandas frames."""

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
