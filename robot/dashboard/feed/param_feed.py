"""Feed of the parameters to the page: all of them once, then changes."""

import json
import threading
from collections import deque
from collections.abc import Callable

from gazerig.robot.control.command_handler import ParamAccess, plain
from gazerig.robot.control.observers import failure_text
from gazerig.robot.dashboard.feed.page_process import PARAMS, VALUES
from gazerig.robot.model.commands import Value

_PIECE = 40  # parameters in a message: some 20 kB, a tenth of the limit


class ParamFeed:
    """Sends the parameters to the page, and after that all changes.

    The first messages are written by the constructor: it takes a moment, so make it before the
    torque is on.

    Args:
        send: sends a message to the page; False: not now.
        tuning: the parameters.
    """

    def __init__(self, send: Callable[[bytes], bool], tuning: ParamAccess) -> None:
        self._send = send
        self._tuning = tuning
        self._due: deque[bytes] = deque()
        self._known: dict[str, Value] = {}
        self._version: int | None = None
        self._write()

    def restart(self) -> None:
        """Send everything again to a restarted page."""
        self._due.clear()
        self._known, self._version = {}, None

    @property
    def pending(self) -> bool:
        """Return whether data waits to be sent."""
        return bool(self._due) or self._tuning.version != self._version

    def step(self) -> None:
        """Send waiting data, as far as the page accepts it."""
        if not self._due and self._tuning.version != self._version:
            self._write()
        while self._due and self._send(self._due[0]):
            self._due.popleft()

    def _write(self) -> None:
        """Create messages: all parameters the first time, then changed values."""
        first = self._version is None
        self._version = self._tuning.version  # before reading: a change meanwhile is seen next
        if first:
            params = [plain(param._asdict()) for param in self._tuning.parameters()]
            for start in range(0, len(params), _PIECE):
                self._due.append(PARAMS + json.dumps(params[start : start + _PIECE]).encode())
        now = dict(self._tuning.values())
        gone = object()
        changed = [key for key, value in now.items() if self._known.get(key, gone) != value]
        self._known = now
        state: dict[str, object] = {
            "unsaved": [change.key for change in self._tuning.unsaved()],
            "path": str(self._tuning.path),
            "character": self._tuning.character_name,
            "characters": sorted(self._tuning.characters()),
        }
        for start in range(0, max(1, len(changed)), _PIECE):
            piece = {key: plain(now[key]) for key in changed[start : start + _PIECE]}
            self._due.append(VALUES + json.dumps({**state, "values": piece}).encode())


class ParamThread:
    """Lets a thread send the parameters: writing them takes milliseconds, which a tick has not.

    It waits until there is something to send.

    Args:
        feed: sends; belongs to the thread from now on.
        tell: gets a line if that fails.
    """

    def __init__(self, feed: ParamFeed, tell: Callable[[str], None]) -> None:
        self._feed, self._tell = feed, tell
        self._wanted = threading.Event()
        self._again = self._over = self._failed = False
        self._thread: threading.Thread | None = None

    def look(self) -> None:
        """Request that changes are sent; called by the loop."""
        if self._feed.pending and not self._wanted.is_set():
            if self._thread is None:
                self._thread = threading.Thread(
                    target=self._work, name="page parameters", daemon=True
                )
                self._thread.start()
            self._wanted.set()

    def restart(self) -> None:
        """Request that everything is sent again to a restarted page."""
        self._again = True
        self._wanted.set()

    def close(self) -> None:
        """End the thread."""
        self._over = True
        self._wanted.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)

    def _work(self) -> None:
        while True:
            self._wanted.wait()
            self._wanted.clear()
            if self._over:
                return
            try:
                if self._again:
                    self._again = False
                    self._feed.restart()
                self._feed.step()
            except Exception as error:
                if not self._failed:
                    self._failed = True
                    self._tell(failure_text("the page's parameters", error))
