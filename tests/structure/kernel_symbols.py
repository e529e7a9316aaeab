#!/usr/bin/env python3
"""Checks that a kernel built for one instruction set keeps its code to itself: kernel_symbols.py NM SET OBJECT

Of inline functions that several objects define, the linker keeps any one. Were one of std::vector to stand in the object for
AVX-512 without being inlined, processors without AVX-512 could be made to run it. Inline functions under
flappy::model::SET, and so on for sim, flight and learn, have names of their own and can do no harm.
"""
import re
import subprocess
import sys

nm, instruction_set, path = sys.argv[1:]
own = re.compile(rf"6flappy\d+(model|sim|flight|learn){len(instruction_set)}{instruction_set}")
symbols = [line.split() for line in subprocess.run([nm, "--defined-only", "--format=posix", path], check=True, capture_output=True,
                                                   text=True).stdout.splitlines()]
code = [name for name, kind, *_ in symbols if kind in "tTW"]
shared = [name for name, kind, *_ in symbols if kind == "W" and not own.search(name)]
if shared:
    print(subprocess.run(["c++filt"], input="\n".join(shared), check=True, capture_output=True, text=True).stdout)
print(f"{len(code)} functions, {len(shared)} that other objects may share")
sys.exit(1 if shared or not code else 0)
