"""A headless Chromium, controlled through its debugging port."""

import atexit
import base64
import itertools
import json
import os
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import cache
from pathlib import Path
from typing import Any, cast

import child_processes
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


class DebuggingSocket:
    """Sends commands of the debugging protocol to a browser or a tab."""

    def __init__(self, url: str) -> None:
        self._ids = itertools.count(1)
        self.asked_for: list[str] = []
        # It is closed in any case: the browser need not confirm.
        self._socket = connect(url, max_size=None, ping_interval=None, close_timeout=0.5)

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

    def close(self) -> None:
        self._socket.close()


class Browser(DebuggingSocket):
    """One tab of a headless Chromium, driven through its debugging port."""

    def __init__(self, url: str, window_px: tuple[int, int], drawing: str = SLOW_DRAWING) -> None:
        super().__init__(url)
        self.width_px, height_px = window_px
        self.ask("Network.enable")
        self.ask("Page.enable")
        self.ask("Page.addScriptToEvaluateOnNewDocument", source=drawing)
        shape = {"width": self.width_px, "height": height_px, "deviceScaleFactor": 1}
        self.ask("Emulation.setDeviceMetricsOverride", **shape, mobile=False)

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


CHROMIUM_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-sync", "--disable-background-networking", "--disable-component-update"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars"),
    # No name resolves: a page that needed anything from elsewhere would stay empty.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE 127.0.0.2",
    "--remote-debugging-port=0",
)


class Chromium:
    """A headless Chromium, whose tabs have cookies and storage of their own."""

    def __init__(self, program: str) -> None:
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._process = subprocess.Popen(
            [program, *CHROMIUM_FLAGS, f"--user-data-dir={self._folder.name}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        child_processes.SHARED.add(self._process.pid)
        # It writes them into its folder once it listens.
        file = Path(self._folder.name) / "DevToolsActivePort"
        wait_for(lambda: file.exists() and file.read_text().count("\n") == 1, "the browser")
        port, path = file.read_text().splitlines()
        self._address = f"ws://127.0.0.1:{port}"
        self._control = DebuggingSocket(self._address + path)

    @contextmanager
    def tab(self, window_px: tuple[int, int], drawing: str) -> Iterator[Browser]:
        context = self._control.ask("Target.createBrowserContext")["browserContextId"]
        asked = {"url": "about:blank", "browserContextId": context}
        target = self._control.ask("Target.createTarget", **asked)["targetId"]
        address = f"{self._address}/devtools/page/{target}"
        try:
            with closing(Browser(address, window_px, drawing)) as browser:
                yield browser
        finally:
            self._control.ask("Target.disposeBrowserContext", browserContextId=context)

    def end(self) -> None:
        self._control.close()
        os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._folder.cleanup()


@cache
def shared_chromium(program: str) -> Chromium:
    """Return the one of this process, which ends with it, or with its tests: see conftest.py."""
    atexit.register(end_chromium)
    return Chromium(program)


def end_chromium() -> None:
    """End it, if a test has started it."""
    if shared_chromium.cache_info().currsize:
        shared_chromium(str(chromium())).end()
        shared_chromium.cache_clear()


@contextmanager
def browsing(
    window_px: tuple[int, int] = WINDOW_PX, drawing: str = SLOW_DRAWING
) -> Iterator[Browser]:
    """Open a tab that first runs a script about drawing on every page."""
    program = chromium()
    if program is None:
        pytest.skip("no chromium, chromium-browser or google-chrome in the path")
    with shared_chromium(program).tab(window_px, drawing) as browser:
        yield browser
