#!/usr/bin/env python3
"""Checks which room includes which: include_graph.py ROOT, or --self-test.

A quoted or angled include that begins with a room or with flappy/ is one arrow of the graph. Files that a file of
another room brings in are its own affair.
"""
import re
import sys
import tempfile
from pathlib import Path

# What a room may include besides itself.
ROOMS = {
    "io": set(),
    "model": {"io"},
    "sim": {"model", "io"},
    "flight": {"sim", "model", "io"},
    "learn": {"deploy", "flight", "sim", "model", "io"},
    "identify": {"flight", "sim", "model", "io"},
    "gap": {"flight", "sim", "model", "io"},
    "deploy": {"flight", "sim", "model", "io"},
    "blind": {"flight", "sim", "model", "io"},
    "oracle": {"blind", "gap", "flight", "sim", "model", "io"},
    "predictor": {"gap", "flight", "sim", "model", "io"},
}
# Of a program, the file that answers the blind benchmark's questions: of the program it may know its own header, and of the
# maker nothing.
PREDICTOR = "tools/flappy_gap/blind_predict."
# Files of a room, by how their names begin, that are a room of their own: who knows the blind robot's truth may look at both
# sides, and neither side at him.
APART = {("blind", "oracle"): "oracle"}
# Rooms that may include no more than these files of others, and io: the blind robot shares neither physics nor effects
# with what it is a test of, only plain data, the log, and what flies.
ONLY = {
    "blind": {"flight/flight_log.hpp", "flight/pid.hpp", "flight/episode.hpp", "flight/excitation.hpp", "model/wing_beat.hpp", "sim/randomise.hpp",
              "flappy/vehicle.hpp", "flappy/vehicle_file.hpp"},
}
# Which room declares itself in which public header.
PUBLIC = {"vehicle.hpp": "model", "vehicle_file.hpp": "model", "world.hpp": "sim", "batch.hpp": "sim"}
TORCH = {"torch", "ATen", "c10", "caffe2"}
MAY_USE_TORCH = {"deploy"}
GENERATED = {"io/version.hpp"}

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', re.MULTILINE)
STANDARD = re.compile(r"[a-z][a-z0-9_]*")


def room_of(folder, name):
    """The room of a file `name` in src/`folder`; None if the folder is none."""
    for (room, start), apart in APART.items():
        if folder == room and name.startswith(start):
            return apart
    return folder if folder in ROOMS else None


def faults(root):
    """One line for each include that the design does not allow, and for each file that has no room."""
    found = []
    files = [p for folder in ("src", "include", "tools") for p in sorted((root / folder).rglob("*")) if p.suffix in (".hpp", ".cpp", ".h")]
    for path in files:
        where = path.relative_to(root)
        if where.parts[0] == "tools" and not str(where).startswith(PREDICTOR):
            continue
        public = where.parts[0] == "include"
        if public:
            room = PUBLIC.get("/".join(where.parts[2:])) if where.parts[1] == "flappy" else None
        elif where.parts[0] == "tools":
            room = "predictor"
        else:
            room = room_of(where.parts[1], "/".join(where.parts[2:]))
        if room is None:
            found.append(f"{where}: no known room; name it in {Path(__file__).name}")
            continue
        text = path.read_text(encoding="utf-8")
        for match in INCLUDE.finditer(text):
            line = text.count("\n", 0, match.start()) + 1
            fault = fault_of(root, room, public, match[1], match[2])
            if fault:
                found.append(f"{where}:{line}: {match[2]}: {fault}")
    return found


def fault_of(root, room, public, bracket, name):
    """Why a file of `room` may not include `name`; None if it may."""
    first, _, rest = name.partition("/")
    if room == "predictor" and name == "blind_predict.hpp":
        return None
    if first in TORCH:
        return None if room in MAY_USE_TORCH else f"LibTorch belongs to {', '.join(sorted(MAY_USE_TORCH))}"
    if first == "flappy":
        if not (root / "include" / name).exists():
            return "no such public header"
        target = PUBLIC.get(rest)
    elif public:
        return None if bracket == "<" and STANDARD.fullmatch(name) else "a public header includes flappy/ and the standard library only"
    elif first in ROOMS and rest:
        if name not in GENERATED and not (root / "src" / name).exists():
            return "no such file"
        target = room_of(first, rest)
    else:
        return None if bracket == "<" else "no known room"
    if target is None or target == room:
        return None
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
        ({"src/deploy/d.cpp": '#include <torch/script.h>\n#include "flight/c.hpp"\n'}, None),
        ({"src/model/x.hpp": '#pragma once\n#include "sim/b.hpp"\n'}, "src/model/x.hpp:2: sim/b.hpp: model may include io, not sim"),
        ({"src/model/x.hpp": "#  include <sim/b.hpp>\n"}, "not sim"),
        ({"src/model/x.hpp": '#include "flappy/batch.hpp"\n'}, "not sim"),
        ({"src/io/x.cpp": '#include "flappy/vehicle.hpp"\n'}, "io may include no other room, not model"),
        ({"src/sim/x.cpp": '#include "flight/c.hpp"\n'}, "not flight"),
        ({"src/blind/x.cpp": '#include "model/a.hpp"\n'}, "src/blind/x.cpp:1: model/a.hpp: blind may include io and flappy/vehicle.hpp"),
        ({"src/blind/x.cpp": '#include "flight/c.hpp"\n'}, "flight/c.hpp: blind may include io and"),
        ({"src/blind/x.cpp": '#include "flappy/batch.hpp"\n'}, "flappy/batch.hpp: blind may include io and"),
        ({"src/blind/x.cpp": '#include "flappy/vehicle.hpp"\n#include "io/files.hpp"\n#include "blind/y.hpp"\n', "src/blind/y.hpp": ""}, None),
        ({"src/blind/oracle.cpp": '#include "gap/b.hpp"\n#include "blind/oracle_y.hpp"\n#include "blind/y.hpp"\n',
          "src/blind/oracle_y.hpp": "", "src/blind/y.hpp": "", "src/gap/b.hpp": ""}, None),
        ({"src/blind/x.cpp": '#include "gap/b.hpp"\n', "src/gap/b.hpp": ""}, "gap/b.hpp: blind may include io and"),
        ({"src/blind/x.cpp": '#include "blind/oracle.hpp"\n', "src/blind/oracle.hpp": ""}, "blind/oracle.hpp: blind may include io and"),
        ({"src/gap/x.cpp": '#include "blind/oracle.hpp"\n', "src/blind/oracle.hpp": ""}, "not oracle"),
        ({"src/deploy/x.cpp": '#include "learn/d.hpp"\n', "src/learn/d.hpp": ""}, "not learn"),
        ({"src/learn/x.cpp": '#include "deploy/d.hpp"\n', "src/deploy/d.hpp": '#include "flight/c.hpp"\n'}, None),
        ({"src/deploy/x.cpp": '#include "gap/b.hpp"\n', "src/gap/b.hpp": ""}, "deploy may include flight, io, model, sim, not gap"),
        ({"src/flight/x.cpp": "#include <torch/script.h>\n"}, "LibTorch belongs to deploy"),
        ({"src/learn/x.cpp": "#include <torch/torch.h>\n"}, "LibTorch belongs to deploy"),
        ({"src/attic/x.cpp": ""}, "src/attic/x.cpp: no known room"),
        ({"tools/flappy_gap/main.cpp": '#include "blind/y.hpp"\n'}, None),
        ({"tools/flappy_gap/blind_predict.cpp": '#include "blind_predict.hpp"\n#include "flappy/vehicle.hpp"\n#include "io/files.hpp"\n'}, None),
        ({"tools/flappy_gap/blind_predict.cpp": '#include "blind/y.hpp"\n', "src/blind/y.hpp": ""}, "predictor may include flight, gap, io, model, sim, not blind"),
        ({"tools/flappy_gap/blind_predict.cpp": '#include "blind_records.hpp"\n'}, "no known room"),
        ({"src/loose.cpp": ""}, "no known room"),
        ({"src/sim/x.cpp": '#include "b.hpp"\n'}, "no known room"),
        ({"src/sim/x.cpp": '#include "model/gone.hpp"\n'}, "no such file"),
        ({"include/flappy/extra.hpp": ""}, "no known room"),
        ({"include/flappy/world.hpp": "#include <Eigen/Core>\n"}, "standard library only"),
        ({"include/flappy/world.hpp": '#include "sim/b.hpp"\n'}, "standard library only"),
    ]
    for extra, expected in cases:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in {**good, **extra}.items():
                path = Path(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            found = faults(Path(folder))
        right = found == [] if expected is None else len(found) == 1 and expected in found[0]
        if not right:
            return [f"self-test: {extra} gave {found}, not {expected}"]
    return []


if __name__ == "__main__":
    problems = self_test() if sys.argv[1:] == ["--self-test"] else faults(Path(sys.argv[1]))
    print("\n".join(problems) or "no fault")
    sys.exit(1 if problems else 0)
