"""A headless Chromium, controlled through its debugging port."""

import base64
import itertools
import json
import os
import shutil
import signal
import subprocess
import tempfile
import urllib.request
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, cast

import pytest
from page_visitor import PATIENCE_S
from shown_page import wait_for
from websockets.sync.client import connect

WINDOW_PX = (1280, 800)
# A processor that does a graphics card's work draws few pictures a second, not sixty ...
SLOW_DRAWING = """(() => {
  const soon = window.requestAnimationFrame.bind(window)
  window.requestAnimationFrame = draw => setTimeout(() => soon(draw), 100)
  window.cancelAnimationFrame = clearTimeout
})()
"""
# ... and of the scene only what a test asks for with drawScene: each picture costs it 0.2 s.
RARE_DRAWING = f"""{SLOW_DRAWING};
for (const draw of ['drawArrays', 'drawElements', 'drawRangeElements',
                    'drawArraysInstanced', 'drawElementsInstanced']) {{
  const drawn = WebGL2RenderingContext.prototype[draw]
  WebGL2RenderingContext.prototype[draw] = function (...what) {{
    if (window.drawScene) drawn.apply(this, what)
  }}
}}
"""


def chromium() -> str | None:
    names = ("chromium", "chromium-browser", "google-chrome")
    return next((path for name in names if (path := shutil.which(name))), None)


class Browser:
    """One tab of a headless Chromium, driven through its debugging port."""

    def __init__(
        self, debugging_port: int, window_px: tuple[int, int], drawing: str = SLOW_DRAWING
    ) -> None:
        self.width_px, height_px = window_px
        self._ids = itertools.count(1)
        self.asked_for: list[str] = []
        with urllib.request.urlopen(f"http://127.0.0.1:{debugging_port}/json/list") as answer:
            tab = next(t for t in json.load(answer) if t["type"] == "page")
        self._socket = connect(
            tab["webSocketDebuggerUrl"],
            max_size=None,
            ping_interval=None,
            close_timeout=0.5,  # the browser is killed in any case
        )
        self.ask("Network.enable")
        self.ask("Page.enable")
        self.ask("Page.addScriptToEvaluateOnNewDocument", source=drawing)
        shape = {"width": self.width_px, "height": height_px, "deviceScaleFactor": 1}
        self.ask("Emulation.setDeviceMetricsOverride", **shape, mobile=False)

    def ask(self, method: str, **params: object) -> dict[str, Any]:
        """Send one command of the debugging protocol and return its answer."""
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv(timeout=PATIENCE_S))
            if answer.get("method") == "Network.requestWillBeSent":
                self.asked_for.append(answer["params"]["request"]["url"])
            if answer.get("id") == number:
                return cast("dict[str, Any]", answer["result"])

    def go(self, url: str) -> None:
        self.ask("Page.navigate", url=url)

    def words(self) -> str:
        """All text on the page and in the frame of the view."""
        frames = "[document, document.querySelector('#view')?.contentDocument]"
        script = f"{frames}.map(d => d?.body?.innerText ?? '').join('\\n')"
        answer = self.ask("Runtime.evaluate", expression=script)
        return str(answer["result"].get("value", ""))

    def run(self, script: str) -> None:
        """Run a script."""
        self.ask("Runtime.evaluate", expression=script)

    def photograph(self) -> bytes:
        """A PNG of the page."""
        return self._captured()

    def _captured(self, **what: object) -> bytes:
        answer = self.ask("Page.captureScreenshot", format="png", optimizeForSpeed=True, **what)
        return base64.b64decode(answer["data"])

    def close(self) -> None:
        self._socket.close()


CHROMIUM_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-sync", "--disable-background-networking", "--disable-component-update"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"),
    # No name resolves: a page that needed anything from elsewhere would stay empty.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE 127.0.0.2",
    "--remote-debugging-port=0",
)


@contextmanager
def browsing(
    window_px: tuple[int, int] = WINDOW_PX, drawing: str = SLOW_DRAWING
) -> Iterator[Browser]:
    """Open a browser that first runs a script about drawing on every page."""
    program = chromium()
    if program is None:
        pytest.skip("no chromium, chromium-browser or google-chrome in the path")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        process = subprocess.Popen(
            [program, *CHROMIUM_FLAGS, f"--user-data-dir={folder}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            with closing(Browser(debugging_port(Path(folder)), window_px, drawing)) as browser:
                yield browser
        finally:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def debugging_port(folder: Path) -> int:
    """The port that Chromium writes into its folder once it listens."""
    file = folder / "DevToolsActivePort"
    wait_for(lambda: file.exists() and "\n" in file.read_text(), "the browser")
    return int(file.read_text().splitlines()[0])
