#!/usr/bin/env python3
"""Sends a server random bytes and messages with a few bytes wrong, on every port that it listens at: garbage_test.py SERVER CONFIG WORK SECONDS

The server, built with sanitizers, must stay, bound its memory, and answer as before.
"""
import os
import random
import socket
import struct
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

server, config, work, seconds = sys.argv[1], sys.argv[2], Path(sys.argv[3]).resolve(), float(sys.argv[4])
DOMAIN = 97


def ports(pid):
    """UDP and TCP ports of a process, as the kernel lists them."""
    inodes = set()
    for fd in Path(f"/proc/{pid}/fd").iterdir():
        try:
            target = os.readlink(fd)
        except OSError:
            continue
        if target.startswith("socket:["):
            inodes.add(target[8:-1])
    found = {"udp": set(), "tcp": set()}
    for kind in found:
        for line in Path(f"/proc/{pid}/net/{kind}").read_text().splitlines()[1:]:
            words = line.split()
            if words[9] in inodes and (kind == "udp" or words[3] == "0A"):
                found[kind].add(int(words[1].split(":")[1], 16))
    return found


def rtps(rng):
    """A message with the header of RTPS and submessages of every kind, whose contents and lengths are chance."""
    message = b"RTPS" + bytes([2, rng.randrange(5), 1, 0x10]) + rng.randbytes(12)
    for _ in range(rng.randrange(1, 6)):
        kind = rng.choice([0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0D, 0x0E, 0x0F, 0x12, 0x13, 0x15, 0x16, 0x30, 0x31, 0x32, 0x33, 0x34, rng.randrange(256)])
        flags, body = rng.randrange(256), rng.randbytes(rng.choice([0, 4, 8, 20, 24, 60, 200, 1000]))
        size = len(body) if rng.random() < 0.8 else rng.randrange(65536)
        if kind == 0x15 and len(body) >= 24 and rng.random() < 0.7:  # DATA of discovery, a list of parameters behind it
            entity = rng.choice([b"\x00\x01\x00\xc2", b"\x00\x00\x03\xc2", b"\x00\x00\x04\xc2", b"\x00\x02\x00\xc2"])
            parameters = b"".join(struct.pack("<HH", rng.choice([0x02, 0x05, 0x07, 0x15, 0x16, 0x1A, 0x1D, 0x2C, 0x31, 0x32, 0x50, 0x58, 0x5A, rng.randrange(0x80)]), n)
                                  + rng.randbytes(n) for n in (rng.choice([0, 4, 8, 12, 16, 24, 400]) for _ in range(rng.randrange(12))))
            body = b"\x00\x00\x10\x00" + b"\x00\x00\x00\x00" + entity + struct.pack("<iI", 0, rng.randrange(100)) + b"\x00\x03\x00\x00" + parameters + b"\x01\x00\x00\x00"
            flags, size = 0x05, len(body) if rng.random() < 0.9 else rng.randrange(65536)
        message += struct.pack("<BBH", kind, flags, size & 0xFFFF) + body
    return message


def main():
    rng = random.Random(7)
    work.mkdir(parents=True, exist_ok=True)
    log = open(work / "server.log", "w")
    environment = {**os.environ, "ASAN_OPTIONS": "detect_leaks=0"}
    process = subprocess.Popen([server, config, "--http", "127.0.0.1:0", "--set", f"jobs.output={work / 'jobs'}", "--set", "dds.enabled=true",
                                "--set", f"dds.domain={DOMAIN}"], stdout=log, stderr=subprocess.STDOUT, env=environment)
    time.sleep(3)
    listening = ports(process.pid)
    assert listening["udp"] and len(listening["tcp"]) == 1, listening
    http = listening["tcp"].pop()
    # messages that a client sends, to be sent again with bytes that are wrong
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sent = requests = 0
    memory = lambda: int(next(line for line in Path(f"/proc/{process.pid}/status").read_text().splitlines() if line.startswith("VmRSS")).split()[1])
    most = before = memory()
    until = time.time() + seconds
    good = [rtps(rng) for _ in range(200)]
    while time.time() < until:
        assert process.poll() is None, f"the server ended with {process.returncode}; see {log.name}"
        for _ in range(200):
            choice = rng.random()
            if choice < 0.2:
                data = rng.randbytes(rng.choice([0, 1, 19, 20, 24, 100, 1400, 9000]))
            elif choice < 0.7:
                data = rtps(rng)
            else:
                data = bytearray(rng.choice(good))
                for _ in range(rng.randrange(1, 8)):
                    data[rng.randrange(len(data))] = rng.randrange(256)
                data = bytes(data)
            udp.sendto(data[:60000], ("127.0.0.1", rng.choice(sorted(listening["udp"]))))
            sent += 1
        try:
            with socket.create_connection(("127.0.0.1", http), timeout=1) as tcp:
                tcp.settimeout(0.2)
                tcp.sendall(rng.choice([rng.randbytes(rng.randrange(1, 3000)), b"GET /" + rng.randbytes(50) + b" HTTP/1.1\r\nHost: localhost\r\n\r\n",
                                        b"GET /api/jobs HTTP/1.1\r\nHost: " + b"a" * rng.randrange(20000) + b"\r\n\r\n",
                                        b"POST /events HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999\r\n\r\n"]))
                requests += 1
                tcp.recv(100)
        except OSError:
            pass
        most = max(most, memory())
    time.sleep(1)
    answer = urllib.request.urlopen(f"http://localhost:{http}/api/jobs", timeout=10).read()
    assert answer.startswith(b"["), answer
    job = Path(server).with_name("flappy-job")
    if job.exists():
        listed = subprocess.run([job, "--dds", f"domain={DOMAIN}", "--timeout", "20", "list"], capture_output=True, text=True)
        assert listed.returncode == 0, listed.stderr
    process.terminate()
    code = process.wait(timeout=60)
    text = (work / "server.log").read_text(errors="replace")
    assert code == 0 and "Sanitizer" not in text and "runtime error" not in text, f"ended with {code}; see {log.name}"
    print(f"{sent} datagrams to {len(listening['udp'])} ports and {requests} requests in {seconds:g} s; memory {before // 1024} MB, at most {most // 1024} MB")


if __name__ == "__main__":
    main()
