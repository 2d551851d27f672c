"""docs/report.png: the report of the 5 km/h run as a browser shows it. `cargo xtask screenshot` runs this.

screenshot.py REPORT.html PICTURE.png
"""

import io
import sys
from pathlib import Path

from PIL import Image

from browser import Visit, launched

# the front car in the middle of the second span
TIME = 36.0
WIDTH, HEIGHT = 1180, 1610


def main(report, picture):
    with launched() as browser:
        it = Visit(browser, Path(report).resolve(), width=WIDTH, height=HEIGHT, color_scheme="light", reduced_motion="reduce")
        it.ask("it.seek(args[0])", TIME)
        it.page.locator("[data-camera=quarter]").click()
        it.page.evaluate("document.activeElement.blur()")
        it.settle()
        png = it.page.screenshot()
        assert it.complaints == [], it.complaints
        it.close()
    # the best of compression, no palette: it would cost the magnets their colours
    Image.open(io.BytesIO(png)).convert("RGB").save(picture, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
