#!/usr/bin/env python3
"""The dashboard in Chromium while something happens: the watched flapper flies, and the curves of a running training grow.

live_page_test.py BIN SOURCE WORK: programs, the project, a folder to use.
"""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

BIN, SOURCE, WORK = (Path(argument).resolve() for argument in sys.argv[1:4])
sys.path.insert(0, str(SOURCE / "scripts"))
from browser import Browser  # noqa: E402

DOMAIN = 100 + os.getpid() % 133  # of the 233; the first hundred are left to people
PATIENCE_S = 60
#: Where the flapper is by the numbers, where it is drawn, which way it looks in the picture, the trail's length, and the picture.
FLAPPER = """
const cell = (name) => [...document.querySelectorAll("#state dt")].find((e) => e.textContent === name).nextSibling.textContent;
const [position, attitude] = [cell("position"), cell("attitude")].map((text) => text.match(/-?[\\d.]+/g).map(Number));
const drawn = live.scene.robots[0].group, q = drawn.quaternion;
return {position, attitude, drawn: drawn.position.toArray(), turned: [q.w, q.x, q.y, q.z], trail: live.path.length,
  picture: document.querySelector("#view canvas").toDataURL()};
"""
CURVES = """
const points = (id) => document.querySelector(`#${id} polyline`)?.getAttribute("points").split(" ").length ?? 0;
return [points("curve"), points("return"), document.querySelector("#jobs progress")?.value ?? 0];
"""


def until(what: str, found: Callable[[], object]) -> object:
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if value := found():
            return value
        time.sleep(0.1)
    raise TimeoutError(f"{what}: not within {PATIENCE_S} s")


def dds(*more: str) -> list[str]:
    return ["--set", "dds.enabled=true", "--set", f"dds.domain={DOMAIN}", "--set", "dds.reach=loopback", *more]


def close(one: list[float], other: list[float], tolerance: float) -> bool:
    return all(abs(a - b) <= tolerance for a, b in zip(one, other, strict=True))


def watch(browser: Browser) -> None:
    """What is drawn is what is told, and both move on."""
    until("a flapper is shown", lambda: browser.run("return !document.getElementById('watched').hidden && live.scene !== null"))
    first = browser.run(FLAPPER)
    until("the trail grows", lambda: browser.run("return live.path.length") > first["trail"] + 5)
    later = browser.run(FLAPPER)
    for seen in (first, later):
        assert close(seen["position"], seen["drawn"], 6e-4), f"told to be at {seen['position']}, drawn at {seen['drawn']}"
        assert close(seen["attitude"], seen["turned"], 6e-4), f"told to be turned by {seen['attitude']}, drawn by {seen['turned']}"
    assert later["position"] != first["position"], "the flapper does not move"
    assert later["picture"] != first["picture"], "the picture stays as it was"


def grow(browser: Browser) -> None:
    first = until("the curves begin", lambda: min(browser.run(CURVES)) > 0 and browser.run(CURVES))
    assert isinstance(first, list)
    until("the curves grow", lambda: all(now > before for now, before in zip(browser.run(CURVES), first, strict=True)))


def main() -> None:
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    server = subprocess.Popen([BIN / "flappy-server", SOURCE / "configs/server/local.toml", "--http", "127.0.0.1:0", "--set", f'jobs.output="{WORK}/jobs"', *dds()],
                              stdout=subprocess.PIPE, text=True)
    flight = None
    try:
        address = server.stdout.readline().split()[-1]
        flight = subprocess.Popen([BIN / "flappy-fly", SOURCE / "configs/fly/figure_eight.toml", *dds("--set", "flight.duration_s=600")], stdout=subprocess.DEVNULL)
        settings = ("learn.updates=200000", "evaluate.every=200", "evaluate.vehicles=20", "collect.flappers=128", "collect.vehicles=128")
        subprocess.run([BIN / "flappy-job", "--dds", f"domain={DOMAIN}", "--dds", "reach=loopback", "--timeout", "20", "submit", "train", "train/escape.toml",
                        *(part for setting in settings for part in ("--set", setting))], check=True, stdout=subprocess.DEVNULL)
        with Browser(1280, 1400) as browser:
            browser.driver.get(address)
            until("the page is live", lambda: browser.run("return document.getElementById('link').textContent") == "live")
            watch(browser)
            grow(browser)
            browser.shoot(WORK / "dashboard.png")
            complaints = browser.complaints()
            assert complaints == [], f"the console complains: {complaints}"
    finally:
        for process in (flight, server):
            if process is not None:
                process.terminate()
                process.wait(60)
    print("the dashboard shows what happens")


main()
