"""Publisher of a running robot to the page, in the loop's thread: ticks and changes.

Nothing is worked out here that is only shown: the page's process makes of the ticks what people
see (robot/dashboard/feed/live_feed.py). Other data is sent when it has changed.
"""

import os
from collections.abc import Callable, Iterable
from math import inf

from gazerig.drivers.process.passed_image import CAN_PASS, copied
from gazerig.drivers.types import Detections
from gazerig.robot.control.tick_stream import TickBatch
from gazerig.robot.dashboard.feed.live_feed import (
    TICKS,
    LiveRig,
    RunState,
    frame_message,
    frame_with_pixels,
    rig_message,
    state_message,
)
from gazerig.robot.dashboard.feed.page_process import PageProcess
from gazerig.robot.dashboard.feed.param_feed import ParamFeed, ParamThread
from gazerig.robot.model.commands import Command, Tune

_FRAME_S = 0.08
_STATE_S = 0.3


class Publisher:
    """Sends batches of ticks to the page, and other state when it changes.

    Args:
        page: the page.
        rig: returns how the rig is built now.
        state: Returns the state that ticks do not contain.
        feed: sends the parameters to the page.
        tell: Prints a line on the terminal, such as the page's address.
        browse: opens an address in the user's browser, once; None: leaves that to the user.

    depth: whether the depth image is shown in place of the camera's
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
        self.depth = False
        self._url_told = False
        self._started = 0
        self._rig_sent = False
        self._sent: RunState | None = None
        self._state_s = self._frame_s = -inf
        self._frame = 0
        self._images = False

    def process_commands(self, commands: Iterable[Command]) -> None:
        """Process executed commands: tuning may have changed the rig's geometry."""
        if any(isinstance(command, Tune) for command in commands):
            self.resend_geometry()

    def resend_geometry(self) -> None:
        """Send the rig's geometry again, after a change of its camera or its parameters."""
        self._rig_sent = False

    def take(self, batch: TickBatch) -> bool:
        """Send ticks and changes; return False if the page did not accept the ticks."""
        page, t_s = self._page, batch.newest.t_s
        self._tell_notices()
        new = page.started != self._started
        if new:
            self._restart()
        if self._started == 0:
            return True
        if self._params is not None:
            self._params.look()
        if not self._rig_sent:
            self._rig_sent = page.send(rig_message(self._rig()))
        if abs(t_s - self._state_s) >= _STATE_S:
            self._state_s = t_s
            self._send_state()
        taken = page.send(TICKS + batch.data)
        if not taken:
            page.dropped += batch.ticks
        if abs(t_s - self._frame_s) >= _FRAME_S:
            self._frame_s = t_s
            self._send_frame(batch.newest.detections)
        return taken and not new  # a new page needs the present percept

    def close(self) -> None:
        """Send no more parameters."""
        if self._params is not None:
            self._params.close()

    def _restart(self) -> None:
        """Send everything to a new page: only the one before has received it."""
        if self._params is not None and self._started:
            self._params.restart()
        self._started = self._page.started
        self._rig_sent, self._sent, self._frame = False, None, 0
        self._state_s = self._frame_s = -inf

    def _tell_notices(self) -> None:
        """Print the page's address once, and its other messages."""
        page = self._page
        if not self._url_told and (url := page.url()) is not None:
            self._url_told = True
            self._tell(f"the page is at {url}")
            if self._browse is not None and (once := page.url_once()) is not None:
                self._browse(once)
        while (note := page.notice()) is not None:
            self._tell(note)

    def _send_state(self) -> None:
        state = self._state()
        if state != self._sent and self._page.send(state_message(state)):
            self._sent = state

    def _send_frame(self, found: Detections | None) -> None:
        """Send the newest frame unless it was sent already."""
        if found is None or found.number == self._frame:
            return
        self._frame = found.number
        depth = self.depth and found.depth_m is not None
        array = found.depth_m if depth else found.image
        if array is None and self._images:
            return  # its slot has been written again
        if array is None:
            self._page.show_detections(frame_message(found, None, False, self.depth))
            return
        self._images = True
        if not CAN_PASS:
            self._page.show_detections(frame_with_pixels(found, array, depth, self.depth))
            return
        image = copied(array)
        try:
            self._page.show_detections(frame_message(found, image, depth, self.depth), image.fd)
        finally:
            os.close(image.fd)
