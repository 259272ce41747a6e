"""A real browser, driven by the W3C WebDriver protocol: a few requests as JSON, for which no package is needed."""

import base64
import json
import shutil
import socket
import subprocess
import time
import urllib.request
from contextlib import contextmanager

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
ARGUMENTS = (
    "--headless=new",
    "--no-sandbox",  # of the browser: tests often run as root, where it cannot start
    "--use-angle=swiftshader",  # WebGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # no network
    "--window-size=640,480",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
)
PATIENCE = 60.0  # seconds until a page has done what is awaited, on a busy machine


class Browser:
    """One window.  run : a script, as the body of a function."""

    def __init__(self, port):
        self._root = f"http://127.0.0.1:{port}"
        browser = next(filter(None, map(shutil.which, BROWSERS)))
        options = {"args": list(ARGUMENTS), "binary": browser}
        wanted = {"capabilities": {"alwaysMatch": {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}}
        self._session = self._request("POST", "/session", wanted)["sessionId"]

    def open(self, url):
        self._command("POST", "/url", {"url": url})

    def run(self, body, *arguments):
        return self._command("POST", "/execute/sync", {"script": body, "args": list(arguments)})

    def wait(self, condition):
        """Until an expression is true; its value."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            value = self.run(f"return {condition}")
            if value:
                return value
            time.sleep(0.05)
        raise AssertionError(f"{condition} stayed false; the console says {self.console()}")

    def picture(self):
        """Of the window, as PNG."""
        return base64.b64decode(self._command("GET", "/screenshot"))

    def press(self, *keys):
        actions = [{"type": kind, "value": key} for key in keys for kind in ("keyDown", "keyUp")]
        self._command("POST", "/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": actions}]})

    def drag(self, start, end):
        """With the left button, from one place of the window to another, in pixels."""
        move = lambda place: {"type": "pointerMove", "duration": 50, "x": place[0], "y": place[1]}
        actions = [move(start), {"type": "pointerDown", "button": 0}, move(end), {"type": "pointerUp", "button": 0}]
        self._command("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": actions}]})

    def click(self, selector):
        name = self._command("POST", "/element", {"using": "css selector", "value": selector})
        self._command("POST", f"/element/{next(iter(name.values()))}/click", {})

    def console(self):
        """Messages of the page since the last call."""
        return [entry["message"] for entry in self._command("POST", "/se/log", {"type": "browser"})]

    def close(self):
        self._request("DELETE", f"/session/{self._session}", None)

    def _command(self, method, path, data=None):
        return self._request(method, f"/session/{self._session}{path}", data)

    def _request(self, method, path, data):
        body = None if data is None else json.dumps(data).encode()
        request = urllib.request.Request(self._root + path, body, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=2 * PATIENCE) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(json.load(error)["value"]["message"]) from None


@contextmanager
def started_browser():
    """A browser for the length of the block; the test is skipped where none is installed."""
    if not shutil.which("chromedriver") or not any(map(shutil.which, BROWSERS)):
        pytest.skip("Chromium and chromedriver are not installed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    driver = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        browser = Browser(_listening(port))
        yield browser
        browser.close()
    finally:
        driver.terminate()
        driver.wait(timeout=10)


def _listening(port):
    """The port, once somebody listens there."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return port
        time.sleep(0.05)
    raise AssertionError("chromedriver does not answer")
