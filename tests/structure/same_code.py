#!/usr/bin/env python3
"""Checks that effects that are off cost nothing: same_code.py OBJDUMP OBJECT BARE

OBJECT is a kernel, BARE the same one compiled without any effect in the catalogue. The functions that fly a block without
effects must be the same instructions in both, but for where their constants lie and for the order in which the compiler
puts independent ones.
"""
import re
import subprocess
import sys

PLAIN, WITH_EFFECTS = "step_block<false, ", "step_block<true, "


def functions(objdump, path):
    """Instructions of every function, by name."""
    text = subprocess.run([objdump, "--disassemble", "--reloc", "--no-show-raw-insn", "--no-addresses", "--demangle", path],
                          check=True, capture_output=True, text=True).stdout
    found, own = {}, None
    for line in text.splitlines():
        start = re.match(r"^<(.*)>:$", line)
        if start:
            own = found.setdefault(start[1], [])
        elif own is not None and line.strip():
            own.append(re.sub(r"^(R_\w+)\s.*$", r"\1", line.strip()))
    return {name: sorted(instructions) for name, instructions in found.items()}


objdump, with_catalogue, bare = sys.argv[1:]
a, b = functions(objdump, with_catalogue), functions(objdump, bare)
plain = [name for name in a if PLAIN in name]
differ = [name for name in plain if a[name] != b.get(name)]
# what the comparison would see if there were something to see
blind = [name for name in a if WITH_EFFECTS in name and a[name] == b.get(name)]
for name in plain:
    print(f"{len(a[name])} instructions, {'others' if name in differ else 'the same'} without the catalogue: {name}")
sys.exit(1 if differ or blind or len(plain) != 2 else 0)
