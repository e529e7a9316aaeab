#!/usr/bin/env python3
"""Checks that built files have what guards them against a stranger's input: hardening.py PROGRAM_OR_LIBRARY..., or --self-test CXX.

A file may have no array on the stack, and no call that _FORTIFY_SOURCE checks, so of a library nobody asks for these two.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ASKED = {
    "is position independent": r"Type: +DYN",
    "relro": r"GNU_RELRO",
    "now": r"Flags: .*\bNOW\b",
    "a stack that does not run": r"GNU_STACK .* RW +0x",
}
ASKED_OF_PROGRAMS = {
    "PIE": r"Flags: .*\bPIE\b",
    "the stack protector": r" __stack_chk_fail\b",
    "_FORTIFY_SOURCE": r" __(?!stack_)\w+_chk\b",
}


def missing(path: str) -> list[str]:
    said = subprocess.run(["readelf", "-hldW", "--dyn-syms", path], check=True, capture_output=True, text=True).stdout
    asked = ASKED if path.endswith(".so") else ASKED | ASKED_OF_PROGRAMS
    return [name for name, pattern in asked.items() if not re.search(pattern, said)]


def self_test(compiler: str) -> bool:
    """Of a program without any guard, all are missing; of one with all, none."""
    source = "#include <cstring>\nint main(int n, char** v) { char a[9]; return strcpy(a, v[n - 1])[0]; }\n"
    without = ["-O1", "-U_FORTIFY_SOURCE", "-fno-stack-protector", "-no-pie", "-fno-pie", "-Wl,-z,norelro,-z,lazy,-z,execstack"]
    guards = ["-O1", "-U_FORTIFY_SOURCE", "-D_FORTIFY_SOURCE=2", "-fstack-protector-strong", "-fPIE", "-pie", "-Wl,-z,relro,-z,now"]
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "program")
        for options, expected in ((without, [*ASKED, *ASKED_OF_PROGRAMS]), (guards, [])):
            command = [compiler, "-w", "-x", "c++", "-", *options, "-o", str(program)]
            subprocess.run(command, input=source, check=True, text=True)
            if (found := missing(str(program))) != expected:
                print(f"self-test: {options} lacks {found}, not {expected}")
                return False
    return True


if sys.argv[1] == "--self-test":
    sys.exit(0 if self_test(sys.argv[2]) else 1)
faults = [f"{path}: lacks {', '.join(found)}" for path in sys.argv[1:] if (found := missing(path))]
print("\n".join(faults) or f"{len(sys.argv) - 1} files, no fault")
sys.exit(1 if faults else 0)
