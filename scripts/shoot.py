#!/usr/bin/env python3
"""Pictures of the pages in a folder, for scripts/pictures: shoot.py PAGES FOLDER. Each below 300 kB."""

import sys
from pathlib import Path

from browser import Browser
from PIL import Image

MOST_BYTES = 300_000
#: The robot every 70 ms of its escape, in a wide view of its own.
ESCAPE = """
const player = players[0];
document.body.replaceChildren(player.view);
Object.assign(player.view.style, {width: "1200px", height: "480px", maxHeight: "none", border: "0", borderRadius: "0"});
player.look("free");
Object.assign(player.scene, {azimuth: -1.42, elevation: 0.36, distance: 0.5, middle: [-0.1, 0, 0.012]});
player.scene.resize();
player.shown.arrows = false;
player.seek(0.28);
Object.assign(player.timeline, {begin_s: 0, end_s: 0.28});
player.showMoments(true, 5);
"""
#: Page, width and height of the window, what is done before it is taken, what of it is taken.
PICTURES = (
    ("escape", 1280, 900, ESCAPE, ".view"),
    ("flights", 1280, 900, "players[0].look('free'); players[0].seek(0.3)", None),
    ("run", 1280, 1150, "", None),
    ("evaluation", 1280, 1000, "", None),
    ("diagnosis", 1280, 1500, "", None),
    ("identification", 1280, 900, "", None),
    ("benchmark", 1280, 1400, "", None),
)


def main() -> None:
    pages, folder = map(Path, sys.argv[1:3])
    for name, width, height, script, selector in PICTURES:
        file = folder / f"{name}.png"
        with Browser(width, height) as browser:
            browser.open(pages / f"{name}.html")
            browser.run(script)
            browser.shoot(file, selector)
            if browser.complaints():
                sys.exit(f"{name}: the console complains")
        picture = Image.open(file).convert("RGB")
        if selector is not None:
            picture = picture.crop((0, 0, picture.width, min(picture.height, height)))
        picture.quantize(255, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).save(file, optimize=True)
        print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")
        if file.stat().st_size > MOST_BYTES:
            sys.exit(f"{file}: more than {MOST_BYTES} bytes")


main()
