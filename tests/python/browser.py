"""A headless Chromium for the tests of the report: the system's own, driven by Playwright.

Debian's package is installed where it is missing and that is allowed; Playwright brings only the
driver, its own browsers are not downloaded.
"""

import os
import shutil
import subprocess
from contextlib import contextmanager

from playwright.sync_api import sync_playwright

NAMES = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"]
INSTALL = "apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends chromium"
# WebGL by software: the same picture with and without a graphics card
OPTIONS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--force-color-profile=srgb"]


class NoBrowser(Exception):
    """There is no Chromium, and why it could not be installed."""


def chromium():
    """Path of a Chromium; $CHROMIUM names one in another place."""
    names = [os.environ["CHROMIUM"]] if "CHROMIUM" in os.environ else NAMES
    found = next(filter(None, map(shutil.which, names)), None)
    return found or _install()


def _install():
    none = NoBrowser("Chromium is missing, and there is no apt-get (or no sudo) to install it; set CHROMIUM to its path")
    if not shutil.which("apt-get"):
        raise none
    shell = ["sh", "-c", INSTALL] if os.geteuid() == 0 else ["sudo", "-n", "sh", "-c", INSTALL]
    if not shutil.which(shell[0]):
        raise none
    done = subprocess.run(shell, capture_output=True, text=True, timeout=900)
    found = shutil.which("chromium")
    if done.returncode != 0 or not found:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise NoBrowser(f"Chromium is missing and `{INSTALL}` failed: {last}")
    return found


@contextmanager
def launched():
    """A running browser."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium(), args=OPTIONS)
        yield browser
        browser.close()


class Visit:
    """A report opened in a page of its own; remembers all that should not happen."""

    def __init__(self, browser, report, width=1000, height=800, script=None, **context):
        self.context = browser.new_context(viewport={"width": width, "height": height}, **context)
        self.page = self.context.new_page()
        self.url = report.as_uri()
        self.complaints, self.requests = [], []
        self.page.on("console", lambda it: self.complaints.append(it.text) if it.type in ("error", "warning") else None)
        self.page.on("pageerror", lambda it: self.complaints.append(str(it)))
        self.page.on("request", lambda it: self.requests.append(it.url))
        if script:
            self.page.add_init_script(script)
        self.page.goto(self.url, timeout=120_000)
        self.page.wait_for_selector("html[data-ready=true]", timeout=120_000)

    def foreign(self):
        """Requests for anything but the report itself and what it holds."""
        return [url for url in self.requests if url.split("#")[0] != self.url and not url.startswith(("blob:", "data:"))]

    def check(self):
        """Nothing was complained about, and nothing asked for from elsewhere."""
        assert self.complaints == [] and self.foreign() == []

    def view(self):
        """The 3D view's element, once it is drawn."""
        self.page.wait_for_selector("#view .view[data-ready]", timeout=60_000)
        return self.page.locator("#view .view")

    def ask(self, script, *arguments):
        """Evaluates a function of the 3D view: `it` is the view."""
        self.view()
        return self.page.evaluate(f"(args) => ((it, args) => {script})(document.querySelector('#view').view, args)", list(arguments))

    def settle(self):
        """Waits until what was asked for is drawn."""
        self.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")

    def close(self):
        self.context.close()
