#!/usr/bin/env python3
"""One motion as C3D, MATLAB file and DataFlash log, written or read by the Python packages ezc3d, c3d, SciPy, h5py and pymavlink, is the same
in flappy-gap import: peers_test.py BIN WORK
"""
import csv
import struct
import subprocess
import sys
from pathlib import Path

import c3d
import ezc3d
import h5py
import numpy as np
import scipy.io
from pymavlink import DFReader

BIN, WORK = (Path(argument).resolve() for argument in sys.argv[1:3])
RATE_HZ, FRAMES = 200, 300
FIELDS = ("x", "y", "z", "qw", "qx", "qy", "qz", "u")
TIMES = np.arange(FRAMES) / RATE_HZ


def motion():
    """Metres, a unit quaternion and a command, by frame."""
    angle = 0.3 * np.sin(4 * TIMES)
    return {"x": np.sin(TIMES), "y": 0.4 * np.cos(3 * TIMES), "z": 1 + 0.1 * TIMES, "qw": np.cos(angle / 2), "qx": np.zeros(FRAMES),
            "qy": np.zeros(FRAMES), "qz": np.sin(angle / 2), "u": np.linspace(0, 1, FRAMES)}


def imported(file, names, others="*", time="t", scale=""):
    """The columns of an import of a file by the given names; the quaternion and the command are in the channel `others`."""
    pose = ", ".join(f'{column} = "{names[field]}"' for column, field in
                     (("x_m", "x"), ("y_m", "y"), ("z_m", "z"), ("qw", "qw"), ("qx", "qx"), ("qy", "qy"), ("qz", "qz")))
    channel, source = ("*", "") if others == "*" else (others[0], "from = { " + ", ".join(f'q{k} = "{others[1]}"' for k in "wxyz") + " }\n")
    when = f'time = "field"\ntime_field = "{time}"\n' if time else ""
    mapping = WORK / f"{file.stem}.toml"
    mapping.write_text(f"""schema = 1
vehicle = "flapper_nimble.toml"
gravity_m_s2 = 9.81
ambient = {{ air_density_kg_m3 = 1.2, ground_z_m = -1000.0, ceiling_z_m = 1000.0, walls = [] }}
[command]
channel = "{channel if others == "*" else others[1]}"
{when}inputs = ["u"]
columns = {{ u = "{names['u']}" }}
[mocap]
channel = "{channel}"
{when}latency_s = 0.0
position_noise_m = 1e-4
attitude_noise_rad = 5e-3
columns = {{ {pose} }}
{source}{scale}""")
    out = WORK / f"of_{file.stem}"
    done = subprocess.run([BIN / "flappy-gap", "import", file, "--mapping", mapping, "--out", out], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    columns = {}
    for table in ("mocap", "command"):
        with (out / f"{table}.csv").open() as lines:
            rows = list(csv.DictReader(lines))
        for key in rows[0]:
            columns[key.removesuffix("_m")] = np.array([float(row[key]) for row in rows])
    return columns


def compare(what, found, read, tolerance):
    for field in FIELDS:
        assert len(found[field]) == FRAMES, f"{what}: {field}: {len(found[field])} rows"
        worst = np.abs(found[field] - read[field]).max()
        assert worst < tolerance, f"{what}: {field} differs by {worst}"
    print(f"{what}: as the peer reads it")


def c3d_by_ezc3d(truth):
    file = WORK / "ezc3d.c3d"
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [RATE_HZ]
    made["parameters"]["POINT"]["LABELS"]["value"] = ["nose"]
    made["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    made["parameters"]["ANALOG"]["RATE"]["value"] = [RATE_HZ]
    made["parameters"]["ANALOG"]["LABELS"]["value"] = list(FIELDS[3:])
    made["data"]["points"] = np.stack([*(1000 * truth[k] for k in "xyz"), np.ones(FRAMES)])[:, None, :]
    made["data"]["analogs"] = np.stack([truth[k] for k in FIELDS[3:]])[None]
    made.write(str(file))
    again = ezc3d.c3d(str(file))["data"]
    read = {k: again["points"][i, 0] / 1000 for i, k in enumerate("xyz")} | {k: again["analogs"][0, i] for i, k in enumerate(FIELDS[3:])}
    names = {k: f"nose.{k}" for k in "xyz"} | {k: k for k in FIELDS[3:]}
    compare("C3D of ezc3d", imported(file, names, (file.stem, f"{file.stem}.analog")), read, 1e-6)


def c3d_by_c3d(truth):
    file = WORK / "c3d.c3d"
    writer = c3d.Writer(point_rate=RATE_HZ, analog_rate=RATE_HZ, point_scale=-1, point_units="mm")
    for f in range(FRAMES):
        points = np.array([[*(1000 * truth[k][f] for k in "xyz"), 1, 0]])
        writer.add_frames([(points, np.array([[truth[k][f]] for k in FIELDS[3:]]))])
    writer.set_point_labels(["nose"])
    writer.set_analog_labels(list(FIELDS[3:]))
    with file.open("wb") as out:
        writer.write(out)
    read = {k: np.empty(FRAMES) for k in FIELDS}
    with file.open("rb") as stream:
        for f, (_, points, analog) in enumerate(c3d.Reader(stream).read_frames()):
            for i, k in enumerate("xyz"):
                read[k][f] = points[0, i] / 1000
            for i, k in enumerate(FIELDS[3:]):
                read[k][f] = analog[i, 0]
    names = {k: f"nose.{k}" for k in "xyz"} | {k: k for k in FIELDS[3:]}
    compare("C3D of c3d", imported(file, names, (file.stem, f"{file.stem}.analog")), read, 1e-6)


def matlab(truth):
    names = {k: f"position[{i}]" for i, k in enumerate("xyz")} | {k: k for k in FIELDS[3:]}
    flight = {"t": TIMES[:, None], "position": np.stack([truth[k] for k in "xyz"], axis=1), **{k: truth[k][:, None] for k in FIELDS[3:]}}
    for packed in (False, True):
        file = WORK / f"scipy_{'packed' if packed else 'plain'}.mat"
        scipy.io.savemat(file, {"flight": flight}, do_compression=packed)
        compare(f"MATLAB file of SciPy, {file.stem}", imported(file, names), truth, 1e-12)
    file = WORK / "h5py.mat"
    with h5py.File(file, "w", userblock_size=512) as out:
        group = out.create_group("flight")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in flight.items():
            group.create_dataset(name, data=values.T, chunks=values.T.shape, compression="gzip").attrs["MATLAB_class"] = np.bytes_("double")
    with file.open("r+b") as head:
        head.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    compare("MATLAB file of h5py", imported(file, names), truth, 1e-12)


def dataflash(truth):
    def described(kind, name, letters, columns):
        size = 3 + struct.calcsize("<" + "".join({"Q": "Q", "f": "f", "e": "i", "B": "B"}[c] for c in letters))
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, name.encode(), letters.encode(), columns.encode())

    file = WORK / "dataflash.bin"
    log = b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", 128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    log += described(129, "POSE", "Qeeefffff", "TimeUS,x,y,z,qw,qx,qy,qz,u")
    for f in range(FRAMES):
        place = (round(1e5 * truth[k][f]) for k in "xyz")  # the letter's 1/100 of millimetres
        log += b"\xa3\x95\x81" + struct.pack("<Qiiifffff", round(1e6 * TIMES[f]), *place, *(truth[k][f] for k in FIELDS[3:]))
    file.write_bytes(log)
    reader, read = DFReader.DFReader_binary(str(file)), {k: [] for k in FIELDS}
    while (message := reader.recv_match(type=["POSE"])) is not None:
        for k in FIELDS:
            read[k].append(getattr(message, k))
    read = {k: np.array(v) * (1e-3 if k in "xyz" else 1) for k, v in read.items()}
    found = imported(file, {k: k for k in FIELDS}, ("POSE", "POSE"), "", "scale = { x_m = 0.001, y_m = 0.001, z_m = 0.001 }\n")
    compare("DataFlash log of pymavlink", found, read, 1e-9)


def main():
    WORK.mkdir(parents=True, exist_ok=True)
    truth = motion()
    for check in (c3d_by_ezc3d, c3d_by_c3d, matlab, dataflash):
        check(truth)


if __name__ == "__main__":
    main()
