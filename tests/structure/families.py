#!/usr/bin/env python3
"""Checks that families of blind robots share nothing: families.py ROOT, or --self-test.

A file of src/lab/blind/b or src/lab/blind/c (family a flies with what we do, include_graph.py) may include its own family, lab/blind/family.hpp, flightlog/flight_log.hpp, io, Eigen and the
standard library.
"""
import re
import tempfile
from pathlib import Path

from self_test import misjudged, run

FAMILIES = ("b", "c")
SHARED = {"lab/blind/family.hpp", "flightlog/flight_log.hpp"}
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', re.MULTILINE)
ANY_INCLUDE = re.compile(r"^[ \t]*(?:#|%:|\?\?=)[ \t]*(?:include\w*|import)\b.*$|^[ \t]*(?:export[ \t]+)?import[ \t].*$|\b__has_include\b.*$", re.MULTILINE)
STANDARD = re.compile(r"[a-z][a-z0-9_]*")


def may_include(family, bracket, name):
    """Whether a file of `family` may include `name`."""
    if ".." in name.split("/"):
        return False
    if bracket == "<":
        engine = family == "c" and name == "mujoco/mujoco.h"  # what family C stands on
        return bool(STANDARD.fullmatch(name)) or name.startswith("Eigen/") or engine
    return name in SHARED or name.startswith(f"lab/blind/{family}/") or name.startswith("io/")


def faults(root):
    """One line for each include that is not allowed, and one where there is no family at all."""
    found = []
    count = 0
    for family in FAMILIES:
        for path in sorted((root / "src" / "lab/blind" / family).rglob("*")):
            if not path.is_file():
                continue
            count += 1
            where = path.relative_to(root)
            if path.suffix not in (".hpp", ".cpp"):
                found.append(f"{where}: a family is made of .hpp and .cpp")
                continue
            text = path.read_text(encoding="utf-8")
            for match in ANY_INCLUDE.finditer(text):
                plain = INCLUDE.match(match[0])
                if plain and may_include(family, plain[1], plain[2]):
                    continue
                line = text.count("\n", 0, match.start()) + 1
                found.append(f"{where}:{line}: {plain[2] if plain else match[0].strip()}: family {family} may include lab/blind/{family}/*, "
                             f"{', '.join(sorted(SHARED))}, io/*, Eigen and the standard library")
    return found if count else ["no file of a family below src/lab/blind"]


def self_test():
    """Each tree has one file that is wrong, or none."""
    good = {"src/lab/blind/b/robot.hpp": "#pragma once\n#include <Eigen/Dense>\n#include <vector>\n#include \"lab/blind/family.hpp\"\n",
            "src/lab/blind/b/robot.cpp": "#include \"lab/blind/b/robot.hpp\"\n#include \"io/config.hpp\"\n#include \"flightlog/flight_log.hpp\"\n",
            "src/lab/blind/a/air.cpp": "#include \"model/air.hpp\"\n"}
    cases = [
        ({}, None),
        ({"src/lab/blind/c/robot.cpp": "#include \"lab/blind/c/robot.hpp\"\n"}, None),
        ({"src/lab/blind/b/x.cpp": "\n#include \"model/wing_beat.hpp\"\n"}, "src/lab/blind/b/x.cpp:2: model/wing_beat.hpp: family b"),
        ({"src/lab/blind/b/x.cpp": "#include \"lab/blind/a/robot.hpp\"\n"}, "lab/blind/a/robot.hpp"),
        ({"src/lab/blind/b/x.cpp": "#include <flappy/vehicle.hpp>\n"}, "flappy/vehicle.hpp"),
        ({"src/lab/blind/b/x.cpp": "#include \"lab/blind/c/robot.hpp\"\n"}, "lab/blind/c/robot.hpp"),
        ({"src/lab/blind/c/x.cpp": "#include \"lab/blind/b/robot.hpp\"\n"}, "family c may include lab/blind/c/*"),
        ({"src/lab/blind/b/x.cpp": "#include \"lab/blind/b/../a/air.hpp\"\n"}, "lab/blind/b/../a/air.hpp"),
        ({"src/lab/blind/b/x.cpp": "#  include\t\"flight/pid.hpp\"\n"}, "flight/pid.hpp"),
        ({"src/lab/blind/b/x.cpp": "#include \"flightlog/motion.hpp\"\n"}, "flightlog/motion.hpp"),
        ({"src/lab/blind/b/x.cpp": "#include FLAPPY_HEADER\n"}, "#include FLAPPY_HEADER"),
        ({"src/lab/blind/b/x.cpp": "import model;\n"}, "import model;"),
        ({"src/lab/blind/b/x.inc": ""}, "made of .hpp and .cpp"),
        ({"src/lab/blind/b/deep/x.hpp": "#include <Random123/philox.h>\n"}, "Random123/philox.h"),
    ]
    if wrong := misjudged(faults, good, cases):
        return wrong
    with tempfile.TemporaryDirectory() as folder:
        if len(faults(Path(folder))) != 1:
            return ["self-test: a tree without families has no fault"]
    return []


if __name__ == "__main__":
    run(faults, self_test)
