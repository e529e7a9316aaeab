"""A headless Chromium, for pictures and tests of pages: Debian's chromium, chromium-driver and python3-selenium, drawing in software."""

import time
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

ARGUMENTS = ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
             "--hide-scrollbars", "--force-device-scale-factor=1", "--force-color-profile=srgb", "--disable-lcd-text")
PATIENCE_S = 120
#: Of a window, what is not the page.
FRAME_PX = 143


class Browser:
    def __init__(self, width: int = 1440, height: int = 900) -> None:
        options = Options()
        for argument in (*ARGUMENTS, f"--window-size={width},{height + FRAME_PX}"):
            options.add_argument(argument)
        options.binary_location = "/usr/bin/chromium"
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.driver.set_script_timeout(PATIENCE_S)

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self.driver.quit()

    def open(self, page: Path) -> float:
        """Opens a report and waits for its first frame; milliseconds from the begin of the navigation to it."""
        self.driver.get(page.resolve().as_uri())
        return self.ready()

    def ready(self) -> float:
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            ready = self.run("return document.documentElement.dataset.ready ?? null")
            if ready is not None:
                return float(ready)
            time.sleep(0.02)
        raise TimeoutError(f"no first frame within {PATIENCE_S} s; the console says {self.complaints()}")

    def run(self, script: str, *arguments: object) -> object:
        return self.driver.execute_script(script, *arguments)

    def complaints(self) -> list[str]:
        """What the console has noted since it was asked last, information left out."""
        return [entry["message"] for entry in self.driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]

    def settle(self) -> None:
        """Until what was asked for is drawn."""
        self.driver.execute_async_script("const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()))")

    def shoot(self, file: Path, selector: str | None = None) -> None:
        """A picture of the window, or of an element."""
        self.settle()
        if selector is None:
            self.driver.save_screenshot(str(file))
        else:
            self.driver.find_element("css selector", selector).screenshot(str(file))
