"""Flights as recordings of Rerun, read back by Rerun's own reader."""

from pathlib import Path

import numpy as np
import pytest

import flappy

chunk = pytest.importorskip("rerun.chunk")


def test_a_flight_comes_back(tmp_path: Path) -> None:
    flappy.fly("fly/hover.toml", log=tmp_path / "flight", overrides=["flight.duration_s=0.3"])
    flight = flappy.read_flight(tmp_path / "flight")
    flappy.to_rerun(tmp_path / "flight", tmp_path / "flight.rrd")
    read = {}
    for part in chunk.RrdReader(tmp_path / "flight.rrd").stream():
        rows = part.to_record_batch()
        read |= {(part.entity_path, name): rows.column(name) for name in rows.schema.names}

    def clock_s(entity: str) -> np.ndarray:
        return read[entity, "t_s"].cast("int64").to_numpy() * 1e-9

    for stream, columns in flight.items():
        for name, values in columns.items() if stream != "header" else ():
            if name != "t_s":
                entity = f"/{stream}/{name}"
                np.testing.assert_array_equal([row[0] for row in read[entity, "Scalars:scalars"].to_pylist()], values)
                np.testing.assert_allclose(clock_s(entity), columns["t_s"], rtol=0, atol=1e-9)  # nanoseconds
    mocap = flight["mocap"]
    at = np.array(read["/robot", "Transform3D:translation"].to_pylist())[:, 0]
    turned = np.array(read["/robot", "Transform3D:quaternion"].to_pylist())[:, 0]
    single = {"rtol": 1e-6, "atol": 1e-7}  # Rerun keeps poses as float32
    np.testing.assert_allclose(at, np.stack([mocap[key] for key in ("x_m", "y_m", "z_m")], axis=1), **single)
    np.testing.assert_allclose(turned, np.stack([mocap[key] for key in ("qx", "qy", "qz", "qw")], axis=1), **single)


def test_a_folder_that_is_none_is_said(tmp_path: Path) -> None:
    with pytest.raises(flappy.InputError):
        flappy.to_rerun(tmp_path / "nowhere", tmp_path / "flight.rrd")
    assert not (tmp_path / "flight.rrd").exists()
