"""Publisher of a running robot to the page, in the loop's thread: ticks and changes.

Data that is only shown is not computed here but in the page's process, from the ticks
(robot/dashboard/feed/live_feed.py). Other data is sent when it has changed.
"""

import json
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable
from math import inf

import msgspec

from gazerig.drivers.process.passed_image import copy_image
from gazerig.drivers.types import Detections
from gazerig.robot.control.command_handler import ParamAccess
from gazerig.robot.control.observers import failure_text
from gazerig.robot.control.tick_stream import TickBatch
from gazerig.robot.dashboard.feed.live_feed import (
    TICKS,
    LiveRig,
    frame_message,
    rig_message,
    state_message,
)
from gazerig.robot.dashboard.feed.page_process import PARAMS, VALUES, PageProcess
from gazerig.robot.dashboard.feed.snapshot import RunState
from gazerig.robot.model.commands import Command, Tune, Value

_FRAME_S = 0.08
_STATE_S = 0.3
_LIVE = "next tick"
"""Time of effect of the parameters that a running rig applies."""
_PIECE = 40  # parameters in a message: about 20 kB, a tenth of the limit


class ParamFeed:
    """Sends the parameters that a running rig applies to the page, and after that all changes.

    The constructor writes the first messages. This takes a moment, so construct it before the
    torque is on.

    Args:
        send: sends a message to the page; returns False if the page does not accept it now.
        tuning: the parameters.
    """

    def __init__(self, send: Callable[[bytes], bool], tuning: ParamAccess) -> None:
        self._send = send
        self._tuning = tuning
        self._due: deque[bytes] = deque()
        self._known: dict[str, Value] = {}
        self._version: int | None = None
        self._live: frozenset[str] = frozenset()
        self._write()

    def restart(self) -> None:
        """Send everything again to a restarted page."""
        self._due.clear()
        self._known, self._version = {}, None

    @property
    def has_pending(self) -> bool:
        """Return whether data waits to be sent."""
        return bool(self._due) or self._tuning.version != self._version

    def step(self) -> None:
        """Send waiting data, as far as the page accepts it."""
        if not self._due and self._tuning.version != self._version:
            self._write()
        while self._due and self._send(self._due[0]):
            self._due.popleft()

    def _write(self) -> None:
        """Create messages: first with all parameters, then with changed values."""
        first = self._version is None
        # Before reading, so that a change in the meantime is sent next.
        self._version = self._tuning.version
        if first:
            params = [param for param in self._tuning.parameters() if param.live == _LIVE]
            self._live = frozenset(param.key for param in params)
            for start in range(0, len(params), _PIECE):
                self._due.append(PARAMS + msgspec.json.encode(params[start : start + _PIECE]))
        values = self._tuning.values()
        now = {key: value for key, value in values.items() if key in self._live}
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
            piece = {key: now[key] for key in changed[start : start + _PIECE]}
            self._due.append(VALUES + json.dumps({**state, "values": piece}).encode())


class ParamThread:
    """Sends the parameters in a thread: writing them takes milliseconds, too long for a tick.

    The thread waits until there is data to send.
    """

    def __init__(self, feed: ParamFeed, tell: Callable[[str], None]) -> None:
        self._feed, self._tell = feed, tell
        self._wanted = threading.Event()
        self._again = self._over = self._failed = False
        self._thread: threading.Thread | None = None

    def request_changes(self) -> None:
        """Request that changes are sent; called by the loop."""
        if self._feed.has_pending and not self._wanted.is_set():
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


class Publisher:
    """Sends batches of ticks to the page, and other state when it changes.

    Args:
        page: the page.
        rig: returns the present geometry of the rig.
    state: returns the state that ticks do not contain.
        feed: sends the parameters to the page.
        tell: Prints a line on the terminal, such as the page's address.
        browse: opens an address in the user's browser, once; None: leaves that to the user.
    """

    def __init__(
        self,
        page: PageProcess,
        rig: Callable[[], LiveRig],
        state: Callable[[], RunState],
        feed: ParamFeed | None,
        tell: Callable[[str], None],
        browse: Callable[[str], object] | None = None,
    ) -> None:
        self._browse = browse
        self._page, self._rig, self._state, self._tell = page, rig, state, tell
        self._params = ParamThread(feed, tell) if feed is not None else None
        self._url_told = False
        self._started = 0
        self._rig_sent = False
        self._sent: RunState | None = None
        self._state_s = self._frame_s = -inf
        self._frame = 0
        self._images = False

    def process_commands(self, commands: Iterable[Command]) -> None:
        """Process executed commands; a tuned parameter may have changed the rig's geometry."""
        if any(isinstance(command, Tune) for command in commands):
            self.resend_geometry()

    def resend_geometry(self) -> None:
        """Send the rig's geometry again, after a change of its camera or its parameters."""
        self._rig_sent = False

    def take(self, batch: TickBatch) -> bool:
        """Send ticks and changes; return False if the page did not accept the ticks."""
        page, t_s = self._page, batch.newest.t_s
        page.check()
        if not self._url_told and (url := page.url()) is not None:
            self._url_told = True
            self._tell(f"the page is at {url}")
            if self._browse is not None and (once := page.url_once()) is not None:
                self._browse(once)
        while (note := page.notice()) is not None:
            self._tell(note)
        new = page.started != self._started
        if new:
            # Send everything to a new page: only the previous page has received it.
            if self._params is not None and self._started:
                self._params.restart()
            self._started = page.started
            self._rig_sent, self._sent, self._frame = False, None, 0
            self._state_s = self._frame_s = -inf
        if self._started == 0:
            return True
        if self._params is not None:
            self._params.request_changes()
        if not self._rig_sent:
            self._rig_sent = page.send(rig_message(self._rig()))
        if abs(t_s - self._state_s) >= _STATE_S:
            self._state_s = t_s
            state = self._state()
            if state != self._sent and page.send(state_message(state)):
                self._sent = state
        taken = page.send(TICKS + batch.data)
        if not taken:
            page.dropped += batch.ticks
        if abs(t_s - self._frame_s) >= _FRAME_S:
            self._frame_s = t_s
            self._send_frame(batch.newest.detections)
        return taken and not new  # a new page needs the present percept

    def close(self) -> None:
        """Stop sending parameters."""
        if self._params is not None:
            self._params.close()

    def _send_frame(self, found: Detections | None) -> None:
        """Send the newest frame unless it was sent already."""
        if found is None or found.number == self._frame:
            return
        self._frame = found.number
        array = found.image
        if array is None:
            if not self._images:  # else its slot has been overwritten
                self._page.send(frame_message(found, None))
            return
        self._images = True
        image = copy_image(array)
        try:
            self._page.send(frame_message(found, image), image.fd)
        finally:
            os.close(image.fd)
