#!/usr/bin/env python3
"""Checks which room includes which, and that names of files are unique: include_graph.py ROOT, or --self-test.

A quoted or angled include that begins with a room or with flappy/ is one arrow of the graph. Files that a file of
another room brings in are its own affair.
"""
import re
from pathlib import Path, PurePosixPath

from self_test import misjudged, run

BASE = {"io", "model", "sim"}
FLIGHT = BASE | {"policy", "flight"}
ROLLOUT = FLIGHT | {"flightlog", "flightlog/check", "flightlog/ros", "rollout"}
GAP = ROLLOUT | {"gap/result", "gap/replay", "gap/evidence", "gap/fit", "gap/localise", "gap/session", "gap/question", "gap/answer", "gap/next", "gap/learn", "gap/diagnose"}
# What a room may include besides itself. A folder is a room; a folder in it that is named here is a room of its own.
ROOMS = {
    "io": set(),
    "model": {"io"},
    "sim": {"io", "model"},
    "policy": BASE,
    "flightlog": BASE,
    "flightlog/check": {"io", "flightlog"},
    "flightlog/ros": {"io", "flightlog"},
    "flightlog/import": {"io", "flightlog", "flightlog/ros"},
    "flight": BASE | {"policy"},
    "rollout": FLIGHT | {"flightlog", "flightlog/ros"},
    "design": ROLLOUT,
    "learn/lanes": BASE | {"policy", "learn"},
    "learn": ROLLOUT | {"learn/lanes"},
    "deploy": {"io"},
    "deploy/header": ROLLOUT | {"deploy"},
    "deploy/firmware": ROLLOUT | {"deploy", "deploy/header"},
    "deploy/proof": {"io", "policy", "deploy"},
    "identify": BASE | {"flightlog"},
    "gap/result": {"io", "flightlog/check"},
    "gap/replay": BASE | {"flight", "flightlog"},
    "gap/evidence": BASE | {"flightlog", "gap/replay"},
    "gap/fit": BASE | {"flightlog", "gap/replay", "gap/evidence"},
    "gap/localise": BASE | {"flightlog", "gap/result", "gap/replay", "gap/evidence"},
    "gap/session": BASE | {"flightlog", "gap/result", "gap/replay"},
    "gap/question": BASE | {"flightlog", "gap/result", "gap/replay", "gap/evidence", "gap/fit", "gap/localise", "gap/session"},
    "gap/answer": BASE | {"flightlog", "flightlog/check", "gap/result", "gap/replay", "gap/evidence", "gap/fit", "gap/localise", "gap/session", "gap/question"},
    "gap/next": GAP - {"gap/learn", "gap/diagnose"},
    "gap/learn": BASE | {"flightlog", "gap/replay", "gap/evidence", "gap/fit", "gap/session", "gap/question"},
    "gap/diagnose": GAP - {"gap/learn"},
    "server": set(),  # what several of its rooms share
    "server/dds": {"io", "flightlog", "flightlog/ros"},
    "server/telemetry": ROLLOUT | {"server/dds"},
    "server/commands": {"io", "server", "server/dds", "server/jobs"},
    "server/record": BASE | {"flightlog", "flightlog/import", "flightlog/ros", "server/dds"},
    "server/sitl": ROLLOUT | {"server/dds", "server/telemetry"},
    "lab/blind": {"io", "flightlog"},
    "lab/blind/a": FLIGHT | {"lab/blind", "flightlog"},
    "lab/blind/b": {"io", "lab/blind", "flightlog"},
    "lab/blind/c": {"io", "lab/blind", "flightlog"},
    "lab/benchmark": GAP | {"lab/blind", "lab/blind/a", "lab/blind/b", "lab/blind/c", "lab/benchmark/predict"},
    "view": ROLLOUT | {"flightlog/check", "gap/result", "learn"},
    "server/jobs": {"io"},
    "server/http": {"io", "server", "server/jobs"},
    "lab/benchmark/predict": GAP,  # answers the benchmark's questions, and knows nothing of who makes them
}
# Rooms that may include no more than these files of others, and io: blind robots share neither physics nor effects
# with what they are a test of, only plain data, the log, and family a what flies.
ONLY = {
    "lab/blind": {"flightlog/flight_log.hpp"},
    "lab/blind/a": {"lab/blind/family.hpp", "flightlog/flight_log.hpp", "flight/episode.hpp", "sim/randomise.hpp",
              "flappy/vehicle.hpp", "flappy/vehicle_file.hpp"},
    "lab/blind/b": {"lab/blind/family.hpp", "flightlog/flight_log.hpp"},
    "lab/blind/c": {"lab/blind/family.hpp", "flightlog/flight_log.hpp"},
}
# The laboratory measures the product; nothing of the product knows it, least of all a diagnosis, which never sees the truth.
LABORATORY = {room for room in ROOMS if room.startswith("lab/")}
# The programs of the laboratory. No other may include it.
LABORATORIES = ("tools/flappy_blind", "tools/flappy_bench")
# Which room declares itself in which public header.
PUBLIC = {"vehicle.hpp": "model", "vehicle_file.hpp": "model", "world.hpp": "sim", "batch.hpp": "sim"}
TORCH = {"torch", "ATen", "c10", "caffe2"}
MAY_USE_TORCH = ("src/policy/", "src/learn/torch/", "src/io/torch/")
GENERATED = {"io/version.hpp"}

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', re.MULTILINE)
STANDARD = re.compile(r"[a-z][a-z0-9_]*")


def room_of(path):
    """The room of a path below src/: the deepest folder that is one; None if there is none."""
    for folder in PurePosixPath(path).parents:
        if str(folder) in ROOMS:
            return str(folder)
    return None


def faults(root):
    """One line for each include that the design does not allow, and for each file that has no room, or the name of another."""
    found = []
    files = [p for folder in ("src", "include", "tools") for p in sorted((root / folder).rglob("*")) if p.suffix in (".hpp", ".cpp", ".h")]
    seen = {"main.cpp": None}  # each program has one
    for path in files:
        where = path.relative_to(root)
        first = seen.setdefault(path.name, where)
        if first not in (None, where):
            found.append(f"{where}: has the name of {first}")
        public = where.parts[0] == "include"
        if where.parts[0] == "tools":
            room = "/".join(where.parts[:2])
            if room in LABORATORIES:
                continue
        elif public:
            room = PUBLIC.get("/".join(where.parts[2:])) if where.parts[1] == "flappy" else None
        else:
            room = room_of("/".join(where.parts[1:]))
        if room is None:
            found.append(f"{where}: no known room; name it in {Path(__file__).name}")
            continue
        text = path.read_text(encoding="utf-8")
        for match in INCLUDE.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            fault = fault_of(root, where, room, public, match[1], match[2])
            if fault:
                found.append(f"{where}:{line}: {match[2]}: {fault}")
    return found


def fault_of(root, where, room, public, bracket, name):
    """Why the file `where` of `room` may not include `name`; None if it may."""
    first, _, rest = name.partition("/")
    if first in TORCH:
        return None if str(where).startswith(MAY_USE_TORCH) else f"LibTorch belongs to {' and '.join(MAY_USE_TORCH)}"
    if first == "flappy":
        if not (root / "include" / name).exists():
            return "no such public header"
        target = PUBLIC.get(rest)
    elif public:
        return None if bracket == "<" and STANDARD.fullmatch(name) else "a public header includes flappy/ and the standard library only"
    elif room_of(name):
        if name not in GENERATED and not (root / "src" / name).exists():
            return "no such file"
        target = room_of(name)
    else:
        return None if bracket == "<" or room.startswith("tools/") else "no known room"
    if target is None or target == room:
        return None
    if room.startswith("tools/"):
        return f"{room} must not know {target}" if target in LABORATORY else None
    if room in ONLY and target != "io" and name not in ONLY[room]:
        return f"{room} may include io and {', '.join(sorted(ONLY[room]))} only"
    if target in ROOMS[room]:
        return None
    return f"{room} may include {', '.join(sorted(ROOMS[room])) or 'no other room'}, not {target}"


def self_test():
    """Each tree has one file that is wrong, or none."""
    good = {"src/io/files.hpp": "#include <string>\n", "src/model/a.hpp": '#include "io/files.hpp"\n',
            "include/flappy/vehicle.hpp": "#include <vector>\n", "include/flappy/batch.hpp": '#include "flappy/vehicle.hpp"\n',
            "src/sim/b.cpp": '#include "flappy/batch.hpp"\n#include "model/a.hpp"\n#include <immintrin.h>\n',
            "src/flight/c.hpp": '#include "sim/b.hpp"\n', "src/sim/b.hpp": ""}
    cases = [
        ({}, None),
        ({"src/policy/d.cpp": '#include <torch/script.h>\n#include "sim/b.hpp"\n'}, None),
        ({"src/model/x.hpp": '#pragma once\n#include "sim/b.hpp"\n'}, "src/model/x.hpp:2: sim/b.hpp: model may include io, not sim"),
        ({"src/model/x.hpp": "#  include <sim/b.hpp>\n"}, "not sim"),
        ({"src/model/x.hpp": '#include "flappy/batch.hpp"\n'}, "not sim"),
        ({"src/io/x.cpp": '#include "flappy/vehicle.hpp"\n'}, "io may include no other room, not model"),
        ({"src/sim/x.cpp": '#include "flight/c.hpp"\n'}, "not flight"),
        ({"src/policy/a.hpp": ""}, "has the name of src/model/a.hpp"),
        ({"tools/flappy_fly/main.cpp": "", "tools/flappy_gap/main.cpp": ""}, None),
        ({"src/lab/blind/a/x.cpp": '#include "model/a.hpp"\n'}, "src/lab/blind/a/x.cpp:1: model/a.hpp: lab/blind/a may include io and flappy/vehicle.hpp"),
        ({"src/lab/blind/a/x.cpp": '#include "flight/c.hpp"\n'}, "flight/c.hpp: lab/blind/a may include io and"),
        ({"src/lab/blind/a/x.cpp": '#include "flappy/batch.hpp"\n'}, "flappy/batch.hpp: lab/blind/a may include io and"),
        ({"src/lab/blind/a/x.cpp": '#include "flappy/vehicle.hpp"\n#include "io/files.hpp"\n#include "lab/blind/a/y.hpp"\n', "src/lab/blind/a/y.hpp": ""}, None),
        ({"src/lab/blind/b/x.cpp": '#include "lab/blind/a/y.hpp"\n', "src/lab/blind/a/y.hpp": ""}, "lab/blind/b may include io and"),
        ({"src/lab/blind/c/x.cpp": '#include "flappy/vehicle.hpp"\n'}, "lab/blind/c may include io and flightlog/flight_log.hpp, lab/blind/family.hpp only"),
        ({"src/lab/blind/c/x.cpp": '#include "lab/blind/a/robot.hpp"\n', "src/lab/blind/a/robot.hpp": ""}, "lab/blind/c may include io and"),
        ({"src/lab/blind/c/x.cpp": '#include "io/files.hpp"\n#include <mujoco/mujoco.h>\n#include "lab/blind/c/y.hpp"\n', "src/lab/blind/c/y.hpp": ""}, None),
        ({"src/lab/benchmark/x.cpp": '#include "gap/replay/r.hpp"\n#include "lab/blind/a/y.hpp"\n', "src/lab/blind/a/y.hpp": "", "src/gap/replay/r.hpp": ""}, None),
        ({"src/lab/benchmark/predict/x.cpp": '#include "gap/replay/r.hpp"\n', "src/gap/replay/r.hpp": ""}, None),
        ({"src/lab/benchmark/predict/x.cpp": '#include "lab/blind/a/y.hpp"\n', "src/lab/blind/a/y.hpp": ""}, "not lab/blind/a"),
        ({"src/lab/benchmark/predict/x.cpp": '#include "lab/benchmark/y.hpp"\n', "src/lab/benchmark/y.hpp": ""}, "not lab/benchmark"),
        ({"src/lab/blind/a/x.cpp": '#include "gap/replay/r.hpp"\n', "src/gap/replay/r.hpp": ""}, "gap/replay/r.hpp: lab/blind/a may include io and"),
        ({"src/gap/diagnose/x.cpp": '#include "lab/benchmark/y.hpp"\n', "src/lab/benchmark/y.hpp": ""}, "not lab/benchmark"),
        ({"src/gap/replay/x.cpp": '#include "gap/evidence/y.hpp"\n', "src/gap/evidence/y.hpp": ""}, "not gap/evidence"),
        ({"src/gap/x.cpp": ""}, "src/gap/x.cpp: no known room"),
        ({"src/deploy/header/x.cpp": '#include "learn/d.hpp"\n', "src/learn/d.hpp": ""}, "not learn"),
        ({"src/learn/x.cpp": '#include "deploy/d.hpp"\n', "src/deploy/d.hpp": ""}, "not deploy"),
        ({"src/flightlog/check/x.cpp": '#include "sim/b.hpp"\n'}, "flightlog/check may include flightlog, io, not sim"),
        ({"src/flightlog/ros/x.cpp": '#include "flightlog/import/y.hpp"\n', "src/flightlog/import/y.hpp": ""}, "not flightlog/import"),
        ({"src/flight/x.cpp": "#include <torch/script.h>\n"}, "LibTorch belongs to src/policy/ and src/learn/torch/ and src/io/torch/"),
        ({"src/learn/torch/x.cpp": "#include <torch/torch.h>\n"}, None),
        ({"src/learn/x.cpp": "#include <torch/torch.h>\n"}, "LibTorch belongs to src/policy/ and src/learn/torch/ and src/io/torch/"),
        ({"src/view/x.cpp": '#include "sim/b.hpp"\n#include "learn/d.hpp"\n', "src/learn/d.hpp": ""}, None),
        ({"src/view/x.cpp": '#include "lab/benchmark/d.hpp"\n', "src/lab/benchmark/d.hpp": ""}, "not lab/benchmark"),
        ({"src/rollout/x.cpp": '#include "view/d.hpp"\n', "src/view/d.hpp": ""}, "not view"),
        ({"src/attic/x.cpp": ""}, "src/attic/x.cpp: no known room"),
        ({"tools/flappy_blind/main.cpp": '#include "lab/blind/a/y.hpp"\n', "src/lab/blind/a/y.hpp": ""}, None),
        ({"tools/flappy_gap/main.cpp": '#include "gap/diagnose/y.hpp"\n#include "command.hpp"\n', "src/gap/diagnose/y.hpp": ""}, None),
        ({"tools/flappy_gap/main.cpp": '#include "lab/blind/a/y.hpp"\n', "src/lab/blind/a/y.hpp": ""}, "tools/flappy_gap must not know lab/blind/a"),
        ({"tools/flappy_gap/main.cpp": '#include "lab/benchmark/y.hpp"\n', "src/lab/benchmark/y.hpp": ""}, "tools/flappy_gap must not know lab/benchmark"),
        ({"src/loose.cpp": ""}, "no known room"),
        ({"src/sim/x.cpp": '#include "b.hpp"\n'}, "no known room"),
        ({"src/sim/x.cpp": '#include "model/gone.hpp"\n'}, "no such file"),
        ({"include/flappy/extra.hpp": ""}, "no known room"),
        ({"include/flappy/world.hpp": "#include <Eigen/Core>\n"}, "standard library only"),
        ({"include/flappy/world.hpp": '#include "sim/b.hpp"\n'}, "standard library only"),
    ]
    return misjudged(faults, good, cases)


if __name__ == "__main__":
    run(faults, self_test)
