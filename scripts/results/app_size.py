#!/usr/bin/env python3
"""What the exported app of the Crazyflie's firmware takes on a Cortex-M4F: prints the table of docs/results/export.md.

    scripts/results/app_size.py BIN ROOT RUN OUT

BIN holds the programs, ROOT is the project, RUN a run of configs/train/flapper_dash.toml within what the firmware can set (docs/guide/firmware.md), OUT
takes what is compiled. The firmware is the stub of the tests; its own PID and estimator are not counted.
"""

import json
import pathlib
import re
import struct
import subprocess
import sys

BIN, ROOT, RUN, OUT = (pathlib.Path(a).resolve() for a in sys.argv[1:5])
MACHINE = ["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]
STEPS = 600  # one lasts 1 ms; a control period has two
RECORD_IN, RECORD_OUT = struct.Struct("<I13f3i"), struct.Struct("<f4i3f4I")
SHIMS = "FreeRTOS app controller controller_pid debug eventtrigger log param stabilizer_types supervisor task usec_time"


def run(*command, data=None):
    done = subprocess.run([str(c) for c in command], input=data, capture_output=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.decode()}")
    return done.stdout


OUT.mkdir(parents=True, exist_ok=True)
run(BIN / "flappy-export", RUN, "--out", OUT, "--for", "crazyflie", "--prove", "--json", OUT / "proof.json")
source, board = OUT / "crazyflie/src", ROOT / "src/deploy/proof/board"
for shim in SHIMS.split():
    (source / f"{shim}.h").write_text('#include "crazyflie_stub.h"\n')
options = ["-O2", *MACHINE, "-ffreestanding", "-I", source, "-I", board, "-I", ROOT / "tests/deploy/firmware"]
run("arm-none-eabi-gcc", *options, "-c", source / "flappy_crazyflie.c", "-o", OUT / "app.o")
size = run("arm-none-eabi-size", OUT / "app.o").decode().split("\n")[1].split()
run("arm-none-eabi-gcc", *options, "-nostdlib", f"-T{board / 'board.ld'}", OUT / "app.o", ROOT / "tests/deploy/firmware/crazyflie_board.c", board / "board.c",
    board / "memory.c", "-lgcc", "-o", OUT / "app.elf")


def instructions(act):
    """Of a control period; an emulated nanosecond is an instruction."""
    records = b"".join(RECORD_IN.pack(1000 * (k + 1), *[0.0] * 6, 1.0, *[0.0] * 6, 1, act, 1) for k in range(STEPS)) + RECORD_IN.pack(0, *[0.0] * 13, 0, -1, 0)
    said = run("qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "stdio", "-semihosting", "-icount", "shift=0", "-kernel",
               OUT / "app.elf", data=records)
    return 1000 * RECORD_OUT.unpack(said[-RECORD_OUT.size:])[-2] / (STEPS / 2)


proof = json.loads((OUT / "proof.json").read_text())
bare = {row["function"]: row for rows in proof["footprints"].values() for row in rows if row["target"] == "Cortex-M4F" and row["options"].endswith("-O2")}
step = next(row["instructions_per_inference"] for row in proof["parity"]["flappy_policy.h"] if row["instructions_per_inference"])
print("| Cortex-M4F, -O2 | flash, B | RAM, B | instructions a control period |\n|---|---|---|---|")
print(f"| `flappy_policy_step` alone | {bare['flappy_policy_step']['flash_bytes']} | 0 | {step:.0f} an inference |")
print(f"| `flappy_controller.h`, a period with its own estimator | {bare['flappy_controller_period']['flash_bytes']} | {bare['flappy_controller_period']['ram_bytes']} | - |")
print(f"| the app, self-tests included, while the policy acts | {int(size[0])} | {int(size[1]) + int(size[2])} | {instructions(1):.0f} |")
print(f"| the app, ready | the same | the same | {instructions(0):.0f} |")
