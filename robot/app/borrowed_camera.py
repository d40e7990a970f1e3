"""Temporary replacement of an emulated rig's camera by a browser's own camera.

Its images arrive through the page's process and are analysed in a camera process of their own, like
a webcam's. While they arrive, the head looks at the person in front of the browser; when they end,
the simulated scene returns.
"""

import contextlib
import threading
from collections.abc import Callable
from functools import partial

from gazerig.drivers.camera.browser_source import FIELD_DEG, BrowserSource
from gazerig.drivers.camera.capture_loop import BACK, LOST
from gazerig.drivers.camera.shared_slots import JpegSlot
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.worker import CameraWorker
from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import Camera, Detections

SILENT_S = 1.5
"""Silence after which a browser counts as gone."""

_BEGINS = (
    f"using a browser's camera; its unknown field of view is assumed to be {FIELD_DEG:g} deg; "
    "the scene pauses"
)
_ENDS = "the browser's camera has ended: the scene continues"

Make = Callable[[Callable[[], FrameSource], int], CameraWorker]
"""Function that returns a camera process of a source; the number counts the former ones."""


class BorrowedCamera:
    """The rig's own camera, or a browser's while its images arrive.

    Args:
        own: The rig's camera.
        make: Returns the process that analyses the browser's images.
        now_s: The host's clock.
        place: Called in the loop's thread when ``lent`` has changed, to update the camera's
            placement.

    lent: whether the browser's camera is in use
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
        self._process: CameraWorker | None = None
        self._starting: threading.Thread | None = None
        self._begun = 1
        self._closed = False
        self._events: list[str] = []

    def take(self, jpeg: bytes) -> None:
        """Store an image of a browser; called from one thread other than the loop's."""
        if self._closed or not self._pictures.put(jpeg, self._now_s()):
            return
        if self._process is None and (self._starting is None or not self._starting.is_alive()):
            self._starting = threading.Thread(
                target=self._start, name="browser camera", daemon=True
            )
            self._starting.start()

    def _start(self) -> None:
        """Start the process, which takes a second; the scene continues meanwhile."""
        process = self._make(partial(BrowserSource, self._pictures), self._begun)
        self._begun += 1
        try:
            process.open()
        except SetupError as error:
            self._events.append(f"a browser's camera cannot be used: {error}")
            return
        if self._closed:
            process.close()
        else:
            self._process = process

    def open(self) -> None:
        """Start the rig's own camera; raises its errors."""
        self.own.open()

    def latest(self, now_s: float) -> Detections | None:
        """Return the detections of the newest frame, None before the first; never blocks."""
        process = self._process
        if process is None:
            return self.own.latest(now_s)
        if self._now_s() - self._pictures.came_s > SILENT_S:
            self._process = None
            threading.Thread(target=process.close, name="browser camera", daemon=True).start()
            if self.lent:
                self.lent = False
                self._place()
                self._events.append(_ENDS)
            return self.own.latest(now_s)
        found = process.latest(now_s)
        if found is None:  # its networks are loading
            return self.own.latest(now_s)
        if not self.lent:
            self.lent = True
            self._place()
            self._events.append(_BEGINS)
        return found

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        process = self._process
        events, self._events = tuple(self._events), []
        others = process.events() if process is not None else ()
        # A browser may end at any time: that is reported as its end, not as a lost camera.
        told = [line for line in others if not line.startswith((LOST, BACK))]
        return (*events, *told, *self.own.events())

    def close(self) -> None:
        """Stop both cameras; safe to call twice."""
        self._closed = True
        process, self._process = self._process, None
        with contextlib.ExitStack() as both:
            both.callback(self.own.close)
            if process is not None:
                both.callback(process.close)
