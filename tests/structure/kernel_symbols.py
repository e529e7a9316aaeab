#!/usr/bin/env python3
"""Checks that kernels built for an instruction set keep their code to themselves: kernel_symbols.py NM SET=OBJECT...

Of inline functions that several objects define, the linker keeps any one. Were one of std::vector to stand in the object for
AVX-512 without being inlined, processors without AVX-512 could be made to run it. Inline functions under
flappy::model::SET, and so on for the other rooms with kernels, have names of their own and can do no harm.
"""
import re
import subprocess
import sys


def shared_of(nm, instruction_set, path):
    """Names of all functions of an object, and of those that other objects may share."""
    own = re.compile(rf"6flappy\d+(model|sim|policy|flight|learn|gap){len(instruction_set)}{instruction_set}")
    symbols = [line.split() for line in subprocess.run([nm, "--defined-only", "--format=posix", path], check=True, capture_output=True,
                                                       text=True).stdout.splitlines()]
    code = [name for name, kind, *_ in symbols if kind in "tTW"]
    return code, [name for name, kind, *_ in symbols if kind == "W" and not own.search(name)]


fault = False
for kernel in sys.argv[2:]:
    instruction_set, path = kernel.split("=", 1)
    code, shared = shared_of(sys.argv[1], instruction_set, path)
    if shared:
        print(subprocess.run(["c++filt"], input="\n".join(shared), check=True, capture_output=True, text=True).stdout)
    print(f"{path}: {len(code)} functions, {len(shared)} that other objects may share")
    fault |= bool(shared) or not code
sys.exit(fault)
