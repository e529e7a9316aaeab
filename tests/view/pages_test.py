#!/usr/bin/env python3
"""Opens every kind of page in Chromium and looks at it.

pages_test.py BIN SOURCE WORK [--update]: programs, the project, a folder to use; --update takes what is seen as right from now on.
"""

import importlib
import json
import math
import random
import shutil
import subprocess
import sys
import types
from pathlib import Path

from PIL import Image, ImageChops, ImageStat

BIN, SOURCE, WORK = (Path(argument).resolve() for argument in sys.argv[1:4])
UPDATE = "--update" in sys.argv
sys.path.insert(0, str(SOURCE / "scripts"))
from browser import Browser  # noqa: E402

DATA = SOURCE / "tests" / "data" / "report"
SCREENS = DATA / "screens"
SMALL = (360, 240)
TOLERANCE = 3.0  # of 255, mean over all pixels: other fonts, other rounding
BLOCKS, BLOCK_TOLERANCE = (12, 8), 16.0  # the same of the block that differs most
ATTACK = "<script>alert(1)</script>"
#: Okabe and Ito, "Color Universal Design", 2008, and black and grey.
PALETTE = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#767676"}

CONTRAST = """
const channel = (v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
const light = (c) => 0.2126 * channel(c[0]) + 0.7152 * channel(c[1]) + 0.0722 * channel(c[2]);
const parsed = (text) => text.match(/[\\d.]+/g).map(Number);
const bad = [];
for (const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT); walker.nextNode();) {
  const node = walker.currentNode, element = node.parentElement;
  if (!node.textContent.trim() || !element.checkVisibility() || element.closest("script, noscript, option")) continue;
  const style = getComputedStyle(element), ink = parsed(element.closest("svg") ? style.fill : style.color);
  let back = [255, 255, 255];
  for (let e = element; e; e = e.parentElement) {
    const colour = parsed(getComputedStyle(e).backgroundColor);
    if (colour.length < 4 || colour[3] > 0.99) { back = colour; break; }
  }
  const [a, b] = [light(ink), light(back)], ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  if (ratio < 4.5) bad.push(`${node.textContent.trim().slice(0, 40)}: ${ratio.toFixed(2)}`);
}
return bad;
"""

#: Every chart's points against those of the report that stands in the page.
FIGURES = """
const report = JSON.parse(document.getElementById("report").textContent), wrong = [];
let checked = 0;
const figures = report.sections.flatMap((s) => s.blocks).filter((b) => b.kind === "figure");
const canvases = [...document.querySelectorAll("figure[data-figure] canvas")];
if (figures.length !== canvases.length) wrong.push(`${canvases.length} of ${figures.length} figures`);
figures.forEach((figure, k) => {
  const shown = Chart.getChart(canvases[k]).data.datasets.filter((d) => d.own.draw !== "band");
  figure.series.filter((s) => s.draw !== "band").forEach((s, i) => {
    const points = s.x.map((x, j) => [x, s.y[j]]).filter(([x]) => s.draw === "line" || x !== null);
    const drawn = shown[i].data.map((p) => [p.x, p.y]);
    if (JSON.stringify(points) !== JSON.stringify(drawn)) wrong.push(`${figure.id}: ${s.name}`);
    checked += points.length;
  });
});
return [checked, wrong];
"""

#: Colours on each canvas.
BLANK = """
return [...document.querySelectorAll("canvas")].filter((c) => c.checkVisibility()).map((canvas) => {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [120, 90];
  const pen = copy.getContext("2d");
  pen.drawImage(canvas, 0, 0, 120, 90);
  return new Set(new Uint32Array(pen.getImageData(0, 0, 120, 90).data.buffer)).size;
});
"""


def program(name: str, *arguments: object) -> str:
    done = subprocess.run([str(BIN / name), *map(str, arguments)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{name} {arguments}: {done.stderr}"
    return done.stdout


def report(name: str, *paths: object) -> Path:
    page = WORK / f"{name}.html"
    program("flappy-report", *paths, "--out", page)
    return page


def fly(name: str, config: str, *options: object) -> Path:
    program("flappy-fly", SOURCE / "configs" / "fly" / config, "--log", WORK / name, *options)
    return WORK / name


BY_THE_BEAT = """schema = 1
vehicle = "flapper_nimble.toml"
flapping_Hz = 14.7
gravity_m_s2 = 9.81

[ambient]
air_density_kg_m3 = 1.18
ground_z_m = -0.5
ceiling_z_m = 1000.0
walls = []

[mocap]
rate_hz = 100.0
latency_s = 0.0
position_noise_m = 2e-4
attitude_noise_rad = 2e-3

[command]
inputs = ["left_flap", "right_flap", "pitch_servo", "yaw_servo"]
"""


def fly_by_the_beat(name: str, seed: int) -> Path:
    """Half a minute of a robot that is known by the beat, whose wings' drag and whose stroke plane push as its file does not know."""
    noise, step_s, mass_kg = random.Random(seed), 1e-3, 0.103
    phase = [noise.uniform(0, 2 * math.pi) for _ in range(6)]
    position, velocity, mocap, command = [0.0, 0.0, 2.0], [0.0, 0.0, 0.0], ["t_s,x_m,y_m,z_m,qw,qx,qy,qz"], ["t_s,left_flap,right_flap,pitch_servo,yaw_servo"]
    for i in range(30000):
        t = i * step_s
        roll = 0.25 * math.sin(1.1 * t + phase[0]) + 0.1 * math.sin(2.7 * t + phase[1])
        pitch = 0.3 * math.sin(0.9 * t + phase[2]) + 0.1 * math.sin(3.1 * t + phase[3])
        yaw = 0.5 * math.sin(0.3 * t + phase[4])
        (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a / 2), math.sin(a / 2)) for a in (roll, pitch, yaw))
        w, x, y, z = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy
        turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
        servo, steer = 0.5 + 0.05 * math.sin(1.7 * t + phase[5]) + 0.03 * math.sin(4.1 * t), 0.5 + 0.01 * math.sin(0.7 * t)
        lift = 9.81 + 3 * (2 + 0.5 * math.sin(0.5 * t) - position[2]) - 3 * velocity[2]
        flap = lift * mass_kg / (0.0344 * 50)  # thrust of the file: 0.0344 N/Hz, 25 Hz at an input of 1
        v, beats = [sum(turn[k][c] * velocity[k] for k in range(3)) for c in range(3)], 25 * flap / 14.7
        force = [-3 * beats * v[0] + 20 * (servo - 0.5), -2 * beats * v[1], lift - beats * v[2]]
        if i % 10 == 0:
            seen = [p + 2e-4 * noise.gauss(0, 1) for p in position]
            mocap.append(",".join(f"{value:.6f}" for value in (t, *seen, w, x, y, z)))
            command.append(",".join(f"{value:.6f}" for value in (t, flap, flap, servo, steer)))
        for k in range(3):
            velocity[k] += step_s * (sum(turn[k][c] * force[c] for c in range(3)) - (9.81 if k == 2 else 0))
            position[k] += step_s * velocity[k]
    folder = WORK / "by_the_beat" / name
    folder.mkdir(parents=True)
    for file, lines in (("flight.toml", [BY_THE_BEAT]), ("mocap.csv", mocap), ("command.csv", command)):
        (folder / file).write_text("\n".join(lines) + "\n")
    return folder


def check_page(browser: Browser, name: str, least_colours: int = 8) -> None:
    """What holds for every page."""
    browser.settle()
    assert browser.complaints() == [], f"{name}: the console complains"
    assert browser.run("return document.querySelectorAll('img, iframe, link').length") == 0, f"{name}: brings something else in"
    colours = browser.run(BLANK)
    assert all(n >= least_colours for n in colours), f"{name}: a canvas is blank: {colours}"
    bad = browser.run(CONTRAST)
    assert bad == [], f"{name}: below a contrast of 4.5 to 1: {bad}"
    checked, wrong = browser.run(FIGURES)
    assert wrong == [], f"{name}: figures show other numbers: {wrong}"
    if "flight" not in name:
        assert checked > 0 or name == "effects", f"{name}: no number was looked at"
    used = set(browser.run("return JSON.parse(document.getElementById('report').textContent).sections.flatMap((s) => s.blocks)"
                           ".flatMap((b) => b.series ?? []).map((s) => s.colour)"))
    assert used <= PALETTE, f"{name}: other colours: {used - PALETTE}"
    # everything that can be worked by the mouse can be reached by the keyboard
    left_out = browser.run("return [...document.querySelectorAll('button, select, input, summary, a, .scroll, .view')]"
                           ".filter((e) => e.checkVisibility() && e.tabIndex < 0).length")
    assert left_out == 0, f"{name}: {left_out} controls are out of the keyboard's reach"


def check_numbers(browser: Browser, results: object, least: int) -> None:
    """Cells that say where in the results they stand show what stands there."""
    cells = browser.run("return [...document.querySelectorAll('[data-at]')].map((e) => [e.dataset.at, e.textContent])")
    assert len(cells) >= least, f"only {len(cells)} cells"
    for pointer, text in cells:
        value = results
        for key in pointer.split("/")[1:]:
            value = value[int(key)] if isinstance(value, list) else value[key]
        if value is None:
            assert text == "–", (pointer, text)
        else:
            assert math.isclose(float(text), value, rel_tol=0.006, abs_tol=1e-12), (pointer, text, value)


def check_screen(browser: Browser, name: str) -> None:
    """What is seen is what was seen, by and large."""
    # a long folder takes another line
    browser.run(
        "const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);"
        "while (texts.nextNode()) texts.currentNode.data = texts.currentNode.data.replaceAll(arguments[0], '/tmp/pages');",
        str(WORK),
    )
    browser.shoot(WORK / f"{name}.png")
    seen = Image.open(WORK / f"{name}.png").convert("RGB").resize(SMALL, Image.BOX)
    if UPDATE:
        SCREENS.mkdir(exist_ok=True)
        seen.save(SCREENS / f"{name}.png", optimize=True)
        return
    before = Image.open(SCREENS / f"{name}.png").convert("RGB")
    difference = ImageChops.difference(seen, before).convert("L")
    mean = ImageStat.Stat(difference).mean[0]
    most = max(difference.resize(BLOCKS, Image.BOX).getdata())
    print(f"{name}: differs by {mean:.2f} of 255, by {most} where most")
    assert mean < TOLERANCE, f"{name}: looks otherwise than {SCREENS / name}.png, by {mean:.1f} of 255"
    assert most < BLOCK_TOLERANCE, f"{name}: looks otherwise than {SCREENS / name}.png in one place, by {most} of 255"


def check_flight(browser: Browser) -> None:
    """The cursor moves the robot; the keyboard works everything."""
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    state = "const p = players[0], r = p.scene.robots[0]; return [p.now_s, ...r.group.position.toArray(), r.wings[0].stroke.rotation.z]"
    view = browser.driver.find_element("css selector", ".view")
    picture = "return document.querySelector('.view canvas').toDataURL()"
    start, first = browser.run(state), browser.run(picture)
    plot = browser.driver.find_element("css selector", ".plot .area")
    ActionChains(browser.driver).move_to_element_with_offset(plot, 40, 0).click().perform()
    browser.settle()
    there = browser.run(state)
    assert there[0] > start[0], "a click on a plot does not go there"
    assert there[1:4] != start[1:4], "the cursor does not move the robot"
    assert browser.run(picture) != first, "the picture stays as it was"
    expected = browser.run("return players[0].flights[0].positionAt(players[0].now_s)")
    assert all(abs(a - b) < 1e-6 for a, b in zip(there[1:4], expected, strict=True)), "the robot is elsewhere than its flight"
    text = browser.run("return document.querySelector('[data-panel=position] .value').textContent").replace("\u2212", "-")
    assert abs(float(text) - expected[0]) <= 0.006 * abs(expected[0]) + 2e-5, f"x is shown as {text}, and is {expected[0]}"

    beat = browser.run("return players[0].beat_s")
    ActionChains(browser.driver).click(view).send_keys(Keys.ARROW_RIGHT).perform()
    stepped = browser.run(state)
    assert abs(stepped[0] - there[0] - beat / 20) < 1e-9, "an arrow is no twentieth of a beat"
    assert stepped[4] != there[4], "the wings do not beat"
    ActionChains(browser.driver).send_keys("c").perform()
    assert browser.run("return players[0].scene.view") == "free", "C does not change the camera"
    before = browser.run("return players[0].scene.azimuth")
    ActionChains(browser.driver).send_keys("d").send_keys("+").perform()
    assert browser.run("return players[0].scene.azimuth") > before, "D does not turn the camera"
    ActionChains(browser.driver).send_keys(Keys.HOME).send_keys(" ").perform()
    assert browser.run("return players[0].playing"), "space does not play"
    browser.driver.execute_async_script("setTimeout(arguments[0], 400)")
    ActionChains(browser.driver).send_keys(" ").perform()
    assert browser.run("return players[0].now_s") > 0.05, "nothing moves while it plays"
    for box in browser.driver.find_elements("css selector", ".choice input"):
        if not box.is_selected():
            box.send_keys(" ")
    browser.run("const p = players[0]; p.timeline.show(p.duration_s / 3); p.seek(p.duration_s)")
    assert browser.run("const p = players[0]; return Math.abs(p.timeline.end_s - p.duration_s) < 1e-9"), "a window does not reach the end"
    browser.run("players[0].look('chase'); players[0].timeline.show(players[0].duration_s); players[0].seek(0.2)")


def check_laboratory(browser: Browser) -> None:
    """What a laboratory asks is answered, in pictures with points."""
    asked = browser.run("return [...document.querySelectorAll('.question')].map((e) => e.textContent)")
    assert "Would a laboratory believe it?" in asked, asked
    shown = browser.run("return [...document.querySelectorAll('figure[data-figure]')].map((e) => e.dataset.figure)")
    for figure in ("ladder_specific_force", "ladder_kinds_specific_force", "controls", "agreement_1"):
        assert figure in shown, f"no {figure} in {shown}"
    words = browser.run("return document.querySelector('article').textContent")
    assert "stroke plane actuation and flapping counter force" in words
    assert "Shifted in time no effect explains as much" in words


def check_declared(browser: Browser) -> None:
    """Declared inputs are plots of their own, and the robot without wings is where its flight is."""
    panels = browser.run("return [...document.querySelectorAll('[data-panel]')].map((e) => e.dataset.panel)")
    assert panels == ["position", "attitude", "path", "declared_0"], panels
    keys = browser.run("return document.querySelector('[data-panel=declared_0]').textContent")
    assert all(name in keys for name in ("left flap", "right flap", "pitch servo", "yaw servo")), keys
    browser.run("players[0].seek(12.345)")
    expected, at = browser.run("const p = players[0]; return [p.flights[0].positionAt(12.345), p.scene.robots[0].group.position.toArray()]")
    assert all(abs(a - b) < 1e-6 for a, b in zip(at, expected, strict=True)), "the robot is elsewhere than its flight"
    assert browser.run("return players[0].scene.robots[0].wings.length") == 0
    assert "ellipsoid of its mass and inertia" in browser.run("return document.querySelector('.player').textContent")


def swap_markers(flight: Path, first: int, last: int) -> None:
    """Poses that leap away and back."""
    lines = (flight / "mocap.csv").read_text().splitlines()
    for row in range(first + 1, last + 2):
        cells = lines[row].split(",")
        lines[row] = ",".join([cells[0], str(float(cells[1]) + 1), *cells[2:]])
    (flight / "mocap.csv").write_text("\n".join(lines) + "\n")


def check_swapped(browser: Browser) -> None:
    """Poses whose markers were taken for others are a mark, and no jump of the robot: rows 1000 to 1004 of 100 Hz."""
    path = browser.run("return [9.98, 10.0, 10.02, 10.04, 10.06].map((t) => players[0].flights[0].positionAt(t)[0])")
    assert max(path) - min(path) < 0.2, f"the robot jumps: {path}"
    assert "5 of 3000 poses are left out" in browser.run("return document.querySelector('.player').textContent")
    browser.run("players[0].timeline.show(1)")
    browser.run("players[0].seek(10.2)")
    grey = """
    const inside = {};
    for (const plot of players[0].timeline.plots) for (const t of [10.02, 10.06]) {
      const {x} = plot.chart.scales, {top, bottom} = plot.chart.chartArea, ratio = plot.chart.currentDevicePixelRatio;
      const copy = document.createElement("canvas"), pen = copy.getContext("2d", {willReadFrequently: true});
      [copy.width, copy.height] = [plot.canvas.width, plot.canvas.height];
      pen.drawImage(plot.canvas, 0, 0);
      const shades = pen.getImageData(Math.round(x.getPixelForValue(t) * ratio), top * ratio, 1, (bottom - top) * ratio).data;
      let marked = 0;
      for (let k = 0; k < shades.length; k += 4) marked += shades[k] === 0xaf && shades[k + 3] === 255;
      (inside[plot.element.dataset.panel] ??= []).push(marked > 0.8 * (bottom - top) * ratio);
    }
    return inside;"""
    assert browser.run(grey) == {"position": [True, False], "attitude": [True, False], "path": [False, False], "declared_0": [False, False]}, browser.run(grey)


def check_notebook(browser: Browser, page: Path) -> None:
    """The page lives in the frame that flappy.show gives a notebook, and can reach nothing of it."""
    sys.modules["flappy"], sys.modules["flappy._core"] = types.ModuleType("flappy"), types.ModuleType("flappy._core")
    sys.modules["flappy"].__path__ = [str(SOURCE / "python" / "flappy")]
    shown = importlib.import_module("flappy.flights").Page(page.read_text(encoding="utf-8"))
    notebook = WORK / "notebook.html"
    notebook.write_text(f"<!DOCTYPE html><meta charset='utf-8'><title>notebook</title>{shown._repr_html_()}", encoding="utf-8")
    browser.driver.get(notebook.as_uri())
    browser.driver.switch_to.frame(0)
    browser.ready()
    browser.settle()
    assert all(n > 8 for n in browser.run(BLANK)), "the frame is blank"
    assert browser.run("try { return parent.document.title } catch { return null }") is None, "the page reaches its notebook"
    browser.driver.switch_to.default_content()
    assert browser.complaints() == []


def check_design(browser: Browser, study: dict[str, list[object]]) -> None:
    """Every robot is drawn; one can be chosen; the mouse turns them, and keys do."""
    from selenium.webdriver.common.action_chains import ActionChains

    names = ["published", *(f"design {k:02}" for k in range(1, len(study["designs"])))]
    assert browser.run("return [...document.querySelectorAll('.designs h4')].map((e) => e.textContent)") == names
    assert browser.run("return document.querySelectorAll('.designs section svg').length") == len(names)
    assert browser.run("return document.querySelectorAll('canvas').length") == 1 + browser.run("return document.querySelectorAll('figure[data-figure]').length")
    assert browser.run("return document.querySelectorAll('.matrix').length") == len(names)
    # wings in the colours of the published robot and of designs, at least a share of the picture
    coloured = """
    const canvas = document.querySelector('.designs canvas'), copy = document.createElement('canvas'), pen = copy.getContext('2d');
    [copy.width, copy.height] = [canvas.width, canvas.height];
    pen.drawImage(canvas, 0, 0);
    const {data} = pen.getImageData(0, 0, copy.width, copy.height);
    let [published, designed] = [0, 0];
    for (let k = 0; k < data.length; k += 4) {
      published += data[k] > data[k + 2] + 60;
      designed += data[k + 2] > data[k] + 60;
    }
    return [published, designed].map((n) => n / (data.length / 4));"""
    published, designed = browser.run(coloured)
    assert published > 0.002, f"the published robot has {published} of the picture"
    areas = [design["values"]["wing_length_m"] * design["values"]["mean_chord_m"] for design in study["designs"]]
    expected = published * sum(areas[1:]) / areas[0]
    assert designed > 0.9 * expected, f"designs have {designed} of the picture, {expected} as their wings compare with the published robot's"
    buttons = browser.driver.find_elements("css selector", ".designs .controls button")
    assert [b.text for b in buttons] == ["all", *names[1:]]
    buttons[1].send_keys("\n")
    browser.settle()
    assert browser.run("return document.querySelector('.designs section.chosen h4').textContent") == "design 01"
    near = browser.run(coloured)
    assert near[0] >= published, "the published robot is no longer shown as large"
    assert 0.5 < near[1] / near[0] < 0.7 * designed / published, f"not the chosen design alone: {near}"
    view, picture = browser.driver.find_element("css selector", ".designs .view"), "return document.querySelector('.designs canvas').toDataURL()"
    before = browser.run(picture)
    ActionChains(browser.driver).drag_and_drop_by_offset(view, 120, 0).perform()
    browser.settle()
    dragged = browser.run(picture)
    assert dragged != before, "the mouse does not turn the robots"
    view.send_keys("w")
    browser.settle()
    assert browser.run(picture) != dragged, "W does not turn the robots"
    buttons[0].send_keys("\n")


def check_cases(browser: Browser) -> None:
    button = browser.driver.find_element("css selector", ".cases button.open")
    button.send_keys("\n")
    detail = browser.run("return document.querySelector('.cases tr.detail:not([hidden])').textContent")
    assert "added mass" in detail, f"a case says nothing of itself: {detail}"
    button.send_keys("\n")


def main() -> None:
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    one = fly("pid", "escape.toml", "--set", "task.base=controller")
    two = fly("eight", "figure_eight.toml", "--set", "flight.duration_s=3.5", "--set", "flight.seed=2")
    # a vehicle that would be a script
    vehicle = next(p for p in one.glob("*.toml") if p.name != "flight.toml")
    vehicle.write_text(vehicle.read_text().replace('name = "hummingbird_nominal"', f'name = "{ATTACK}"'))
    assert ATTACK in vehicle.read_text(), "the vehicle has another name"
    header = one / "flight.toml"
    evil = one / (ATTACK.replace("/", "\u2215") + ".toml")
    vehicle.rename(evil)
    header.write_text("\n".join(f"vehicle = '{evil.name}'" if line.startswith("vehicle =") else line for line in header.read_text().splitlines()
                                if not line.startswith("vehicle_sha256")) + "\n")
    sixty = fly("sixty", "hover.toml", "--set", "flight.duration_s=60")
    program("flappy-train", SOURCE / "configs/train/escape.toml", "--seeds", "0-1", "--out", WORK / "runs", "--set", "learn.updates=600", "--set",
            "evaluate.every=100", "--set", "evaluate.vehicles=50", "--set", "collect.flappers=128", "--set", "collect.vehicles=128")

    with Browser() as browser:
        browser.open(report("flight", one, "--goal", "0,0,0"))
        check_page(browser, "flight")
        assert browser.run("return players[0].flights[0].json.vehicle.name") == ATTACK
        check_flight(browser)
        check_page(browser, "flight, all plots")
        check_screen(browser, "flight")

        browser.open(report("flights", one, two))
        check_page(browser, "flights")
        browser.run("players[0].seek(0.3)")
        check_screen(browser, "flights")

        check_notebook(browser, WORK / "flights.html")

        page = report("sixty", sixty)
        weight, first_ms = page.stat().st_size / 1e6, min(browser.open(page) for _ in range(3))
        print(f"60 s of flight: {weight:.2f} MB, first frame after {first_ms:.0f} ms")
        assert weight < 15
        assert first_ms < 2000
        check_page(browser, "flight of 60 s")

        page = report("large", fly("large", "hover.toml", "--set", "flight.duration_s=600", "--set", "sensors.mocap.rate_hz=500"))
        weight, first_ms = page.stat().st_size / 1e6, browser.open(page)
        print(f"10 min of flight at 500 Hz: {weight:.2f} MB, first frame after {first_ms:.0f} ms")
        assert weight < 60
        assert first_ms < 10000
        check_page(browser, "flight of 10 min")
        shutil.rmtree(WORK / "large")

        for name, path, least in (("diagnosis", DATA / "diagnosis", 20), ("evaluation", DATA / "evaluation.json", 27), ("effects", DATA / "effects.json", 0),
                                  ("identification", DATA / "fit.json", 60)):
            browser.open(report(name, path))
            check_page(browser, name)
            check_numbers(browser, json.loads((path / "diagnosis.json" if path.is_dir() else path).read_text()), least)
            check_screen(browser, name)

        beats = [fly_by_the_beat(f"flight_{seed}", seed) for seed in (1, 2, 3)]
        found = WORK / "by_the_beat" / "diagnosis"
        program("flappy-gap", "diagnose", "--vehicle", SOURCE / "configs/vehicles/flapper_nimble.toml", "--flights", *beats, "--out", found)
        browser.open(report("by_the_beat", found))
        check_page(browser, "by_the_beat")
        check_numbers(browser, json.loads((found / "diagnosis.json").read_text()), 60)
        check_laboratory(browser)
        check_screen(browser, "by_the_beat")
        browser.run("[...document.querySelectorAll('.question')].find((e) => e.textContent.includes('laboratory')).scrollIntoView()")
        check_screen(browser, "laboratory")
        browser.open(report("declared", beats[0]))
        check_page(browser, "flight of declared inputs")
        check_declared(browser)
        check_screen(browser, "declared")
        swap_markers(beats[0], 1000, 1004)
        browser.open(report("swapped", beats[0]))
        check_page(browser, "flight of swapped markers")
        check_swapped(browser)

        browser.open(report("benchmark", DATA / "score.csv"))
        check_page(browser, "benchmark")
        check_cases(browser)
        check_screen(browser, "benchmark")

        browser.open(report("reported", SOURCE / "docs/results/blind_alone.csv"))
        check_page(browser, "reported benchmark")
        rows = len((SOURCE / "docs/results/blind_alone.csv").read_text().splitlines()) - 1
        told = browser.run("return document.querySelector('.cases').textContent")
        assert f"{rows} of {rows} cases" in told, told[:200]

        small = ("search.population=16", "search.generations=4", "flights.hover=4", "flights.escape=4", "flights.effects=1", "verify.designs=2",
                 "verify.vehicles=8", "verify.generations=0")
        program("flappy-design", SOURCE / "configs/design/hummingbird.toml", "--out", WORK / "study", *(word for s in small for word in ("--set", s)))
        study = json.loads((WORK / "study" / "design.json").read_text())
        browser.open(report("design", WORK / "study"))
        check_page(browser, "design")
        check_numbers(browser, study, 30)
        check_design(browser, study)

        browser.open(report("run", WORK / "runs"))
        check_page(browser, "run")
        check_numbers(browser, {run.name: json.loads((run / "summary.json").read_text()) for run in (WORK / "runs").glob("seed_*")}, 10)
        changed = browser.run("return [...document.querySelectorAll('article .table')].at(-1).textContent")
        assert "learn.updates" in changed and "60000" in changed and "600" in changed, f"the configuration's difference is {changed}"
        browser.open(report("all", DATA / "diagnosis", DATA / "evaluation.json", one))
        check_page(browser, "flight among others")
        assert browser.run("return document.querySelectorAll('nav a').length") == 3
    for picture in (SOURCE / "docs" / "pictures").glob("*.png"):
        assert picture.stat().st_size <= 300_000, f"{picture} is too large"
        assert any(f"pictures/{picture.name}" in text.read_text() for text in (SOURCE / "README.md", *(SOURCE / "docs").rglob("*.md"))), f"{picture} is nowhere shown"
    print("all pages are as they should be")


main()
