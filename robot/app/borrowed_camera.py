"""An emulated rig's camera in whose place a browser's own camera may stand for a while.

Its pictures come through the page's process and are looked at in a camera process of their own, as
a webcam's are. While they come, the head looks at who sits before the browser; when they end, the
simulated scene is there again.
"""

import contextlib
import threading
from collections.abc import Callable
from functools import partial

from gazerig.drivers.camera.browser_source import FIELD_DEG, BrowserSource
from gazerig.drivers.camera.capture_loop import BACK, LOST
from gazerig.drivers.camera.jpeg_slot import JpegSlot
from gazerig.drivers.camera.process import CameraProcess
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import Camera, Detections

SILENT_S = 1.5
"""A browser that has sent nothing for so long has ended."""

_BEGINS = (
    f"looking through a browser's camera, taken to be {FIELD_DEG:g} deg wide as nothing is known "
    "of its lens; the scene waits"
)
_ENDS = "the browser's camera has ended: the scene is there again"

Make = Callable[[Callable[[], FrameSource], int], CameraProcess]
"""Returns a camera process of a source; the number counts those there were before."""


class BorrowedCamera:
    """The rig's own camera, or a browser's while its pictures come.

    Args:
        own: the rig's.
        make: returns the process that looks at the browser's pictures.
        now_s: the host's clock.
        place: called in the loop's thread when ``lent`` has changed, to place the camera again.

    lent: the browser's camera stands in
    """

    def __init__(
        self,
        own: Camera,
        make: Make,
        now_s: Callable[[], float],
        place: Callable[[], None],
    ) -> None:
        self.own = own
        self.lent = False
        self._place = place
        self._make, self._now_s = make, now_s
        self._pictures = JpegSlot()
        self._process: CameraProcess | None = None
        self._starting: threading.Thread | None = None
        self._begun = 1
        self._closed = False
        self._events: list[str] = []

    def take(self, jpeg: bytes) -> None:
        """Keep a picture of a browser; from one thread, beside the loop."""
        if self._closed or not self._pictures.put(jpeg, self._now_s()):
            return
        if self._process is None and (self._starting is None or not self._starting.is_alive()):
            self._starting = threading.Thread(
                target=self._start, name="browser camera", daemon=True
            )
            self._starting.start()

    def _start(self) -> None:
        """Start the process, which takes a second; the scene goes on meanwhile."""
        process = self._make(partial(BrowserSource, self._pictures), self._begun)
        self._begun += 1
        try:
            process.open()
        except SetupError as error:
            self._events.append(f"a browser's camera cannot be looked through: {error}")
            return
        if self._closed:
            process.close()
        else:
            self._process = process

    def open(self) -> None:
        """Start looking with the rig's own camera; raises as it does."""
        self.own.open()

    def latest(self, now_s: float) -> Detections | None:
        """Return what the newest frame showed, None before the first; never blocks."""
        process = self._process
        if process is None:
            return self.own.latest(now_s)
        if self._now_s() - self._pictures.came_s > SILENT_S:
            self._give_back(process)
            return self.own.latest(now_s)
        found = process.latest(now_s)
        if found is None:  # its networks are being loaded
            return self.own.latest(now_s)
        if not self.lent:
            self.lent = True
            self._place()
            self._events.append(_BEGINS)
        return found

    def _give_back(self, process: CameraProcess) -> None:
        self._process = None
        threading.Thread(target=process.close, name="browser camera", daemon=True).start()
        if self.lent:
            self.lent = False
            self._place()
            self._events.append(_ENDS)

    def events(self) -> tuple[str, ...]:
        """Return what has happened since the last call, one line each."""
        process = self._process
        events, self._events = tuple(self._events), []
        others = process.events() if process is not None else ()
        # A browser may end at any time: that is told as such, and is no lost camera.
        told = [line for line in others if not line.startswith((LOST, BACK))]
        return (*events, *told, *self.own.events())

    def close(self) -> None:
        """Stop looking; safe to call twice."""
        self._closed = True
        process, self._process = self._process, None
        with contextlib.ExitStack() as both:
            both.callback(self.own.close)
            if process is not None:
                both.callback(process.close)
