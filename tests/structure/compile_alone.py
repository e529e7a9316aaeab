#!/usr/bin/env python3
"""Checks that each C++ source and header compiles by itself: compile_alone.py ROOT BUILD [--all], or --self-test.

Unity builds and precompiled headers hide a missing include. Each file is therefore compiled without them (-fsyntax-only), with the flags that
BUILD/compile_commands.json has for it or for a file near it. BUILD/compiled_alone notes what passed, by a hash of command, file and includes.
Without --all, a run checks at most MAX of the files that have not passed: first those that changed last.
"""
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

from self_test import misjudged, run

FOLDERS = ("include", "src", "tools", "tests", "examples", "python")
# What other builds compile, and with what.
ELSEWHERE = {"tests/server/fastdds_reader.cpp": "Fast DDS"}
MAX = 12
COMMITS = 100  # how far back changes are looked for
INDIRECT = 10  # a changed include counts as a change of so many commits before
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*["<]([^">]+)[">]', re.MULTILINE)


def flags_of(entry):
    """The command of a compilation without launcher, output, source and precompiled header."""
    words = shlex.split(entry["command"])
    first = next(i for i, word in enumerate(words) if not os.path.basename(word).startswith("ccache"))
    kept, i = [], first
    while i < len(words):
        if words[i] in ("-o", "-c", "-x", "-MF", "-MT") or (words[i] == "-include" and "cmake_pch" in words[i + 1]):
            i += 2
            continue
        if words[i] not in ("-Winvalid-pch", "-MD", entry["file"]):
            kept.append(words[i])
        i += 1
    return kept


def commands_of(build):
    """The flags of each source, those in a unity source included."""
    found = {}
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        file = Path(entry["directory"], entry["file"])
        if file.suffix not in (".cpp", ".cxx", ".cc") or "cmake_pch" in file.name:
            continue
        sources = [file]
        if file.parent.name == "Unity":
            sources = [Path(name) for name in INCLUDE.findall(file.read_text(encoding="utf-8"))]
        for source in sources:
            found.setdefault(source.resolve(), flags_of(entry))
    return found


class Tree:
    """The project's C++ files: what each includes, how it is compiled, how long ago it changed."""

    def __init__(self, root, build):
        """Reads the commands of the build, and the commits."""
        self.root = root.resolve()
        self.commands = commands_of(build)
        self.files = sorted(p for folder in FOLDERS for p in (self.root / folder).rglob("*.[ch]pp")
                            if str(p.relative_to(self.root)) not in ELSEWHERE)
        known = {str(p): p for p in self.files}
        searched = {Path(word[2:]).resolve() for flags in self.commands.values() for word in flags if word.startswith("-I")}
        searched = sorted(p for p in searched if p.is_relative_to(self.root))
        self.text = {p: p.read_text(encoding="utf-8") for p in self.files}
        self.includes = {}  # None: a file that is not the project's
        for file, text in self.text.items():
            places = [[os.path.normpath(f"{folder}/{name}") for folder in (file.parent, *searched)] for name in INCLUDE.findall(text)]
            self.includes[file] = [next((known[p] for p in some if p in known), None) for some in places]
        self.compiled = {p: None for p in self.files if p in self.commands}
        self.ages = self.ages_of_files()

    def ages_of_files(self):
        """The number of commits since a file was changed, from the working tree's 0 on."""
        def git(*words):
            result = subprocess.run(["git", "-C", str(self.root), *words], capture_output=True, text=True, check=False)
            return result.stdout if result.returncode == 0 else ""
        ages = {}
        commits = [git("diff", "--name-only", "HEAD") + git("ls-files", "--others", "--exclude-standard")]
        commits += git("log", f"-{COMMITS}", "--first-parent", "-m", "--name-only", "--format=%x00").split("\0")[1:]
        for age, names in enumerate(commits):
            for name in names.split("\n"):
                ages.setdefault(self.root / name, age)
        return ages

    @cache
    def closure(self, file):
        """The project files that a file includes, itself among them."""
        found, rest = set(), [file]
        while rest:
            at = rest.pop()
            if at not in found:
                found.add(at)
                rest += [p for p in self.includes[at] if p]
        return found

    def age(self, file):
        """The commits since a file or, as INDIRECT more, one of its includes was changed."""
        def own(p):
            return self.ages.get(p, COMMITS + 1)
        direct = [file, self.header_of(file) or file]
        return min([own(p) for p in direct] + [own(p) + INDIRECT for p in self.closure(file)])

    def header_of(self, source):
        """The header that a source includes first, which is thereby tried in it."""
        first = next(iter(self.includes[source]), None)
        return first if first and source.suffix == ".cpp" and first.stem == source.stem else None

    def flags(self, file):
        """The flags of a file, else of the nearest source: one that includes it, or one in a folder above."""
        if file in self.commands:
            return self.commands[file]
        namesake = file.with_suffix(".cpp")
        if namesake in self.compiled:
            return self.commands[namesake]
        near = next((p for p in self.compiled if file in self.includes[p]), None)
        near = near or next((p for folder in file.parents for p in self.compiled if str(p).startswith(f"{folder}/")), None)
        return self.commands[near] if near else None

    def units(self):
        """The files to compile, those that changed last first."""
        tried = {self.header_of(p) for p in self.files}
        return sorted((p for p in self.files if p not in tried), key=lambda p: (self.age(p), p))

    def key(self, file):
        """What a compilation depends on."""
        parts = [" ".join(self.flags(file) or [])] + [self.text[p] for p in sorted(self.closure(file))]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def compile_alone(tree, file):
    """The first error of a file, or nothing."""
    flags = tree.flags(file)
    if flags is None:
        return "no source near it is built"
    # a header is included, as a main file may not say #pragma once
    words = [*flags, "-fsyntax-only", "-x", "c++", "-"]
    result = subprocess.run(words, input=f'#include "{file}"\n', capture_output=True, text=True, check=False)
    if result.returncode == 0:
        return ""
    lines = result.stderr.strip().splitlines()
    error = next((line for line in lines if "error" in line), lines[-1] if lines else "the compiler failed").replace(f"{tree.root}/", "")
    # what this build leaves out, as a library is not installed
    return "" if file not in tree.commands and "No such file or directory" in error else error


def faults(root, build, whole):
    """One line for each file that does not compile by itself."""
    if not (build / "compile_commands.json").exists():
        return [f"{build}/compile_commands.json: is missing; accepted: a folder that cmake configured"]
    tree = Tree(root, build)
    noted = build / "compiled_alone"
    keys = {file: tree.key(file) for file in tree.units()}
    passed = set(noted.read_text(encoding="utf-8").split() if noted.exists() else []) & set(keys.values())
    noted.write_text("".join(f"{key}\n" for key in sorted(passed)), encoding="utf-8")
    waiting = [file for file in keys if keys[file] not in passed]
    chosen = waiting if whole else waiting[:MAX]

    def fault(file):
        error = compile_alone(tree, file)
        if error:
            return f"{file.relative_to(tree.root)}: does not compile by itself: {error}"
        with noted.open("a", encoding="utf-8") as record:  # at once, as a run may be stopped
            record.write(f"{keys[file]}\n")
        return None
    pool = ThreadPoolExecutor(len(os.sched_getaffinity(0)))
    try:
        found = [error for error in pool.map(fault, chosen) if error]
    finally:
        pool.shutdown(cancel_futures=True)
    print(f"{len(chosen)} of {len(keys)} files compiled, {len(waiting) - len(chosen)} are left")
    return found


def self_test():
    """Includes that a unity build and a precompiled header hide, in a source and in headers."""
    good = {"src/a.hpp": "#pragma once\n#include <cstdint>\ninline std::int64_t a() { return {}; }\n",
            "src/a.cpp": "#include \"a.hpp\"\nstd::int64_t b() { return a(); }\n",
            "src/c.cpp": "#include \"a.hpp\"\nstd::int64_t c() { return a(); }\n",
            "src/late.hpp": "#pragma once\n#include \"a.hpp\"\nstd::int64_t late();\n"}
    cases = [({}, None),
             ({"src/c.cpp": "std::int64_t c() { return a(); }\n"}, "src/c.cpp: does not compile by itself: src/c.cpp:1:6: error"),
             ({"src/a.hpp": "#pragma once\ninline std::int64_t a() { return {}; }\n", "src/c.cpp": "#include <cstdint>\n#include \"a.hpp\"\n",
               "src/late.hpp": "#pragma once\n"}, "src/a.cpp: does not compile by itself: src/a.hpp:2:13: error"),
             ({"src/late.hpp": "#pragma once\nstd::int64_t late();\n"}, "src/late.hpp: does not compile by itself: src/late.hpp:2:6: error")]

    def in_order(root):
        """What changed last comes first, then what includes it."""
        (root / "build").mkdir()
        (root / "build/compile_commands.json").write_text("[]", encoding="utf-8")

        def git(*words):
            name = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
            subprocess.run(["git", "-C", str(root), *name, *words], check=True, capture_output=True)
        git("init", "--quiet")
        for names in (["src/a.cpp", "src/c.cpp", "src/late.hpp"], ["src/a.hpp"]):
            git("add", *names)
            git("commit", "--quiet", "-m", names[0])
        with (root / "src/late.hpp").open("a", encoding="utf-8") as file:
            file.write("int changed();\n")
        return [" ".join(p.name for p in Tree(root, root / "build").units())]

    def tried(root):
        build = root / "build"
        unity = build / "Unity/unity_0_cxx.cxx"
        unity.parent.mkdir(parents=True)
        unity.write_text(f"#include \"{root}/src/a.cpp\"\n#include \"{root}/src/c.cpp\"\n", encoding="utf-8")
        (build / "cmake_pch.hxx").write_text("#include <cstdint>\n", encoding="utf-8")
        command = f"/usr/bin/ccache g++ -std=c++20 -I{root}/src -Winvalid-pch -include {build}/cmake_pch.hxx -o u.o -c {unity}"
        entry = {"directory": str(build), "command": command, "file": str(unity)}
        (build / "compile_commands.json").write_text(json.dumps([entry]), encoding="utf-8")
        return faults(root, build, True)
    return misjudged(tried, good, cases) + misjudged(in_order, good, [({"src/alone.cpp": ""}, "alone.cpp late.hpp a.cpp c.cpp")])


if __name__ == "__main__":
    run(lambda root: faults(root, Path(sys.argv[2]), "--all" in sys.argv), self_test)
