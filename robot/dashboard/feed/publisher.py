"""Publisher of a running robot to the page, in the loop's thread: ticks and changes.

Data that is only shown is not computed here but in the page's process, from the ticks
(robot/dashboard/feed/rig_feed.py). Other data is sent when it has changed.
"""

import os
from collections.abc import Callable, Iterable
from math import inf

from gazerig.drivers.process.passed_image import copy_image
from gazerig.drivers.types import Detections
from gazerig.robot.dashboard.feed.page_process import PageProcess
from gazerig.robot.dashboard.feed.rig_feed import (
    TICKS,
    LiveRig,
    frame_message,
    rig_message,
    state_message,
)
from gazerig.robot.loop.tick_stream import TickBatch
from gazerig.robot.model.commands import Command, Tune
from gazerig.robot.net.topics import RunState

_FRAME_S = 0.08
_STATE_S = 0.5
"""Time between two states, s; computing one takes half a millisecond."""


class Publisher:
    """Sends batches of ticks to the page, and other state when it changes.

    Args:
        page: the page.
        rig: returns the present geometry of the rig.
        state: returns the state that ticks do not contain.
        tell: Prints a line on the terminal, such as the page's address.
        browse: opens an address in the user's browser, once; None: leaves that to the user.
    """

    def __init__(
        self,
        page: PageProcess,
        rig: Callable[[], LiveRig],
        state: Callable[[], RunState],
        tell: Callable[[str], None],
        browse: Callable[[str], object] | None = None,
    ) -> None:
        self._browse = browse
        self._page, self._rig, self._state, self._tell = page, rig, state, tell
        self._url_told = False
        self._started = 0
        self._rig_sent = False
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
            self._started = page.started
            self._rig_sent, self._frame = False, 0
            self._state_s = self._frame_s = -inf
        if self._started == 0:
            return True
        if not self._rig_sent:
            self._rig_sent = page.send(rig_message(self._rig()))
        if abs(t_s - self._state_s) >= _STATE_S:
            self._state_s = t_s
            page.send(state_message(self._state()))
        taken = page.send(TICKS + batch.data)
        if not taken:
            page.dropped += batch.ticks
        if abs(t_s - self._frame_s) >= _FRAME_S:
            self._frame_s = t_s
            self._send_frame(batch.newest.detections)
        return taken and not new  # a new page needs the present percept

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
